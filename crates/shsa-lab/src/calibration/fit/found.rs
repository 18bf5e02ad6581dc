//! The results of a calibration: numbers of the model, the differences of its pairs, and whether the numbers may be used.

use super::power::{Open, Unfaulted};
use super::{Promise, Stretch, Verdicts, scales};
use crate::calibration::comparison::Comparison;
use crate::calibration::poisson::fewest_expected;
use crate::calibration::rhythm::Rhythm;
use crate::order::{median, spread};
use shsa_core::knowledge::{Draft, RelationId, SignalId, VariableId};
use shsa_core::monitor::WatchedWay;
use shsa_core::time::Span;

/// A fitted number of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Parameter {
    /// The value error of a signal.
    Signal(SignalId),
    /// The error of a relation.
    Relation(RelationId),
}

impl Parameter {
    pub(super) fn signal(self) -> Option<SignalId> {
        match self {
            Parameter::Signal(signal) => Some(signal),
            Parameter::Relation(_) => None,
        }
    }
}

/// The fitted numbers of a parameter; all but the delay are in the unit of the signal or of the relation's left side.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// The parameter.
    pub parameter: Parameter,
    /// The error, plus-minus; `None` when no relation that holds gives a value; then the declared value is not changed.
    pub error: Option<f64>,
    /// The constant part of the error.
    pub offset: f64,
    /// The deviation that the model's factor multiplies: of values and between sessions.
    pub spread: f64,
    /// The part that is there for single values, beyond what the loop needs.
    pub singles: f64,
    /// The standard deviation of a signal's own noise.
    pub noise: Option<f64>,
    /// The delay of the signal beyond that of its model; zero if none was accepted.
    pub delay: Span,
    /// The smallest step of the signal that is detected in both directions; `None` when none was, or none was looked for.
    pub smallest_bias: Option<f64>,
}

/// A pair of ways, all values in SI.
#[derive(Clone, Debug)]
pub struct PairFit {
    /// The common variable.
    pub variable: VariableId,
    /// The relations and the signals of the slower way, which sets the rate of the comparisons.
    pub one: (Vec<RelationId>, Vec<SignalId>),
    /// The relations and the signals of the other way.
    pub other: (Vec<RelationId>, Vec<SignalId>),
    /// Comparisons in the fitted part, and in the unseen part.
    pub compared: (usize, usize),
    /// The median of the first minus the second.
    pub offset: f64,
    /// The mean distance of their difference from its median.
    pub spread: f64,
    /// This distance as a share of the variation of the first way, both for means over several comparisons.
    pub unexplained: f64,
    /// Whether the two ways are shown to measure the same; a pair that does not hold is not fitted.
    pub holds: bool,
    /// The delay of the first way relative to the second in seconds, and the remaining share of the spread; `None` when no delay
    /// was accepted.
    pub late: Option<(f64, f64)>,
    /// How much wider the fitted errors make them: half of both widths.
    pub given: f64,
    /// What both leave open.
    pub open: Open,
}

impl PairFit {
    /// Whether the other side is the variable's range, which shows nothing of errors.
    pub(super) fn is_with_range(&self) -> bool {
        self.other.0.is_empty() && self.other.1.is_empty()
    }

    /// The signals, if both ways are signals.
    pub(super) fn direct(&self) -> Option<(SignalId, SignalId)> {
        let only = |(relations, signals): &(Vec<RelationId>, Vec<SignalId>)| match signals.as_slice() {
            [signal] if relations.is_empty() => Some(*signal),
            _ => None,
        };
        only(&self.one).zip(only(&self.other))
    }
}

/// The result of a calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The rhythm of each signal in the fitted part.
    pub rhythms: Vec<Rhythm>,
    /// Every pair that the engine compares.
    pub pairs: Vec<PairFit>,
    /// Every number that could be fitted.
    pub fitted: Vec<Fitted>,
    /// The model with the fitted numbers.
    pub draft: Draft,
    /// The promise that the numbers keep.
    pub promise: Promise,
    /// The verdicts about the unseen part with the given model,
    pub before: Verdicts,
    /// its alarms about the fitted part,
    pub before_fitted: Unfaulted,
    /// and the verdicts about the unseen part with the fitted model.
    pub after: Verdicts,
    /// The length of the unseen part in hours.
    pub unseen_hours: f64,
    /// Stretches that look like faults and were not fitted.
    pub unhealthy: Vec<Stretch>,
}

impl Calibration {
    /// Why the fitted numbers must not be used; `None` when they may.
    #[must_use]
    pub fn refusal(&self) -> Option<String> {
        let (before, after) = (self.before, self.after);
        if after.failed > before.failed {
            return Some(format!(
                "in the part that it has not seen, the fitted model calls {} healthy signals failed, and the model as it is {}",
                after.failed, before.failed
            ));
        }
        let least = fewest_expected(after.alarms) / self.unseen_hours.max(1e-9);
        if after.alarms > before.alarms && least > self.promise.alarms_per_hour {
            return Some(format!(
                "in the part that it has not seen, the fitted model gives {} alarms in {:.2} h, and the model as it is {}: more than \
                 the promised {} an hour can be",
                after.alarms, self.unseen_hours, before.alarms, self.promise.alarms_per_hour
            ));
        }
        if after.suspected > before.suspected {
            return Some(format!(
                "in the part that it has not seen, the fitted model suspects {} healthy signals, and the model as it is {}",
                after.suspected, before.suspected
            ));
        }
        None
    }
}

/// The facts of one pair and its differences.
pub(super) fn pair_fit(one: &WatchedWay, other: &WatchedWay, compared: &[Vec<Comparison>]) -> PairFit {
    let side = |way: &WatchedWay| {
        let way = way.computation.way();
        (way.substitution.relations(), way.inputs().collect::<Vec<SignalId>>())
    };
    let apart: Vec<f64> = compared.iter().flatten().map(|it| it.value - it.known).collect();
    let unexplained = scales::unexplained(compared);
    let (one_side, other_side) = (side(one), side(other));
    let is_direct = one_side.0.is_empty() && other_side.0.is_empty();
    PairFit {
        variable: one.variable(),
        one: one_side,
        other: other_side,
        compared: (apart.len(), 0),
        offset: median(apart.iter().copied()),
        spread: spread(&apart),
        unexplained,
        holds: is_direct || unexplained <= scales::UNEXPLAINED,
        late: None,
        given: 0.0,
        open: Open::default(),
    }
}
