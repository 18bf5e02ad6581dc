//! A knowledge base prepared for searches: flat arrays, built once, and a view without forbidden elements.

mod lasting;
mod update;
mod appraisal;

pub use appraisal::Appraisal;

use super::utility::{Scale, Weight};
use crate::knowledge::{
    ACCURACY, IdVec, Inputs, KnowledgeBase, Numbers, RelationId, Rows, Shape, SignalId, Utility, VariableId,
};
use crate::substitution::{Step, Substitution};
use alloc::vec::Vec;

/// The facts about a variable that searches use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Status {
    /// Whether the variable is known without a relation.
    pub(super) provided: bool,
    /// The variable's own property, else the best of its usable signals.
    pub(super) accuracy: Option<f64>,
    /// The weight of using the variable as it is provided: the smallest of its usable signals.
    pub(super) weight: Weight,
}

#[derive(Clone, Debug)]
struct VariableFacts {
    constant: bool,
    own_accuracy: Option<f64>,
    status: Status,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Carrier {
    signal: SignalId,
    available: bool,
    accuracy: Option<f64>,
    weight: Weight,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RelationFacts {
    /// Whether the relation can produce several variables.
    pub(super) several_outputs: bool,
    /// Whether the relation can be used only once in a substitution: each of its outputs needs all the others.
    pub(super) exclusive: bool,
}

/// A relation that can produce a variable, with the facts that a walk needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Producer {
    pub(super) relation: RelationId,
    /// The bounds of its inputs.
    inputs: (u32, u32),
    pub(super) facts: RelationFacts,
    /// The weight with the available signals of the knowledge base.
    pub(super) weight: Weight,
}

/// The structure of a knowledge base and the weights of its relations, prepared for searches.
///
/// A graph holds the availability of signals at the time of its making: [`Graph::version`] tells whether that is current.
#[derive(Clone, Debug)]
pub struct Graph {
    version: u64,
    monotone: bool,
    utility: Utility,
    variables: IdVec<VariableId, VariableFacts>,
    /// The most requested part of each variable's status.
    provided: IdVec<VariableId, bool>,
    relations: IdVec<RelationId, RelationFacts>,
    /// The numbers that ratings of relations read: those of each relation, and of each variable as an output.
    numbers: Rows<RelationId, f64>,
    output_numbers: Rows<VariableId, f64>,
    carried: IdVec<SignalId, VariableId>,
    carriers: Rows<VariableId, Carrier>,
    producers: Rows<VariableId, Producer>,
    inputs: Rows<RelationId, VariableId>,
    /// The relations that read each variable, ascending.
    readers: Rows<VariableId, RelationId>,
    /// The vectors that relations compute, ascending.
    computed_vectors: Vec<VariableId>,
}

impl Graph {
    /// Prepares a knowledge base. Complexity: O(model).
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Graph {
        let mut graph = Graph {
            version: knowledge.version(),
            monotone: knowledge.utility().check(knowledge).is_empty(),
            utility: knowledge.utility().clone(),
            variables: IdVec::new(),
            provided: IdVec::new(),
            relations: IdVec::new(),
            numbers: Rows::default(),
            output_numbers: Rows::default(),
            carried: IdVec::new(),
            carriers: Rows::default(),
            producers: Rows::default(),
            inputs: Rows::default(),
            readers: update::readers(knowledge),
            computed_vectors: computed_vectors(knowledge),
        };
        graph.add_variables(knowledge);
        graph.add_relations(knowledge);
        graph.add_producers(knowledge);
        graph
    }

    /// The version of the knowledge base that the graph was made from.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Whether additional relations never raise the utility; searches refuse a graph for which this does not hold.
    #[must_use]
    pub fn is_monotone(&self) -> bool {
        self.monotone
    }

    /// The vectors that relations compute, ascending.
    pub(crate) fn computed_vectors(&self) -> &[VariableId] {
        &self.computed_vectors
    }

    /// The number of variables.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.variables.len()
    }

    /// The number of relations.
    #[must_use]
    pub fn relations(&self) -> usize {
        self.relations.len()
    }

    /// The number of signals.
    pub(super) fn signals(&self) -> usize {
        self.carried.len()
    }

    /// How weights are joined.
    pub(super) fn scale(&self) -> Scale {
        Scale(self.utility.aggregate())
    }

    /// Whether using a provided variable has a weight.
    pub(super) fn rates_signals(&self) -> bool {
        self.utility.rates_signals()
    }

    fn add_variables(&mut self, knowledge: &KnowledgeBase) {
        let scale = self.scale();
        for (_, signal) in knowledge.signals().enumerate() {
            self.carried.push(signal.variable);
        }
        for (id, variable) in knowledge.variables().enumerate() {
            let carrier = |&signal: &SignalId| Carrier {
                signal,
                available: knowledge.is_available(signal),
                accuracy: knowledge.signals()[signal].properties.get(ACCURACY).copied(),
                weight: scale.signal(self.utility.of_signal(knowledge, signal)),
            };
            self.carriers.push(knowledge.carriers(id).iter().map(carrier));
            let mut facts = VariableFacts {
                constant: variable.constant.is_some(),
                own_accuracy: variable.properties.get(ACCURACY).copied(),
                status: Status { provided: false, accuracy: None, weight: Weight::ZERO },
            };
            facts.status = status(&facts, self.carriers.row(id), &[]);
            self.provided.push(facts.status.provided);
            self.output_numbers.push(self.utility.numbers_of_output(&variable.properties).into_iter());
            self.variables.push(facts);
        }
    }

    fn add_relations(&mut self, knowledge: &KnowledgeBase) {
        for relation in knowledge.relations() {
            self.inputs.push(relation.inputs.iter().copied());
            self.numbers.push(self.utility.numbers_of(&relation.properties).into_iter());
            self.relations.push(RelationFacts {
                several_outputs: relation.outputs.len() > 1,
                exclusive: relation.outputs.iter().all(|output| relation.inputs.contains(output)),
            });
        }
    }

    fn add_producers(&mut self, knowledge: &KnowledgeBase) {
        let mut all = Rows::default();
        for variable in knowledge.variables().ids() {
            // A relation that names an output twice is listed twice in a row.
            let mut last = None;
            let relations = knowledge.producers(variable).iter().copied();
            all.push(relations.filter(|&relation| last.replace(relation) != Some(relation)).map(
                |relation| {
                    let weight = self.weight(relation, variable, |input| self.variables[input].status);
                    let inputs = self.inputs.bounds(relation);
                    Producer { relation, inputs, facts: self.relations[relation], weight }
                },
            ));
        }
        self.producers = all;
    }

    fn weight(
        &self,
        relation: RelationId,
        output: VariableId,
        status: impl Fn(VariableId) -> Status,
    ) -> Weight {
        let mut inputs = Inputs { count: 0.0, unprovided: 0.0, accuracy: 1.0 };
        for &input in self.inputs.row(relation).iter().filter(|&&input| input != output) {
            let status = status(input);
            inputs.count += 1.0;
            inputs.unprovided += if status.provided { 0.0 } else { 1.0 };
            inputs.accuracy *= status.accuracy.unwrap_or(1.0);
        }
        let numbers =
            Numbers { relation: self.numbers.row(relation), output: self.output_numbers.row(output) };
        self.scale().relation(self.utility.of_relation(numbers, &inputs))
    }

    /// The substitution of steps in their order of computation.
    pub(super) fn substitution(&self, sink: VariableId, steps: Vec<Step>) -> Substitution {
        let mut outputs: Vec<VariableId> = steps.iter().map(|step| step.output).collect();
        outputs.sort_unstable();
        let mut sources =
            if steps.is_empty() { Vec::from([sink]) } else { Vec::with_capacity(2 * steps.len()) };
        for step in &steps {
            let inputs = self.inputs(step.relation).iter().copied();
            sources.extend(
                inputs.filter(|input| *input != step.output && outputs.binary_search(input).is_err()),
            );
        }
        sources.sort_unstable();
        sources.dedup();
        Substitution { sink, steps, sources }
    }

    /// The variable of a signal; `None` for a signal of another knowledge base.
    pub(super) fn carried(&self, signal: SignalId) -> Option<VariableId> {
        self.carried.find(signal).copied()
    }

    /// The available signals of a variable, ascending.
    pub(super) fn usable_carriers(&self, variable: VariableId) -> impl Iterator<Item = SignalId> + '_ {
        self.carriers.row(variable).iter().filter(|carrier| carrier.available).map(|carrier| carrier.signal)
    }

    /// All inputs of a relation, ascending, for whichever output.
    pub(super) fn inputs(&self, relation: RelationId) -> &[VariableId] {
        self.inputs.row(relation)
    }

    /// As [`Graph::inputs`], for a relation whose bounds are known.
    pub(super) fn inputs_of(&self, producer: &Producer) -> &[VariableId] {
        self.inputs.between(producer.inputs)
    }

    /// Whether a relation can produce several variables.
    pub(super) fn has_several_outputs(&self, relation: RelationId) -> bool {
        self.relations[relation].several_outputs
    }

    /// Whether a relation can be used only once in a substitution: each of its outputs needs all the others.
    pub(super) fn is_exclusive(&self, relation: RelationId) -> bool {
        self.relations[relation].exclusive
    }
}

fn status(facts: &VariableFacts, carriers: &[Carrier], forbidden: &[SignalId]) -> Status {
    let usable = || carriers.iter().filter(|c| c.available && forbidden.binary_search(&c.signal).is_err());
    let best = || usable().filter_map(|carrier| carrier.accuracy).reduce(f64::max);
    let lightest = usable().map(|carrier| carrier.weight).min();
    Status {
        provided: facts.constant || lightest.is_some(),
        accuracy: facts.own_accuracy.or_else(best),
        weight: lightest.filter(|_| !facts.constant).unwrap_or_default(),
    }
}

/// The options of a search, beside the variable.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Whether provided variables may be substituted, too; otherwise they are always used as provided.
    pub substitute_provided: bool,
    /// Whether to leave out the empty substitution, the root's own signals.
    pub without_empty: bool,
    /// Signals that must not be used, in any order.
    pub forbidden_signals: Vec<SignalId>,
    /// Relations that must not be used, in any order.
    pub forbidden_relations: Vec<RelationId>,
}

/// A graph without forbidden elements. Making one costs nothing in the size of the graph.
#[derive(Clone, Debug)]
pub(super) struct View<'a> {
    graph: &'a Graph,
    /// The variables that the forbidden signals carry, ascending, with their status without them.
    changed: Vec<(VariableId, Status)>,
    forbidden: Vec<RelationId>,
}

impl<'a> View<'a> {
    pub(super) fn new(graph: &'a Graph, options: &Options) -> View<'a> {
        let forbidden = sorted(&options.forbidden_relations);
        if options.forbidden_signals.is_empty() {
            return View { graph, changed: Vec::new(), forbidden };
        }
        let signals = sorted(&options.forbidden_signals);
        let carried: Vec<_> = signals.iter().filter_map(|&s| graph.carried.find(s).copied()).collect();
        let without =
            |variable| (variable, status(&graph.variables[variable], graph.carriers.row(variable), &signals));
        let changed = sorted(&carried).into_iter().map(without).collect();
        View { graph, changed, forbidden }
    }

    pub(super) fn graph(&self) -> &'a Graph {
        self.graph
    }

    fn change(&self, variable: VariableId) -> Option<Status> {
        let at = self.changed.binary_search_by_key(&variable, |&(changed, _)| changed).ok()?;
        self.changed.get(at).map(|&(_, status)| status)
    }

    /// Whether a variable is known without a relation.
    pub(super) fn is_provided(&self, variable: VariableId) -> bool {
        match self.changed.is_empty() {
            true => self.graph.provided[variable],
            false => self.status(variable).provided,
        }
    }

    pub(super) fn status(&self, variable: VariableId) -> Status {
        self.change(variable).unwrap_or_else(|| self.graph.variables[variable].status)
    }

    /// The relations that may produce a variable, ascending.
    pub(super) fn producers(&self, variable: VariableId) -> impl Iterator<Item = &'a Producer> + '_ {
        let allowed = |producer: &&Producer| {
            self.forbidden.is_empty() || self.forbidden.binary_search(&producer.relation).is_err()
        };
        self.graph.producers.row(variable).iter().filter(allowed)
    }

    /// The weight of a relation for an output, without the forbidden signals.
    #[inline]
    pub(super) fn weight(&self, producer: &Producer, output: VariableId) -> Weight {
        if self.changed.is_empty() { producer.weight } else { self.changed_weight(producer, output) }
    }

    fn changed_weight(&self, producer: &Producer, output: VariableId) -> Weight {
        let is_changed = |&input: &VariableId| self.change(input).is_some();
        if !self.graph.inputs_of(producer).iter().any(is_changed) {
            return producer.weight;
        }
        self.graph.weight(producer.relation, output, |input| self.status(input))
    }
}

/// The vectors that relations compute, ascending. Complexity: O(variables).
fn computed_vectors(knowledge: &KnowledgeBase) -> Vec<VariableId> {
    let is_computed = |id: &VariableId| {
        knowledge.variables()[*id].shape == Shape::Vector && !knowledge.producers(*id).is_empty()
    };
    knowledge.variables().ids().filter(is_computed).collect()
}

fn sorted<T: Copy + Ord>(items: &[T]) -> Vec<T> {
    if items.is_empty() {
        return Vec::new();
    }
    let mut items = items.to_vec();
    items.sort_unstable();
    items.dedup();
    items
}
