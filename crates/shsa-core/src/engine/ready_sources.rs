//! The sources of each need after the loss of any one signal, prepared before the loss.

use super::ways::{Lost, Source, admitted_ways, preparation, ways, ways_of};
use crate::assurance::Search;
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, Need, NeedId, SignalId, VariableId};
use crate::plan::{Contingency, Graph, Plan, Requirements, Shortfall, StopReason};
use crate::substitution::Way;
use alloc::collections::BTreeMap;
use alloc::sync::Arc;
use alloc::vec::Vec;

/// At most this many substitutions are prepared for all needs together: some tens of megabytes.
const MOST_READY: usize = 100_000;

/// The sources of all needs with nothing lost and after single losses, within counted bounds. Other cases, such as several losses
/// that each matter, are searched for on demand.
#[derive(Debug, Default)]
pub(super) struct ReadySources {
    table: Contingency,
    demands: IdVec<NeedId, Demands>,
    ready: IdVec<NeedId, BTreeMap<Vec<SignalId>, Arc<[Source]>>>,
}

impl ReadySources {
    /// Prepares the sources.
    pub(super) fn new(knowledge: &KnowledgeBase, graph: &Graph) -> ReadySources {
        ReadySources::of(
            knowledge,
            graph,
            Contingency::new(knowledge, graph, needed(knowledge), preparation()),
        )
    }

    /// As [`ReadySources::new`], from the sources of the knowledge base before, whose graph was `before`.
    pub(super) fn carried_over(
        self,
        before: &Graph,
        lineage: &Lineage,
        knowledge: &KnowledgeBase,
        graph: &Graph,
    ) -> ReadySources {
        let table = self.table.carried_over(before, lineage, knowledge, graph, needed(knowledge));
        ReadySources::of(knowledge, graph, table)
    }

    /// Prepares the sources from the plans of a table.
    fn of(knowledge: &KnowledgeBase, graph: &Graph, table: Contingency) -> ReadySources {
        let ready = IdVec::filled(knowledge.needs().len(), |_| BTreeMap::new());
        let demands = IdVec::filled(knowledge.needs().len(), |need| Demands::of(knowledge, need));
        let mut ready_sources = ReadySources { table, demands, ready };
        let mut left = MOST_READY;
        for need in knowledge.needs().ids() {
            let ready = ready_sources.of_need(knowledge, graph, need, &mut left);
            ready_sources.ready[need] = ready;
        }
        ready_sources
    }

    fn of_need(
        &self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        need: NeedId,
        left: &mut usize,
    ) -> BTreeMap<Vec<SignalId>, Arc<[Source]>> {
        let mut ready: BTreeMap<Vec<SignalId>, Arc<[Source]>> = BTreeMap::new();
        if !self.demands[need].barred.relations.is_empty() {
            // The plans of the table use these relations.
            return ready;
        }
        let mut losses = self.table.losses(knowledge.needs()[need].variable);
        let Some((&[], with_all)) = losses.next() else { return ready };
        let with_all_ready: Arc<[Source]> = self.planned(knowledge, graph, need, with_all, &[]).into();
        ready.insert(Vec::new(), with_all_ready.clone());
        for (lost, plan) in losses {
            if *left == 0 {
                break;
            }
            let sources = match core::ptr::eq(plan, with_all) && !starts_from(knowledge, plan, lost) {
                true => with_all_ready.clone(),
                false => {
                    *left = left.saturating_sub(1 + plan.substitutions.len());
                    self.planned(knowledge, graph, need, plan, lost).into()
                }
            };
            ready.insert(lost.to_vec(), sources);
        }
        ready
    }

    /// The ways of a plan of the table that meet the need's demands; where the table may lack some, the ways that a search finds.
    fn planned(
        &self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        need: NeedId,
        plan: &Plan,
        lost: &[SignalId],
    ) -> Vec<Source> {
        let Need { variable, .. } = knowledge.needs()[need];
        let demands = &self.demands[need].requirements;
        let meets = |way: &Way| demands.shortfalls_of_way(knowledge, way).is_empty();
        let sources = ways_of(knowledge, graph, plan, lost, meets);
        let may_be_more = plan.stop != StopReason::Complete && {
            let anything = ways_of(knowledge, graph, plan, lost, |_| true);
            anything.len() > sources.len()
        };
        match may_be_more {
            true => {
                let lost = Lost { signals: lost.to_vec(), relations: Vec::new() };
                ways(knowledge, graph, variable, &lost, demands)
            }
            false => sources,
        }
    }

    /// The sources that meet the demands of a need without the lost elements, best first.
    pub(super) fn sources(
        &self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        need: NeedId,
        lost: &Lost,
    ) -> Arc<[Source]> {
        let variable = knowledge.needs()[need].variable;
        let Demands { requirements, barred } = &self.demands[need];
        let lost = lost.with(barred);
        let is_current = self.table.version() == knowledge.version();
        let is_ready = is_current && lost.relations.is_empty();
        let loss = self.table.loss(variable, &lost.signals).filter(|_| is_ready);
        let ready = loss.and_then(|loss| self.ready[need].get(loss));
        ready.cloned().unwrap_or_else(|| ways(knowledge, graph, variable, &lost, requirements).into())
    }

    /// The signals whose loss makes a difference to a variable, ascending.
    pub(super) fn matters(&self, variable: VariableId) -> &[SignalId] {
        self.table.events(variable)
    }

    /// Signals with all that are derived from them, ascending.
    pub(super) fn with_derived(&self, lost: &[SignalId]) -> Vec<SignalId> {
        self.table.with_derived(lost)
    }

    /// The same of what contracts admit now, by a search.
    pub(super) fn admitted(
        &self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        need: NeedId,
        lost: &Lost,
        contracts: &Search<'_>,
    ) -> Arc<[Source]> {
        let variable = knowledge.needs()[need].variable;
        let Demands { requirements, barred } = &self.demands[need];
        admitted_ways(knowledge, graph, variable, &lost.with(barred), requirements, contracts).into()
    }

    /// The ways better than any that meets the need's demands, best first, each with the reasons why it must not serve.
    ///
    /// Complexity: that of one search.
    pub(super) fn refused(
        &self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        need: NeedId,
        lost: &Lost,
    ) -> Vec<(Way, Vec<Shortfall>)> {
        let variable = knowledge.needs()[need].variable;
        let anything = ways(knowledge, graph, variable, lost, &Requirements::default());
        let demands = &self.demands[need].requirements;
        let asked = anything.into_iter().map(|Source { way, .. }| {
            let shortfalls = demands.shortfalls_of_way(knowledge, &way);
            (way, shortfalls)
        });
        asked.take_while(|(_, shortfalls)| !shortfalls.is_empty()).collect()
    }
}

/// The demands of a need.
#[derive(Debug)]
struct Demands {
    requirements: Requirements,
    /// Elements that fall short on their own: for the need, these signals count as lost.
    barred: Lost,
}

impl Demands {
    fn of(knowledge: &KnowledgeBase, need: NeedId) -> Demands {
        let requirements = Requirements::of(&knowledge.needs()[need]);
        let (signals, relations) = requirements.barred(knowledge);
        Demands { requirements, barred: Lost { signals, relations } }
    }
}

fn needed(knowledge: &KnowledgeBase) -> impl Iterator<Item = VariableId> + '_ {
    knowledge.needs().iter().map(|need| need.variable)
}

/// Whether some substitution starts from a variable that a lost signal carries.
fn starts_from(knowledge: &KnowledgeBase, plan: &Plan, lost: &[SignalId]) -> bool {
    let starts = |variable| {
        plan.substitutions.iter().any(|(substitution, _)| substitution.sources.contains(&variable))
    };
    lost.iter().any(|&signal| starts(knowledge.signals()[signal].variable))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::knowledge::{
        BodyDraft, Draft, NeedDraft, RelationDraft, SignalDraft, Text, VariableDraft, build,
    };
    use alloc::format;
    use proptest::prelude::*;

    fn text(text: &str) -> Text {
        Text { text: text.into(), ..Text::default() }
    }

    /// Equations of two or three of six variables, and which variable each signal carries.
    fn system(equations: &[(usize, usize, usize)], carried: &[usize]) -> KnowledgeBase {
        let name = |index: usize| text(&format!("v{}", index % 6));
        let variable = |index| VariableDraft { name: name(index), ..VariableDraft::default() };
        let relation = |(index, &(a, b, c)): (usize, &(usize, usize, usize))| RelationDraft {
            name: text(&format!("r{index}")),
            body: BodyDraft::Equation(text(&format!("v{a} = v{} + v{}", (a + b) % 6, (a + c) % 6))),
            directions: None,
            condition: None,
            error: None,
            learn: Vec::new(),
            properties: Vec::from([(text("cost"), text(&format!("{}", 1 + index % 2)))]),
        };
        let signal = |(index, &variable): (usize, &usize)| SignalDraft {
            name: text(&format!("s{index}")),
            variable: Some(name(variable)),
            delay: Some(text(&format!("{} ms", 150 * index))),
            derived_from: (variable == 3).then(|| text("s0")).into_iter().collect(),
            ..SignalDraft::default()
        };
        let need = |index| NeedDraft {
            variable: name(index),
            max_age: Some(text("500 ms")),
            ..NeedDraft::default()
        };
        let (knowledge, _) = build(&Draft {
            variables: (0..6).map(variable).collect(),
            relations: equations.iter().enumerate().map(relation).collect(),
            signals: carried.iter().enumerate().map(signal).collect(),
            needs: (0..2).map(need).collect(),
            ..Draft::default()
        });
        knowledge
    }

    proptest! {
        /// After any loss, the ready sources are those that a search finds; after a change of structure, too.
        #[test]
        fn what_stands_ready_is_what_is_searched_for(
            equations in prop::collection::vec((0..6_usize, 1..6_usize, 1..6_usize), 1..6),
            carried in prop::collection::vec(0..6_usize, 1..7),
            before in (0..6_usize, 0..7_usize),
        ) {
            let knowledge = system(&equations, &carried);
            let graph = Graph::new(&knowledge);
            let (equation, signal) = before;
            let old = system(equations.get(equation..).unwrap_or(&equations), carried.get(..signal).unwrap_or(&carried));
            let (old_graph, lineage) = (Graph::new(&old), Lineage::new(&old, &knowledge));
            let ready_sources = ReadySources::new(&old, &old_graph);
            let ready_sources = ready_sources.carried_over(&old_graph, &lineage, &knowledge, &graph);
            for need in knowledge.needs().ids() {
                for set in 0..1_u32 << knowledge.signals().len() {
                    let is_lost = |(index, _): &(usize, SignalId)| set >> index & 1 == 1;
                    let signals: Vec<SignalId> =
                        knowledge.signals().ids().enumerate().filter(is_lost).map(|(_, id)| id).collect();
                    let lost = Lost { signals, relations: Vec::new() };
                    let variable = knowledge.needs()[need].variable;
                    let demands = &ready_sources.demands[need];
                    let all = lost.with(&demands.barred);
                    let searched = ways(&knowledge, &graph, variable, &all, &demands.requirements);
                    prop_assert_eq!(&ready_sources.sources(&knowledge, &graph, need, &lost)[..], &searched[..]);
                }
            }
        }
    }
}
