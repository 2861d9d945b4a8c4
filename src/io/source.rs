//! A file that is read at given offsets, from several threads at once.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use rayon::prelude::*;

use super::error::ReadError;
use super::memory::check_memory;

/// Bytes that one task reads at a time.
pub(super) const CHUNK: usize = 4 << 20;

/// An open, regular, non-empty file of known length.
pub(super) struct Source<'a> {
    /// The file's name, for messages.
    pub path: &'a Path,
    /// Its length in bytes.
    pub len: u64,
    file: File,
}

impl<'a> Source<'a> {
    /// Opens `path`; an empty file and what is not a regular file are errors.
    pub fn open(path: &'a Path) -> Result<Self, ReadError> {
        // Looked at before it is opened: opening a named pipe would wait for a writer.
        let meta = std::fs::metadata(path).map_err(|e| ReadError::io(path, "open", e))?;
        if !meta.is_file() {
            return Err(ReadError::file(path, "not a regular file"));
        }
        let file = File::open(path).map_err(|e| ReadError::io(path, "open", e))?;
        if meta.len() == 0 {
            return Err(ReadError::file(path, "the file is empty"));
        }
        Ok(Self { path, len: meta.len(), file })
    }

    /// Fills `buf` from `offset`.
    pub fn read_at(&self, buf: &mut [u8], offset: u64) -> Result<(), ReadError> {
        self.file.read_exact_at(buf, offset).map_err(|e| ReadError::io(self.path, "read", e))
    }

    /// Fills the first `n` bytes of `buf`, growing it if need be, from `offset`; returns them.
    pub fn read_into<'b>(
        &self,
        buf: &'b mut Vec<u8>,
        n: usize,
        offset: u64,
    ) -> Result<&'b [u8], ReadError> {
        if buf.len() < n {
            buf.resize(n, 0);
        }
        self.read_at(&mut buf[..n], offset)?;
        Ok(&buf[..n])
    }

    /// Everything from `offset` on, read in parallel.
    pub fn read_from(&self, offset: u64) -> Result<Vec<u8>, ReadError> {
        let n = usize::try_from(self.len.saturating_sub(offset))
            .map_err(|_| ReadError::file(self.path, "the file does not fit into memory"))?;
        check_memory(self.path, n as u64)?;
        let mut bytes = vec![0; n];
        bytes
            .par_chunks_mut(CHUNK)
            .enumerate()
            .try_for_each(|(i, part)| self.read_at(part, offset + (i * CHUNK) as u64))?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files() {
        let text = |path: &str| Source::open(Path::new(path)).err().map(|e| e.to_string());
        assert_eq!(text("/").as_deref(), Some("/: not a regular file"));
        assert_eq!(text("/dev/zero").as_deref(), Some("/dev/zero: not a regular file"));
        assert!(text("/nowhere").is_some_and(|t| t.starts_with("/nowhere: cannot open: ")));
    }

    #[test]
    fn a_file_that_shrinks_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        std::fs::write(&path, [0; 100]).unwrap();
        let source = Source::open(&path).unwrap();
        File::options().write(true).open(&path).unwrap().set_len(50).unwrap();
        let text = source.read_from(0).unwrap_err().to_string();
        assert!(text.contains("a.ply: cannot read"), "{text}");
        assert!(source.read_at(&mut [0; 50], 0).is_ok());
    }

    #[test]
    fn reads_in_parts() {
        let path = std::env::temp_dir().join(format!("alhazen-{}-parts", std::process::id()));
        let bytes: Vec<u8> = (0..2 * CHUNK + 5).map(|i| (i % 251) as u8).collect();
        std::fs::write(&path, &bytes).unwrap();
        let source = Source::open(&path).unwrap();
        assert_eq!(source.read_from(3).unwrap(), bytes[3..]);
        assert_eq!(source.read_into(&mut vec![1], 4, 9).unwrap(), &bytes[9..13]);
        assert!(source.read_at(&mut [0; 9], source.len - 8).is_err());
        std::fs::remove_file(&path).unwrap();
    }
}
