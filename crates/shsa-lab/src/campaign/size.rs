//! The size of a signal's values, and the amounts of faults derived from it.

use super::kind::{Kind, What};
use shsa_core::knowledge::{Scaling, Signal};
use shsa_core::observation::RawValue;
use shsa_core::time::Span;
use shsa_recording::Sample;

/// The size of a signal's values, and their declared accuracy.
pub(super) struct Size {
    /// The declared error of a value of median size, in the signal's unit.
    pub error: f64,
    /// Median of the values' magnitudes, in the signal's unit.
    pub median: f64,
    /// The range of the values.
    pub range: f64,
    /// The declared error of its time stamps plus the mean time between two values.
    pub time: Span,
}

impl Size {
    /// The size from the samples in each session; `None` without a finite value.
    pub(super) fn of(signal: &Signal, own: &[Vec<&Sample>]) -> Option<Size> {
        let values = own.iter().flatten().flat_map(|sample| numbers(&sample.value, signal.scaling));
        let values = values.filter(|value| value.is_finite());
        let (lowest, highest) = values
            .clone()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), value| (lo.min(value), hi.max(value)));
        let mut magnitudes: Vec<f64> = values.map(f64::abs).collect();
        let middle = magnitudes.len() / 2;
        let median =
            (!magnitudes.is_empty()).then(|| *magnitudes.select_nth_unstable_by(middle, f64::total_cmp).1)?;
        let scale = signal.unit.as_ref().map_or(1.0, |unit| unit.scale);
        let declared = signal.value_error;
        let error = declared.lo.abs().max(declared.hi.abs()) / scale + declared.relative * median;
        let lasts = |own: &Vec<&Sample>| Some((own.last()?.received - own.first()?.received).0);
        let steps: usize = own.iter().map(|own| own.len().saturating_sub(1)).sum();
        let period = Span(own.iter().filter_map(lasts).sum::<i64>() / (steps as i64).max(1));
        let (early, late) = signal.time_error;
        Some(Size { error, median, range: highest - lowest, time: early.abs().max(late.abs()) + period })
    }

    /// The amount to inject: `None` if none can be computed, `Some(None)` for a kind without an amount.
    pub(super) fn amount(&self, what: What, duration: Span) -> Option<Option<f64>> {
        let Some(by) = what.multiple else { return Some(None) };
        let amount = match what.kind {
            Kind::Delay => by * self.time.seconds(),
            _ if self.error <= 0.0 => return None,
            Kind::Drift => by * self.error / duration.seconds(),
            Kind::Scale => 1.0 + by * self.error / self.median,
            _ => by * self.error,
        };
        amount.is_finite().then_some(Some(amount))
    }
}

/// The numbers in a reading, in the signal's unit.
pub(super) fn numbers(reading: &RawValue, scaling: Option<Scaling>) -> Vec<f64> {
    let mut values = match reading {
        RawValue::Number(value) => vec![*value],
        RawValue::Interval { lo, hi } => vec![lo.midpoint(*hi)],
        RawValue::Vector(values) => values.clone(),
    };
    if let Some(scaling) = scaling {
        values.iter_mut().for_each(|value| *value = scaling.value(*value));
    }
    values
}
