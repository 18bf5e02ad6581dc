//! Time on the processor and memory of a process, as the system reports them.

use std::fs;
use std::path::PathBuf;
use std::time::Instant;

/// Measures the processor time of this thread, or the wall time where the system does not give the former.
pub(super) struct Stopwatch {
    began: Instant,
    on_processor: Option<f64>,
}

impl Stopwatch {
    /// Starts now.
    pub(super) fn start() -> Stopwatch {
        Stopwatch { began: Instant::now(), on_processor: on_processor() }
    }

    /// Seconds since the start.
    pub(super) fn seconds(&self) -> f64 {
        let ran = on_processor().zip(self.on_processor).map(|(now, start)| now - start);
        ran.unwrap_or_else(|| self.began.elapsed().as_secs_f64())
    }
}

/// Processor time of this thread in seconds; up to a tick of the scheduler (some milliseconds) behind.
fn on_processor() -> Option<f64> {
    Some(nanoseconds_in(&fs::read_to_string("/proc/thread-self/schedstat").ok()?)? / 1e9)
}

/// Processor time of all threads of a process in seconds. `who` is its number, or the folder of one thread in /proc. NaN where
/// the system does not tell.
pub(super) fn seconds_of(who: &str) -> f64 {
    let folders = match fs::read_dir(format!("/proc/{who}/task")) {
        Ok(threads) => threads.flatten().map(|thread| thread.path()).collect(),
        Err(_) => vec![PathBuf::from(who)],
    };
    let read = |folder: &PathBuf| nanoseconds_in(&fs::read_to_string(folder.join("schedstat")).ok()?);
    // A thread may have ended meanwhile.
    folders.iter().filter_map(read).reduce(|sum, each| sum + each).map_or(f64::NAN, |sum| sum / 1e9)
}

/// Processor time of a process in seconds, its threads that have ended included; `who` is its number. `None` where the system does not
/// tell.
pub(super) fn spent_seconds(who: &str) -> Option<f64> {
    /// The unit of the system's figures is the same on all processors.
    const TICKS_A_SECOND: f64 = 100.0;
    let stat = fs::read_to_string(format!("/proc/{who}/stat")).ok()?;
    // The name of the program, in brackets, may have spaces; the time of the user is the 12th field after it.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS_A_SECOND)
}

fn nanoseconds_in(schedstat: &str) -> Option<f64> {
    schedstat.split_whitespace().next()?.parse().ok()
}

/// A line of a process's status that holds kibibytes, as bytes; `who` is its number, or `self`.
///
/// `VmHWM` is the largest resident memory so far, `VmRSS` that of now, `RssAnon` the part of it that no file backs. Not a number
/// where the system does not give it.
pub(super) fn memory_bytes(who: &str, line: &str) -> f64 {
    let status = fs::read_to_string(format!("/proc/{who}/status")).unwrap_or_default();
    let value = status.lines().find_map(|each| each.strip_prefix(line)?.strip_prefix(':'));
    let kibibytes = value.and_then(|value| value.trim().strip_suffix(" kB")?.trim().parse::<f64>().ok());
    kibibytes.map_or(f64::NAN, |kibibytes| kibibytes * 1024.0)
}
