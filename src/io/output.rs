//! Writing files so that they are whole or not there: under a temporary name in the same folder,
//! flushed to the disk, then renamed. A full disk or a kill leaves the old file as it was.

use std::fs::Permissions;
use std::io::{BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::{Builder, NamedTempFile};

use super::error::WriteError;

/// Something to be kept with a picture, by name.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// Its name, at most 31 characters (older readers refuse longer ones): "alhazen.seed".
    pub name: String,
    /// Its value.
    pub value: AttributeValue,
}

impl Attribute {
    /// An attribute of this name.
    pub fn new(name: impl Into<String>, value: AttributeValue) -> Self {
        Self { name: name.into(), value }
    }
}

/// The kinds of attributes.
#[derive(Debug, Clone, PartialEq)]
pub enum AttributeValue {
    /// Text.
    Text(String),
    /// A whole number.
    Integer(i32),
    /// A number.
    Float(f64),
    /// Three numbers.
    Vector([f32; 3]),
}

/// The folder that `path` lies in; a bare name lies in the current one.
fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn temporary(path: &Path) -> Result<NamedTempFile, WriteError> {
    Builder::new()
        .prefix(".alhazen-")
        .suffix(".part")
        // As any new file: what the user's mask leaves of it.
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder(path))
        .map_err(|e| WriteError::io(path, "create a file in its folder", e))
}

/// Finds out before hours of work whether a file could be written.
///
/// # Errors
/// As writing would give.
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    if path.is_dir() {
        return Err(WriteError::format(path, "is a folder; expected a file name"));
    }
    temporary(&path.canonicalize().unwrap_or_else(|_| path.to_owned())).map(drop)
}

/// Files that are being written, under their temporary names.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes what is being written: for a program that is about to end without unwinding.
pub fn remove_unfinished() {
    for path in UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        // Nothing can be done about one that stays.
        let _ = std::fs::remove_file(path);
    }
}

/// Keeps a file in the list above while it lives.
struct Unfinished(PathBuf);

impl Unfinished {
    fn new(path: &Path) -> Self {
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).push(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).retain(|p| *p != self.0);
    }
}

/// Writes `path` through `write`, whole or not at all.
pub(super) fn write_whole<W>(path: &Path, write: W) -> Result<(), WriteError>
where
    W: FnOnce(&mut BufWriter<&std::fs::File>) -> Result<(), WriteError>,
{
    // Through a link to the file that it names, which stays as open or as closed as it was.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let file = temporary(&target)?;
    let _unfinished = Unfinished::new(file.path());
    if let Ok(old) = target.metadata() {
        let failed = |e| WriteError::io(path, "keep the permissions of", e);
        file.as_file().set_permissions(old.permissions()).map_err(failed)?;
    }
    let mut writer = BufWriter::with_capacity(1 << 20, file.as_file());
    write(&mut writer)?;
    writer.flush().map_err(|e| WriteError::io(path, "write", e))?;
    drop(writer);
    file.as_file().sync_all().map_err(|e| WriteError::io(path, "write", e))?;
    file.persist(&target)
        .map_err(|e| WriteError::io(path, "rename the finished file to it", e.error))?;
    Ok(())
}

/// Writes a text file, whole or not at all.
///
/// # Errors
/// [`WriteError`] where the file cannot be written; the old one is then untouched.
pub fn write_text(path: &Path, text: &str) -> Result<(), WriteError> {
    write_whole(path, |w| {
        w.write_all(text.as_bytes()).map_err(|e| WriteError::io(path, "write", e))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.exr");
        write_whole(&path, |w| w.write_all(b"old").map_err(|e| WriteError::io(&path, "write", e)))
            .unwrap();
        let failed = write_whole(&path, |w| {
            w.write_all(b"new, but").map_err(|e| WriteError::io(&path, "write", e))?;
            Err(WriteError::format(&path, "no"))
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        let left = std::fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, 1, "the temporary file is gone");
    }

    #[test]
    fn links_and_permissions_stay() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["file.exr", "link.exr"].map(|name| folder.path().join(name));
        std::fs::write(&file, "old").unwrap();
        std::fs::set_permissions(&file, Permissions::from_mode(0o600)).unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_text(&link, "new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(std::fs::read(&file).unwrap(), b"new");
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = check_writable(Path::new("/nowhere/at/all.exr")).unwrap_err().to_string();
        assert!(
            error.starts_with("/nowhere/at/all.exr: cannot create a file in its folder"),
            "{error}"
        );
        assert!(check_writable(Path::new("/tmp")).is_err());
    }
}
