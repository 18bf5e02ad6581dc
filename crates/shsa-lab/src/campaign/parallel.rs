//! Runs work on all cores; the order of results does not depend on the number of cores.

use crate::LabError;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Receives the progress of a search, from several threads.
pub trait Progress: Sync {
    /// `count` steps of the named work begin.
    fn begin(&self, count: usize, of_what: &str);

    /// One step is done.
    fn step(&self);

    /// All steps are done.
    fn end(&self);
}

/// Ignores the progress.
impl Progress for () {
    fn begin(&self, _: usize, _: &str) {}

    fn step(&self) {}

    fn end(&self) {}
}

/// The results of `work` for each number below a count, in order; reports the progress.
pub(crate) fn on_all_cores<T: Send>(
    count: usize,
    threads: Option<NonZeroUsize>,
    progress: &dyn Progress,
    of_what: &'static str,
    work: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, LabError> {
    let cores = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let threads = threads.map_or_else(cores, NonZeroUsize::get).min(count);
    progress.begin(count, of_what);
    let next = AtomicUsize::new(0);
    let work = |_| {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return done;
            }
            done.push((number, work(number)));
            progress.step();
        }
    };
    let mut done = Vec::new();
    for worker in side_by_side(threads, work) {
        done.extend(worker.ok_or(LabError::BrokeOff)?);
    }
    progress.end();
    done.sort_unstable_by_key(|(number, _)| *number);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

/// The results of `work` for each number below a count, each in a thread of its own; `None` where it panicked. Without threads, as in
/// WebAssembly, one after the other.
pub(crate) fn side_by_side<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<Option<T>> {
    if cfg!(target_family = "wasm") {
        return (0..count).map(|number| Some(work(number))).collect();
    }
    std::thread::scope(|scope| {
        let work = &work;
        let workers: Vec<_> = (0..count).map(|number| scope.spawn(move || work(number))).collect();
        // All are joined before the first failure is told: the scope panics for one that nobody has joined.
        workers.into_iter().map(|worker| worker.join().ok()).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::resume_unwind;

    #[test]
    fn work_that_breaks_off_in_every_thread_is_told_once() {
        let two = NonZeroUsize::new(2);
        let work = |_: usize| -> usize { resume_unwind(Box::new("interrupted")) };
        assert!(matches!(on_all_cores(8, two, &(), "runs", work), Err(LabError::BrokeOff)));
        assert_eq!(on_all_cores(3, two, &(), "runs", |number| number * 2).unwrap(), [0, 2, 4]);
    }
}
