//! Substitutions and ways of knowing a variable: the relations that compute it, in order, and their sources.

use crate::knowledge::{KnowledgeBase, Lineage, RelationId, SignalId, VariableId};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// A relation that produces one variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Step {
    /// The relation.
    pub relation: RelationId,
    /// The variable that the relation produces.
    pub output: VariableId,
}

/// A connected acyclic part of the knowledge base with one sink.
///
/// Each variable has at most one relation above it, and a shared variable is computed once. Without steps it is
/// the empty substitution: the variable's own signals.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Substitution {
    /// The computed variable.
    pub sink: VariableId,
    /// The steps in the order of computation: the inputs of a step are sources or outputs of earlier steps.
    pub steps: Vec<Step>,
    /// The sources, ascending: variables provided by a signal or constant.
    pub sources: Vec<VariableId>,
}

impl Substitution {
    /// Puts a choice of one relation per computed variable into the order of computation.
    ///
    /// `choice` has, for every variable to compute, the relation above it. Returns `None` when the choice is cyclic. Complexity:
    /// O(s log s) for s inputs of the chosen relations.
    #[must_use]
    pub fn from_choice(
        knowledge: &KnowledgeBase,
        sink: VariableId,
        choice: &BTreeMap<VariableId, RelationId>,
    ) -> Option<Substitution> {
        let mut order =
            Order { knowledge, choice, steps: Vec::new(), sources: BTreeSet::new(), done: BTreeSet::new() };
        order.visit(sink)?;
        Some(Substitution { sink, steps: order.steps, sources: order.sources.into_iter().collect() })
    }

    /// Whether the substitution goes on from the last value of its own sink, as dead reckoning does: it has nothing new about
    /// the sink, so it is no witness, and it serves only where no other source can.
    #[must_use]
    pub fn continues_itself(&self, knowledge: &KnowledgeBase) -> bool {
        let sink = self.sink.symbol();
        let refers_to_sink = |step: &Step| {
            let formula = knowledge.relations()[step.relation].formula(step.output);
            formula.is_some_and(|formula| formula.previous_symbols().contains(&sink))
        };
        self.steps.iter().any(refers_to_sink)
    }

    /// The relations of the steps, ascending.
    #[must_use]
    pub fn relations(&self) -> Vec<RelationId> {
        let mut relations: Vec<_> = self.steps.iter().map(|step| step.relation).collect();
        relations.sort_unstable();
        relations.dedup();
        relations
    }

    /// All variables, ascending: the sink, the computed variables, and the sources.
    #[must_use]
    pub fn variables(&self) -> Vec<VariableId> {
        let computed = self.steps.iter().map(|step| step.output);
        let mut variables: Vec<_> = computed.chain(self.sources.iter().copied()).collect();
        variables.push(self.sink);
        variables.sort_unstable();
        variables.dedup();
        variables
    }
}

/// A substitution with one signal chosen for each of its sources: one way of knowing a variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Way {
    /// The substitution.
    pub substitution: Substitution,
    /// The signal of each source, in their order; `None` for a constant.
    pub signals: Vec<Option<SignalId>>,
}

impl Way {
    /// All choices of one usable signal for each source, at most `most`: the best rated signals first, as they give the utility
    /// of the substitution, then in file order.
    #[must_use]
    pub fn choices(
        knowledge: &KnowledgeBase,
        substitution: &Substitution,
        usable: impl Fn(SignalId) -> bool,
        most: usize,
    ) -> Vec<Way> {
        Way::each_choice(knowledge, substitution, usable).take(most).collect()
    }

    /// As [`Way::choices`], one after the other.
    pub fn each_choice(
        knowledge: &KnowledgeBase,
        substitution: &Substitution,
        usable: impl Fn(SignalId) -> bool,
    ) -> impl Iterator<Item = Way> {
        Choices::new(knowledge, substitution, usable)
    }

    /// The signals that the way reads.
    pub fn inputs(&self) -> impl Iterator<Item = SignalId> + '_ {
        self.signals.iter().copied().flatten()
    }

    /// The signal, when the way is a signal alone.
    #[must_use]
    pub fn direct(&self) -> Option<SignalId> {
        match (self.substitution.steps.is_empty(), self.signals.as_slice()) {
            (true, [Some(signal)]) => Some(*signal),
            _ => None,
        }
    }

    /// The same way in the knowledge base that replaces its own; `None` when an element of it is gone, or the meaning of a signal
    /// has changed. The formulas of relations are not compared.
    #[must_use]
    pub fn succeeded(&self, lineage: &Lineage) -> Option<Way> {
        let Substitution { sink, steps, sources } = &self.substitution;
        let step = |step: &Step| {
            let (relation, output) = (lineage.relation(step.relation)?, lineage.variable(step.output)?);
            Some(Step { relation, output })
        };
        let source = |(&variable, signal): (&VariableId, &Option<SignalId>)| {
            let signal = match signal {
                Some(signal) => Some(lineage.signal(*signal)?),
                None => None,
            };
            Some((lineage.variable(variable)?, signal))
        };
        let mut pairs = sources.iter().zip(&self.signals).map(source).collect::<Option<Vec<_>>>()?;
        pairs.sort_unstable();
        let (sources, signals) = pairs.into_iter().unzip();
        let (sink, steps) = (lineage.variable(*sink)?, steps.iter().map(step).collect::<Option<_>>()?);
        Some(Way { substitution: Substitution { sink, steps, sources }, signals })
    }

    /// The way in words: its signals and relations, such as `/a, /b by r1`; without both, the variable's range.
    #[must_use]
    pub fn describe(&self, knowledge: &KnowledgeBase) -> String {
        let signals: Vec<&str> =
            self.inputs().map(|signal| knowledge.signals()[signal].name.as_str()).collect();
        let relations: Vec<&str> = self
            .substitution
            .steps
            .iter()
            .map(|step| knowledge.relations()[step.relation].name.as_str())
            .collect();
        match (signals.is_empty(), relations.is_empty()) {
            (true, true) => format!("the range of {}", knowledge.variables()[self.substitution.sink].name),
            (false, true) => signals.join(", "),
            (true, false) => relations.join(", "),
            (false, false) => format!("{} by {}", signals.join(", "), relations.join(", ")),
        }
    }
}

/// The choices of one signal for each source, the last source's first.
struct Choices<'s> {
    substitution: &'s Substitution,
    /// The signals of all sources, one source after the other.
    signals: Vec<SignalId>,
    /// For each source its first signal, the end of its signals, and the next choice; `None` for a constant.
    places: Vec<Option<(usize, usize, usize)>>,
    has_more: bool,
}

impl<'s> Choices<'s> {
    fn new(
        knowledge: &KnowledgeBase,
        substitution: &'s Substitution,
        usable: impl Fn(SignalId) -> bool,
    ) -> Choices<'s> {
        let count = substitution.sources.len();
        let (mut signals, mut places) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for &source in &substitution.sources {
            if knowledge.variables()[source].constant.is_some() {
                places.push(None);
                continue;
            }
            let start = signals.len();
            signals.extend(knowledge.carriers(source).iter().copied().filter(|&signal| usable(signal)));
            if let Some(own @ [_, _, ..]) = signals.get_mut(start..) {
                knowledge.utility().sort_signals(knowledge, own);
            }
            places.push(Some((start, signals.len(), start)));
        }
        let has_more = places.iter().flatten().all(|(start, end, _)| start < end);
        Choices { substitution, signals, places, has_more }
    }
}

impl Iterator for Choices<'_> {
    type Item = Way;

    fn next(&mut self) -> Option<Way> {
        if !self.has_more {
            return None;
        }
        let chosen =
            |place: &Option<(usize, usize, usize)>| place.and_then(|(.., at)| self.signals.get(at).copied());
        let signals = self.places.iter().map(chosen).collect();
        self.has_more = false;
        for (start, end, at) in self.places.iter_mut().flatten().rev() {
            *at += 1;
            if at < end {
                self.has_more = true;
                break;
            }
            *at = *start;
        }
        Some(Way { substitution: self.substitution.clone(), signals })
    }
}

/// A depth-first walk that lists a step after those that it reads; with an explicit stack, as chains may be long.
struct Order<'a> {
    knowledge: &'a KnowledgeBase,
    choice: &'a BTreeMap<VariableId, RelationId>,
    steps: Vec<Step>,
    sources: BTreeSet<VariableId>,
    done: BTreeSet<VariableId>,
}

enum Visit {
    Enter(VariableId),
    Leave(Step),
}

impl Order<'_> {
    fn visit(&mut self, sink: VariableId) -> Option<()> {
        let mut open = BTreeSet::new();
        let mut stack = Vec::from([Visit::Enter(sink)]);
        while let Some(visit) = stack.pop() {
            match visit {
                Visit::Enter(variable) if self.done.contains(&variable) => {}
                Visit::Enter(variable) => match self.choice.get(&variable) {
                    None => {
                        self.sources.insert(variable);
                        self.done.insert(variable);
                    }
                    Some(&relation) => {
                        if !open.insert(variable) {
                            return None;
                        }
                        let step = Step { relation, output: variable };
                        stack.push(Visit::Leave(step));
                        self.enter_inputs(step, &mut stack);
                    }
                },
                Visit::Leave(step) => {
                    open.remove(&step.output);
                    self.done.insert(step.output);
                    self.steps.push(step);
                }
            }
        }
        Some(())
    }

    fn enter_inputs(&self, step: Step, stack: &mut Vec<Visit>) {
        let Some(relation) = self.knowledge.relations().find(step.relation) else { return };
        let first = stack.len();
        stack.extend(relation.needs(step.output).map(Visit::Enter));
        if let Some(inputs) = stack.get_mut(first..) {
            inputs.reverse();
        }
    }
}
