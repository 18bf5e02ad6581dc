//! How small a step of a signal shows, through whatever the signal is compared by.

use super::edit::Trial;
use super::{PairFit, Problem, Work};
use crate::comparison::{Comparison, Watched};
use crate::order::{quantile, sorted};
use shsa_core::knowledge::{IdVec, KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};

/// The step that is tried: this share of how much the values of the signal vary, so that curves count as straight.
const TRIED: f64 = 1e-3;

/// A pair that a step moves by less, as a share of its size in SI, does not show it.
const LEAST_GAIN: f64 = 1e-9;

/// A step moves a pair for good when it still moves it by this share of what it did at first.
const LASTS: f64 = 0.5;

/// The smallest steps of a signal that are seen, in its unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// By single comparisons, at once.
    pub(super) bias: f64,
    /// The pair that shows it.
    pub(super) by: usize,
    /// By many comparisons together, when it lasts so long.
    pub(super) lasting: Option<(f64, Span)>,
}

/// How far a step moves the difference of a pair, in SI for one of its unit: at first, and as long as there is something to
/// compare.
#[derive(Clone, Copy, Debug)]
struct Gain {
    first: f64,
    lasting: f64,
}

impl Work<'_> {
    /// The smallest step of each signal that is seen, by trying a small one at the split.
    ///
    /// Where a step is seen for a while only, because the pair looks at changes over a window, it is the first of these
    /// windows that counts. Time: one run of the monitor over the later part for each signal.
    pub(super) fn smallest_biases(
        &self,
        watched: &Watched,
        trial: &Trial,
        pairs: &[PairFit],
        knowledge: &KnowledgeBase,
    ) -> Result<IdVec<SignalId, Option<Seen>>, Problem> {
        let mut seen = IdVec::filled(knowledge.signals().len(), |_: SignalId| None);
        for signal in knowledge.signals().ids() {
            // When both rest on it, they may move together.
            let compares = |at: &usize| {
                let (one, other) = watched.sides(&watched.monitor.pairs()[*at]);
                one.rests_on.contains(signal) != other.rests_on.contains(signal)
            };
            let compared: Vec<usize> = (0..pairs.len()).filter(compares).collect();
            let Some(step) = self.tried(signal).filter(|_| !compared.is_empty()) else { continue };
            let stepped = self.watch(trial, &self.stepped(signal, step))?;
            let gains: Vec<(usize, Gain)> = compared
                .iter()
                .filter_map(|&at| Some((at, self.gain(watched, &stepped, at, step)?)))
                .collect();
            seen[signal] = smallest(pairs, &gains);
        }
        Ok(seen)
    }

    /// The step to try; `None` when the signal has no numbers.
    fn tried(&self, signal: SignalId) -> Option<f64> {
        let values = self.observations.iter().filter(|it| it.signal == signal).filter_map(number);
        let (lo, hi) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), it| (lo.min(it), hi.max(it)));
        (lo <= hi).then_some(if hi > lo { TRIED * (hi - lo) } else { TRIED })
    }

    fn stepped(&self, signal: SignalId, step: f64) -> Vec<Observation> {
        let mut all = self.observations.to_vec();
        for observation in all.iter_mut().skip(self.early.len()).filter(|it| it.signal == signal) {
            match &mut observation.value {
                RawValue::Number(value) => *value += step,
                RawValue::Interval { lo, hi } => (*lo, *hi) = (*lo + step, *hi + step),
                RawValue::Vector(values) => values.iter_mut().for_each(|value| *value += step),
            }
        }
        all
    }

    /// How far the difference of a pair moves after the step: the median of the moves; at first, where the pair looks at a
    /// window, the upper quartile of those within two of them: a mean takes one window to follow, a change is seen for one.
    fn gain(&self, watched: &Watched, stepped: &Watched, at: usize, step: f64) -> Option<Gain> {
        let later = |watched: &Watched| -> Vec<(Time, f64)> {
            let all = watched.comparisons.get(at).map_or(&[][..], Vec::as_slice);
            let difference = |it: &Comparison| (it.validity.to, it.value - it.known);
            all[self.before_split(all).len()..].iter().map(difference).collect()
        };
        let (before, after) = (later(watched), later(stepped));
        let (slow, other) = watched.sides(&watched.monitor.pairs()[at]);
        let window = slow.computation.timing().window.max(other.computation.timing().window);
        let (end, share) = match window {
            Span::ZERO => (Time::MAX, 0.5),
            window => (before.first()?.0 + window.times(2), 0.75),
        };
        let moved = |end: Time, share: f64| {
            // A step may decide whether there is something to compare at all.
            let same = before.iter().zip(&after).take_while(|(one, other)| one.0 == other.0 && one.0 <= end);
            let moves = same.map(|(one, other)| (other.1 - one.1).abs() / step);
            quantile(&sorted(moves), share)
        };
        Some(Gain { first: moved(end, share)?, lasting: moved(Time::MAX, 0.5)? })
    }
}

/// The smallest steps that pairs with these gains show.
fn smallest(pairs: &[PairFit], gains: &[(usize, Gain)]) -> Option<Seen> {
    let at_once = gains.iter().filter(|(_, gain)| gain.first > LEAST_GAIN);
    let at_once = at_once.filter_map(|(at, gain)| Some((pairs[*at].smallest_bias? / gain.first, *at)));
    let (bias, by) = at_once.min_by(|one, other| one.0.total_cmp(&other.0))?;
    let lasting = gains.iter().filter(|(_, gain)| gain.lasting > (LASTS * gain.first).max(LEAST_GAIN));
    let lasting = lasting.filter_map(|(at, gain)| {
        let (apart, span) = pairs[*at].lasting_bias?;
        Some((apart / gain.lasting, span))
    });
    let lasting = lasting.min_by(|one, other| one.0.total_cmp(&other.0));
    Some(Seen { bias, by, lasting: lasting.filter(|(lasting, _)| *lasting < bias) })
}

fn number(observation: &Observation) -> Option<f64> {
    match &observation.value {
        RawValue::Number(value) => Some(*value).filter(|value| value.is_finite()),
        RawValue::Interval { lo, hi } => Some(0.5 * (lo + hi)),
        RawValue::Vector(values) => values.iter().copied().find(|value| value.is_finite()),
    }
}
