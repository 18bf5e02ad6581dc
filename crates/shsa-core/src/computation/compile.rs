//! Compiles a way to a program, with its trigger and the sources of its inputs.

use super::input::{Input, Source, Wrapping, period};
use super::{Body, Compiled, Precedence, USUAL_RATE_HZ};
use crate::expression::{self, Assignment, Constant, Formula, InputKind, Program, Symbol};
use crate::interval::{Course, Interval};
use crate::knowledge::{Id, KnowledgeBase, SignalId, Variable, VariableId};
use crate::substitution::{Step, Way};
use crate::time::Span;
use alloc::vec::Vec;

/// The input that makes a way compute. An input whose values hold drives a way only where all inputs hold, because its value is
/// known at the moments of the other inputs.
pub(super) fn trigger(knowledge: &KnowledgeBase, way: &Way, goes_before: Precedence) -> Option<SignalId> {
    let stands = |signal: SignalId| knowledge.signals()[signal].holds;
    way.inputs().reduce(|best, next| match (stands(best), stands(next)) {
        (true, false) => next,
        (false, true) => best,
        _ if goes_before(knowledge, next, best) => next,
        _ => best,
    })
}

/// The longest time between an event and a signal's observation of it.
pub(super) fn lateness(knowledge: &KnowledgeBase, signal: SignalId) -> Span {
    period(knowledge, signal).unwrap_or(Span::ZERO) + knowledge.signals()[signal].delay
}

/// The program of a way with its memory and the sources of its inputs, and its longest window.
pub(super) fn computed(
    knowledge: &KnowledgeBase,
    way: &Way,
    trigger: Option<SignalId>,
) -> Option<(Body, Span)> {
    let (program, inputs) = program(knowledge, way, trigger)?;
    let rate_hz = trigger.and_then(|signal| knowledge.signals()[signal].rate_hz).unwrap_or(USUAL_RATE_HZ);
    let state = program.new_state(0, rate_hz);
    let window = program.longest_window();
    let wrapping = wrapping(knowledge, way, &inputs);
    Some((Body::Computed(Compiled { program, state, inputs, wrapping }), window))
}

/// The program of a variable that is known within these bounds.
pub(super) fn constant(variable: VariableId, bounds: Interval) -> Option<Compiled> {
    let formula = Formula::constant(Constant { value: bounds.midpoint(), bounds });
    let assignment = Assignment { symbol: variable.symbol(), formula: &formula, condition: None };
    let program = Program::compile(&[assignment]).ok()?;
    let state = program.new_state(0, USUAL_RATE_HZ);
    Some(Compiled { program, state, inputs: Vec::new(), wrapping: Vec::new() })
}

/// The wrapping inputs; none where the program remembers inputs, which must be continuous then.
fn wrapping(knowledge: &KnowledgeBase, way: &Way, inputs: &[Source]) -> Vec<Wrapping> {
    let is_stateful = |step: &Step| {
        let relation = &knowledge.relations()[step.relation];
        let formulas = relation.formula(step.output).into_iter().chain(&relation.condition);
        formulas.into_iter().any(Formula::is_stateful)
    };
    if way.substitution.steps.iter().any(is_stateful) {
        return Vec::new();
    }
    let wraps = |(at, source): (usize, &Source)| {
        let Source::Signal(input) = source else { return None };
        let variable = &knowledge.variables()[knowledge.signals()[input.signal].variable];
        let symbol = knowledge.signals()[input.signal].variable.symbol();
        let is_asked = way.substitution.steps.iter().any(|step| {
            let relation = &knowledge.relations()[step.relation];
            let mut formulas = relation.formula(step.output).into_iter().chain(&relation.condition);
            formulas.any(|formula| formula.compares(symbol))
        });
        Some(Wrapping { at, turn: variable.wraps?, begins: variable.turn_begins(), is_asked })
    };
    inputs.iter().enumerate().filter_map(wraps).collect()
}

/// The program of a way with the sources of its inputs.
pub(super) fn program(
    knowledge: &KnowledgeBase,
    way: &Way,
    trigger: Option<SignalId>,
) -> Option<(Program, Vec<Source>)> {
    let steps = &way.substitution.steps;
    let assignment = |step: &Step| {
        let relation = &knowledge.relations()[step.relation];
        Some(Assignment {
            symbol: step.output.symbol(),
            formula: relation.formula(step.output)?,
            condition: relation.condition.as_ref(),
        })
    };
    let assignments = steps.iter().map(assignment).collect::<Option<Vec<_>>>()?;
    let variable = |symbol: Symbol| knowledge.variables().find(VariableId::from_index(symbol.0 as usize));
    let offset = |symbol: Symbol| {
        let at = way.substitution.sources.iter().position(|source| source.symbol() == symbol)?;
        way.signals.get(at)?.map(|signal| knowledge.signals()[signal].offset())
    };
    let course = |symbol| Course {
        offset: offset(symbol).unwrap_or_default(),
        ..variable(symbol).map_or(Course::ANY, Variable::course)
    };
    let program = Program::compile_within(&assignments, &course).ok()?;
    let source = |input: &expression::Input| source(knowledge, way, trigger, input);
    let inputs = program.inputs().iter().map(source).collect::<Option<Vec<_>>>()?;
    Some((program, inputs))
}

fn source(
    knowledge: &KnowledgeBase,
    way: &Way,
    trigger: Option<SignalId>,
    input: &expression::Input,
) -> Option<Source> {
    if input.kind == InputKind::Previous {
        return (input.symbol == way.substitution.sink.symbol()).then_some(Source::Last);
    }
    let at = way.substitution.sources.iter().position(|source| source.symbol() == input.symbol)?;
    match (way.signals.get(at)?, way.substitution.sources.get(at)?) {
        (Some(signal), _) => Some(Source::Signal(Input::new(knowledge, *signal, trigger))),
        (None, variable) => knowledge.variables()[*variable].constant.map(Source::Constant),
    }
}
