//! Points in time and spans, counted in nanoseconds, never measured.
//!
//! All arithmetic saturates: a stranger's time stamp may be any 64-bit number and must not make us overflow.

use core::ops::{Add, Neg, Sub};

/// A point in time: nanoseconds since an epoch that the source of the observations defines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(pub i64);

/// A signed length of time in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Span(pub i64);

impl Time {
    /// The earliest point there is: older than every observation.
    pub const MIN: Time = Time(i64::MIN);
    /// The latest point there is.
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
    /// No time at all.
    pub const ZERO: Span = Span(0);
    /// The longest span there is.
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
    #[must_use]
    pub fn seconds(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// Its length without its sign.
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

impl Add<Span> for Time {
    type Output = Time;
    fn add(self, span: Span) -> Time {
        Time(self.0.saturating_add(span.0))
    }
}

impl Sub<Span> for Time {
    type Output = Time;
    fn sub(self, span: Span) -> Time {
        Time(self.0.saturating_sub(span.0))
    }
}

impl Sub for Time {
    type Output = Span;
    fn sub(self, earlier: Time) -> Span {
        Span(self.0.saturating_sub(earlier.0))
    }
}

impl Add for Span {
    type Output = Span;
    fn add(self, other: Span) -> Span {
        Span(self.0.saturating_add(other.0))
    }
}

impl Sub for Span {
    type Output = Span;
    fn sub(self, other: Span) -> Span {
        Span(self.0.saturating_sub(other.0))
    }
}

impl Neg for Span {
    type Output = Span;
    fn neg(self) -> Span {
        Span(self.0.saturating_neg())
    }
}

/// When a value held: at some moment between two points, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Validity {
    /// The earliest moment.
    pub from: Time,
    /// The latest moment.
    pub to: Time,
}

impl Validity {
    /// A time stamp that is known exactly.
    #[must_use]
    pub const fn at(time: Time) -> Validity {
        Validity { from: time, to: time }
    }

    /// Always: what a constant is valid for.
    #[must_use]
    pub const fn always() -> Validity {
        Validity { from: Time::MIN, to: Time::MAX }
    }

    /// The moments in both; `None` when there is none. Touching counts.
    #[must_use]
    pub fn intersection(self, other: Validity) -> Option<Validity> {
        let from = self.from.max(other.from);
        let to = self.to.min(other.to);
        (from <= to).then_some(Validity { from, to })
    }

    /// The shortest validity that holds both.
    #[must_use]
    pub fn hull(self, other: Validity) -> Validity {
        Validity { from: self.from.min(other.from), to: self.to.max(other.to) }
    }

    /// Time between the two when they do not overlap, else zero.
    #[must_use]
    pub fn gap(self, other: Validity) -> Span {
        let apart = (other.from - self.to).max(self.from - other.to);
        apart.max(Span::ZERO)
    }

    /// From the earliest to the latest moment.
    #[must_use]
    pub fn length(self) -> Span {
        self.to - self.from
    }

    /// Moved by a span, later when positive.
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
    fn touching_validities_overlap() {
        let a = Validity { from: Time(0), to: Time(5) };
        let b = Validity { from: Time(5), to: Time(9) };
        assert_eq!(a.intersection(b), Some(Validity::at(Time(5))));
        assert_eq!(a.gap(b), Span::ZERO);
        assert_eq!(a.gap(b.shifted(Span(3))), Span(3));
        assert_eq!(a.intersection(b.shifted(Span(1))), None);
    }
}
