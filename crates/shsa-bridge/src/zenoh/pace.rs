//! Sending no faster than what is sent can leave: Zenoh drops the newest, not the oldest, when its queues are full.

use std::time::{Duration, Instant};

/// Faster than any stream of values, slower than a loopback; bytes a second.
const RATE: f64 = 16e6;
/// So much may go out at once: half of what waits in Zenoh's queue; bytes.
const BURST: f64 = 512.0 * 1024.0;
/// No message waits longer for its turn.
const WAIT_MAX: Duration = Duration::from_millis(20);
/// What a message takes beside its payload and its key, bytes.
const FRAME: usize = 32;

/// How much may go out now.
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
    /// Waits until a message of this size may go out; without a burst, not at all.
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
        // A huge one costs a turn, not more.
        let mut pace = Pace::default();
        let now = pace.since;
        assert_eq!(pace.wait(usize::MAX, now), Duration::ZERO);
        assert!(pace.wait(1, now) < Duration::from_millis(1));
    }
}
