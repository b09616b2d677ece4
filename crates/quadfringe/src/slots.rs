//! Working memory of tasks: made once, handed to whichever thread runs one.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// One value for every thread of the pool; a task takes that of the thread it runs on.
#[derive(Debug)]
pub(crate) struct Slots<T>(Vec<Mutex<T>>);

impl<T: Default> Default for Slots<T> {
    fn default() -> Self {
        Self((0..rayon::current_num_threads().max(1)).map(|_| Mutex::default()).collect())
    }
}

impl<T> Slots<T> {
    /// The value of this thread. A task must not start another that takes from the same slots while it holds one.
    pub fn take(&self) -> MutexGuard<'_, T> {
        let thread = rayon::current_thread_index().unwrap_or(0);
        // What a panic left behind is working memory: the next task writes it before it reads it.
        self.0[thread % self.0.len()].lock().unwrap_or_else(PoisonError::into_inner)
    }
}
