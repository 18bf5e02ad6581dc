//! Points in time and spans, counted in nanoseconds, never measured.
//!
//! All arithmetic saturates: a time stamp may be any 64-bit number and must not cause an overflow.

use core::ops::{Add, Neg, Sub};

/// A point in time: nanoseconds since an epoch that the source of the observations defines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(pub i64);

/// A signed length of time in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Span(pub i64);

impl Time {
    /// The earliest point, before every observation.
    pub const MIN: Time = Time(i64::MIN);
    /// The latest point.
    pub const MAX: Time = Time(i64::MAX);

    /// Seconds since the epoch, rounded to the nearest nanosecond; saturates, and not-a-number gives 0.
    #[must_use]
    pub fn from_seconds(seconds: f64) -> Time {
        Time(Span::from_seconds(seconds).0)
    }

    /// Seconds since the epoch.
    #[must_use]
    pub fn seconds(self) -> f64 {
        self.0 as f64 / 1e9
    }
}

impl Span {
    /// The empty span.
    pub const ZERO: Span = Span(0);
    /// The longest span.
    pub const MAX: Span = Span(i64::MAX);

    /// Rounded to the nearest nanosecond; saturates, and not-a-number gives 0.
    #[must_use]
    pub fn from_seconds(seconds: f64) -> Span {
        Span(libm::round(seconds * 1e9) as i64)
    }

    /// In milliseconds; saturates.
    #[must_use]
    pub const fn from_millis(millis: i64) -> Span {
        Span(millis.saturating_mul(1_000_000))
    }

    /// In seconds.
    #[inline]
    #[must_use]
    pub fn seconds(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// The magnitude of the span.
    #[must_use]
    pub const fn abs(self) -> Span {
        Span(self.0.saturating_abs())
    }

    /// This span `count` times; saturates.
    #[must_use]
    pub const fn times(self, count: i64) -> Span {
        Span(self.0.saturating_mul(count))
    }
}

/// The saturating sum. Only a mistake or an attack saturates, so the branch is almost never taken and costs a third of
/// [`i64::saturating_add`].
#[inline]
fn sum(one: i64, other: i64) -> i64 {
    one.checked_add(other).unwrap_or_else(|| end_of_time(one))
}

/// The saturating difference.
#[inline]
fn difference(one: i64, other: i64) -> i64 {
    one.checked_sub(other).unwrap_or_else(|| end_of_time(one))
}

/// The saturated result of a sum or a difference whose first number has this sign.
#[cold]
#[inline(never)]
fn end_of_time(towards: i64) -> i64 {
    if towards < 0 { i64::MIN } else { i64::MAX }
}

impl Add<Span> for Time {
    type Output = Time;
    #[inline]
    fn add(self, span: Span) -> Time {
        Time(sum(self.0, span.0))
    }
}

impl Sub<Span> for Time {
    type Output = Time;
    #[inline]
    fn sub(self, span: Span) -> Time {
        Time(difference(self.0, span.0))
    }
}

impl Sub for Time {
    type Output = Span;
    #[inline]
    fn sub(self, earlier: Time) -> Span {
        Span(difference(self.0, earlier.0))
    }
}

impl Add for Span {
    type Output = Span;
    #[inline]
    fn add(self, other: Span) -> Span {
        Span(sum(self.0, other.0))
    }
}

impl Sub for Span {
    type Output = Span;
    #[inline]
    fn sub(self, other: Span) -> Span {
        Span(difference(self.0, other.0))
    }
}

impl Neg for Span {
    type Output = Span;
    fn neg(self) -> Span {
        Span(self.0.saturating_neg())
    }
}

/// The validity of a value: it was true at some moment between two points, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Validity {
    /// The earliest moment.
    pub from: Time,
    /// The latest moment.
    pub to: Time,
}

impl Validity {
    /// The validity of an exactly known time.
    #[must_use]
    pub const fn at(time: Time) -> Validity {
        Validity { from: time, to: time }
    }

    /// The validity of a constant: always.
    #[must_use]
    pub const fn always() -> Validity {
        Validity { from: Time::MIN, to: Time::MAX }
    }

    /// The moments in both validities; `None` when there are none. Touching counts.
    #[inline]
    #[must_use]
    pub fn intersection(self, other: Validity) -> Option<Validity> {
        let from = self.from.max(other.from);
        let to = self.to.min(other.to);
        (from <= to).then_some(Validity { from, to })
    }

    /// The middle moment.
    #[inline]
    #[must_use]
    pub fn centre(self) -> Time {
        self.from + Span((self.to - self.from).0 / 2)
    }

    /// The shortest validity that holds both.
    #[must_use]
    pub fn hull(self, other: Validity) -> Validity {
        Validity { from: self.from.min(other.from), to: self.to.max(other.to) }
    }

    /// The time between two validities; zero when they overlap.
    #[inline]
    #[must_use]
    pub fn gap(self, other: Validity) -> Span {
        let apart = (other.from - self.to).max(self.from - other.to);
        apart.max(Span::ZERO)
    }

    /// The time from the earliest to the latest moment.
    #[inline]
    #[must_use]
    pub fn length(self) -> Span {
        self.to - self.from
    }

    /// The validity shifted by a span, later when positive.
    #[must_use]
    pub fn shifted(self, span: Span) -> Validity {
        Validity { from: self.from + span, to: self.to + span }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extreme_times_saturate() {
        assert_eq!(Time::MAX + Span::MAX, Time::MAX);
        assert_eq!(Time::MIN - Time::MAX, Span(i64::MIN));
        assert_eq!(Time::from_seconds(f64::NAN), Time(0));
        assert_eq!(Time::from_seconds(1e300), Time::MAX);
        assert_eq!(Span(i64::MIN).abs(), Span::MAX);
    }

    #[test]
    fn sums_and_differences_saturate_as_the_standard_library_has_it() {
        let numbers = [i64::MIN, i64::MIN + 1, -1, 0, 1, i64::MAX - 1, i64::MAX];
        for (one, other) in numbers.into_iter().flat_map(|one| numbers.map(|other| (one, other))) {
            assert_eq!(Time(one) + Span(other), Time(one.saturating_add(other)));
            assert_eq!(Time(one) - Span(other), Time(one.saturating_sub(other)));
            assert_eq!(Time(one) - Time(other), Span(one.saturating_sub(other)));
            assert_eq!(Span(one) + Span(other), Span(one.saturating_add(other)));
            assert_eq!(Span(one) - Span(other), Span(one.saturating_sub(other)));
        }
    }

    #[test]
    fn touching_validities_overlap() {
        let a = Validity { from: Time(0), to: Time(5) };
        let b = Validity { from: Time(5), to: Time(9) };
        assert_eq!(a.intersection(b), Some(Validity::at(Time(5))));
        assert_eq!(a.gap(b), Span::ZERO);
        assert_eq!(a.gap(b.shifted(Span(3))), Span(3));
        assert_eq!(a.intersection(b.shifted(Span(1))), None);
    }
}
