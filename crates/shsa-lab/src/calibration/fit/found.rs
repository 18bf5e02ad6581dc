//! What a calibration finds: numbers of the model, how its pairs of ways differ, and whether the numbers may be used.

use super::{Promise, Stretch, Verdicts, scales};
use crate::calibration::comparison::Comparison;
use crate::calibration::poisson::fewest_expected;
use crate::calibration::rhythm::Rhythm;
use crate::order::{median, spread};
use shsa_core::knowledge::{Draft, RelationId, SignalId, VariableId};
use shsa_core::monitor::WatchedWay;
use shsa_core::time::Span;

/// A number of the model that is fitted.
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

/// A number of the model, fitted; all but the delay in the unit of the signal or of the relation's left side.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// Which.
    pub parameter: Parameter,
    /// Plus-minus; `None` when nothing that holds shows it, and it stays as it is.
    pub error: Option<f64>,
    /// How much of the error is there all the time.
    pub offset: f64,
    /// One deviation, of which the error has as many as the model's factor: of values and of sessions.
    pub spread: f64,
    /// The standard deviation of the noise of a signal alone.
    pub noise: Option<f64>,
    /// How much later the signal tells than its model says; zero where that is not believed.
    pub delay: Span,
    /// The smallest step of the signal that is told, whichever way it points; `None` when none was, or none was looked for.
    pub smallest_bias: Option<f64>,
}

/// Two ways of knowing a variable, all values in SI.
#[derive(Clone, Debug)]
pub struct PairFit {
    /// What both know.
    pub variable: VariableId,
    /// The relations and the signals of the slower way, whose rhythm the comparisons have.
    pub one: (Vec<RelationId>, Vec<SignalId>),
    /// Those of the other.
    pub other: (Vec<RelationId>, Vec<SignalId>),
    /// Comparisons in what is fitted, and in what is not.
    pub compared: (usize, usize),
    /// The median of the first minus the second.
    pub offset: f64,
    /// The mean distance of their difference from its median.
    pub spread: f64,
    /// That as a share of how much the first itself varies, both as means over some comparisons.
    pub unexplained: f64,
    /// Whether the two are shown to tell the same: what does not hold is not fitted.
    pub holds: bool,
    /// By how much the first is later than the second, in seconds, and what share of the spread is left then; `None`
    /// when no delay explains a part of it.
    pub late: Option<(f64, f64)>,
    /// How much wider the fitted errors make them: half of both widths.
    pub given: f64,
}

impl PairFit {
    /// The signals, when both are compared themselves.
    pub(super) fn direct(&self) -> Option<(SignalId, SignalId)> {
        let only = |(relations, signals): &(Vec<RelationId>, Vec<SignalId>)| match signals.as_slice() {
            [signal] if relations.is_empty() => Some(*signal),
            _ => None,
        };
        only(&self.one).zip(only(&self.other))
    }
}

/// A model calibrated.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// How each signal comes, in what is fitted.
    pub rhythms: Vec<Rhythm>,
    /// Every pair that the engine compares.
    pub pairs: Vec<PairFit>,
    /// Every number that could be fitted.
    pub fitted: Vec<Fitted>,
    /// The model with the fitted numbers.
    pub draft: Draft,
    /// What stands behind them.
    pub promise: Promise,
    /// What is said about the part that is not fitted with the model as it was,
    pub before: Verdicts,
    /// and with the fitted one.
    pub after: Verdicts,
    /// How long that part is, in hours.
    pub unseen_hours: f64,
    /// Stretches that look like faults and were not fitted.
    pub unhealthy: Vec<Stretch>,
}

impl Calibration {
    /// Why the fitted numbers must not be used; `None` when nothing speaks against them.
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
        (after.suspected > before.suspected).then(|| {
            format!(
                "in the part that it has not seen, the fitted model suspects {} healthy signals, and the model as it is {}",
                after.suspected, before.suspected
            )
        })
    }
}

/// What one pair is, and how it differs.
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
    }
}
