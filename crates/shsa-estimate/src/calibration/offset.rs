//! What signals and relations are off by all the time, taken out where that is worth it.

use super::edit::{self, Trial};
use super::{PairFit, Parameter, Problem, Work};
use crate::comparison::Watched;
use crate::order::median;
use shsa_core::knowledge::{IdVec, KnowledgeBase, SignalId, VariableId};
use shsa_core::monitor::WatchedWay;

/// Offsets are taken out when that leaves no more than this share of what the pairs need.
const WORTH: f64 = 0.9;

/// Rounds in which signals vote about each other's offsets; a few dozen are enough for any dozen of witnesses.
const ROUNDS: usize = 100;

/// A pair speaks about a relation whose offset moves it by at least this share of the most that it moves any.
const LEAST_OF_MOST: f64 = 0.05;

impl Work<'_> {
    /// Takes out what differs all the time: first from the signals of a variable, then from relations.
    pub(super) fn without_offsets(
        &self,
        knowledge: &KnowledgeBase,
        trial: Trial,
        watched: Watched,
    ) -> Result<(Trial, Watched), Problem> {
        let (mut trial, mut watched) = self.without_signal_offsets(knowledge, trial, watched)?;
        for number in 0..self.parameters.len() {
            if matches!(self.parameters[number], Parameter::Relation(_)) {
                (trial, watched) = self.without_relation_offset(number, trial, watched)?;
            }
        }
        Ok((trial, watched))
    }

    fn without_signal_offsets(
        &self,
        knowledge: &KnowledgeBase,
        trial: Trial,
        watched: Watched,
    ) -> Result<(Trial, Watched), Problem> {
        let fits = self.fits(&watched);
        let offsets = signal_offsets(knowledge, &watched, &fits);
        let of_signals = self.parameters.iter().map(|parameter| match parameter {
            Parameter::Signal(signal) => offsets[*signal],
            Parameter::Relation(_) => 0.0,
        });
        let mut moved = Trial { offsets: of_signals.collect(), ..trial.clone() };
        let other = self.fits(&self.watch(&moved, self.observations)?);
        let sum = |fits: &[PairFit], variable: VariableId| -> f64 {
            fits.iter().filter(|it| it.variable == variable).map(|it| it.needed).sum()
        };
        for (parameter, offset) in self.parameters.iter().zip(&mut moved.offsets) {
            let Parameter::Signal(signal) = parameter else { continue };
            let variable = knowledge.signals()[*signal].variable;
            if sum(&other, variable) > WORTH * sum(&fits, variable) {
                *offset = 0.0;
            }
        }
        if moved.offsets.iter().all(|offset| *offset == 0.0) {
            return Ok((trial, watched));
        }
        let watched = self.watch(&moved, self.observations)?;
        Ok((moved, watched))
    }

    /// Takes out what the sides of a relation differ by: the median of what the pairs say that it moves.
    fn without_relation_offset(
        &self,
        number: usize,
        trial: Trial,
        watched: Watched,
    ) -> Result<(Trial, Watched), Problem> {
        let fits = self.fits(&watched);
        let mut moved = trial.clone();
        moved.offsets[number] += edit::PROBE;
        let tried = self.fits(&self.watch(&moved, self.observations)?);
        let gains: Vec<f64> =
            tried.iter().zip(&fits).map(|(tried, fit)| (tried.middle - fit.middle) / edit::PROBE).collect();
        let most = gains.iter().map(|gain| gain.abs()).fold(0.0, f64::max);
        let speaks = |at: &usize| gains[*at].abs() > (LEAST_OF_MOST * most).max(1e-9);
        let speaking: Vec<usize> = (0..fits.len()).filter(speaks).collect();
        let offset = median(speaking.iter().map(|&at| -fits[at].middle / gains[at]));
        if offset == 0.0 {
            return Ok((trial, watched));
        }
        moved.offsets[number] = trial.offsets[number] + offset;
        let other = self.watch(&moved, self.observations)?;
        let sum = |fits: &[PairFit]| speaking.iter().map(|&at| fits[at].needed).sum::<f64>();
        let is_worth = sum(&self.fits(&other)) <= WORTH * sum(&fits);
        Ok(if is_worth { (moved, other) } else { (trial, watched) })
    }

    pub(super) fn fits(&self, watched: &Watched) -> Vec<PairFit> {
        (0..watched.comparisons.len()).map(|at| PairFit::new(self, watched, at, None)).collect()
    }
}

/// By how much each signal lies above the mean of those that carry the same variable, in its own unit: least squares
/// over the middles of their pairs.
fn signal_offsets(knowledge: &KnowledgeBase, watched: &Watched, fits: &[PairFit]) -> IdVec<SignalId, f64> {
    let direct = |way: &WatchedWay| way.computation.way().direct();
    let pairs = watched.monitor.pairs().iter().zip(fits);
    let known: Vec<(SignalId, SignalId, f64)> = pairs
        .filter(|(_, fit)| fit.compared.0 > 0)
        .filter_map(|(pair, fit)| {
            let (slow, other) = watched.sides(pair);
            Some((direct(slow)?, direct(other)?, fit.middle))
        })
        .collect();
    let mut offsets = IdVec::filled(knowledge.signals().len(), |_: SignalId| 0.0);
    // All at once (Jacobi), with the present value as one more vote: the sum of each group stays 0.
    for _ in 0..ROUNDS {
        offsets = IdVec::filled(offsets.len(), |signal: SignalId| {
            let by_others = known.iter().filter_map(|&(one, other, difference)| match signal {
                _ if one == signal => Some(offsets[other] + difference),
                _ if other == signal => Some(offsets[one] - difference),
                _ => None,
            });
            let (sum, count) = by_others.fold((offsets[signal], 1), |(sum, count), it| (sum + it, count + 1));
            sum / f64::from(count)
        });
    }
    IdVec::filled(offsets.len(), |signal: SignalId| offsets[signal] / edit::scale(knowledge, signal))
}
