//! The members of a flow of information, and which member provides what to which.

use crate::knowledge::{
    ContractId, KnowledgeBase, NeedId, RelationId, SignalId, SignalSet, Subject, VariableId,
};
use crate::substitution::{Step, Way};
use alloc::vec::Vec;

/// A member of a flow, which gives or takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Member {
    /// The producer of a signal.
    Signal(SignalId),
    /// A relation, used for one of its outputs.
    Relation(RelationId, VariableId),
    /// The consumer behind a need.
    Need(NeedId),
    /// A platform, or this program.
    Other(ContractId),
}

impl Member {
    /// The contract of the member.
    pub(super) fn contract(self, knowledge: &KnowledgeBase) -> Option<ContractId> {
        let of = |subject| knowledge.contracts().of(subject);
        match self {
            Member::Signal(id) => of(Subject::Signal(id)),
            Member::Relation(id, _) => of(Subject::Relation(id)),
            Member::Need(id) => of(Subject::Need(id)),
            Member::Other(id) => Some(id),
        }
    }

    /// The name of the member in the model.
    pub(super) fn name(self, knowledge: &KnowledgeBase) -> &str {
        match self {
            Member::Signal(id) => &knowledge.signals()[id].name,
            Member::Relation(id, _) => &knowledge.relations()[id].name,
            Member::Need(id) => knowledge.need_name(id),
            Member::Other(id) => &knowledge.contracts().rows()[id].name,
        }
    }
}

/// A flow of information.
#[derive(Clone, Copy)]
pub(super) enum Flow<'w> {
    /// The flow to one need, served by one way.
    Way(NeedId, &'w Way),
    /// Every flow to one need that the model allows, at once.
    Any(NeedId),
}

impl Flow<'_> {
    /// The members of the flow, without those that their contracts ask.
    pub(super) fn members(self, knowledge: &KnowledgeBase) -> Vec<Member> {
        match self {
            Flow::Way(need, way) => {
                let steps =
                    way.substitution.steps.iter().map(|step| Member::Relation(step.relation, step.output));
                let signals = way.inputs().map(Member::Signal);
                core::iter::once(Member::Need(need)).chain(steps).chain(signals).collect()
            }
            Flow::Any(need) => {
                let of = |(id, relation): (RelationId, &crate::knowledge::Relation)| {
                    relation.outputs.iter().map(|&output| Member::Relation(id, output)).collect::<Vec<_>>()
                };
                let relations = knowledge.relations().enumerate().flat_map(of);
                let need = core::iter::once(Member::Need(need));
                need.chain(relations).chain(knowledge.signals().ids().map(Member::Signal)).collect()
            }
        }
    }

    /// The members that provide a variable to a member; `None` for a constant, which has no provider.
    pub(super) fn providers(
        self,
        knowledge: &KnowledgeBase,
        to: Member,
        variable: VariableId,
    ) -> Option<Vec<Member>> {
        if knowledge.variables()[variable].constant.is_some() {
            return None;
        }
        let found = match self {
            Flow::Way(_, way) => provider(way, to, variable).into_iter().collect(),
            Flow::Any(_) => {
                let carriers = knowledge.carriers(variable).iter().map(|&id| Member::Signal(id));
                let producers =
                    knowledge.producers(variable).iter().map(|&id| Member::Relation(id, variable));
                carriers.chain(producers).filter(|member| *member != to).collect()
            }
        };
        Some(found)
    }

    /// The consumer at the end of the flow: the need.
    pub(super) fn consumer(self) -> Member {
        match self {
            Flow::Way(need, _) | Flow::Any(need) => Member::Need(need),
        }
    }

    /// All signals on which a variable rests in the flow of a way.
    pub(super) fn grounds(self, knowledge: &KnowledgeBase, variable: VariableId) -> SignalSet {
        let mut found = SignalSet::new();
        let Flow::Way(_, way) = self else { return found };
        let mut open = Vec::from([variable]);
        let mut seen = Vec::new();
        while let Some(variable) = open.pop() {
            if seen.contains(&variable) {
                continue;
            }
            seen.push(variable);
            match step(way, variable) {
                Some(step) => open.extend(knowledge.relations()[step.relation].needs(step.output)),
                None => found.extend(&source(way, variable).into_iter().collect()),
            }
        }
        found
    }
}

fn provider(way: &Way, to: Member, variable: VariableId) -> Option<Member> {
    let computed = step(way, variable).map(|step| Member::Relation(step.relation, step.output));
    let computed = computed.filter(|member| *member != to);
    computed.or_else(|| source(way, variable).map(Member::Signal))
}

/// The step that computes a variable.
fn step(way: &Way, variable: VariableId) -> Option<Step> {
    way.substitution.steps.iter().copied().find(|step| step.output == variable)
}

/// The signal that is chosen for a source.
fn source(way: &Way, variable: VariableId) -> Option<SignalId> {
    let at = way.substitution.sources.iter().position(|source| *source == variable)?;
    way.signals.get(at).copied().flatten()
}
