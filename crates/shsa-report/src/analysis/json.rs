//! The analysis as one JSON object.

use super::Report;
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::{Map, Value, json};
use shsa_core::analysis::{Addition, Candidate, Gap, Hidden, Limited, Obstacle, Survives, Tolerance, Watch};
use shsa_core::knowledge::{RelationId, SignalId};
use shsa_core::trust::Component;

/// A number of losses is `null` where no loss can take the variable away, or nothing knows it anyway.
///
/// Each signal lists all signals that its fault is isolable from, so signals are made one at a time as they are written.
pub(super) struct Object<'r> {
    pub(super) report: &'r Report<'r>,
    /// The number of signals that were left out.
    pub(super) left_out: usize,
}

impl Serialize for Object<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("signals", &Signals(self.report))?;
        object.serialize_entry("relations", &Relations(self.report))?;
        for (key, value) in rest(self.report) {
            object.serialize_entry(&key, &value)?;
        }
        if let Some(liars) = self.report.liars {
            object.serialize_entry("liars", &liars.json(self.report))?;
        }
        object.serialize_entry("left_out", &self.left_out)?;
        object.end()
    }
}

struct Signals<'r>(&'r Report<'r>);

impl Serialize for Signals<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.knowledge.signals().ids().map(|id| signal(self.0, id)))
    }
}

struct Relations<'r>(&'r Report<'r>);

impl Serialize for Relations<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.knowledge.relations().ids().map(|id| relation(self.0, id)))
    }
}

/// Everything except signals and relations.
fn rest(report: &Report<'_>) -> Map<String, Value> {
    let (knowledge, analysis) = (report.knowledge, report.analysis);
    let needs: Vec<Value> = knowledge
        .needs()
        .enumerate()
        .map(|(id, need)| {
            let tolerance = &analysis.needs[id];
            json!({
                "need": need.signal,
                "variable": report.variable(need.variable),
                "served": tolerance.known,
                "survives": survives(tolerance),
                "exact": tolerance.exact,
                "single_points": report.signals(&tolerance.single_points),
                "taken_by": report.signals(&tolerance.cut),
            })
        })
        .collect();
    let groups: Vec<Vec<&str>> = analysis.faults.groups().iter().map(|group| report.signals(group)).collect();
    let rest = json!({
        "needs": needs,
        "comparisons": analysis.comparisons.pairs().len(),
        "watch": { "ways": report.watch.ways, "cost_per_second": report.watch.cost },
        "watched": analysis.watched.iter().map(|watch| watched(report, watch)).collect::<Vec<_>>(),
        "undetectable": report.signals(&report.undetectable()),
        "not_told_apart": groups,
        "gaps": analysis.gaps.iter().map(|each| gap(report, each)).collect::<Vec<_>>(),
        "unhealed": report.signals(&analysis.unhealed()),
        "additions": analysis.additions.iter().map(|each| addition(report, each)).collect::<Vec<_>>(),
        "structure": report.figures.json(),
        "only_runnable": report.only_runnable,
        "without_formula": report.without_formula(),
        "limited": analysis.limited.iter().map(limited).collect::<Vec<_>>(),
    });
    match rest {
        Value::Object(rest) => rest,
        _ => Map::new(),
    }
}

fn signal(report: &Report<'_>, id: SignalId) -> Value {
    let analysis = report.analysis;
    let others = analysis.isolable_from(Component::Signal(id));
    let (isolable, relations): (Vec<Component>, Vec<Component>) =
        others.partition(|other| matches!(other, Component::Signal(_)));
    let named = |of: Vec<Component>| of.into_iter().map(|it| report.component(it)).collect::<Vec<&str>>();
    json!({
        "signal": report.signal(id),
        "variable": report.variable(report.knowledge.signals()[id].variable),
        "detectable": analysis.faults.is_detectable(id),
        "shown_by": analysis.faults.shown_by(id),
        "isolable_from": named(isolable),
        "isolable_from_relations": named(relations),
        "isolable_in_part_from": named(analysis.isolable_in_part_from(Component::Signal(id)).collect()),
        "in_part": report.in_part(Component::Signal(id)),
        "substitutable": analysis.is_substitutable(id),
        "tolerates": survives(&analysis.signals[id]),
        "exact": analysis.signals[id].exact,
        "needs_lost": report.needs_lost(id),
    })
}

/// A relation is faulty when it does not hold.
fn relation(report: &Report<'_>, id: RelationId) -> Value {
    let (analysis, component) = (report.analysis, Component::Relation(id));
    let described = analysis.faults.of_relation(id);
    let isolable: Vec<&str> =
        analysis.isolable_from(component).map(|other| report.component(other)).collect();
    let in_part: Vec<&str> =
        analysis.isolable_in_part_from(component).map(|other| report.component(other)).collect();
    let prior = report.knowledge.relations()[id].properties.prior();
    json!({
        "relation": report.component(Component::Relation(id)),
        "prior": prior,
        "detectable": described.shown_by > 0,
        "shown_by": described.shown_by,
        "isolable_from": isolable,
        "isolable_in_part_from": in_part,
        "in_part": report.in_part(component),
    })
}

fn gap(report: &Report<'_>, gap: &Gap) -> Value {
    let obstacle = |obstacle: &Obstacle| {
        let relation = |id: &RelationId| report.component(Component::Relation(*id));
        match obstacle {
            Obstacle::Loop { relations, variables, is_dynamic } => json!({
                "what": "loop",
                "relations": relations.iter().map(relation).collect::<Vec<_>>(),
                "variables": variables.iter().map(|it| report.variable(*it)).collect::<Vec<_>>(),
                "dynamic": is_dynamic,
            }),
            Obstacle::Direction { relation: id, variable } => {
                json!({ "what": "direction", "relation": relation(id), "variable": report.variable(*variable) })
            }
            Obstacle::NotRun { relation: id } => json!({ "what": "not run", "relation": relation(id) }),
            Obstacle::Derived { signal } => json!({ "what": "derived", "signal": report.signal(*signal) }),
            Obstacle::LeftOut => json!({ "what": "left out" }),
            Obstacle::NotSearched => json!({ "what": "not searched" }),
        }
    };
    json!({
        "fault": report.component(gap.fault),
        "from": gap.from.map(|from| report.component(from)),
        "obstacles": gap.obstacles.iter().map(obstacle).collect::<Vec<_>>(),
        "because": report.obstacles(&gap.obstacles),
    })
}

fn watched(report: &Report<'_>, watch: &Watch) -> Value {
    let hidden = |hidden: &Hidden| {
        json!({
            "signal": report.signal(hidden.signal),
            "undetected": hidden.undetected,
            "taken_for": report.signals(&hidden.taken_for),
        })
    };
    json!({
        "variable": report.variable(watch.variable),
        "ways": watch.ways,
        "possible": watch.possible,
        "exact": watch.exact,
        "cost_per_second": watch.cost,
        "hidden": watch.hidden.iter().map(hidden).collect::<Vec<_>>(),
    })
}

fn survives(tolerance: &Tolerance) -> Option<usize> {
    tolerance.survives.filter(|_| tolerance.known)
}

fn addition(report: &Report<'_>, addition: &Addition) -> Value {
    let (kind, variables) = match addition.candidate {
        Candidate::Sensor(variable) => ("sensor", vec![variable]),
        Candidate::Relation(one, other) => ("relation", vec![one, other]),
        Candidate::Given(place) => ("given", report.variables_of_given(place)),
    };
    let given = match addition.candidate {
        Candidate::Given(place) => report.given.get(place).map(|it| it.name.as_str()),
        Candidate::Sensor(_) | Candidate::Relation(..) => None,
    };
    let need = |each: &Survives| json!({ "need": report.need(each.need), "from": survives(&each.now), "to": survives(&each.then) });
    json!({
        "kind": kind,
        "relation": given,
        "variables": variables.iter().map(|&variable| report.variable(variable)).collect::<Vec<_>>(),
        "detectable": report.signals(&addition.detectable),
        "isolable_pairs": addition.isolable_pairs,
        "substitutable": report.signals(&addition.substitutable),
        "survives": addition.survives.iter().map(need).collect::<Vec<_>>(),
    })
}

fn limited(limited: &Limited) -> Value {
    match limited {
        Limited::Ways { variables } => json!({ "what": "ways", "variables": variables }),
        Limited::Skipped { variables } => json!({ "what": "skipped", "variables": variables }),
        Limited::Needs { needs } => json!({ "what": "needs", "needs": needs }),
        Limited::Variables { variables } => json!({ "what": "variables", "variables": variables }),
        Limited::Additions { tried, of } => json!({ "what": "additions", "tried": tried, "of": of }),
    }
}
