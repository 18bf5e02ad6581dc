//! What time it is, for the time of reception: it never goes back, whatever happens to the wall clock.

use shsa_core::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// A clock that runs evenly from the wall's time at its start; clones are the same clock.
///
/// Someone may step the wall clock meanwhile, and with it the stamps of all publishers. [`Clock::follow`] notices, and
/// [`Clock::steady`] and [`Clock::by_wall`] translate.
#[derive(Clone, Debug)]
pub struct Clock(Arc<Kind>);

#[derive(Debug)]
enum Kind {
    /// Set by whoever drives it.
    Manual(AtomicI64),
    Running {
        started: Instant,
        /// The wall's time at the start, nanoseconds.
        base: i64,
        /// How far the wall clock is ahead of this one.
        ahead: AtomicI64,
    },
}

impl Clock {
    /// One that runs, and shows the wall's time now.
    #[must_use]
    pub fn running() -> Clock {
        Clock(Arc::new(Kind::Running { started: Instant::now(), base: wall(), ahead: AtomicI64::new(0) }))
    }

    /// One that stands at 0 until it is [set](Clock::set): a run that is driven by it repeats.
    #[must_use]
    pub fn manual() -> Clock {
        Clock(Arc::new(Kind::Manual(AtomicI64::new(0))))
    }

    /// The time now.
    #[must_use]
    pub fn now(&self) -> Time {
        match &*self.0 {
            Kind::Manual(now) => Time(now.load(Ordering::Acquire)),
            Kind::Running { started, base, .. } => Time(base.saturating_add(nanoseconds(*started))),
        }
    }

    /// Sets a manual clock; a running one goes on as it does.
    pub fn set(&self, to: Time) {
        if let Kind::Manual(now) = &*self.0 {
            now.store(to.0, Ordering::Release);
        }
    }

    /// Looks at the wall clock. Where it has moved against this one by more than `tolerance` nanoseconds since it was last
    /// followed, that is a step: it is taken over, and given back (positive: the wall clock went ahead).
    pub fn follow(&self, tolerance: i64) -> Option<i64> {
        let Kind::Running { ahead, .. } = &*self.0 else { return None };
        let (is, was) = (wall().saturating_sub(self.now().0), ahead.load(Ordering::Acquire));
        let step = is.saturating_sub(was);
        if step.saturating_abs() <= tolerance {
            return None;
        }
        ahead.store(is, Ordering::Release);
        Some(step)
    }

    /// A time by the wall clock, as this clock shows it.
    #[must_use]
    pub fn steady(&self, time: Time) -> Time {
        Time(time.0.saturating_sub(self.ahead()))
    }

    /// A time of this clock, as the wall clock shows it.
    #[must_use]
    pub fn by_wall(&self, time: Time) -> Time {
        Time(time.0.saturating_add(self.ahead()))
    }

    fn ahead(&self) -> i64 {
        match &*self.0 {
            Kind::Manual(_) => 0,
            Kind::Running { ahead, .. } => ahead.load(Ordering::Acquire),
        }
    }
}

fn wall() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

fn nanoseconds(since: Instant) -> i64 {
    i64::try_from(since.elapsed().as_nanos()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_clock_shows_the_walls_time_and_goes_on() {
        let clock = Clock::running();
        let (first, again) = (clock.now(), clock.clone().now());
        assert!(again >= first && (wall() - first.0).abs() < 1_000_000_000);
        clock.set(Time(5));
        assert!(clock.now() >= again);
    }

    #[test]
    fn a_step_of_the_wall_clock_is_told_once_and_translated() {
        let clock = Clock::running();
        assert_eq!(clock.follow(1_000_000_000), None);
        let hour = 3_600_000_000_000;
        if let Kind::Running { ahead, .. } = &*clock.0 {
            ahead.store(-hour, Ordering::Release);
        }
        let step = clock.follow(1_000_000_000).unwrap();
        assert!((step - hour).abs() < 1_000_000_000, "{step}");
        assert_eq!(clock.follow(1_000_000_000), None);
        assert_eq!(clock.steady(clock.by_wall(Time(7))), Time(7));
    }

    #[test]
    fn a_manual_clock_stands_where_it_was_set() {
        let clock = Clock::manual();
        clock.set(Time(5));
        assert_eq!((clock.now(), clock.follow(0)), (Time(5), None));
    }
}
