//! What is learned while running, as JSON and as text.

use serde_json::{Map, Value, json};
use shsa_core::engine::{Engine, LearnedNow};
use shsa_core::interval::Interval;
use shsa_core::knowledge::Variable;

/// By variable: all that it can be now, its range, its unit, its state (`learning`, `frozen` while something that it rests on is not
/// trusted, or `out of range`), and the whole seconds until it reaches the end of its range, if it is seen to drift.
#[must_use]
pub fn json(engine: &Engine) -> Map<String, Value> {
    let row = |it: LearnedNow| {
        let variable = &engine.knowledge().variables()[it.variable];
        let [[lo, hi], range] =
            [it.set, variable.range.unwrap_or(Interval::ENTIRE)].map(|set| shown(variable, set));
        let unit = variable.unit.as_ref().map(ToString::to_string);
        let limit_in_s = it.limit_in.map(|limit_in| limit_in.seconds().round());
        let row = json!({
            "lo": lo, "hi": hi, "range": range, "unit": unit, "state": state(&it), "limit_in_s": limit_in_s,
        });
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::{Given, Run};
    use crate::story;
    use shsa_core::engine::Options;
    use shsa_core::time::Time;
    use std::convert::Infallible;
    use std::path::Path;

    /// The row of the resistance of story 21 after some hours, and how long it says that is left, in hours.
    fn after(hours: f64) -> (Value, Option<f64>) {
        let text = include_str!("../../../stories/21-a-cell-that-ages.yaml");
        let story = story::load(text, "21.yaml", Path::new(".")).story.unwrap();
        let end = Time::from_seconds(hours * 3600.0);
        let mut rows = Map::new();
        let give = |run: &mut Run, given: Given<'_>| {
            if given.time() <= end {
                run.give(given);
                rows = json(&run.engine);
            }
            Ok::<(), Infallible>(())
        };
        let Ok(_run) = Run::of(&story.journal(), Some((Time(0), end)), Options::default(), give);
        let row = rows.remove("resistance").unwrap();
        let left = row["limit_in_s"].as_f64().map(|seconds| seconds / 3600.0);
        (row, left)
    }

    #[test]
    fn a_drift_tells_how_long_is_left() {
        let (row, left) = after(1.0);
        assert_eq!(
            (&row["unit"], &row["range"], left),
            (&json!("mohm"), &json!([15.0, 60.0]), None),
            "{row}"
        );
        // It leaves its range 40 h after the beginning.
        let (row, left) = after(20.0);
        assert!(left.is_some_and(|left| (15.0..25.0).contains(&left)), "{left:?}: {row}");
    }
}
