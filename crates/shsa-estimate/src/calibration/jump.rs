//! What the readings of a signal need so that one can have followed the one before it.
//!
//! A signal that may change only so fast is called faulty when too many of its readings do not fit the ones before them. Between two that
//! follow each other closely, as where stamps come unevenly, that is a matter of its error rather than of its variable.

use super::edit::{self, Trial};
use super::{Parameter, Problem, Work};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Signal, SignalId};
use shsa_core::monitor::Debounce;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Validity};
use std::collections::VecDeque;

/// So many times fewer than would be called a fault may be too fast in what is fitted.
const FEWER: usize = 2;

impl Work<'_> {
    /// The least error of each parameter by itself, in its unit: 0 but for signals that may change only so fast.
    pub(super) fn least_errors(&self, trial: &Trial) -> Result<Vec<f64>, Problem> {
        let knowledge = edit::built(&trial.applied(self.draft))?;
        let one = |parameter: &Parameter| match parameter {
            Parameter::Relation(_) => 0.0,
            Parameter::Signal(id) => {
                self.needed_by(*id, &knowledge.signals()[*id]) / edit::scale(&knowledge, *id)
            }
        };
        Ok(self.parameters.iter().map(one).collect())
    }

    /// How much wider, in SI and on either side, the readings of a signal have to be. O(n k) for n readings.
    fn needed_by(&self, id: SignalId, signal: &Signal) -> f64 {
        let Some(max_rate) = signal.limits.max_rate else { return 0.0 };
        let debounce = Debounce::default();
        let period = signal.rate_hz.map_or(debounce.span, |rate| Span::from_seconds(1.0 / rate));
        let (among, fault) = debounce.window(period);
        let allowed = fault as usize / FEWER;
        let readings = self.early.iter().filter(|it| it.signal == id).filter_map(|it| reading(signal, it));
        let (mut before, mut needs, mut most): (Option<Reading>, VecDeque<f64>, f64) =
            (None, VecDeque::new(), 0.0);
        for mut reading in readings {
            if let Some(before) = &before {
                // A value that is repeated exactly may be one that is held.
                if before.value == reading.value {
                    reading.validity.from = reading.validity.from.min(before.validity.from);
                }
                needs.push_back(reading.beyond(before, max_rate) / 2.0);
            }
            if needs.len() > among as usize {
                needs.pop_front();
            }
            most = most.max(largest(&needs, allowed));
            before = Some(reading);
        }
        most
    }
}

struct Reading {
    value: Interval,
    validity: Validity,
}

fn reading(signal: &Signal, observation: &Observation) -> Option<Reading> {
    let (lo, hi) = match observation.value {
        RawValue::Number(value) => (value, value),
        RawValue::Interval { lo, hi } => (lo, hi),
        RawValue::Vector(_) => return None,
    };
    let value = signal.enclose_bounds(lo, hi);
    (value.is_bounded() && !value.is_empty())
        .then(|| Reading { value, validity: signal.validity(observation.stamp) })
}

impl Reading {
    /// How far it is from the one before it, beyond what can have changed in between.
    fn beyond(&self, before: &Reading, max_rate: f64) -> f64 {
        let (one, other) = (before.validity, self.validity);
        let within = (other.to - one.from).max(one.to - other.from);
        let apart = (self.value.lo() - before.value.hi()).max(before.value.lo() - self.value.hi());
        apart - max_rate * within.seconds()
    }
}

/// What at most `allowed` of these exceed; 0 where that is less.
fn largest(needs: &VecDeque<f64>, allowed: usize) -> f64 {
    let mut sorted: Vec<f64> = needs.iter().copied().filter(|need| *need > 0.0).collect();
    sorted.sort_unstable_by(|one, other| other.total_cmp(one));
    sorted.get(allowed).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_few_exceed_is_the_largest_but_those() {
        let needs: VecDeque<f64> = [0.1, -3.0, 0.4, 0.2, 0.3].into();
        let found = [0, 1, 3, 4].map(|allowed| largest(&needs, allowed));
        assert_eq!(found, [0.4, 0.3, 0.1, 0.0]);
    }
}
