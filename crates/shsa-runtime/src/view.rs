//! The rows that the live page draws of a running model: a few words and numbers each, cheap enough to be made ten times a second
//! in the thread that decides.
//!
//! Values that change with every message have rows of their own (`values`, `readings`), so that the other rows need not be sent
//! again. In a large model each look takes only some of the signals in turn, so that no decision waits for all of them.

use crate::healer::Healer;
use crate::outlet::Outlet;
use crate::profile;
use serde_json::{Map, Value, json};
use shsa_bridge::Clock;
use shsa_core::engine::{Order, Subject};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, KnowledgeBase, NeedId, Relation, Shape, Signal, SignalId, VariableId};
use shsa_core::monitor::{ResidualState, Symptom, WatchedWay};
use shsa_core::reason::ServedBy;
use shsa_core::time::Time;
use shsa_core::trust::Verdict;
use shsa_core::unit::Unit;
use shsa_format::order::OrderForm;
use shsa_format::{event, learned};
use std::collections::BTreeSet;

/// How many signals of a model one look takes.
pub(super) const SIGNALS: usize = 256;

/// The most conflicts in a view.
const MOST_CONFLICTS: usize = 64;

/// How far a reader has followed the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Look {
    /// The number of the first decision that the reader lacks; `None`: it lacks all.
    pub(super) since: Option<u64>,
    /// The first signal of this look.
    pub(super) from: usize,
    /// The number of this look: vectors take turns.
    pub(super) turn: u64,
}

/// The view of one model.
///
/// `news` are the decisions that the reader lacks. Without any, the rows that follow from decisions alone are left out.
pub(super) fn of(healer: &Healer, look: Look, news: &[Value], now: Time, clock: &Clock) -> Value {
    let knowledge = healer.engine().knowledge();
    let is_news = look.since.is_none() || !news.is_empty();
    let (signals, readings) = signals(healer, &wanted(knowledge, look, news), clock);
    let about = Map::from_iter([("version".to_owned(), json!(knowledge.version()))]);
    let mut tables = vec![
        ("about", about),
        ("conflicts", conflicts(healer, now)),
        ("needs", needs(healer, now)),
        ("values", values(healer, clock)),
        ("signals", signals),
        ("readings", readings),
    ];
    let learned = learned::json(healer.engine());
    tables.extend((!learned.is_empty()).then_some(("learned", learned)));
    tables.extend(profile::tables(healer, look.turn, now));
    if is_news {
        tables.push(("lost", lost(healer)));
        tables.push(("ahead", ahead(healer)));
        tables.push(("orders", orders(healer)));
        tables.push(("derived", derived(healer)));
    }
    let tables = tables.into_iter().map(|(name, rows)| (name.to_owned(), Value::Object(rows)));
    json!({
        "version": knowledge.version(),
        "count": knowledge.signals().len(),
        "tables": Value::Object(tables.collect()),
    })
}

/// The signals of this look, and those with a new decision.
fn wanted(knowledge: &KnowledgeBase, look: Look, news: &[Value]) -> BTreeSet<SignalId> {
    let end = knowledge.signals().len().min(look.from.saturating_add(SIGNALS));
    let in_turn = (look.from..end).map(SignalId::from_index);
    let decided = news.iter().filter_map(|event| knowledge.signal(event.get("signal")?.as_str()?));
    in_turn.chain(decided).collect()
}

/// How each need is served.
fn needs(healer: &Healer, now: Time) -> Map<String, Value> {
    let row = |(need, outlet): (NeedId, &Outlet)| {
        let status = healer.engine().need_status(need);
        let row = json!({
            "variable": outlet.variable().0,
            "signal": outlet.topic(),
            "unit": outlet.variable().1.map(ToString::to_string),
            "quality": outlet.quality(now).name(),
            "source": outlet.provenance().source,
            "forced": status.forced,
            "way": status.source.as_ref().and_then(way),
            "max_age_s": outlet.max_age().seconds(),
            "longest_gap_s": status.longest_gap.seconds(),
            "assurance": status.assurance.as_ref().map(|it| healer.assurance(it)),
        });
        (outlet.key().to_owned(), row)
    };
    healer.outlets().map(row).collect()
}

/// A way as [`ahead`] names it.
fn way(source: &ServedBy) -> Option<&str> {
    match source {
        ServedBy::Way(way) => Some(way),
        _ => None,
    }
}

/// The latest value of each need: its bounds, the time of its publication, the number of values so far.
fn values(healer: &Healer, clock: &Clock) -> Map<String, Value> {
    let row = |(need, outlet): (NeedId, &Outlet)| {
        let [lo, hi] = bounds(outlet.value(), outlet.variable().1);
        let last = outlet.last().map(|last| clock.by_wall(last).0);
        (outlet.key().to_owned(), json!([lo, hi, last, healer.engine().need_status(need).published]))
    };
    healer.outlets().map(row).collect()
}

/// The last minutes of each need: for each point its time, the bounds of its values, whether the source changed, and whether the need
/// was not served before.
pub(super) fn past(healer: &Healer, clock: &Clock) -> Value {
    let row = |(_, outlet): (NeedId, &Outlet)| {
        let points = outlet.past().map(|it| {
            let [lo, hi] = bounds(Some(it.value), outlet.variable().1);
            json!([clock.by_wall(it.last).0, lo, hi, it.is_switch, it.is_gap])
        });
        (outlet.key().to_owned(), Value::Array(points.collect()))
    };
    Value::Object(healer.outlets().map(row).collect())
}

/// The ways that contradict each other now, described by their signals and relations.
fn conflicts(healer: &Healer, now: Time) -> Map<String, Value> {
    let (knowledge, monitor) = (healer.engine().knowledge(), healer.engine().monitor());
    let names = |way: &WatchedWay| {
        let names = way.rests_on.iter().map(|signal| knowledge.signals()[signal].name.clone());
        names.collect::<Vec<_>>()
    };
    let pairs = monitor.restless().filter(|pair| pair.residual_state(now) == ResidualState::Conflict);
    let rows = pairs.filter_map(|pair| {
        let (one, other) = (monitor.way(pair.way)?, monitor.way(pair.other)?);
        let words = |way: &WatchedWay| way.computation.way().describe(knowledge);
        let variable = &*knowledge.variables()[one.variable()].name;
        let row = json!({ "variable": variable, "one": names(one), "other": names(other) });
        Some((format!("{variable}: {} and {}", words(one), words(other)), row))
    });
    rows.take(MOST_CONFLICTS).collect()
}

/// The signals that nothing may rest on now.
fn lost(healer: &Healer) -> Map<String, Value> {
    let engine = healer.engine();
    let is_lost = |&(id, _): &(SignalId, &Signal)| {
        engine.absence(id).is_some() || matches!(engine.verdict(id), Verdict::Suspect | Verdict::Failed)
    };
    let forbidden = engine.standing_orders().into_iter().filter_map(|order| match order {
        Order::Forbid(Subject::Signal(name)) => Some(name),
        _ => None,
    });
    let lost =
        engine.knowledge().signals().enumerate().filter(is_lost).map(|(_, signal)| signal.name.clone());
    lost.chain(forbidden).map(|name| (name, Value::Bool(true))).collect()
}

/// What could serve each need, best first.
fn ahead(healer: &Healer) -> Map<String, Value> {
    let knowledge = healer.engine().knowledge();
    let row = |(need, outlet): (NeedId, &Outlet)| {
        let ways = healer.engine().ways_to_serve(need).map(|way| {
            let names = |signal: SignalId| knowledge.signals()[signal].name.clone();
            let steps = way.substitution.steps.iter();
            json!({
                "words": way.describe(knowledge),
                "signals": way.inputs().map(names).collect::<Vec<_>>(),
                "relations": steps.map(|step| &*knowledge.relations()[step.relation].name).collect::<Vec<_>>(),
            })
        });
        (outlet.key().to_owned(), Value::Array(ways.collect()))
    };
    healer.outlets().map(row).collect()
}

/// The vectors from each of which alone a relation computes a need, whether or not they serve it now.
fn derived(healer: &Healer) -> Map<String, Value> {
    let knowledge = healer.engine().knowledge();
    let is_vector = |id: &VariableId| knowledge.variables()[*id].shape == Shape::Vector;
    // What a relation computes may be among the variables that it reads in its other directions.
    let relations = knowledge.relations().iter().filter(|it| it.inputs.len() <= 2);
    let relations: Vec<&Relation> = relations.filter(|it| it.inputs.iter().any(is_vector)).collect();
    let row = |(need, outlet): (NeedId, &Outlet)| {
        let variable = knowledge.needs()[need].variable;
        let relations = relations.iter().filter(|it| it.outputs.contains(&variable));
        let vectors = relations.filter_map(|it| {
            let mut inputs = it.inputs.iter().filter(|input| **input != variable);
            let vector = inputs.next().filter(|input| is_vector(input) && inputs.next().is_none())?;
            Some(&*knowledge.variables()[*vector].name)
        });
        let vectors: Vec<&str> = vectors.collect();
        (!vectors.is_empty()).then(|| (outlet.key().to_owned(), json!(vectors)))
    };
    healer.outlets().filter_map(row).collect()
}

/// The orders that are in force, by number.
fn orders(healer: &Healer) -> Map<String, Value> {
    let orders = healer.engine().standing_orders();
    let rows =
        orders.iter().enumerate().map(|(number, order)| (number.to_string(), json!(OrderForm::from(order))));
    rows.collect()
}

/// The verdicts on some signals, their latest values with their times, and the counts of their observations.
fn signals(
    healer: &Healer,
    wanted: &BTreeSet<SignalId>,
    clock: &Clock,
) -> (Map<String, Value>, Map<String, Value>) {
    let engine = healer.engine();
    let knowledge = engine.knowledge();
    let (mut signals, mut readings) = (Map::new(), Map::new());
    for &id in wanted {
        let signal = &knowledge.signals()[id];
        let port = &engine.monitor().ports()[id];
        let [lo, hi] = bounds(port.hull(), signal.unit.as_ref());
        let last = port.received().map(|last| clock.by_wall(last).0);
        readings.insert(signal.name.clone(), json!([lo, hi, last, port.counts().accepted]));
        let about = json!({
            "variable": knowledge.variables()[signal.variable].name,
            "unit": signal.unit.as_ref().map(ToString::to_string),
            "verdict": event::verdict(engine.absence(id), engine.verdict(id)),
            "is_list": knowledge.variables()[signal.variable].shape == Shape::Vector,
            "symptom": engine.fault(id).map(Symptom::name),
        });
        signals.insert(signal.name.clone(), about);
    }
    (signals, readings)
}

/// The bounds of a value in a unit; an infinite bound is left open.
pub(super) fn bounds(value: Option<Interval>, unit: Option<&Unit>) -> [Option<f64>; 2] {
    let shown = |si: f64| Some(unit.map_or(si, |unit| unit.from_si(si))).filter(|shown| shown.is_finite());
    value.map_or([None; 2], |value| [shown(value.lo()), shown(value.hi())])
}
