//! The value of an input at the time of a computation: its latest value, its extrapolation, or the latest value while it is
//! fresh.
//!
//! Inputs of one substitute come at different rates, so they have different ages when it is computed (temporal alignment, D.
//! Ratasich, "Self-Healing Cyber-Physical Systems", 2019, 1.6.3). The latest value is wrong by the change since. An estimator
//! models this change and its uncertainty.

use crate::Error;
use crate::fusion::{Fusion, Options};
use crate::kinematic::Kinematic;
use crate::method::Measurement;
use crate::normal::two_sided;
use shsa_core::interval::Interval;
use shsa_core::time::{Span, Time};

/// The source of an input's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The latest value.
    Port,
    /// The value at the time of the computation, from an estimator.
    Estimate,
    /// The latest value while it is no older than this; then the estimate.
    Both(Span),
}

/// The origin of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The value was measured.
    Port,
    /// The value was extrapolated.
    Estimate,
}

/// The value of an input at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aligned {
    /// The value.
    pub value: f64,
    /// The interval of the truth, with a probability of 95 %; of the latest value only with its measurement error, whatever its
    /// age.
    pub interval: Interval,
    /// The origin of the value.
    pub origin: Origin,
}

/// The number of moments kept for late values.
const MOMENTS: usize = 8;

/// The probability that an interval holds the truth.
const SHARE: f64 = 0.95;

/// An input with an estimator. No allocation after construction.
pub struct Extrapolation {
    access: Access,
    /// The half-width of a measurement's interval, and its number of standard deviations.
    reach: f64,
    deviations: f64,
    fusion: Option<Fusion>,
    latest: Option<(Time, f64)>,
    unknown_after: Span,
}

impl Extrapolation {
    /// The extrapolation of an input that changes as `model` says. Before the first value, the input and its rates are known to be
    /// within about `reach` of zero. After a silence longer than `unknown_after` there is no value.
    ///
    /// # Errors
    /// A reach that is not finite and above 0.
    pub fn new(
        model: Kinematic,
        reach: f64,
        access: Access,
        unknown_after: Span,
    ) -> Result<Extrapolation, Error> {
        if !(reach > 0.0 && reach.is_finite()) {
            return Err(Error::Range {
                what: "the reach of an input",
                value: reach,
                range: "finite and above 0",
            });
        }
        let options = Options { horizon: unknown_after, moments: MOMENTS, gate: None, unknown_after };
        let fusion = match access {
            Access::Port => None,
            Access::Estimate | Access::Both(_) => {
                let filter = model.filter(0.0, reach)?;
                Some(Fusion::new(Box::new(filter), Time(0), 1, 0, options)?)
            }
        };
        let deviations = two_sided(SHARE);
        let reach = deviations * model.variance().sqrt();
        Ok(Extrapolation { access, reach, deviations, fusion, latest: None, unknown_after })
    }

    /// Takes in a value at its time of validity; a late value counts at its own time. A value that is not a number is ignored.
    pub fn observe(&mut self, at: Time, value: f64) {
        if !value.is_finite() {
            return;
        }
        if let Some(fusion) = &mut self.fusion {
            if self.latest.is_none() {
                fusion.restart(at);
            }
            fusion.measure(at, Measurement { sensor: 0, value, variance: None, bound: 0.0 });
        }
        if self.latest.is_none_or(|(newest, _)| newest <= at) {
            self.latest = Some((at, value));
        }
    }

    /// The input at a time; `None` where it is unknown.
    pub fn at(&mut self, at: Time) -> Option<Aligned> {
        let (newest, value) = self.latest?;
        let age = at - newest;
        if age > self.unknown_after {
            return None;
        }
        match self.access {
            Access::Port => Some(aligned(value, self.reach, Origin::Port)),
            Access::Both(fresh) if age <= fresh => Some(aligned(value, self.reach, Origin::Port)),
            Access::Both(_) | Access::Estimate => self.estimated(at),
        }
    }

    fn estimated(&mut self, at: Time) -> Option<Aligned> {
        let estimate = self.fusion.as_mut()?.estimate(at)?;
        let (value, variance) = (*estimate.mean.first()?, *estimate.spread.get((0, 0))?);
        Some(aligned(value, self.deviations * variance.max(0.0).sqrt(), Origin::Estimate))
    }
}

fn aligned(value: f64, reach: f64, origin: Origin) -> Aligned {
    Aligned { value, interval: Interval::new((value - reach).next_down(), (value + reach).next_up()), origin }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp of 2 a second, measured every 0.1 s until 2 s.
    fn ramp(access: Access) -> Extrapolation {
        let model = Kinematic::new(2, 1e-3, 1e-4).unwrap();
        let mut input = Extrapolation::new(model, 100.0, access, Span(1_000_000_000)).unwrap();
        (0..=20).for_each(|place| input.observe(Time(place * 100_000_000), 0.2 * place as f64));
        input
    }

    fn at(access: Access, millis: i64) -> Option<(Origin, f64)> {
        ramp(access).at(Time(millis * 1_000_000)).map(|aligned| (aligned.origin, aligned.value))
    }

    #[test]
    fn the_latest_value_stays_and_the_estimate_goes_on() {
        assert_eq!(at(Access::Port, 2500), Some((Origin::Port, 4.0)));
        let (origin, value) = at(Access::Estimate, 2500).unwrap();
        assert!(origin == Origin::Estimate && (value - 5.0).abs() < 0.02, "{value}");
        assert_eq!(at(Access::Estimate, 3001), None);
    }

    #[test]
    fn the_latest_value_goes_first_while_it_is_fresh() {
        let both = Access::Both(Span(200_000_000));
        assert_eq!(at(both, 2200), Some((Origin::Port, 4.0)));
        assert_eq!(at(both, 2201).unwrap().0, Origin::Estimate);
    }

    #[test]
    fn a_late_value_counts_where_it_belongs_and_is_never_the_latest() {
        let (mut late, mut in_order) = (ramp(Access::Estimate), ramp(Access::Estimate));
        in_order.observe(Time(1_950_000_000), 4.1);
        late.observe(Time(2_100_000_000), 4.2);
        late.observe(Time(1_950_000_000), 4.1);
        in_order.observe(Time(2_100_000_000), 4.2);
        let then = Time(2_300_000_000);
        assert_eq!(late.at(then), in_order.at(then));
        let mut port = ramp(Access::Port);
        port.observe(Time(1_950_000_000), 9.0);
        assert_eq!(port.at(then).unwrap().value, 4.0);
    }

    #[test]
    fn the_interval_grows_with_the_age() {
        let mut input = ramp(Access::Estimate);
        let mut width = |millis: i64| input.at(Time(millis * 1_000_000)).unwrap().interval.width();
        assert!(width(2000) < width(2400) && width(2400) < width(2900));
    }
}
