//! Ranks additional sensors and relations: each is added to the model, and the improvements are counted.

use super::Options;
use super::basis::Basis;
use super::budget::Budget;
use super::comparisons::{Comparisons, Watched, gathered, isolated};
use super::faults::Faults;
use super::losses::{Left, Losses, Target, Tolerance};
use super::survey::Survey;
use crate::knowledge::{
    Id, IdVec, KnowledgeBase, NeedId, Properties, Relation, RelationId, Shape, Signal, SignalId, SignalSet,
    VariableId,
};
use crate::plan::Graph;
use crate::unit::Dimension;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::string::String;
use alloc::vec::Vec;
use core::cmp::Reverse;

/// Relations are tried between at most this many variables of one dimension, those with the least redundancy first.
const MOST_RELATED: usize = 16;

/// A possible addition to a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Candidate {
    /// One more signal of a variable, independent of all others; for a variable without signals the first one.
    Sensor(VariableId),
    /// An equation between two variables of the same dimension that no relation contains together yet, usable in both directions.
    /// Only people can say whether the equation holds.
    Relation(VariableId, VariableId),
    /// A relation that the model does not have yet, by its place in those given to [`analyze_with`](super::analyze_with).
    Given(usize),
}

/// The benefits of an addition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Addition {
    /// The addition.
    pub candidate: Candidate,
    /// Signals whose faults become detectable.
    pub detectable: SignalSet,
    /// Newly isolable ordered pairs: a fault of the first signal becomes isolable from one of the second.
    pub isolable_pairs: usize,
    /// Signals that become substitutable.
    pub substitutable: SignalSet,
    /// Needs that would survive more losses.
    pub survives: Vec<Survives>,
}

/// A need that would survive more losses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Survives {
    /// The need.
    pub need: NeedId,
    /// The tolerance of the present model.
    pub now: Tolerance,
    /// The tolerance with the addition.
    pub then: Tolerance,
}

impl Survives {
    fn gained(&self) -> usize {
        self.then.level().saturating_sub(self.now.level())
    }
}

impl Addition {
    /// Larger is better: first by detectable faults, then isolable pairs, then substitutable signals, then survived losses.
    fn rank(&self) -> (usize, usize, usize, usize) {
        let survived = self.survives.iter().map(Survives::gained).fold(0, usize::saturating_add);
        (self.detectable.len(), self.isolable_pairs, self.substitutable.len(), survived)
    }

    fn brings_something(&self) -> bool {
        self.rank() > (0, 0, 0, 0)
    }
}

/// The tried additions, and those that help.
#[derive(Clone, Debug, Default)]
pub(super) struct Tried {
    /// The additions that help, the best first.
    pub(super) additions: Vec<Addition>,
    pub(super) tried: usize,
    pub(super) candidates: usize,
}

/// A model with the relations that may be added to it.
#[derive(Clone, Copy)]
pub(super) struct Extensible<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) given: &'a [Relation],
}

/// Tries all candidates, the given ones first, then those of the least redundant variables, until the budget is spent.
///
/// Complexity: for each candidate, an analysis of the part of the model that is connected with it.
pub(super) fn ranked(model: Extensible<'_>, options: Options, survey: &Survey, budget: &mut Budget) -> Tried {
    let given = (0..model.given.len()).map(Candidate::Given);
    let candidates: Vec<Candidate> = given.chain(candidates(model.knowledge, survey)).collect();
    let mut tried = Tried { candidates: candidates.len(), ..Tried::default() };
    for &candidate in &candidates {
        if budget.is_spent() {
            break;
        }
        tried.tried += 1;
        tried.additions.extend(
            Some(addition(model, options, survey, candidate, budget)).filter(Addition::brings_something),
        );
    }
    // Equals keep the order in which they were tried.
    tried.additions.sort_by_key(|addition| Reverse(addition.rank()));
    tried
}

/// Sensors first, then relations; each kind by the redundancy of its variables, then in file order.
fn candidates(knowledge: &KnowledgeBase, survey: &Survey) -> Vec<Candidate> {
    let mut variables: Vec<VariableId> = knowledge
        .variables()
        .enumerate()
        .filter(|(id, variable)| variable.constant.is_none() && is_used(knowledge, *id))
        .map(|(id, _)| id)
        .collect();
    variables.sort_by_key(|&variable| redundancy(knowledge, survey, variable));
    let sensors = variables.iter().map(|&variable| Candidate::Sensor(variable));
    sensors.chain(relations(knowledge, &variables)).collect()
}

fn is_used(knowledge: &KnowledgeBase, variable: VariableId) -> bool {
    let needed = || knowledge.needs().iter().any(|need| need.variable == variable);
    let related = || knowledge.relations().iter().any(|relation| relates(relation, variable));
    !knowledge.carriers(variable).is_empty() || needed() || related()
}

fn relates(relation: &Relation, variable: VariableId) -> bool {
    relation.inputs.binary_search(&variable).is_ok() || relation.outputs.contains(&variable)
}

/// Smaller is more urgent: the losses that the variable's need survives, then those that the variable survives.
fn redundancy(knowledge: &KnowledgeBase, survey: &Survey, variable: VariableId) -> (usize, usize) {
    let of_need = |(need, tolerance): (NeedId, &Tolerance)| {
        let is_of = knowledge.needs()[need].variable == variable;
        is_of.then(|| tolerance.level())
    };
    let need = survey.needs.enumerate().filter_map(of_need).min().unwrap_or(usize::MAX);
    (need, survey.variables[variable].as_ref().map_or(0, Tolerance::level))
}

/// Pairs of scalars of one known dimension that no relation contains together.
fn relations(knowledge: &KnowledgeBase, variables: &[VariableId]) -> Vec<Candidate> {
    let mut alike: BTreeMap<Dimension, Vec<VariableId>> = BTreeMap::new();
    for &id in variables {
        let variable = &knowledge.variables()[id];
        if let (Some(unit), Shape::Scalar) = (&variable.unit, variable.shape) {
            let same = alike.entry(unit.dimension).or_default();
            if same.len() < MOST_RELATED {
                same.push(id);
            }
        }
    }
    let related: BTreeSet<(VariableId, VariableId)> =
        knowledge.relations().iter().flat_map(|relation| pairs_of(relation, &alike)).collect();
    let pair = |one: VariableId, other: VariableId| (one.min(other), one.max(other));
    let mut found = Vec::new();
    for same in alike.values() {
        for (at, &one) in same.iter().enumerate() {
            let others = same.iter().skip(at + 1).map(|&other| pair(one, other));
            found.extend(others.filter(|pair| !related.contains(pair)));
        }
    }
    found.into_iter().map(|(one, other)| Candidate::Relation(one, other)).collect()
}

/// The pairs of candidates that a relation contains, each with the smaller first.
fn pairs_of(
    relation: &Relation,
    alike: &BTreeMap<Dimension, Vec<VariableId>>,
) -> Vec<(VariableId, VariableId)> {
    let named: Vec<VariableId> =
        alike.values().flatten().copied().filter(|&variable| relates(relation, variable)).collect();
    let after = |one: VariableId| named.iter().copied().filter(move |&other| one < other);
    named.iter().flat_map(|&one| after(one).map(move |other| (one, other))).collect()
}

/// The benefits of one candidate.
fn addition(
    model: Extensible<'_>,
    options: Options,
    survey: &Survey,
    candidate: Candidate,
    budget: &mut Budget,
) -> Addition {
    let knowledge = model.knowledge;
    budget.spend(2 * (knowledge.variables().len() + knowledge.relations().len()) as u64);
    let larger = model.with(candidate);
    let ends = model.ends(candidate);
    let graph = Graph::new(&larger);
    let basis = Basis::new(&larger, options, RelationId::from_index(knowledge.relations().len()));
    let faults = faults_with(&larger, &graph, &basis, survey, &ends, budget);
    let end = SignalId::from_index(knowledge.signals().len());
    let signals = || knowledge.signals().ids();
    let isolable = |faults: &Faults| signals().map(|s| faults.isolable_among(s, end)).sum::<usize>();
    let newly = |&signal: &SignalId| faults.is_detectable(signal) && !survey.faults.is_detectable(signal);
    let (substitutable, survives) = losses_with(knowledge, &larger, &graph, &basis, survey, &ends, budget);
    Addition {
        candidate,
        detectable: signals().filter(newly).collect(),
        isolable_pairs: isolable(&faults).saturating_sub(isolable(&survey.faults)),
        substitutable,
        survives,
    }
}

/// The faults with a candidate. Comparisons are searched again only for variables whose ways can contain the candidate.
fn faults_with(
    larger: &KnowledgeBase,
    graph: &Graph,
    basis: &Basis,
    survey: &Survey,
    ends: &[VariableId],
    budget: &mut Budget,
) -> Faults {
    let is_looked_behind = |variable: VariableId| {
        !larger.is_provided(variable) || larger.variables()[variable].shape == Shape::Vector
    };
    let affected = downstream(larger, ends, is_looked_behind);
    let mut watched =
        IdVec::filled(larger.variables().len(), |variable| match affected.contains(&variable) {
            true => Watched::of(larger, graph, basis, variable, budget),
            false => survey.wanted[variable].clone(),
        });
    isolated(larger, graph, basis, &mut watched, budget);
    let comparisons = Comparisons::new(larger, gathered(larger, basis, &mut watched));
    budget.spend(comparisons.pairs().len() as u64);
    Faults::new(larger, &comparisons)
}

/// The signals that become substitutable, and the needs that survive more losses.
fn losses_with(
    knowledge: &KnowledgeBase,
    larger: &KnowledgeBase,
    graph: &Graph,
    basis: &Basis,
    survey: &Survey,
    ends: &[VariableId],
    budget: &mut Budget,
) -> (SignalSet, Vec<Survives>) {
    let affected = downstream(larger, ends, |_| true);
    let mut losses = Losses::new(larger, graph, basis);
    let mut substitutable = SignalSet::new();
    for signal in knowledge.signals().ids() {
        let variable = knowledge.signals()[signal].variable;
        if affected.contains(&variable) && !survey.is_substitutable(knowledge, signal) {
            let lost = SignalSet::from_iter([signal]);
            if let Left::Way(_) = losses.left(&Target::of_variable(variable), &lost, budget) {
                substitutable.insert(signal);
            }
        }
    }
    let mut survives = Vec::new();
    for (need, now) in survey.needs.enumerate() {
        if affected.contains(&knowledge.needs()[need].variable) {
            let then = losses.tolerance(&Target::of_need(larger, need), budget);
            survives.push(Survives { need, now: now.clone(), then });
        }
    }
    survives.retain(|survives| survives.gained() > 0);
    (substitutable, survives)
}

/// The given variables and all that can be computed from them, continued only through variables that `passes` accepts.
fn downstream(
    knowledge: &KnowledgeBase,
    from: &[VariableId],
    passes: impl Fn(VariableId) -> bool,
) -> BTreeSet<VariableId> {
    let mut readers: BTreeMap<VariableId, Vec<RelationId>> = BTreeMap::new();
    for (id, relation) in knowledge.relations().enumerate() {
        relation.inputs.iter().for_each(|&input| readers.entry(input).or_default().push(id));
    }
    let mut reached: BTreeSet<VariableId> = from.iter().copied().collect();
    let mut open = from.to_vec();
    while let Some(variable) = open.pop() {
        for &relation in readers.get(&variable).into_iter().flatten() {
            for &output in &knowledge.relations()[relation].outputs {
                if reached.insert(output) && passes(output) {
                    open.push(output);
                }
            }
        }
    }
    reached
}

impl Extensible<'_> {
    /// The variables of a candidate.
    fn ends(self, candidate: Candidate) -> Vec<VariableId> {
        match candidate {
            Candidate::Sensor(variable) => Vec::from([variable]),
            Candidate::Relation(one, other) => Vec::from([one, other]),
            Candidate::Given(place) => {
                let of = |it: &Relation| it.inputs.iter().chain(&it.outputs).copied().collect();
                self.given.get(place).map(of).unwrap_or_default()
            }
        }
    }

    /// The model with a candidate; signals keep their availability.
    fn with(self, candidate: Candidate) -> KnowledgeBase {
        let knowledge = self.knowledge;
        let (mut relations, mut signals) = (knowledge.relations().clone(), knowledge.signals().clone());
        match candidate {
            Candidate::Sensor(variable) => {
                signals.push(Signal::new(String::new(), variable));
            }
            Candidate::Relation(one, other) => {
                relations.push(relation(one, other));
            }
            Candidate::Given(place) => self.given.get(place).into_iter().for_each(|it| {
                relations.push(it.clone());
            }),
        }
        let mut larger = KnowledgeBase::from_parts(
            knowledge.variables().clone(),
            relations,
            signals,
            knowledge.needs().clone(),
        )
        .with_utility(knowledge.utility().clone());
        for signal in knowledge.signals().ids() {
            larger.set_available(signal, knowledge.is_available(signal));
        }
        larger
    }
}

fn relation(one: VariableId, other: VariableId) -> Relation {
    let ends = Vec::from([one.min(other), one.max(other)]);
    Relation {
        name: String::new(),
        inputs: ends.clone(),
        outputs: ends,
        formulas: Vec::new(),
        condition: None,
        text: String::new(),
        properties: Properties::new(),
    }
}
