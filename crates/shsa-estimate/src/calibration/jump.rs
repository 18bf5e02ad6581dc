//! What the readings of a signal need so that one can have followed the one before it.
//!
//! A signal that may change only so fast is called faulty when too many of its readings do not fit the ones before them. Between
//! two that follow each other closely, as where stamps come unevenly, that is a matter of its error rather than of its variable.

use super::edit::{self, Trial};
use super::{Parameter, Problem, Work};
use shsa_core::alignment::{Acceptance, Jump, Port};
use shsa_core::knowledge::{Shape, Signal, SignalId};
use shsa_core::monitor::Debounce;
use shsa_core::time::Span;
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
        if signal.limits.max_rate.is_none() {
            return 0.0;
        }
        let debounce = Debounce::default();
        let period = signal.rate_hz.map_or(debounce.span, |rate| Span::from_seconds(1.0 / rate));
        let (among, fault) = debounce.window(period);
        let mut port = Port::new(Shape::Scalar, signal, 1);
        // Each reading is measured by the one before it, whatever that was.
        port.set_gate(true);
        let (mut recent, mut most) = (VecDeque::new(), 0.0_f64);
        for observation in self.early.iter().filter(|it| it.signal == id) {
            let reception = port.accept(signal, observation, observation.received);
            recent.push_back(match reception.acceptance {
                Acceptance::TooFast(jump) => 0.5 * excess(jump),
                _ => 0.0,
            });
            if recent.len() > among as usize {
                recent.pop_front();
            }
            most = most.max(exceeded_by(&recent, fault as usize / FEWER));
        }
        most
    }
}

/// How far the two readings are apart beyond what can have changed between them, SI.
fn excess(jump: Jump) -> f64 {
    jump.from.distance(jump.to) - jump.max_rate * jump.within.seconds()
}

/// What so many of these exceed.
fn exceeded_by(needs: &VecDeque<f64>, count: usize) -> f64 {
    let mut sorted: Vec<f64> = needs.iter().copied().collect();
    sorted.sort_unstable_by(|one, other| other.total_cmp(one));
    sorted.get(count).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_few_exceed_is_the_largest_but_those() {
        let needs: VecDeque<f64> = [0.1, 0.0, 0.4, 0.2, 0.3].into();
        let found = [0, 1, 3, 4, 5].map(|count| exceeded_by(&needs, count));
        assert_eq!(found, [0.4, 0.3, 0.1, 0.0, 0.0]);
    }
}
