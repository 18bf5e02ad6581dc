//! What a quantity can have been between the moments at which it is known, by the largest rate of its change and by its range.

use super::Interval;

/// How a quantity can move between two moments at which it is known. SI, and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// The largest rate of change, above 0; infinite where it is not known.
    pub max_rate: f64,
    /// The possible values.
    pub range: Interval,
    /// The part of what its values are off by that does not change with time.
    pub offset: Offset,
}

/// A part of the error of values that all of them share, but for a slow drift. SI, and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Offset {
    /// The lowest one, as it is added to a value.
    pub lo: f64,
    /// The highest one.
    pub hi: f64,
    /// The largest rate at which it changes.
    pub drift: f64,
}

impl Offset {
    /// None: each value may be off in its own way.
    pub const NONE: Offset = Offset { lo: 0.0, hi: 0.0, drift: 0.0 };

    /// Whether values have one.
    #[inline]
    #[must_use]
    pub fn is_some(self) -> bool {
        self.lo < self.hi
    }

    /// What is the same in all values within a time, whatever it drifts by meanwhile; [`Offset::NONE`] where nothing is.
    #[must_use]
    pub fn throughout(self, seconds: f64) -> Offset {
        let moved = (0.5 * self.drift * seconds).next_up();
        let (lo, hi) = (self.lo + moved, self.hi - moved);
        if self.is_some() && lo < hi { Offset { lo, hi, drift: 0.0 } } else { Offset::NONE }
    }

    /// The offset of the sum of two values.
    #[must_use]
    pub fn and(self, other: Offset) -> Offset {
        Offset { lo: self.lo + other.lo, hi: self.hi + other.hi, drift: self.drift + other.drift }
    }

    /// The offset of the value times a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Offset {
        let (one, other) = (self.lo * factor, self.hi * factor);
        Offset { lo: one.min(other), hi: one.max(other), drift: self.drift * factor.abs() }
    }
}

/// More than the roundings of the areas amount to, as a share of the largest term: each is of at most six operations.
const ROUNDINGS: f64 = 8.0 * f64::EPSILON;

impl Course {
    /// Nothing is known: a quantity can be anything as soon as it is not known.
    pub const ANY: Course = Course { max_rate: f64::INFINITY, range: Interval::ENTIRE, offset: Offset::NONE };

    /// Whether the rate of change is bounded.
    #[inline]
    #[must_use]
    pub fn is_rated(self) -> bool {
        self.max_rate < f64::INFINITY
    }

    /// The possible part of a value; a value of which nothing is possible stays as it is, to show that it is wrong.
    #[inline]
    fn possible(self, value: Interval) -> Interval {
        let part = value.intersection(self.range);
        if part.is_empty() { value } else { part }
    }

    /// The value some time before or after a moment at which it is known.
    #[inline]
    #[must_use]
    pub fn away(self, value: Interval, seconds: f64) -> Interval {
        if seconds <= 0.0 {
            return self.possible(value);
        }
        match self.is_rated() {
            true => self.possible(value.widened((seconds * self.max_rate).next_up())),
            false => self.range,
        }
    }

    /// The value at a moment between two at which it is known, each given with the time from there. Where both contradict each
    /// other, one of them is wrong: the hull of what they say.
    #[inline]
    #[must_use]
    pub fn between(self, before: (Interval, f64), after: (Interval, f64)) -> Interval {
        let ((first, last), rises) =
            ((before.0, after.0), (before.1 * self.max_rate, after.1 * self.max_rate));
        let largest = first.magnitude().max(last.magnitude()) + rises.0 + rises.1;
        let margin = ROUNDINGS * largest;
        let hi = (first.hi() + rises.0).min(last.hi() + rises.1) + margin;
        let lo = (first.lo() - rises.0).max(last.lo() - rises.1) - margin;
        let (lo, hi) = (lo.max(self.range.lo()), hi.min(self.range.hi()));
        if largest < f64::INFINITY && lo <= hi {
            return Interval::new(lo, hi);
        }
        self.between_any(before, after)
    }

    #[inline(never)]
    fn between_any(self, before: (Interval, f64), after: (Interval, f64)) -> Interval {
        let (one, other) = (self.away(before.0, before.1), self.away(after.0, after.1));
        let both = one.intersection(other);
        if both.is_empty() { one.hull(other) } else { both }
    }

    /// The integral over the time between two moments at which the value is known: the area below the highest course, and that
    /// below the lowest.
    #[must_use]
    pub fn integral(self, before: Interval, after: Interval, seconds: f64) -> Interval {
        if seconds <= 0.0 {
            return Interval::point(0.0);
        }
        if !self.is_rated() {
            return self.range * Interval::point(seconds);
        }
        let (one, other) = match self.range == Interval::ENTIRE {
            true => (before, after),
            false => (self.possible(before), self.possible(after)),
        };
        let rise = self.max_rate * seconds;
        let highest = highest(one.hi(), other.hi(), self.range.hi(), rise) * seconds;
        let lowest = -highest_of_mirrored(one, other, self.range.lo(), rise) * seconds;
        let largest = one.magnitude().max(other.magnitude()) + rise;
        let margin = ROUNDINGS * largest * seconds;
        // Of values that contradict each other by more than the rate allows, each course may be the right one.
        Interval::new(lowest.min(highest) - margin, lowest.max(highest) + margin)
    }
}

/// The mean of the highest course between two ends: it rises and falls by at most `rise` in all of the time, and stays below `cap`.
fn highest(before: f64, after: f64, cap: f64, rise: f64) -> f64 {
    let cap = cap.max(before).max(after);
    // Beyond the other end and the full rise, an end cannot be.
    let (before, after) = (before.min(after + rise), after.min(before + rise));
    let (difference, middle) = (after - before, 0.5 * (before + after));
    // Two lines up to the peak: a trapezoid with a triangle on it, the top of which may be cut off.
    let whole = middle + 0.25 * (rise - difference * difference / rise);
    let above = middle + 0.5 * rise - cap;
    if above > 0.0 { whole - above * above / rise } else { whole }
}

/// The same for the lowest course, upside down.
fn highest_of_mirrored(before: Interval, after: Interval, floor: f64, rise: f64) -> f64 {
    highest(-before.lo(), -after.lo(), -floor, rise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// A course that keeps the rate and the range: from one end by random steps, sampled finely.
    fn course(steps: &[f64], start: f64, range: Interval, max_step: f64) -> Vec<f64> {
        let mut value = start;
        let mut all = Vec::from([start]);
        for step in steps {
            value = (value + step * max_step).clamp(range.lo(), range.hi());
            all.push(value);
        }
        all
    }

    proptest! {
        /// What a quantity was between two moments lies within what it can have been.
        #[test]
        fn what_was_is_possible(
            steps in prop::collection::vec(prop_oneof![Just(-1.0), Just(1.0), -1.0..1.0_f64], 2..60),
            start in -5.0..5.0_f64, hi in 5.0..12.0_f64, max_rate in 0.01..20.0_f64, seconds in 0.1..30.0_f64,
            error in 0.0..2.0_f64, side in -1.0..1.0_f64, is_ranged: bool,
        ) {
            let range = Interval::new(-5.0, hi);
            let step = seconds / steps.len() as f64;
            let truth = course(&steps, start, range, max_rate * step);
            let range_known = if is_ranged { range } else { Interval::ENTIRE };
            let known = Course { max_rate, range: range_known, ..Course::ANY };
            let seen = |value: f64| Interval::new(value + (side - 1.0) * error - 1e-9, value + (side + 1.0) * error + 1e-9);
            let (first, last) = (seen(truth[0]), seen(*truth.last().unwrap()));
            for (at, value) in truth.iter().enumerate() {
                let since = at as f64 * step;
                let found = known.between((first, since), (last, seconds - since));
                prop_assert!(found.widened(1e-9).contains(*value), "{found:?} {value}");
            }
            let area: f64 = truth.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]) * step).sum();
            let found = known.integral(first, last, seconds);
            prop_assert!(found.widened(1e-9).contains(area), "{found:?} {area}");
        }

        /// The bound is no wider than the highest course that a fine search finds.
        #[test]
        fn no_more_than_possible_is_said(
            before in -5.0..5.0_f64, after in -5.0..5.0_f64, cap in 0.0..6.0_f64, max_rate in 0.1..20.0_f64, seconds in 0.1..10.0_f64,
        ) {
            let rise = max_rate * seconds;
            prop_assume!((before - after).abs() <= rise);
            let top = 5.0 + cap;
            let known = Course { max_rate, range: Interval::new(-100.0, top), ..Course::ANY };
            let count = 2_000;
            let highest = |at: usize| {
                let since = (at as f64 + 0.5) / f64::from(count) * seconds;
                (before + max_rate * since).min(after + max_rate * (seconds - since)).min(top)
            };
            let area: f64 = (0..count as usize).map(highest).sum::<f64>() * seconds / f64::from(count);
            let found = known.integral(Interval::point(before), Interval::point(after), seconds);
            prop_assert!((found.hi() - area).abs() <= 1e-3 * (1.0 + rise * seconds), "{found:?} {area}");
        }
    }

    #[test]
    fn without_a_rate_only_the_range_is_left() {
        let known = Course { range: Interval::new(0.0, 60.0), ..Course::ANY };
        let at = |value: f64| Interval::point(value);
        assert_eq!(known.integral(at(1.0), at(2.0), 10.0), Interval::new(0.0, 600.0));
        assert_eq!(known.between((at(1.0), 1.0), (at(2.0), 1.0)), Interval::new(0.0, 60.0));
        assert!(!Course::ANY.integral(at(1.0), at(2.0), 10.0).is_bounded());
    }
}
