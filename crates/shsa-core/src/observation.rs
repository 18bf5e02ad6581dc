//! One value of one signal, with its uncertainty, its time of validity and the time of its reception.

use crate::interval::Interval;
use crate::knowledge::{Signal, SignalId, ValueError};
use crate::time::{Time, Validity};
use crate::unit::Unit;
use alloc::vec::Vec;

/// A value as it comes from outside, in the unit of its signal.
#[derive(Clone, Debug, PartialEq)]
pub enum RawValue {
    /// One number; may be not-a-number or infinite, which is an invalid value.
    Number(f64),
    /// A value that brings its own uncertainty.
    Interval {
        /// Lower bound.
        lo: f64,
        /// Upper bound.
        hi: f64,
    },
    /// A list, such as a scan.
    Vector(Vec<f64>),
}

/// An observation from a bridge or a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// The observed signal.
    pub signal: SignalId,
    /// The time stamp, as the source gave it.
    pub stamp: Time,
    /// When the observation was received.
    pub received: Time,
    /// The value.
    pub value: RawValue,
}

impl Signal {
    /// The interval, SI, of the true value for a number read from this signal; empty when the number is not finite.
    #[must_use]
    pub fn enclose(&self, value: f64) -> Interval {
        self.enclose_bounds(value, value)
    }

    /// As [`Signal::enclose`], for a value with its own bounds, to which the signal's error is added.
    ///
    /// The errors are those of the value in the signal's unit, after scaling; the relative one is a share of the value. Without a
    /// relative error, without scaling and in SI units the bounds are plain sums of 64-bit numbers; otherwise they are rounded
    /// outward.
    #[inline]
    #[must_use]
    pub fn enclose_bounds(&self, lo: f64, hi: f64) -> Interval {
        if !(lo > f64::NEG_INFINITY && lo <= hi && hi < f64::INFINITY) {
            return Interval::EMPTY;
        }
        match self.plain_error() {
            Some(error) => Interval::new(lo + error.lo, hi + error.hi),
            None => self.enclose_shares(lo, hi),
        }
    }

    /// The error of a signal whose values are enclosed by plain sums.
    #[inline]
    pub(crate) fn plain_error(&self) -> Option<ValueError> {
        let is_si = self.scaling.is_none() && self.unit.as_ref().is_none_or(Unit::is_si);
        let is_plain = self.value_error.relative == 0.0 && is_si && self.limits.saturation.is_none();
        is_plain.then_some(self.value_error)
    }

    /// The bounds with a relative error, a scaling, a unit, or ends of what can be shown.
    fn enclose_shares(&self, lo: f64, hi: f64) -> Interval {
        let error = self.value_error;
        let unit = self.unit.as_ref().filter(|unit| !unit.is_si());
        let reading = Interval::new(lo, hi);
        let shown = self.scaling.map_or(reading, |scaling| scaling.values(reading));
        let reading = unit.map_or(shown, |unit| unit.to_si_interval(shown));
        let mut value = reading;
        if error.relative != 0.0 {
            let share = |bound: f64| (error.relative * bound.abs()).next_up();
            let of_hi = share(shown.hi());
            // A plain number, the most frequent case, has one share.
            let of_lo = if shown.lo() == shown.hi() { of_hi } else { share(shown.lo()) };
            let shares = Interval::new(-of_lo, of_hi);
            value = value + unit.map_or(shares, |unit| unit.to_si_difference_interval(shares));
        }
        // Often there is no other error.
        let is_more = error.lo != 0.0 || error.hi != 0.0;
        let value = if is_more { value + Interval::new(error.lo, error.hi) } else { value };
        self.limits.saturation.map_or(value, |it| it.opened(reading, value))
    }

    /// The validity of an observation with this time stamp.
    #[inline]
    #[must_use]
    pub fn validity(&self, stamp: Time) -> Validity {
        let content = stamp - self.delay;
        Validity { from: content + self.time_error.0, to: content + self.time_error.1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knowledge::{Id, ReadingLimits, Saturation, Scaling, VariableId};
    use alloc::string::String;
    use proptest::prelude::*;

    fn signal(unit: Option<&str>, lo: f64, hi: f64, relative: f64) -> Signal {
        Signal {
            unit: unit.and_then(|text| Unit::parse(text).ok()),
            value_error: ValueError { lo, hi, relative },
            ..Signal::new(String::new(), VariableId::from_index(0))
        }
    }

    #[track_caller]
    fn check(signal: &Signal, value: f64, lo: f64, hi: f64) {
        let enclosed = signal.enclose(value);
        let near = |bound: f64, expected: f64| (bound - expected).abs() <= 1e-12 * expected.abs().max(1.0);
        assert!(near(enclosed.lo(), lo) && near(enclosed.hi(), hi), "{enclosed:?} is not [{lo}, {hi}]");
    }

    #[test]
    fn si_readings_are_widened_by_plain_sums() {
        let enclosed = signal(Some("m"), -0.1, 0.2, 0.0).enclose(1.3);
        assert_eq!((enclosed.lo(), enclosed.hi()), (1.3 - 0.1, 1.3 + 0.2));
        assert_eq!(signal(None, 0.0, 0.0, 0.0).enclose(0.1), Interval::point(0.1));
    }

    #[test]
    fn readings_are_converted_and_errors_come_on_top() {
        check(&signal(Some("km/h"), -1.0, 1.0, 0.0), 36.0, 9.0, 11.0);
        check(&signal(Some("degC"), -0.5, 0.5, 0.0), 20.0, 292.65, 293.65);
        check(&signal(Some("degC"), 0.0, 0.0, 0.02), 20.0, 292.75, 293.55);
        check(&signal(None, -0.3, 0.3, 0.01), -10.0, -10.4, -9.6);
    }

    proptest! {
        /// A sensor that shows its ends in place of what is beyond them: the truth is in what its readings say.
        #[test]
        fn a_reading_at_an_end_holds_what_is_beyond(
            truth in -100.0..100.0_f64,
            error in -1.0..1.0_f64,
            (size, share) in (0.01..5.0_f64, 0.0..0.1_f64),
            (one, other) in (-120.0..120.0_f64, -120.0..120.0_f64),
            unit in prop::sample::select(alloc::vec![None, Some("m"), Some("km/h")]),
        ) {
            let unit: Option<Unit> = unit.and_then(|text: &str| Unit::parse(text).ok());
            let factor = unit.as_ref().map_or(1.0, |unit| unit.scale);
            let ends = Interval::new(one.min(other), one.max(other));
            let sensor = Signal {
                limits: ReadingLimits {
                    saturation: Some(Saturation { ends, beyond: Interval::new(-150.0, 150.0) }),
                    ..ReadingLimits::default()
                },
                unit,
                ..signal(None, -size, size, share)
            };
            let reading = (truth - error * size) / (1.0 + share * error.abs());
            let shown = reading.clamp(ends.lo(), ends.hi());
            let said = sensor.enclose(shown / factor).widened(1e-9);
            prop_assert!(said.contains(truth), "{shown} says {said:?}, and not {truth}");
            let half = size + share * shown.abs();
            let is_inside = shown - half > ends.lo() && shown + half < ends.hi();
            prop_assert!(!is_inside || said.width() < 2.0 * half + 1e-6, "{said:?}");
        }
    }

    #[test]
    fn readings_are_scaled_before_errors_come_on_top() {
        let scaled = |unit, lo, hi, relative, scale, offset| Signal {
            scaling: Some(Scaling { scale, offset }),
            ..signal(Some(unit), lo, hi, relative)
        };
        check(&scaled("m/s", -0.1, 0.2, 0.0, -1.0, 0.0), 3.0, -3.1, -2.8);
        check(&scaled("V", -0.1, 0.1, 0.0, 0.005, -2.0), 1000.0, 2.9, 3.1);
        check(&scaled("km/h", -1.0, 1.0, 0.0, 0.1, 0.0), 360.0, 9.0, 11.0);
        check(&scaled("degC", 0.0, 0.0, 0.02, 0.1, -20.0), 400.0, 292.75, 293.55);
        let turned = scaled("m", 0.0, 0.0, 0.0, -2.0, 1.0).enclose_bounds(1.0, 4.0);
        assert_eq!((turned.lo(), turned.hi()), (-7.0, -1.0));
        assert!(scaled("m", 0.0, 0.0, 0.0, -2.0, 1.0).enclose(f64::NAN).is_empty());
    }

    #[test]
    fn what_is_no_number_is_empty() {
        let signal = signal(Some("km/h"), -1.0, 1.0, 0.1);
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(signal.enclose(value).is_empty());
        }
        assert!(signal.enclose_bounds(2.0, 1.0).is_empty());
        assert!(signal.enclose_bounds(0.0, f64::INFINITY).is_empty());
    }

    proptest! {
        #[test]
        fn every_value_within_its_error_is_enclosed(
            reading in -1e6..1e6_f64, own in 0.0..10.0_f64, margin in 0.0..5.0_f64, share in 0.0..0.9_f64,
            at in 0.0..=1.0_f64,
        ) {
            let unit = Unit::parse("km/h").unwrap();
            let signal = signal(Some("km/h"), -margin, margin, share);
            let shown = reading + own * at;
            let enclosed = signal.enclose_bounds(reading, reading + own);
            for sign in [-1.0, 0.0, 1.0] {
                let truth = unit.to_si(shown * (1.0 + sign * 0.999 * share)) + sign * 0.999 * margin;
                prop_assert!(enclosed.contains(truth) || (share + margin == 0.0 && enclosed.distance(Interval::point(truth)) < 1e-6));
            }
        }
    }
}
