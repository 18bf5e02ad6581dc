//! Warns of ways that say nothing: relations solved for a variable, where the intervals are wider than the variable's range.

use super::problems::Problems;
use crate::expression::{Assignment, InputKind, Program, Symbol, Value};
use crate::interval::{Course, Interval};
use crate::knowledge::draft::Place;
use crate::knowledge::{
    Id, IdVec, KnowledgeBase, Relation, RelationId, Shape, SignalId, Variable, VariableId,
};
use crate::time::{Span, Time, Validity};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Where in the ranges of its inputs a formula is evaluated. At the ends, a product of an uncertain factor may be 0.
const SHARES: [f64; 5] = [0.25, 0.5, 0.75, 0.0, 1.0];
/// How many of these are inside of the ranges.
const INSIDE: usize = 3;
/// In how many steps a window fills.
const STEPS: i64 = 8;

/// Where relations with formulas are declared; empty when some relations were given twice.
pub(super) fn places(
    relations: &IdVec<RelationId, Relation>,
    declared: &IdVec<RelationId, Place>,
) -> Vec<(RelationId, Place)> {
    let same = relations.len() == declared.len();
    let computed = relations.enumerate().filter(|(_, relation)| same && !relation.formulas.is_empty());
    computed.map(|(id, _)| (id, declared[id])).collect()
}

/// Warns of each output whose values are wider than its range: inside of the ranges of exact inputs, or wherever inputs are that the
/// best of their signals read.
///
/// `places` are those of the relations. Time: linear in the formulas.
pub(super) fn check(problems: &mut Problems, places: &[(RelationId, Place)], knowledge: &KnowledgeBase) {
    for &(id, place) in places {
        let relation = &knowledge.relations()[id];
        for &output in &relation.outputs {
            let variable = &knowledge.variables()[output];
            let range = variable.range.filter(|range| range.is_bounded() && variable.wraps.is_none());
            let Some(range) = range else { continue };
            let widths = [false, true].map(|is_read| least_width(knowledge, relation, output, is_read));
            let Some(least) = widths.into_iter().flatten().find(|least| *least > range.width()) else {
                continue;
            };
            let message = format!(
                "`{}` follows from relation `{}` within {}, and its range is {} wide: this says nothing",
                variable.name,
                relation.name,
                written(variable, least),
                written(variable, range.width())
            );
            let mut help = format!(
                "narrow what the relation computes with, or name in `for` what else it is solved for, without `{}`",
                variable.name
            );
            if differs_only(knowledge, relation, output) {
                help.push_str(
                    "; of a sensor whose error is mostly the same for long, say so: `change_error`",
                );
            }
            problems.warn(place, message, help);
        }
    }
}

/// The least width of an output over some values of its inputs, which are exact or read, and have stood for the longest window;
/// `None` where a value is not known.
fn least_width(
    knowledge: &KnowledgeBase,
    relation: &Relation,
    output: VariableId,
    is_read: bool,
) -> Option<f64> {
    let formula = relation.formula(output)?;
    let assignment = Assignment { symbol: output.symbol(), formula, condition: None };
    let offset = |symbol: Symbol| {
        let read = knowledge.carriers(VariableId::from_index(symbol.0 as usize)).iter();
        let offsets = read.map(|signal| knowledge.signals()[*signal].offset());
        // The most that one of them leaves out of differences.
        offsets.max_by(|one, other| (one.hi - one.lo).total_cmp(&(other.hi - other.lo)))
    };
    let course =
        |symbol| Course { offset: offset(symbol).filter(|_| is_read).unwrap_or_default(), ..Course::ANY };
    let program = Program::compile_within(&[assignment], &course).ok()?;
    let mut least = f64::INFINITY;
    for share in SHARES.into_iter().take(if is_read { SHARES.len() } else { INSIDE }) {
        least = least.min(width_at(knowledge, &program, share, is_read)?);
    }
    Some(least)
}

/// The width of a program's value where its inputs are at this share of their ranges; `None` without a value.
fn width_at(knowledge: &KnowledgeBase, program: &Program, share: f64, is_read: bool) -> Option<f64> {
    let read = |input: &crate::expression::Input| {
        let id = VariableId::from_index(input.symbol.0 as usize);
        let known = input.kind == InputKind::Current;
        known.then(|| read_at(knowledge, id, share, is_read)).flatten().map(Value::Scalar)
    };
    let inputs: Vec<Value<'_, Interval>> = program.inputs().iter().map(read).collect::<Option<_>>()?;
    let window = program.longest_window();
    let step = Span(window.0 / STEPS + 1);
    let steps = if window > Span::ZERO { STEPS + 1 } else { 0 };
    let mut state = program.new_state::<Interval>(0, 1.0 / step.seconds());
    let mut value = Interval::EMPTY;
    for number in 0..=steps {
        let (now, last) =
            (Time(0) + step.times(number), (number > 0).then(|| Time(0) + step.times(number - 1)));
        value =
            program.evaluate(&mut state, &inputs, Validity::at(now), last.map(Validity::at)).value.scalar();
    }
    (!value.is_empty()).then(|| value.width())
}

/// Whether an input of which only differences count has a sensor with no `change_error`.
fn differs_only(knowledge: &KnowledgeBase, relation: &Relation, output: VariableId) -> bool {
    let Some(formula) = relation.formula(output) else { return false };
    let has_none = |signal: &SignalId| knowledge.signals()[*signal].change_error.is_none();
    relation
        .needs(output)
        .any(|id| formula.only_differentiates(id.symbol()) && knowledge.carriers(id).iter().any(has_none))
}

/// The value of a variable at a share of its range, exact or read by the best of its signals.
fn read_at(knowledge: &KnowledgeBase, id: VariableId, share: f64, is_read: bool) -> Option<Interval> {
    let variable = &knowledge.variables()[id];
    if variable.constant.is_some() || variable.shape == Shape::Vector {
        return variable.constant;
    }
    let range = variable.range.filter(|range| range.is_bounded())?;
    let value = range.lo() + share * range.width();
    let carriers = if is_read { knowledge.carriers(id) } else { &[] };
    let read = carriers.iter().map(|signal| {
        let error = knowledge.signals()[*signal].value_error;
        Interval::new(value + error.lo, value + error.hi).widened(error.relative * value.abs())
    });
    Some(read.min_by(|one, other| one.width().total_cmp(&other.width())).unwrap_or(Interval::point(value)))
}

fn written(variable: &Variable, width: f64) -> String {
    const DIGITS: f64 = 1e6;
    let scale = variable.unit.as_ref().map_or(1.0, |unit| unit.scale.abs());
    let number = libm::round(width / scale * DIGITS) / DIGITS;
    match &variable.unit {
        _ if !width.is_finite() => "no bounds".to_string(),
        Some(unit) => format!("{number} {unit}"),
        None => number.to_string(),
    }
}
