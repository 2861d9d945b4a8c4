//! What can go wrong while a file is read or written, in the words that a user sees.

use std::io;
use std::path::{Path, PathBuf};

/// A file could not be read. Every variant names the file, and the place in it where there is one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system refused: missing file, no permission, failing disk.
    #[error("{}: cannot {doing}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried: "open", "read".
        doing: &'static str,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A line of a text file is wrong.
    #[error("{}:{line}: {message}", .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong, and what would be accepted.
        message: String,
    },
    /// A place in a binary file is wrong.
    #[error("{}: at byte {offset}: {message}", .path.display())]
    Byte {
        /// The file.
        path: PathBuf,
        /// Offset from the start of the file.
        offset: u64,
        /// What is wrong, and what would be accepted.
        message: String,
    },
    /// The file as a whole is wrong: its type, its size, what it lacks.
    #[error("{}: {message}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what would be accepted.
        message: String,
    },
}

impl ReadError {
    /// The operating system refused `doing` ("open", "read") on `path`.
    pub(crate) fn io(path: &Path, doing: &'static str, source: io::Error) -> Self {
        Self::Io { path: path.to_owned(), doing, source }
    }
    /// Line `line` (from 1) of `path` is wrong.
    pub(crate) fn line(path: &Path, line: usize, message: impl Into<String>) -> Self {
        Self::Line { path: path.to_owned(), line, message: message.into() }
    }
    /// The bytes at `offset` of `path` are wrong.
    pub(crate) fn byte(path: &Path, offset: u64, message: impl Into<String>) -> Self {
        Self::Byte { path: path.to_owned(), offset, message: message.into() }
    }
    /// `path` as a whole is wrong.
    pub(crate) fn file(path: &Path, message: impl Into<String>) -> Self {
        Self::File { path: path.to_owned(), message: message.into() }
    }
}

/// A file could not be written. What was on disk before is untouched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The operating system refused: full disk, no permission, missing folder.
    #[error("{}: cannot {doing}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        doing: &'static str,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The format cannot hold the picture.
    #[error("{}: {message}", .path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Why not.
        message: String,
    },
    /// Whoever asked for the file does not want it any more.
    #[error("interrupted")]
    Interrupted,
}

impl WriteError {
    /// The operating system refused `doing` on `path`.
    pub(crate) fn io(path: &Path, doing: &'static str, source: io::Error) -> Self {
        Self::Io { path: path.to_owned(), doing, source }
    }
    /// The format cannot hold the picture.
    pub(crate) fn format(path: &Path, message: impl Into<String>) -> Self {
        Self::Format { path: path.to_owned(), message: message.into() }
    }
}
