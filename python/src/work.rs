//! Work that takes long: without Python's lock, with progress, and ended by an interrupt.

use pyo3::prelude::*;
use shsa_lab::campaign::Progress;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// How often Python is asked whether to go on, and told how far the work is.
const TICK: Duration = Duration::from_millis(50);

/// What the work and who waits for it know of each other.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    done: AtomicUsize,
    total: AtomicUsize,
    is_stopped: AtomicBool,
    is_over: AtomicBool,
}

/// What ends work that is interrupted.
struct Stopped;

impl Watch {
    /// So many steps are to be done.
    pub(crate) fn begin(&self, total: usize) {
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
    }

    /// Some steps are done. Leaves the work where it is interrupted, without a message: that is no defect.
    pub(crate) fn advance(&self, steps: usize) {
        self.done.fetch_add(steps, Ordering::Relaxed);
        if self.is_stopped.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Stopped));
        }
    }
}

impl Progress for Watch {
    fn begin(&self, count: usize, _: &str) {
        Watch::begin(self, count);
    }

    fn step(&self) {
        self.advance(1);
    }

    fn end(&self) {}
}

/// Runs work in a thread of its own. Meanwhile Python's other threads run; `progress(done, total)` is called, and an exception in
/// it, or a signal such as Ctrl-C, ends the work.
///
/// # Errors
/// That exception.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Watch) -> T + Send,
) -> PyResult<T> {
    let watch = &Watch::default();
    py.detach(|| {
        thread::scope(|scope| {
            let waiting = thread::current();
            let worker = scope.spawn(move || {
                let result = catch_unwind(AssertUnwindSafe(|| work(watch)));
                watch.is_over.store(true, Ordering::Release);
                waiting.unpark();
                result
            });
            let mut interrupted = Ok(());
            while !watch.is_over.load(Ordering::Acquire) {
                thread::park_timeout(TICK);
                if interrupted.is_ok() {
                    interrupted = Python::attach(|py| look(py, progress, watch));
                    watch.is_stopped.store(interrupted.is_err(), Ordering::Relaxed);
                }
            }
            let result = worker.join().and_then(|result| result);
            interrupted?;
            result.map_err(|_| pyo3::exceptions::PyRuntimeError::new_err("the work has broken off"))
        })
    })
}

fn look(py: Python<'_>, progress: Option<&Py<PyAny>>, watch: &Watch) -> PyResult<()> {
    py.check_signals()?;
    let Some(progress) = progress else { return Ok(()) };
    let (done, total) = (watch.done.load(Ordering::Relaxed), watch.total.load(Ordering::Relaxed));
    progress.call1(py, (done, total)).map(|_| ())
}
