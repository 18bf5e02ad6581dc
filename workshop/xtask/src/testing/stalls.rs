//! When the machine stalls: for how long a thread that sleeps wakes up too late.
//!
//! Tests with real middleware wait in real time. Where the machine gives them no processor for a while, as a virtual machine whose host
//! is busy, sensors fall silent that nobody has broken.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// How often it looks.
const STEP: Duration = Duration::from_millis(50);

/// The shortest stall that counts: the sensors of the tests may be silent for 300 ms.
const SHORTEST: Duration = Duration::from_millis(200);

/// A stall, and when it was over.
struct Stall {
    end: Instant,
    length: Duration,
}

/// The stalls since it watches.
pub(super) struct Stalls(Arc<Mutex<Vec<Stall>>>);

impl Stalls {
    /// Watches until the process ends.
    pub(super) fn watch() -> Stalls {
        let stalls = Stalls(Arc::default());
        let noted = stalls.0.clone();
        thread::spawn(move || {
            loop {
                let began = Instant::now();
                thread::sleep(STEP);
                let length = began.elapsed().saturating_sub(STEP);
                if length >= SHORTEST {
                    let stall = Stall { end: Instant::now(), length };
                    noted.lock().unwrap_or_else(PoisonError::into_inner).push(stall);
                }
            }
        });
        stalls
    }

    /// A stall that ends after everything else, for tests.
    #[cfg(test)]
    pub(super) fn always() -> Stalls {
        let end = Instant::now() + Duration::from_secs(3600);
        Stalls(Arc::new(Mutex::new(vec![Stall { end, length: SHORTEST }])))
    }

    /// The longest stall that ended after a time; `None` if there was none.
    pub(super) fn longest_since(&self, began: Instant) -> Option<Duration> {
        let stalls = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        stalls.iter().filter(|stall| stall.end >= began).map(|stall| stall.length).max()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stalls_before_a_time_do_not_count() {
        let now = Instant::now();
        let stall = |end: Instant, ms: u64| Stall { end, length: Duration::from_millis(ms) };
        let later = now + Duration::from_secs(1);
        let stalls =
            Stalls(Arc::new(Mutex::new(vec![stall(now, 900), stall(later, 300), stall(later, 400)])));
        assert_eq!(stalls.longest_since(now), Some(Duration::from_millis(900)));
        assert_eq!(stalls.longest_since(later), Some(Duration::from_millis(400)));
        assert_eq!(stalls.longest_since(later + Duration::from_secs(1)), None);
    }
}
