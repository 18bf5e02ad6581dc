//! Work on all cores, in an order that does not depend on how many there are.

use crate::LabError;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Hears how far a search is, from several threads.
pub trait Progress: Sync {
    /// So many steps of what is named are about to be taken.
    fn begin(&self, count: usize, of_what: &str);

    /// One of them is done.
    fn step(&self);

    /// All of them are.
    fn end(&self);
}

/// Nobody looks on.
impl Progress for () {
    fn begin(&self, _: usize, _: &str) {}

    fn step(&self) {}

    fn end(&self) {}
}

/// What `work` gives for each number below a count, in their order, and who asks is told how far it is.
pub(super) fn on_all_cores<T: Send>(
    count: usize,
    threads: Option<NonZeroUsize>,
    told: &dyn Progress,
    of_what: &'static str,
    work: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, LabError> {
    let cores = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let threads = threads.map_or_else(cores, NonZeroUsize::get).min(count);
    told.begin(count, of_what);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return done;
            }
            done.push((number, work(number)));
            told.step();
        }
    };
    let mut done = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let mut done = Vec::new();
        for worker in workers {
            done.extend(worker.join().map_err(|_| LabError::BrokeOff)?);
        }
        Ok::<_, LabError>(done)
    })?;
    told.end();
    done.sort_unstable_by_key(|(number, _)| *number);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}
