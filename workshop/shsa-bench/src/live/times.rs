//! A histogram of times, and its quantiles.

use hdrhistogram::Histogram;
use serde_json::{Value, json};
use shsa_core::time::Span;

/// The longest time that the histogram resolves, nanoseconds: a minute.
const LONGEST: u64 = 60_000_000_000;

/// A histogram of times.
#[derive(Clone, Debug)]
pub(super) struct Times(Histogram<u64>);

impl Times {
    /// # Errors
    /// Never: the bounds are fixed and right.
    pub(super) fn new() -> anyhow::Result<Times> {
        Ok(Times(Histogram::new_with_bounds(1, LONGEST, 3)?))
    }

    pub(super) fn record(&mut self, span: Span) {
        self.0.saturating_record(u64::try_from(span.0).unwrap_or(0).max(1));
    }

    pub(super) fn add(&mut self, other: &Times) {
        // Cannot fail: both histograms have the same bounds.
        let _ = self.0.add(&other.0);
    }

    pub(super) fn count(&self) -> u64 {
        self.0.len()
    }

    pub(super) fn quantiles(&self) -> Quantiles {
        let at = |share: f64| {
            if self.0.is_empty() { f64::NAN } else { self.0.value_at_quantile(share) as f64 / 1e9 }
        };
        Quantiles { p50: at(0.5), p99: at(0.99), worst: at(1.0) }
    }
}

/// Quantiles in seconds; NaN when there are no times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quantiles {
    pub(super) p50: f64,
    pub(super) p99: f64,
    pub(super) worst: f64,
}

impl Quantiles {
    pub(super) fn to_json(self) -> Value {
        json!({ "p50_s": self.p50, "p99_s": self.p99, "worst_s": self.worst })
    }

    /// The quantiles of a state's JSON, which are in microseconds.
    pub(super) fn from_state(state: &Value) -> Quantiles {
        let at = |name: &str| state[name].as_f64().map_or(f64::NAN, |microseconds| microseconds / 1e6);
        Quantiles { p50: at("p50"), p99: at("p99"), worst: at("worst") }
    }

    /// The smaller of each.
    pub(super) fn least(self, other: Quantiles) -> Quantiles {
        Quantiles {
            p50: self.p50.min(other.p50),
            p99: self.p99.min(other.p99),
            worst: self.worst.min(other.worst),
        }
    }

    /// The difference to another's quantiles.
    pub(super) fn beyond(self, other: Quantiles) -> Quantiles {
        Quantiles { p50: self.p50 - other.p50, p99: self.p99 - other.p99, worst: self.worst - other.worst }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_times() {
        let mut times = Times::new().unwrap();
        assert!(times.quantiles().p50.is_nan());
        (1..=1_000).for_each(|at| times.record(Span(at * 1_000)));
        let Quantiles { p50, p99, worst } = times.quantiles();
        assert!((p50 - 500e-6).abs() < 1e-6 && (p99 - 990e-6).abs() < 1e-6 && (worst - 1e-3).abs() < 1e-6);
    }
}
