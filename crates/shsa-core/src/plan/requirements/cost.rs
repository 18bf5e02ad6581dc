//! Lower bounds of costs along a substitution: latency, width and period.

use crate::expression::{Binary, Formula, Operation, Symbol, Unary};
use crate::knowledge::{Id, KnowledgeBase, SignalId, VariableId};
use crate::substitution::{Step, Substitution};
use crate::time::Span;
use alloc::collections::BTreeMap;

/// Lower bounds of the costs from the sources to the sink.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cost {
    pub(super) latency: Span,
    /// The width, SI.
    pub(super) width: f64,
    /// The period of the fastest signal; infinite for constants.
    pub(super) period: Span,
}

impl Cost {
    pub(super) const NONE: Cost = Cost { latency: Span::ZERO, width: 0.0, period: Span::ZERO };
    pub(super) const MAX: Cost = Cost { latency: Span::MAX, width: f64::INFINITY, period: Span::MAX };

    /// The costs of a complete substitution, from those of its sources.
    pub(super) fn along(
        knowledge: &KnowledgeBase,
        substitution: &Substitution,
        source: impl Fn(VariableId) -> Cost,
    ) -> Cost {
        let source = |&variable: &VariableId| (variable, source(variable));
        let mut known: BTreeMap<VariableId, Cost> = substitution.sources.iter().map(source).collect();
        for step in &substitution.steps {
            let of = |input| known.get(&input).copied().unwrap_or(Cost::NONE);
            known.insert(step.output, Cost::of_step(knowledge, *step, of));
        }
        known.get(&substitution.sink).copied().unwrap_or(Cost::NONE)
    }

    /// The costs of the best signals of a provided variable; a constant has the width of its bounds.
    pub(super) fn of_source(
        knowledge: &KnowledgeBase,
        variable: VariableId,
        signals: impl Iterator<Item = SignalId>,
    ) -> Cost {
        if let Some(constant) = knowledge.variables()[variable].constant {
            return Cost { latency: Span::ZERO, width: constant.width(), period: Span::MAX };
        }
        signals.map(|signal| &knowledge.signals()[signal]).fold(Cost::MAX, |least, signal| {
            let width = signal.value_error.hi - signal.value_error.lo;
            let period = signal.rate_hz.map_or(Span::ZERO, |rate| Span::from_seconds(1.0 / rate));
            least.least(Cost { latency: signal.delay, width, period })
        })
    }

    pub(super) fn of_step(knowledge: &KnowledgeBase, step: Step, of: impl Fn(VariableId) -> Cost) -> Cost {
        let relation = &knowledge.relations()[step.relation];
        let latency = relation.needs(step.output).map(|input| of(input).latency).max().unwrap_or_default();
        let period = relation.needs(step.output).map(|input| of(input).period).min().unwrap_or(Span::MAX);
        let Some(formula) = relation.formula(step.output) else {
            return Cost { latency, width: 0.0, period };
        };
        let width = |symbol: Symbol| of(VariableId::from_index(symbol.0 as usize)).width;
        Cost { latency: latency + looks_back(formula), width: least_width(formula, &width), period }
    }

    pub(super) fn least(self, other: Cost) -> Cost {
        Cost {
            latency: self.latency.min(other.latency),
            width: self.width.min(other.width),
            period: self.period.min(other.period),
        }
    }
}

/// The longest time that the operators on a path to a leaf look back.
fn looks_back(formula: &Formula) -> Span {
    let below = formula.arguments().iter().map(looks_back).max().unwrap_or_default();
    match formula.operation() {
        Operation::Derivative(window) | Operation::Delay(window) | Operation::MovingMean(window) => {
            below + window
        }
        _ => below,
    }
}

/// A lower bound of the width of a formula's interval evaluation, from the widths of its variables.
///
/// Sums and differences of terms that share nothing add up widths, constant factors scale them; any other operation may narrow them to
/// zero.
fn least_width(formula: &Formula, width: &dyn Fn(Symbol) -> f64) -> f64 {
    let argument =
        |at: usize| formula.arguments().get(at).map_or(0.0, |argument| least_width(argument, width));
    let factor = |at: usize| {
        let constant = formula.arguments().get(at).and_then(Formula::as_constant);
        constant.map_or(0.0, |constant| constant.bounds.mignitude())
    };
    if let [left, right] = formula.arguments()
        && left.shares(right)
    {
        return 0.0;
    }
    match formula.operation() {
        Operation::Constant(constant) | Operation::Known(_, constant) => constant.bounds.width(),
        Operation::Symbol(symbol) => width(symbol),
        Operation::Unary(Unary::Neg) | Operation::Delay(_) => argument(0),
        Operation::Binary(Binary::Add | Binary::Sub) => argument(0) + argument(1),
        Operation::Binary(Binary::Mul) => (factor(0) * argument(1)).max(factor(1) * argument(0)),
        Operation::Binary(Binary::Div) => {
            let divisor = formula.arguments().get(1).and_then(Formula::as_constant);
            divisor.map_or(0.0, |divisor| argument(0) / divisor.bounds.magnitude())
        }
        _ => 0.0,
    }
}
