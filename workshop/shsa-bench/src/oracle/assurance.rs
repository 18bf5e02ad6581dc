//! Recorded evaluations of certificates: which guarantees hold, why others do not, and the consequences of changed evidence.
//!
//! A file of `shsa-assurance-golden-1` holds its own scales and units, so the comparison uses none of ours.

use super::Compared;
use super::certificates::{Bounds, Case, EvidenceFacts, Recorded, certificates, interval};
use anyhow::Context;
use serde_json::{Map, Value, json};
use shsa_core::assurance::{DemandId, Evaluation, EvidenceId, GuaranteeId, Leaf, Sets, System, Verdict};
use shsa_core::interval::{Interval, Truth};
use shsa_core::statement::Level;
use std::collections::BTreeMap;

/// The most evaluations for one question about minimal sets.
const MOST: usize = 1_000_000;

/// Evaluates every case and each of its steps; one answer each.
///
/// # Errors
/// When a case uses a name, scale or unit that it does not define.
pub(super) fn compare(recorded: &Recorded, compared: &mut Compared) -> anyhow::Result<()> {
    for case in recorded.examples.iter().chain(&recorded.cases) {
        let case = Composed::new(recorded, case).with_context(|| case.id.clone())?;
        case.compare(compared)?;
    }
    Ok(())
}

/// A case and our system made of it.
struct Composed<'a> {
    recorded: &'a Recorded,
    case: &'a Case,
    system: System,
    facts: BTreeMap<&'a str, (EvidenceId, &'a EvidenceFacts)>,
}

impl<'a> Composed<'a> {
    fn new(recorded: &'a Recorded, case: &'a Case) -> anyhow::Result<Composed<'a>> {
        let system = System::new(certificates(recorded, case)?)
            .map_err(|problems| anyhow::anyhow!("its certificates cannot be composed: {problems:?}"))?;
        let all = case.services.iter().flat_map(|service| &service.evidence);
        let facts = all.zip(system.certificates().evidence.ids());
        let facts = facts.map(|(facts, id)| (facts.id.as_str(), (id, facts))).collect();
        Ok(Composed { recorded, case, system, facts })
    }

    fn compare(&self, compared: &mut Compared) -> anyhow::Result<()> {
        let mut evaluation = Evaluation::new(&self.system);
        for (id, facts) in self.facts.values() {
            let truth = match (facts.range, facts.measured) {
                (Some(_), measured) => self.measured(*id, facts, measured)?,
                (None, _) => truth_of(facts.value),
            };
            evaluation.set(&self.system, *id, truth);
        }
        let mut differences = Vec::new();
        let ours = sorted(self.answer(&evaluation));
        differ(&self.case.id, &sorted(self.case.expected.clone()), &ours, &mut differences);
        compared.answer(differences);
        for (at, step) in self.case.steps.iter().enumerate() {
            let mut changes = Vec::new();
            for (name, value) in &step.set {
                let (id, facts) =
                    self.facts.get(name.as_str()).with_context(|| format!("no evidence {name}"))?;
                let truth = match facts.range {
                    Some(_) => self.measured(*id, facts, serde_json::from_value(value.clone())?)?,
                    None => truth_of(serde_json::from_value(value.clone())?),
                };
                changes.push((*id, truth));
            }
            evaluation.set_all(&self.system, changes.into_iter());
            let label = format!("{} step {at}", self.case.id);
            let mut differences = Vec::new();
            let expected = sorted(json!({ "holds": step.holds, "met": step.met }));
            let ours = sorted(json!({ "holds": self.holding(&evaluation), "met": self.met(&evaluation) }));
            differ(&label, &expected, &ours, &mut differences);
            compared.answer(differences);
        }
        Ok(())
    }

    fn measured(
        &self,
        id: EvidenceId,
        facts: &EvidenceFacts,
        measured: Option<Bounds>,
    ) -> anyhow::Result<Truth> {
        let (_, factor) = self.recorded.unit(facts.unit.as_deref())?;
        let measured = measured.map_or(Interval::EMPTY, |bounds| interval(bounds, factor));
        Ok(self.system.certificates().evidence[id].truth(measured))
    }

    fn holding(&self, evaluation: &Evaluation) -> Vec<&str> {
        self.guarantees(|id| evaluation.guarantee(&self.system, id) == Verdict::Holds)
    }

    fn met(&self, evaluation: &Evaluation) -> Vec<&str> {
        let all = self.system.certificates().demands.enumerate();
        let met = all.filter(|&(id, _)| evaluation.demand(&self.system, id) == Verdict::Holds);
        met.map(|(_, demand)| demand.name.as_str()).collect()
    }

    fn guarantees(&self, are: impl Fn(GuaranteeId) -> bool) -> Vec<&str> {
        let all = self.system.certificates().guarantees.enumerate();
        all.filter(|&(id, _)| are(id)).map(|(_, guarantee)| guarantee.name.as_str()).collect()
    }

    /// Our answers to everything that the file records, in the file's form.
    fn answer(&self, evaluation: &Evaluation) -> Value {
        let (system, rows) = (&self.system, self.system.certificates());
        let evidence: Map<String, Value> = rows
            .evidence
            .enumerate()
            .map(|(id, row)| (row.name.clone(), json!(truth_name(evaluation.truth(id)))))
            .collect();
        let matches: Map<String, Value> = rows
            .demands
            .enumerate()
            .map(|(id, row)| {
                let names: Vec<&str> =
                    system.matches(id).map(|it| rows.guarantees[it].name.as_str()).collect();
                (row.name.clone(), json!(names))
            })
            .collect();
        let would = |id| matches!(evaluation.guarantee(system, id), Verdict::Holds | Verdict::Open);
        let not_held = rows
            .guarantees
            .enumerate()
            .filter(|&(id, _)| evaluation.guarantee(system, id) != Verdict::Holds)
            .map(|(id, row)| (row.name.clone(), self.why_no_guarantee(evaluation, id)))
            .collect::<Map<String, Value>>();
        let demands = rows.demands.enumerate();
        let demands = demands.map(|(id, row)| (row.name.clone(), self.demand(evaluation, id)));
        json!({
            "evidence": evidence,
            "matches": matches,
            "holds": self.holding(evaluation),
            "holds_if_unknown_true": self.guarantees(would),
            "greatest_fixed_point": self.guarantees(|id| evaluation.is_consistent(system, id)),
            "guarantees": not_held,
            "demands": demands.collect::<Map<String, Value>>(),
        })
    }

    fn why_no_guarantee(&self, evaluation: &Evaluation, id: GuaranteeId) -> Value {
        let rows = self.system.certificates();
        let leaf = |leaf: &Leaf| match *leaf {
            Leaf::Demand(id) => json!(rows.demands[id].name),
            Leaf::Evidence(id) => json!(rows.evidence[id].name),
        };
        let missing = evaluation.missing(&self.system, id, MOST);
        let (repairs, causes) = evaluation.why_no_guarantee(&self.system, id, MOST);
        json!({
            "verdict": match evaluation.guarantee(&self.system, id) {
                Verdict::Holds => "holds",
                Verdict::Open => "open",
                Verdict::Circular => "circular",
                Verdict::Refused => "refused",
            },
            "missing": sets(&missing, leaf),
            "repairs": self.names(&repairs),
            "causes": self.names(&causes),
        })
    }

    fn names(&self, found: &Sets<EvidenceId>) -> Value {
        sets(found, |&id| json!(self.system.certificates().evidence[id].name))
    }

    fn demand(&self, evaluation: &Evaluation, id: DemandId) -> Value {
        let (system, rows) = (&self.system, self.system.certificates());
        let is_met = evaluation.demand(system, id) == Verdict::Holds;
        let mut answer = json!({ "met": is_met });
        if !is_met {
            let (repairs, causes) = evaluation.why_unmet(system, id, MOST);
            answer["repairs"] = self.names(&repairs);
            answer["causes"] = self.names(&causes);
        }
        if rows.demands[id].statement.level.is_some() && !rows.demands[id].of.is_empty() {
            let name = |level: Level| rows.scales.level_name(level);
            let higher = evaluation.higher(system, id, MOST);
            let higher = higher
                .iter()
                .map(|it| json!({ "level": name(it.level), "repairs": self.names(&it.repairs) }));
            answer["highest"] = json!(evaluation.highest(system, id).map(name));
            answer["highest_if_unknown_true"] =
                json!(evaluation.highest_if_unknown_true(system, id).map(name));
            answer["higher"] = higher.collect();
        }
        answer
    }
}

fn truth_of(value: Option<bool>) -> Truth {
    value.map_or(Truth::Unknown, Truth::from)
}

fn truth_name(truth: Truth) -> &'static str {
    match truth {
        Truth::False => "false",
        Truth::Unknown => "unknown",
        Truth::True => "true",
    }
}

/// An incomplete enumeration of sets differs from every recorded answer.
fn sets<T>(found: &Sets<T>, name: impl Fn(&T) -> Value) -> Value {
    match found.is_complete {
        true => found.sets.iter().map(|set| set.iter().map(&name).collect::<Value>()).collect(),
        false => json!("not all were found"),
    }
}

/// The value with every list sorted, because the recorded lists are sets.
fn sorted(value: Value) -> Value {
    match value {
        Value::Array(items) => {
            let mut items: Vec<Value> = items.into_iter().map(sorted).collect();
            items.sort_by_cached_key(Value::to_string);
            Value::Array(items)
        }
        Value::Object(fields) => fields.into_iter().map(|(name, value)| (name, sorted(value))).collect(),
        value => value,
    }
}

/// All differences between the recorded value and ours, with their paths. The number of rounds is not compared.
fn differ(path: &str, recorded: &Value, ours: &Value, differences: &mut Vec<String>) {
    match (recorded, ours) {
        (Value::Object(recorded), Value::Object(ours)) => {
            for (name, value) in recorded.iter().filter(|(name, _)| *name != "rounds") {
                match ours.get(name) {
                    Some(own) => differ(&format!("{path} {name}"), value, own, differences),
                    None => differences.push(format!("{path} {name}: recorded {value}, ours has none")),
                }
            }
            let more = ours.iter().filter(|(name, _)| !recorded.contains_key(*name));
            differences
                .extend(more.map(|(name, value)| format!("{path} {name}: ours {value}, recorded none")));
        }
        (recorded, ours) if recorded == ours => {}
        (recorded, ours) => differences.push(format!("{path}: recorded {recorded}, ours {ours}")),
    }
}
