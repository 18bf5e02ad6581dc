//! What is learned while running, as JSON and as text.

use serde_json::{Map, Value, json};
use shsa_core::engine::{Engine, LearnedNow};
use shsa_core::interval::Interval;
use shsa_core::knowledge::Variable;

/// By variable: all that it can be now, its range, its unit, and its state: `learning`, `frozen` while something that it rests on
/// is not trusted, or `out of range`.
#[must_use]
pub fn json(engine: &Engine) -> Map<String, Value> {
    let row = |it: LearnedNow| {
        let variable = &engine.knowledge().variables()[it.variable];
        let [[lo, hi], range] =
            [it.set, variable.range.unwrap_or(Interval::ENTIRE)].map(|set| shown(variable, set));
        let unit = variable.unit.as_ref().map(ToString::to_string);
        let row = json!({ "lo": lo, "hi": hi, "range": range, "unit": unit, "state": state(&it) });
        (variable.name.clone(), row)
    };
    engine.learned().map(row).collect()
}

fn shown(variable: &Variable, set: Interval) -> [f64; 2] {
    [set.lo(), set.hi()].map(|si| variable.unit.as_ref().map_or(si, |unit| unit.from_si(si)))
}

fn state(it: &LearnedNow) -> &'static str {
    match (it.has_left, it.is_frozen) {
        (true, _) => "out of range",
        (_, true) => "frozen",
        _ => "learning",
    }
}
