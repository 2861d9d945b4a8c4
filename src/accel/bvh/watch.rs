//! What a build has done, what it may hold, and whether it is to go on.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::super::AccelError;

/// Tells of a build's progress, and ends it.
pub(super) struct Watch<'a> {
    progress: &'a (dyn Fn(f64) -> bool + Sync),
    total: u64,
    done: AtomicU64,
    is_stopped: AtomicBool,
    limit: Option<u64>,
    /// Bytes of what is already built.
    held: AtomicU64,
}

impl<'a> Watch<'a> {
    /// - `total`: primitives of all trees;
    /// - `limit`: bytes that the build may hold at any time.
    pub(super) fn new(
        total: u64,
        limit: Option<u64>,
        progress: &'a (dyn Fn(f64) -> bool + Sync),
    ) -> Self {
        let is_stopped = AtomicBool::new(!progress(0.0));
        let [done, held] = [0, 0].map(AtomicU64::new);
        Self { progress, total, done, is_stopped, limit, held }
    }

    /// So many more primitives have their places.
    pub(super) fn add(&self, primitives: u64) {
        let done = self.done.fetch_add(primitives, Ordering::Relaxed) + primitives;
        if !(self.progress)((done as f64 / self.total.max(1) as f64).min(1.0)) {
            self.is_stopped.store(true, Ordering::Relaxed);
        }
    }

    pub(super) fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }

    /// # Errors
    /// [`AccelError::Interrupted`] where the build is to end.
    pub(super) fn check(&self) -> Result<(), AccelError> {
        if self.is_stopped() { Err(AccelError::Interrupted) } else { Ok(()) }
    }

    /// What is built from now on comes on top of so many bytes more.
    ///
    /// # Errors
    /// [`AccelError::MemoryLimit`] where these are too many.
    pub(super) fn hold(&self, bytes: u64) -> Result<(), AccelError> {
        self.held.fetch_add(bytes, Ordering::Relaxed);
        self.reserve(0)
    }

    /// # Errors
    /// [`AccelError::MemoryLimit`] where so many bytes more are too many.
    pub(super) fn reserve(&self, bytes: u64) -> Result<(), AccelError> {
        match self.limit {
            Some(limit) if self.held.load(Ordering::Relaxed) + bytes > limit => {
                Err(AccelError::MemoryLimit { limit })
            }
            _ => Ok(()),
        }
    }
}
