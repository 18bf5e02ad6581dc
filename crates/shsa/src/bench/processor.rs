//! Time on the processor and memory of a process, as the system tells them.

use std::fs;
use std::time::Instant;

/// Measures the time that this thread runs on a processor; the time that passes where the system does not tell it.
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

/// Seconds that this thread has run; up to a tick of the scheduler (some milliseconds) behind.
fn on_processor() -> Option<f64> {
    let text = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? / 1e9)
}

/// A line of the status of a process that holds kibibytes, in bytes; `who` is its number, or `self`.
///
/// `VmHWM` is the largest resident memory so far, `VmRSS` that of now. Not a number where the system does not tell it.
pub(super) fn memory_bytes(who: &str, line: &str) -> f64 {
    let status = fs::read_to_string(format!("/proc/{who}/status")).unwrap_or_default();
    let value = status.lines().find_map(|each| each.strip_prefix(line)?.strip_prefix(':'));
    let kibibytes = value.and_then(|value| value.trim().strip_suffix(" kB")?.trim().parse::<f64>().ok());
    kibibytes.map_or(f64::NAN, |kibibytes| kibibytes * 1024.0)
}
