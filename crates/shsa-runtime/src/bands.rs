//! The recent values of all ways of knowing one variable, for the live page.

use crate::healer::Healer;
use serde_json::{Value, json};
use shsa_bridge::Clock;
use shsa_core::knowledge::{KnowledgeBase, Variable, VariableId};
use shsa_core::monitor::{WatchedWay, WayIndex};
use shsa_core::time::{Span, Time};
use std::collections::BTreeMap;

/// The most ways in an answer; further ones are only counted.
const MOST_WAYS: usize = 32;

/// The variable whose bands are requested, and what the reader has already.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct BandsOf {
    /// The name of the model.
    pub(super) model: String,
    /// The name of the variable.
    pub(super) variable: String,
    /// How far the reader has followed the variable.
    pub(super) last_sent: LastSent,
}

/// How far a reader has followed a variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LastSent {
    /// The time of the last value of each way, by its description: ways have values at different times.
    pub(super) ways: BTreeMap<String, Time>,
    /// The time of the last conflict.
    pub(super) conflicts: Time,
}

impl Default for LastSent {
    fn default() -> LastSent {
        LastSent { ways: BTreeMap::new(), conflicts: Time::MIN }
    }
}

impl LastSent {
    /// Advances by an answer, and removes the fields from it that only mark the progress.
    pub(super) fn follow(&mut self, described: &mut Value) {
        let until = |it: &mut Value| it.as_object_mut()?.remove("until").and_then(|it| it.as_i64()).map(Time);
        self.conflicts = until(described).unwrap_or(self.conflicts);
        let ways = described.get_mut("ways").and_then(Value::as_array_mut);
        for way in ways.into_iter().flatten() {
            let until = until(way);
            let words = way.get("words").and_then(Value::as_str);
            self.ways.extend(words.map(str::to_owned).zip(until));
        }
    }
}

/// The values of a variable since then, each at the middle of its time; and which ways have disagreed.
///
/// # Errors
/// When the model has no such variable.
pub(super) fn of(healer: &Healer, wanted: &BandsOf, now: Time, clock: &Clock) -> Result<Value, String> {
    let knowledge = healer.engine().knowledge();
    let id = knowledge.variable(&wanted.variable);
    let id = id.ok_or_else(|| format!("the model has no variable '{}'", wanted.variable))?;
    let variable = &knowledge.variables()[id];
    let ways = ways(healer, id);
    let described = ways.iter().take(MOST_WAYS);
    let described = described.map(|(_, way)| values_of(knowledge, variable, way, &wanted.last_sent, clock));
    Ok(json!({
        "until": now.0,
        "time_ns": clock.by_wall(now).0,
        "unit": variable.unit.as_ref().map(ToString::to_string),
        "ways": described.collect::<Vec<_>>(),
        "more": ways.len().saturating_sub(MOST_WAYS),
        "conflicts": conflicts(healer, &ways, wanted.last_sent.conflicts, clock),
    }))
}

/// The ways of knowing the variable, direct ones first.
fn ways(healer: &Healer, variable: VariableId) -> Vec<(WayIndex, &WatchedWay)> {
    let all = (0..).map(WayIndex).zip(healer.engine().monitor().ways());
    let mut ways: Vec<_> = all.filter(|(_, way)| way.variable() == variable).collect();
    ways.sort_by_key(|(_, way)| way.computation.way().direct().is_none());
    ways
}

fn values_of(
    knowledge: &KnowledgeBase,
    variable: &Variable,
    way: &WatchedWay,
    last_sent: &LastSent,
    clock: &Clock,
) -> Value {
    let words = way.computation.way().describe(knowledge);
    let after = last_sent.ways.get(&words).copied().unwrap_or(Time::MIN);
    let news = way.outputs.newest_first().take_while(|sample| sample.validity.to > after);
    let shown = |si: f64| variable.unit.as_ref().map_or(si, |unit| unit.from_si(si));
    let mut samples: Vec<_> = news
        .map(|sample| {
            let middle = sample.validity.from + Span(sample.validity.length().0 / 2);
            let value = variable.brought_back(sample.value);
            json!([clock.by_wall(middle).0, shown(value.lo()), shown(value.hi())])
        })
        .collect();
    samples.reverse();
    let rests_on = way.rests_on.iter().map(|signal| &*knowledge.signals()[signal].name);
    json!({
        "words": words,
        "until": way.outputs.newest(0).map(|newest| newest.validity.to.0),
        "signals": rests_on.collect::<Vec<_>>(),
        "samples": samples,
    })
}

/// When two of the ways have disagreed since then, and which.
fn conflicts(healer: &Healer, ways: &[(WayIndex, &WatchedWay)], after: Time, clock: &Clock) -> Vec<Value> {
    let place = |index| ways.iter().take(MOST_WAYS).position(|(way, _)| *way == index);
    let pairs = healer.engine().monitor().restless().filter_map(|pair| {
        let disagreement = pair.disagreement.filter(|it| it.time > after)?;
        Some(json!([clock.by_wall(disagreement.time).0, place(pair.way)?, place(pair.other)?]))
    });
    pairs.collect()
}
