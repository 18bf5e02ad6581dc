//! Paces the sending: when its queues are full, Zenoh drops the newest message, not the oldest.

use std::time::{Duration, Instant};

/// The rate in bytes a second: above any stream of values, below a loopback.
const RATE: f64 = 16e6;
/// The largest burst in bytes: half of what fits into Zenoh's queue.
const BURST: f64 = 512.0 * 1024.0;
/// The longest wait of a message.
const WAIT_MAX: Duration = Duration::from_millis(20);
/// The bytes of a message beside its payload and its key.
const FRAME: usize = 32;

/// The bytes that may be sent now.
#[derive(Debug)]
pub(crate) struct Pace {
    allowance: f64,
    since: Instant,
}

impl Default for Pace {
    fn default() -> Pace {
        Pace { allowance: BURST, since: Instant::now() }
    }
}

impl Pace {
    /// Waits until a message of this size may be sent; without a burst there is no wait.
    pub(crate) fn take(&mut self, bytes: usize) {
        let wait = self.wait(bytes, Instant::now());
        if !wait.is_zero() {
            std::thread::sleep(wait);
        }
    }

    fn wait(&mut self, bytes: usize, now: Instant) -> Duration {
        let earned = now.saturating_duration_since(self.since).as_secs_f64() * RATE;
        self.since = now;
        let size = (bytes.saturating_add(FRAME) as f64).min(BURST);
        self.allowance = (self.allowance + earned).min(BURST) - size;
        Duration::from_secs_f64((-self.allowance / RATE).max(0.0)).min(WAIT_MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_do_not_wait_and_bursts_do() {
        let mut pace = Pace::default();
        let mut now = pace.since;
        for _ in 0..100_000 {
            now += Duration::from_micros(20);
            assert_eq!(pace.wait(250, now), Duration::ZERO);
        }
        let waits: Vec<Duration> = (0..10_000).map(|_| pace.wait(150, now)).collect();
        assert!(waits[..2_000].iter().all(Duration::is_zero));
        assert!(waits[9_000..].iter().all(|wait| *wait == WAIT_MAX));
        // A huge message delays others by one wait at most.
        let mut pace = Pace::default();
        let now = pace.since;
        assert_eq!(pace.wait(usize::MAX, now), Duration::ZERO);
        assert!(pace.wait(1, now) < Duration::from_millis(1));
    }
}
