//! The content of a drawing of a knowledge base, for every format: the links and the texts of the elements.

use super::number::number;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    Id, IdVec, KnowledgeBase, Need, Properties, Relation, RelationId, Signal, SignalId, SignalSet, Variable,
    VariableId,
};
use shsa_core::substitution::Substitution;
use shsa_core::unit::Unit;
use std::collections::{BTreeMap, BTreeSet};

/// The highlighted elements of a drawing of a knowledge base.
#[derive(Clone, Debug, Default)]
pub struct Marks {
    /// The chosen substitution; its relations are numbered in the order of computation.
    pub chosen: Option<Substitution>,
    /// Signals that are lost, in addition to the unavailable ones of the knowledge base.
    pub lost: SignalSet,
}

/// A knowledge base as a graph of variables and relations.
pub(super) struct Graph<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    marks: &'a Marks,
    needs: IdVec<VariableId, Vec<&'a Need>>,
    /// For each relation that the chosen substitution uses, its steps: their numbers, from 1, and the computed variables.
    steps: BTreeMap<RelationId, Vec<(usize, VariableId)>>,
    /// The variables of the chosen substitution.
    chosen: BTreeSet<VariableId>,
}

/// A variable that takes part in a relation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Link {
    pub(super) variable: VariableId,
    pub(super) relation: RelationId,
    /// Whether the relation can produce the variable.
    pub(super) makes: bool,
    /// Whether the relation can read the variable.
    pub(super) reads: bool,
    /// The direction in which the chosen substitution uses the link.
    pub(super) chosen: Option<Direction>,
    /// The direction in which the link is drawn.
    pub(super) flow: Direction,
}

/// A direction along a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    /// From the variable into the relation.
    Read,
    /// From the relation to the variable.
    Make,
}

impl<'a> Graph<'a> {
    pub(super) fn new(knowledge: &'a KnowledgeBase, marks: &'a Marks) -> Graph<'a> {
        let mut needs = IdVec::filled(knowledge.variables().len(), |_| Vec::new());
        knowledge.needs().iter().for_each(|need| needs[need.variable].push(need));
        let mut steps: BTreeMap<RelationId, Vec<(usize, VariableId)>> = BTreeMap::new();
        for (step, number) in marks.chosen.iter().flat_map(|chosen| &chosen.steps).zip(1..) {
            steps.entry(step.relation).or_default().push((number, step.output));
        }
        let chosen = marks.chosen.iter().flat_map(Substitution::variables).collect();
        Graph { knowledge, marks, needs, steps, chosen }
    }

    /// Every link once, relations in file order, their variables ascending.
    pub(super) fn links(&self) -> Vec<Link> {
        let relations = self.knowledge.relations().enumerate();
        relations.flat_map(|(id, relation)| self.links_of(id, relation)).collect()
    }

    fn links_of(&self, id: RelationId, relation: &Relation) -> Vec<Link> {
        let mut variables: Vec<VariableId> =
            relation.inputs.iter().chain(&relation.outputs).copied().collect();
        variables.sort_unstable();
        variables.dedup();
        let outputs = self.chosen_outputs(id);
        let main = outputs.first().copied().or_else(|| self.main_output(relation));
        let link = |variable: VariableId| {
            let makes = relation.outputs.contains(&variable);
            let is_other = |output: &VariableId| *output != variable;
            let reads = relation.inputs.contains(&variable) && relation.outputs.iter().any(is_other);
            let flow = if Some(variable) == main || !reads { Direction::Make } else { Direction::Read };
            let chosen = match outputs.contains(&variable) {
                true => Some(Direction::Make),
                false => (reads && !outputs.is_empty()).then_some(Direction::Read),
            };
            Link { variable, relation: id, makes, reads, chosen, flow: chosen.unwrap_or(flow) }
        };
        variables.into_iter().map(link).collect()
    }

    /// The output for which a relation with several directions is drawn: the left side of its equation, else an output that is
    /// not provided, else a needed one, else the first.
    fn main_output(&self, relation: &Relation) -> Option<VariableId> {
        let variables = self.knowledge.variables();
        let left_side = relation.text.split('=').next().unwrap_or_default().trim();
        let rank = |&&output: &&VariableId| {
            (
                variables[output].name != left_side,
                self.is_provided(output),
                self.needs(output).is_empty(),
                output,
            )
        };
        relation.outputs.iter().min_by_key(rank).copied()
    }

    fn chosen_outputs(&self, relation: RelationId) -> Vec<VariableId> {
        self.steps.get(&relation).into_iter().flatten().map(|&(_, output)| output).collect()
    }

    /// The places of a relation in the chosen order of computation, from 1, such as `2`; `None` when it is not
    /// chosen.
    pub(super) fn numbers(&self, relation: RelationId) -> Option<String> {
        let numbers = self.steps.get(&relation)?.iter().map(|(number, _)| number.to_string());
        Some(numbers.collect::<Vec<String>>().join(","))
    }

    /// Whether a variable takes part in the chosen substitution.
    pub(super) fn is_chosen(&self, variable: VariableId) -> bool {
        self.chosen.contains(&variable)
    }

    /// Whether the chosen substitution can start from a signal.
    pub(super) fn is_source(&self, signal: SignalId) -> bool {
        let variable = self.knowledge.signals()[signal].variable;
        let starts = |chosen: &Substitution| chosen.sources.contains(&variable);
        !self.is_lost(signal) && self.marks.chosen.as_ref().is_some_and(starts)
    }

    pub(super) fn is_lost(&self, signal: SignalId) -> bool {
        self.marks.lost.contains(signal) || !self.knowledge.is_available(signal)
    }

    /// Whether a variable is known without a relation.
    pub(super) fn is_provided(&self, variable: VariableId) -> bool {
        self.knowledge.variables()[variable].constant.is_some()
            || self.knowledge.carriers(variable).iter().any(|&signal| !self.is_lost(signal))
    }

    /// The needs of a variable.
    pub(super) fn needs(&self, variable: VariableId) -> &[&'a Need] {
        &self.needs[variable]
    }

    /// The description of a variable, in a few lines.
    pub(super) fn variable_description(&self, id: VariableId) -> String {
        let variable = &self.knowledge.variables()[id];
        let signals: Vec<&str> =
            self.knowledge.carriers(id).iter().map(|&signal| self.name(signal)).collect();
        let needs: Vec<&str> = self.needs(id).iter().map(|need| &*need.signal).collect();
        lines([
            Some(format!("variable {}", variable.name)),
            variable.unit.as_ref().map(|unit| format!("unit: {unit}")),
            constant(variable).map(|value| format!("constant: {value}")),
            variable.range.map(|range| format!("range: {}", interval(range, variable.unit.as_ref()))),
            (!signals.is_empty()).then(|| format!("signals: {}", signals.join(", "))),
            (!needs.is_empty()).then(|| format!("needed as: {}", needs.join(", "))),
            properties(&variable.properties),
        ])
    }

    /// The description of a relation, in a few lines.
    pub(super) fn relation_description(&self, id: RelationId) -> String {
        let relation = &self.knowledge.relations()[id];
        let outputs: Vec<&str> =
            relation.outputs.iter().map(|&output| &*self.knowledge.variables()[output].name).collect();
        let structure_only = relation.formulas.is_empty();
        lines([
            Some(format!("relation {}", relation.name)),
            (!relation.text.is_empty()).then(|| relation.text.clone()),
            structure_only.then(|| "structure only: can be planned, not run".to_owned()),
            Some(format!("gives: {}", outputs.join(", "))),
            relation.condition.is_some().then(|| "holds under a condition only".to_owned()),
            self.numbers(id).map(|numbers| format!("chosen: step {numbers}")),
            properties(&relation.properties),
        ])
    }

    /// The description of a signal, in a few lines.
    pub(super) fn signal_description(&self, id: SignalId) -> String {
        let signal = &self.knowledge.signals()[id];
        let derived: Vec<&str> = signal.derived_from.iter().map(|&from| self.name(from)).collect();
        lines([
            Some(format!("signal {}", signal.name)),
            self.is_lost(id).then(|| "lost".to_owned()),
            (!signal.source.is_empty()).then(|| format!("source: {}", signal.source)),
            signal.rate_hz.map(|rate| format!("rate: {} Hz", number(rate))),
            error_description(signal),
            (!derived.is_empty()).then(|| format!("derived from: {}", derived.join(", "))),
            properties(&signal.properties),
        ])
    }

    /// The description of the whole in one or two sentences.
    pub(super) fn description(&self) -> String {
        let knowledge = self.knowledge;
        let counts = [
            (knowledge.variables().len(), "variable"),
            (knowledge.relations().len(), "relation"),
            (knowledge.signals().len(), "signal"),
            (knowledge.needs().len(), "need"),
        ];
        let counted =
            counts.map(|(count, what)| format!("{count} {what}{}", if count == 1 { "" } else { "s" }));
        let mut description = format!("Knowledge base with {}.", counted.join(", "));
        if let Some(chosen) = &self.marks.chosen {
            let steps = chosen.steps.iter().map(|step| &*knowledge.relations()[step.relation].name);
            let steps: Vec<&str> = steps.collect();
            let by = if steps.is_empty() { "its own signals" } else { &steps.join(", ") };
            description += &format!(" Chosen: {} by {by}.", knowledge.variables()[chosen.sink].name);
        }
        let lost: Vec<&str> = knowledge
            .signals()
            .ids()
            .filter(|&signal| self.is_lost(signal))
            .map(|signal| self.name(signal))
            .collect();
        if !lost.is_empty() {
            description += &format!(" Lost: {}.", lost.join(", "));
        }
        description
    }

    fn name(&self, signal: SignalId) -> &'a str {
        &self.knowledge.signals()[signal].name
    }

    /// The number of a variable among all nodes; variables come first.
    pub(super) fn variable_node(&self, variable: VariableId) -> usize {
        variable.index()
    }

    /// The number of a relation among all nodes; relations come after all variables.
    pub(super) fn relation_node(&self, relation: RelationId) -> usize {
        self.knowledge.variables().len() + relation.index()
    }
}

/// The value of a constant with its unit.
pub(super) fn constant(variable: &Variable) -> Option<String> {
    variable.constant.map(|value| interval(value, variable.unit.as_ref()))
}

/// A number when the interval is narrow enough, else its bounds.
fn interval(value: Interval, unit: Option<&Unit>) -> String {
    let shown = |si: f64| number(unit.map_or(si, |unit| unit.from_si(si)));
    let unit = unit.map(|unit| format!(" {unit}")).unwrap_or_default();
    let (lo, hi) = (shown(value.lo()), shown(value.hi()));
    if lo == hi { format!("{lo}{unit}") } else { format!("[{lo}, {hi}]{unit}") }
}

fn error_description(signal: &Signal) -> Option<String> {
    let error = signal.value_error;
    let size = |si: f64| number(signal.unit.as_ref().map_or(si, |unit| si / unit.scale));
    let unit = signal.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
    let absolute = match (error.lo, error.hi) {
        (0.0, 0.0) => None,
        (lo, hi) if lo == -hi => Some(format!("±{}{unit}", size(hi))),
        (lo, hi) => Some(format!("{} to {}{unit}", size(lo), size(hi))),
    };
    let relative = (error.relative != 0.0).then(|| format!("±{} %", number(error.relative * 100.0)));
    let parts: Vec<String> = absolute.into_iter().chain(relative).collect();
    (!parts.is_empty()).then(|| format!("error: {}", parts.join(" and ")))
}

fn properties(properties: &Properties) -> Option<String> {
    let description: Vec<String> =
        properties.iter().map(|(name, value)| format!("{name} {}", number(*value))).collect();
    (!description.is_empty()).then(|| description.join(", "))
}

fn lines<const N: usize>(lines: [Option<String>; N]) -> String {
    lines.into_iter().flatten().collect::<Vec<String>>().join("\n")
}
