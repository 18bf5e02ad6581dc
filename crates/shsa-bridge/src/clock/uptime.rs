//! The time since the machine was started, including its sleep.

use std::ops::Add;
use std::time::Duration;

/// A moment like [`std::time::Instant`] that goes on while the machine is suspended. A lid that was closed for an hour is an hour
/// of absence, and deadlines within it have passed.
///
/// On Linux it reads `CLOCK_BOOTTIME`. Elsewhere it is an `Instant`, and only the step of the wall clock shows a sleep of the
/// machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Uptime(Duration);

impl Uptime {
    /// The moment now.
    #[cfg(target_os = "linux")]
    pub(crate) fn now() -> Uptime {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::Boottime);
        let seconds = u64::try_from(now.tv_sec).unwrap_or_default();
        Uptime(Duration::new(seconds, u32::try_from(now.tv_nsec).unwrap_or_default()))
    }

    /// The moment now.
    #[cfg(not(target_os = "linux"))]
    pub(crate) fn now() -> Uptime {
        use std::sync::LazyLock;
        use std::time::Instant;
        static START: LazyLock<Instant> = LazyLock::new(Instant::now);
        Uptime(START.elapsed())
    }

    /// The time since this moment.
    pub(crate) fn elapsed(self) -> Duration {
        Uptime::now().saturating_duration_since(self)
    }

    /// The time since an earlier moment; zero if that is not earlier.
    pub(crate) fn saturating_duration_since(self, earlier: Uptime) -> Duration {
        self.0.saturating_sub(earlier.0)
    }

    /// The moment after a span; `None` if it cannot be expressed.
    #[cfg(feature = "mqtt")]
    pub(crate) fn checked_add(self, span: Duration) -> Option<Uptime> {
        self.0.checked_add(span).map(Uptime)
    }
}

impl Add<Duration> for Uptime {
    type Output = Uptime;

    /// The moment after a span, at most the last possible one.
    fn add(self, span: Duration) -> Uptime {
        Uptime(self.0.saturating_add(span))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_on_and_never_back() {
        let first = Uptime::now();
        let again = Uptime::now();
        assert!(first <= again && again.saturating_duration_since(first) < Duration::from_secs(3_600));
        assert_eq!(first.saturating_duration_since(again + Duration::from_secs(1)), Duration::ZERO);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn it_counts_the_time_in_which_the_machine_slept() {
        // The first number of the file is the kernel's uptime, which counts sleep as CLOCK_BOOTTIME does.
        let text = std::fs::read_to_string("/proc/uptime").unwrap();
        let kernel: f64 = text.split(' ').next().unwrap().parse().unwrap();
        let ours = Uptime::now().0.as_secs_f64();
        assert!((kernel - ours).abs() < 60.0, "{kernel} {ours}");
    }
}
