//! The clock for times of reception: it never goes back, even if the wall clock is set.

mod source;
mod uptime;

pub use source::SourceClock;
pub(crate) use uptime::Uptime;

use shsa_core::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// A larger change of the wall clock against this one is a step, nanoseconds: 50 ms.
const STEP: i64 = 50_000_000;
/// For this long after a step, messages stamped before the step may still arrive, nanoseconds.
const ON_ITS_WAY: i64 = 2_000_000_000;

/// A clock that starts with the wall clock's time and runs evenly, also while the machine sleeps; clones are the same clock.
///
/// The wall clock may be set meanwhile, and with it the stamps of publishers on this machine. [`Clock::follow`] detects this, and
/// [`SourceClock`], [`Clock::steady`] and [`Clock::by_wall`] convert.
#[derive(Clone, Debug)]
pub struct Clock(Arc<Kind>);

#[derive(Debug)]
enum Kind {
    /// The time set by the caller.
    Manual(AtomicI64),
    Running {
        started: Uptime,
        /// The wall clock's time at the start, nanoseconds.
        base: i64,
        /// The lead of the wall clock over this one.
        ahead: AtomicI64,
        /// The lead before the last step of the wall clock.
        was_ahead: AtomicI64,
        /// The time at which the step was detected, by this clock.
        stepped: AtomicI64,
        /// The number of steps.
        steps: AtomicU64,
    },
}

/// The steps of the wall clock.
#[derive(Clone, Copy, Debug)]
struct Steps {
    number: u64,
    /// The lead of the wall clock over the steady one, and the one before the last step, nanoseconds.
    ahead: i64,
    was_ahead: i64,
    /// The time of the last step, by the steady clock.
    last: Time,
}

impl Clock {
    /// A running clock that starts with the wall clock's time.
    #[must_use]
    pub fn running() -> Clock {
        Clock(Arc::new(Kind::Running {
            started: Uptime::now(),
            base: wall(),
            ahead: AtomicI64::new(0),
            was_ahead: AtomicI64::new(0),
            stepped: AtomicI64::new(i64::MIN),
            steps: AtomicU64::new(0),
        }))
    }

    /// A clock that stays at 0 until it is [set](Clock::set): a run driven by it can be repeated.
    #[must_use]
    pub fn manual() -> Clock {
        Clock(Arc::new(Kind::Manual(AtomicI64::new(0))))
    }

    /// Whether time passes by itself.
    pub(crate) fn is_running(&self) -> bool {
        matches!(&*self.0, Kind::Running { .. })
    }

    /// The time now.
    #[must_use]
    pub fn now(&self) -> Time {
        match &*self.0 {
            Kind::Manual(now) => Time(now.load(Ordering::Acquire)),
            Kind::Running { started, base, .. } => Time(base.saturating_add(nanoseconds(*started))),
        }
    }

    /// Sets a manual clock; has no effect on a running one.
    pub fn set(&self, to: Time) {
        if let Kind::Manual(now) = &*self.0 {
            now.store(to.0, Ordering::Release);
        }
    }

    /// Checks the wall clock. If it has moved by more than 50 ms against this clock since the last call, this is a step; the
    /// clock adopts it and returns it in nanoseconds (positive: the wall clock went ahead). Call it before reading stamps; it
    /// costs two readings of the clock.
    pub fn follow(&self) -> Option<i64> {
        let Kind::Running { ahead, was_ahead, stepped, steps, .. } = &*self.0 else { return None };
        let now = self.now().0;
        let (is, was) = (wall().saturating_sub(now), ahead.load(Ordering::Acquire));
        let step = is.saturating_sub(was);
        if step.saturating_abs() <= STEP {
            return None;
        }
        was_ahead.store(was, Ordering::Release);
        stepped.store(now, Ordering::Release);
        ahead.store(is, Ordering::Release);
        steps.fetch_add(1, Ordering::AcqRel);
        Some(step)
    }

    /// The steps of the wall clock so far; `None` where time does not pass by itself.
    fn steps(&self) -> Option<Steps> {
        let Kind::Running { ahead, was_ahead, stepped, steps, .. } = &*self.0 else { return None };
        Some(Steps {
            number: steps.load(Ordering::Acquire),
            ahead: ahead.load(Ordering::Acquire),
            was_ahead: was_ahead.load(Ordering::Acquire),
            last: Time(stepped.load(Ordering::Acquire)),
        })
    }

    /// A message's wall-clock stamp as a time of this clock. Shortly after a step the stamp may be from before the step: of both
    /// conversions, the one closer to the reception is taken.
    #[must_use]
    pub fn steady(&self, stamp: Time, received: Time) -> Time {
        let before = |ahead: i64| Time(stamp.0.saturating_sub(ahead));
        match &*self.0 {
            Kind::Running { ahead, was_ahead, stepped, .. } => {
                let (is, was) = (ahead.load(Ordering::Acquire), was_ahead.load(Ordering::Acquire));
                let since = received.0.saturating_sub(stepped.load(Ordering::Acquire));
                let age = |time: &Time| received.0.abs_diff(time.0);
                if since > ON_ITS_WAY || age(&before(is)) <= age(&before(was)) {
                    before(is)
                } else {
                    before(was)
                }
            }
            Kind::Manual(_) => stamp,
        }
    }

    /// A time of this clock as a wall-clock time.
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

fn nanoseconds(since: Uptime) -> i64 {
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
    fn a_step_of_the_wall_clock_is_reported_once_and_translated() {
        let clock = Clock::running();
        assert_eq!(clock.follow(), None);
        let hour = 3_600_000_000_000;
        if let Kind::Running { ahead, .. } = &*clock.0 {
            ahead.store(-hour, Ordering::Release);
        }
        let step = clock.follow().unwrap();
        assert!((step - hour).abs() < 1_000_000_000, "{step}");
        assert_eq!(clock.follow(), None);
    }

    #[test]
    fn what_was_stamped_before_a_step_and_comes_after_it_is_no_hour_old() {
        let clock = Clock::running();
        let hour = 3_600_000_000_000;
        if let Kind::Running { ahead, .. } = &*clock.0 {
            ahead.store(-hour, Ordering::Release);
        }
        let before = clock.by_wall(clock.now());
        clock.follow();
        let (now, after) = (clock.now(), clock.by_wall(clock.now()));
        for stamp in [before, after] {
            let age = now.0.abs_diff(clock.steady(stamp, now).0);
            assert!(age < 1_000_000_000, "{age}");
        }
        let late = Time(now.0 + ON_ITS_WAY + 1_000_000_000);
        assert!(clock.steady(before, late).0.abs_diff(late.0) > hour as u64 / 2);
    }

    #[test]
    fn a_manual_clock_stands_where_it_was_set() {
        let clock = Clock::manual();
        clock.set(Time(5));
        assert_eq!((clock.now(), clock.follow()), (Time(5), None));
        assert_eq!(clock.steady(clock.by_wall(Time(7)), Time(9)), Time(7));
    }
}
