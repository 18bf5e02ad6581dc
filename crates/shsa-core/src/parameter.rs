//! A constant that changes slowly, as a set that holds its true value: set-membership estimation with bounded errors.
//!
//! The set begins as the range, grows by the largest rate of change as time passes, and is intersected with what a relation,
//! solved for the constant, gives from sound signals. While the bounds of the signals and of the relation are right, the truth
//! is in the set. A value that does not meet the set is a contradiction, and is not learned.
//!
//! Source: M. Milanese, A. Vicino, "Optimal estimation theory for dynamic systems with set membership uncertainty: An
//! overview", Automatica 27 (1991), 10.1016/0005-1098(91)90134-N.

use crate::interval::Interval;
use crate::numbers::{CONFIRMED_AFTER, RANGE_SHARE};
use crate::time::{Span, Time};

/// A value is given for this long ahead, so that it needs no renewal with every observation.
pub const AHEAD: Span = Span::from_millis(1_000);

/// A set and the time for which it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The set, SI.
    pub set: Interval,
    /// When the constant was in the set.
    pub at: Time,
}

/// The part of a parameter that outlasts a restart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// The newest knowledge.
    pub newest: Known,
    /// What no fault can take back.
    pub confirmed: Known,
    /// The knowledge from which a drift is counted.
    pub anchor: Known,
}

/// A drift towards an end of the range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// What the constant was.
    pub from: Interval,
    /// How long ago.
    pub within: Span,
    /// What the constant is.
    pub to: Interval,
    /// The end of the range that it moves to.
    pub limit: f64,
    /// The time until then, if it goes on like this.
    pub remaining: Span,
}

/// A change that is worth an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum News {
    /// The constant moves on.
    Drifts(Drift),
    /// The constant has certainly left its range.
    Left,
    /// The constant may be in its range again.
    Back,
}

/// A constant under estimation.
#[derive(Clone, Debug)]
pub struct Parameter {
    range: Interval,
    max_rate: f64,
    /// `None` before the first moment.
    memory: Option<Memory>,
    /// What becomes confirmed next.
    recent: Option<Known>,
    has_left: bool,
}

impl Parameter {
    /// A constant of which only its bounded range (SI) and its largest rate of change (SI a second) are known.
    #[must_use]
    pub fn new(range: Interval, max_rate: f64) -> Parameter {
        Parameter { range, max_rate, memory: None, recent: None, has_left: false }
    }

    /// The part that outlasts a restart; `None` before the first moment.
    #[must_use]
    pub fn memory(&self) -> Option<Memory> {
        self.memory
    }

    /// Goes on with what was known before a restart at `now`: later times count as `now`. Empty sets are ignored.
    pub fn recall(&mut self, memory: Memory, now: Time) {
        let past = |known: Known| Known { at: known.at.min(now), ..known };
        let Memory { newest, confirmed, anchor } = memory;
        let all = [newest, confirmed, anchor];
        if all.iter().all(|known| known.set.is_bounded() && !known.set.is_empty()) {
            let memory = Memory { newest: past(newest), confirmed: past(confirmed), anchor: past(anchor) };
            self.memory = Some(memory);
            self.recent = Some(memory.newest);
            self.has_left = !memory.newest.set.overlaps(self.range);
        }
    }

    /// Forgets everything learned.
    pub fn forget(&mut self) {
        (self.memory, self.recent, self.has_left) = (None, None, false);
    }

    /// Whether the constant has certainly left its range.
    #[must_use]
    pub fn has_left(&self) -> bool {
        self.has_left
    }

    /// All that the constant can be from a moment on for [`AHEAD`], SI: the whole line when it has left its range, as the relations
    /// with it hold no more.
    #[must_use]
    pub fn value(&self, now: Time) -> Interval {
        let Some(Memory { newest, .. }) = self.memory else { return self.range };
        if self.has_left {
            Interval::ENTIRE
        } else {
            self.grown(newest, now + AHEAD).intersection(self.reach())
        }
    }

    /// The newest set at a moment, SI.
    #[must_use]
    pub fn set(&self, now: Time) -> Interval {
        self.memory.map_or(self.range, |memory| self.grown(memory.newest, now))
    }

    /// Takes what the relation gives for a moment not after `now`. Returns what that shows.
    pub fn take(&mut self, value: Interval, at: Time, now: Time) -> Option<News> {
        let unknown = Known { set: self.range, at };
        let start = Memory { newest: unknown, confirmed: unknown, anchor: unknown };
        let mut memory = *self.memory.get_or_insert(start);
        let then = memory.newest.at.max(at).min(now.max(memory.newest.at));
        let value = value.widened(self.max_rate * (then - at).seconds().max(0.0));
        let set = self.grown(memory.newest, then).intersection(value);
        if set.is_empty() {
            return None;
        }
        memory.newest = Known { set, at: then };
        let recent = *self.recent.get_or_insert(memory.newest);
        let is_confirmed = then - recent.at >= CONFIRMED_AFTER;
        if is_confirmed {
            memory.confirmed = recent;
            self.recent = Some(memory.newest);
        }
        self.memory = Some(memory);
        // It is back when it is more likely within than beyond the end.
        let is_beyond = !self.range.contains(set.midpoint());
        let has_left = !set.overlaps(self.range) || self.has_left && is_beyond;
        if core::mem::replace(&mut self.has_left, has_left) != has_left {
            return Some(if has_left { News::Left } else { News::Back });
        }
        if is_confirmed { self.drift() } else { None }
    }

    /// A fault has been noticed: what is not confirmed may rest on it, and is taken back.
    pub fn take_back(&mut self) {
        if let Some(memory) = &mut self.memory {
            memory.newest = memory.confirmed;
            self.recent = Some(memory.confirmed);
        }
    }

    /// Compares what is known now with what was: a drift is a move by a good part of the range beyond all doubt.
    fn drift(&mut self) -> Option<News> {
        let memory = self.memory.as_mut()?;
        let (before, after) = (memory.anchor, memory.newest);
        if after.set.width() < 0.5 * before.set.width() {
            memory.anchor = after;
            return None;
        }
        let moved = after.set.midpoint() - before.set.midpoint();
        if !self.range.contains(after.set.midpoint()) {
            return None;
        }
        if after.set.overlaps(before.set) || moved.abs() < RANGE_SHARE * self.range.width() {
            return None;
        }
        memory.anchor = after;
        let limit = if moved > 0.0 { self.range.hi() } else { self.range.lo() };
        let within = after.at - before.at;
        let remaining = ((limit - after.set.midpoint()) / moved).max(0.0) * within.seconds();
        Some(News::Drifts(Drift {
            from: before.set,
            within,
            to: after.set,
            limit,
            remaining: Span::from_seconds(remaining),
        }))
    }

    /// A set at a later moment: it grows, but not beyond what the range makes plausible.
    fn grown(&self, known: Known, at: Time) -> Interval {
        let grown = known.set.widened(self.max_rate * (at - known.at).seconds().max(0.0));
        grown.intersection(known.set.hull(self.reach()))
    }

    /// The range and a bit to either side, without a change of sign: a relation may be solved for one sign only.
    fn reach(&self) -> Interval {
        let (lo, hi) = (self.range.lo(), self.range.hi());
        let beyond = RANGE_SHARE * self.range.width();
        let low = if lo >= 0.0 { (lo - beyond).max(0.5 * lo) } else { lo - beyond };
        let high = if hi <= 0.0 { (hi + beyond).min(0.5 * hi) } else { hi + beyond };
        Interval::new(low, high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HOUR: f64 = 3_600.0;

    fn parameter() -> Parameter {
        Parameter::new(Interval::new(15.0, 60.0), 1.0 / HOUR)
    }

    fn at(hours: f64) -> Time {
        Time::from_seconds(hours * HOUR)
    }

    /// Takes plus-minus `error` around a truth once a minute.
    fn learn(
        parameter: &mut Parameter,
        hours: core::ops::Range<f64>,
        error: f64,
        truth: impl Fn(f64) -> f64,
    ) -> std::vec::Vec<News> {
        let minutes = ((hours.end - hours.start) * 60.0) as u32;
        let moments = (0..minutes).map(|minute| hours.start + f64::from(minute) / 60.0);
        let taken = moments.filter_map(|hour| {
            let value = Interval::new(truth(hour) - error, truth(hour) + error);
            parameter.take(value, at(hour), at(hour))
        });
        taken.collect()
    }

    #[test]
    fn a_constant_is_found_within_the_error() {
        let mut known = parameter();
        assert_eq!(learn(&mut known, 0.0..5.0, 2.0, |_| 30.0), []);
        let set = known.set(at(5.0));
        assert!(set.lo() <= 30.0 && 30.0 <= set.hi() && set.width() < 4.2, "{set:?}");
    }

    #[test]
    fn a_drift_is_told_with_the_time_to_the_limit_and_its_end_as_left() {
        let mut known = parameter();
        let news = learn(&mut known, 0.0..80.0, 1.0, |hour| 30.0 + 0.5 * hour);
        let Some(News::Drifts(first)) = news.first().copied() else { panic!("{news:?}") };
        let at_first = (first.to.midpoint() - 30.0) / 0.5;
        let expected = (60.0 - 30.0) / 0.5 - at_first;
        assert!((first.remaining.seconds() / HOUR - expected).abs() < 3.0, "{first:?}, {expected} h");
        assert_eq!(first.limit, 60.0);
        assert!(news.len() <= 9 && news.last() == Some(&News::Left), "{news:?}");
        assert_eq!(known.value(at(80.0)), Interval::ENTIRE);
    }

    #[test]
    fn a_contradiction_is_not_learned_and_a_fault_takes_back_what_is_new() {
        let mut known = parameter();
        learn(&mut known, 0.0..5.0, 2.0, |_| 30.0);
        let before = known.memory();
        assert_eq!(known.take(Interval::new(40.0, 44.0), at(5.0), at(5.0)), None);
        assert_eq!(known.memory(), before);
        // A small fault is within the set; once it is noticed, it is gone.
        known.take(Interval::new(31.5, 33.5), at(5.0), at(5.0));
        assert!(known.set(at(5.0)).lo() > 31.0);
        known.take_back();
        assert!(known.set(at(5.0)).lo() < 30.0);
    }

    #[test]
    fn without_values_the_set_grows_up_to_a_bit_beyond_the_range() {
        let mut known = parameter();
        learn(&mut known, 0.0..1.0, 1.0, |_| 30.0);
        assert!(known.set(at(11.0)).width() > 20.0);
        assert_eq!(known.set(at(1000.0)), Interval::new(15.0 - 5.625, 60.0 + 5.625));
    }

    proptest! {
        #[test]
        fn the_truth_stays_in_the_set(
            steps in prop::collection::vec((-1.0..1.0_f64, 0.0..0.5_f64, -1.0..1.0_f64, any::<bool>()), 1..200),
        ) {
            let mut known = parameter();
            let (mut truth, mut hour) = (37.0, 0.0);
            for (slope, hours, off, is_heard) in steps {
                hour += hours;
                truth = (truth + slope * hours).clamp(15.0, 60.0);
                if is_heard {
                    let middle = truth + 3.0 * off;
                    known.take(Interval::new(middle - 3.0, middle + 3.0), at(hour), at(hour));
                }
                let (set, value) = (known.set(at(hour)), known.value(at(hour)));
                prop_assert!(set.lo() - 1e-9 <= truth && truth <= set.hi() + 1e-9, "{truth} {set:?}");
                prop_assert!(value.lo() - 1e-9 <= truth && truth <= value.hi() + 1e-9, "{truth} {value:?}");
            }
        }
    }
}
