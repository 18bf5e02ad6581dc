//! Recorded searches: models of structure only, and for each variable every substitution with its utility.

use super::{Compared, TOLERANCE};
use crate::structure;
use anyhow::Context;
use serde::Deserialize;
use shsa_core::knowledge::{
    IdVec, KnowledgeBase, Properties, Relation, RelationId, Signal, SignalId, Variable, VariableId,
};
use shsa_core::plan::{Graph, Limits, Options, best};
use std::collections::BTreeMap;

/// A file of `shsa-search-golden-1`.
#[derive(Deserialize)]
pub(super) struct Recorded {
    models: BTreeMap<String, Model>,
}

#[derive(Deserialize)]
struct Model {
    graph: Structure,
    roots: BTreeMap<String, Root>,
}

#[derive(Deserialize)]
struct Structure {
    variables: BTreeMap<String, VariableFacts>,
    relations: BTreeMap<String, RelationFacts>,
}

#[derive(Deserialize)]
struct VariableFacts {
    provided: bool,
    accuracy: Option<f64>,
}

#[derive(Deserialize)]
struct RelationFacts {
    #[serde(rename = "in")]
    inputs: Vec<String>,
    #[serde(rename = "out")]
    outputs: Vec<String>,
    cost: Option<f64>,
}

#[derive(Deserialize)]
struct Root {
    /// All substitutions.
    dfs: Vec<Answer>,
}

#[derive(Deserialize)]
struct Answer {
    relations: Vec<String>,
    utility: f64,
}

/// Substitutions as sets of relations, with their utilities.
type Answers = BTreeMap<Vec<String>, f64>;

/// Searches all roots of all models.
///
/// # Errors
/// When a model uses a variable that it does not have.
pub(super) fn compare(recorded: &Recorded, compared: &mut Compared) -> anyhow::Result<()> {
    for (file, model) in &recorded.models {
        let knowledge = knowledge(&model.graph).with_context(|| file.clone())?;
        let graph = Graph::new(&knowledge);
        for (name, root) in &model.roots {
            let id = knowledge.variable(name).with_context(|| format!("{file} has no variable {name}"))?;
            let plan = best(&graph, id, &Options::default(), usize::MAX, Limits::default());
            let name_of = |relation: RelationId| knowledge.relations()[relation].name.clone();
            let found = plan.substitutions.iter().map(|(substitution, utility)| {
                (sorted(substitution.relations().into_iter().map(name_of).collect()), *utility)
            });
            let recorded = root.dfs.iter().map(|it| (sorted(it.relations.clone()), it.utility));
            compared.answer(differences(&format!("{file} {name}"), &found.collect(), &recorded.collect()));
        }
    }
    Ok(())
}

fn sorted(mut names: Vec<String>) -> Vec<String> {
    names.sort();
    names
}

fn differences(label: &str, found: &Answers, recorded: &Answers) -> Vec<String> {
    let shown = |relations: &[String]| format!("{{{}}}", relations.join(", "));
    let missing = recorded.keys().filter(|it| !found.contains_key(*it));
    let missing = missing.map(|it| format!("{label}: {} is recorded and not found", shown(it)));
    let others = found.iter().filter_map(|(relations, utility)| match recorded.get(relations) {
        None => Some(format!("{label}: {} is found and not recorded", shown(relations))),
        Some(other) if (utility - other).abs() <= TOLERANCE => None,
        Some(other) => Some(format!("{label}: {} has the utility {utility}, not {other}", shown(relations))),
    });
    missing.chain(others).collect()
}

fn knowledge(recorded: &Structure) -> anyhow::Result<KnowledgeBase> {
    let mut variables: IdVec<VariableId, Variable> = IdVec::new();
    let mut signals: IdVec<SignalId, Signal> = IdVec::new();
    let mut ids = BTreeMap::new();
    for (name, facts) in &recorded.variables {
        let properties = property("accuracy", facts.accuracy);
        let id = variables.push(structure::variable(name.clone(), properties));
        ids.insert(name.as_str(), id);
        if facts.provided {
            signals.push(Signal::new(format!("/{name}"), id));
        }
    }
    let all = |names: &[String]| -> anyhow::Result<Vec<VariableId>> {
        let id =
            |name: &String| ids.get(name.as_str()).copied().with_context(|| format!("no variable {name}"));
        names.iter().map(id).collect()
    };
    let mut relations: IdVec<RelationId, Relation> = IdVec::new();
    for (name, facts) in &recorded.relations {
        relations.push(Relation {
            name: name.clone(),
            inputs: all(&facts.inputs)?,
            outputs: all(&facts.outputs)?,
            formulas: Vec::new(),
            condition: None,
            text: String::new(),
            properties: property("cost", facts.cost),
        });
    }
    Ok(KnowledgeBase::from_parts(variables, relations, signals, IdVec::new()))
}

fn property(name: &str, value: Option<f64>) -> Properties {
    value.map(|value| (name.to_owned(), value)).into_iter().collect()
}
