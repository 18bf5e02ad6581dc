//! Warns of ways that say nothing: relations solved for a variable, where the intervals are wider than the variable's range.

use super::problems::Problems;
use crate::expression::{Assignment, InputKind, Program, State, Value};
use crate::interval::Interval;
use crate::knowledge::draft::Place;
use crate::knowledge::{Id, IdVec, KnowledgeBase, Relation, RelationId, Shape, Variable, VariableId};
use crate::time::{Time, Validity};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Where in the ranges of its inputs a formula is evaluated. At the ends, a product of an uncertain factor may be 0.
const SHARES: [f64; 5] = [0.25, 0.5, 0.75, 0.0, 1.0];
/// How many of these are inside of the ranges.
const INSIDE: usize = 3;

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
            let help = format!(
                "narrow what the relation computes with, or name in `for` what else it is solved for, without `{}`",
                variable.name
            );
            problems.warn(place, message, help);
        }
    }
}

/// The least width of an output over some values of its inputs, which are exact or read; `None` where a value is not known, or
/// depends on the past.
fn least_width(
    knowledge: &KnowledgeBase,
    relation: &Relation,
    output: VariableId,
    is_read: bool,
) -> Option<f64> {
    let formula = relation.formula(output).filter(|formula| !formula.is_stateful())?;
    let assignment = Assignment { symbol: output.symbol(), formula, condition: None };
    let program = Program::compile(&[assignment]).ok()?;
    let mut state = program.new_state(0, 1.0);
    let mut least = f64::INFINITY;
    for share in SHARES.into_iter().take(if is_read { SHARES.len() } else { INSIDE }) {
        least = least.min(width_at(knowledge, &program, &mut state, share, is_read)?);
    }
    Some(least)
}

/// The width of a program's value where its inputs are at this share of their ranges; `None` without a value.
fn width_at(
    knowledge: &KnowledgeBase,
    program: &Program,
    state: &mut State<Interval>,
    share: f64,
    is_read: bool,
) -> Option<f64> {
    let read = |input: &crate::expression::Input| {
        let id = VariableId::from_index(input.symbol.0 as usize);
        let known = input.kind == InputKind::Current;
        known.then(|| read_at(knowledge, id, share, is_read)).flatten().map(Value::Scalar)
    };
    let inputs: Vec<Value<'_, Interval>> = program.inputs().iter().map(read).collect::<Option<_>>()?;
    let value = program.evaluate(state, &inputs, Validity::at(Time(0)), None).value.scalar();
    (!value.is_empty()).then(|| value.width())
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
