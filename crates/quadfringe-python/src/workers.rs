//! The threads that the kernel works on, and how Python's Ctrl-C reaches a caller that waits for them.
//!
//! A fork copies memory but no threads: work that a child gave to the threads of its parent would never end. Each process
//! therefore starts workers.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::resume_unwind;
use std::process;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// The workers that everything shares which does not ask for a number of threads.
static SHARED: Workers = Workers { threads: None, pool: Mutex::new(None) };

/// The process whose shared workers are rayon's own: the first that worked.
static FIRST: OnceLock<u32> = OnceLock::new();

/// Most threads of a decoder. Twice those of the largest machines of today; many more exhaust the process.
pub const THREADS_MAX: usize = 1024;

/// How often a caller that waits looks for signals.
const SIGNALS_EVERY: Duration = Duration::from_millis(100);

/// A number of threads, in whichever process they are used.
pub struct Workers {
    /// `None`: those that everything shares.
    threads: Option<usize>,
    pool: Mutex<Option<Pool>>,
}

struct Pool {
    process: u32,
    threads: Arc<ThreadPool>,
}

impl Workers {
    /// Starts `threads` threads, or takes those that everything shares.
    pub fn start(threads: Option<usize>) -> PyResult<Self> {
        if let Some(count) = threads.filter(|count| !(1..=THREADS_MAX).contains(count)) {
            let message = format!("threads: expected 1 to {THREADS_MAX}, got {count}");
            return Err(PyValueError::new_err(message));
        }
        let workers = Self { threads, pool: Mutex::default() };
        if threads.is_some() {
            workers.pool()?;
        }
        Ok(workers)
    }

    /// The pool to work in; `None` for the one that rayon makes itself.
    pub fn in_use(&self) -> PyResult<Option<Arc<ThreadPool>>> {
        match self.threads {
            Some(_) => self.pool().map(Some),
            None if *FIRST.get_or_init(process::id) == process::id() => Ok(None),
            None => SHARED.pool().map(Some),
        }
    }

    /// The pool of this process, started when it is first used.
    fn pool(&self) -> PyResult<Arc<ThreadPool>> {
        let mut pool = self.pool.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pool) = pool.as_ref().filter(|pool| pool.process == process::id()) {
            return Ok(Arc::clone(&pool.threads));
        }
        let threads = Arc::new(started(self.threads.unwrap_or(0))?);
        let before = pool.replace(Pool { process: process::id(), threads: Arc::clone(&threads) });
        // The threads of another process cannot be ended from this one.
        std::mem::forget(before);
        Ok(threads)
    }
}

/// Does `work` without the GIL, on the workers that everything shares.
pub fn detached<R: Send>(py: Python<'_>, work: impl FnOnce() -> R + Send) -> PyResult<R> {
    let pool = SHARED.in_use()?;
    Ok(py.detach(|| match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }))
}

/// Does long `work` without the GIL, and raises what a signal raises meanwhile. The work then goes on until its end,
/// and nobody gets its result.
pub fn interruptible<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> R + Send + 'static,
) -> PyResult<R> {
    // A worker would not do for this: while it waits for a part of the work, it may take up the next shot, which waits
    // for the end of this one.
    let (done, mut result) = channel();
    let thread =
        std::thread::Builder::new().name("long work".into()).spawn(move || drop(done.send(work())))?;
    loop {
        let (waited, again) = py.detach(move || (result.recv_timeout(SIGNALS_EVERY), result));
        result = again;
        match waited {
            Ok(found) => return Ok(found),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    // The work panicked, and so does its caller.
    Err(thread.join().map_or_else(|panic| resume_unwind(panic), |()| unreachable!("it sends what it found")))
}

/// Starts threads; 0 for one on each core.
fn started(threads: usize) -> PyResult<ThreadPool> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| {
        PyRuntimeError::new_err(format!(
            "threads: {threads} cannot be started: {error}; in a forked process, use multiprocessing with the start \
             method \"spawn\""
        ))
    })
}
