//! What nothing admissible can rest on, whatever else serves a need.

use super::Assurance;
use super::flow::{Flow, Member};
use super::join::Joint;
use crate::assurance::certificate::{DemandId, GuaranteeId, ServiceId, Tree};
use crate::assurance::evaluation::{Evaluation, System, Verdict};
use crate::interval::Truth;
use crate::knowledge::{
    ContractId, EvidenceSource, IdVec, KnowledgeBase, NeedId, RelationId, RelationSet, SignalSet, VariableId,
    Watched,
};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

impl Assurance {
    /// Signals and relations on which nothing that is admissible for a need can rest, under the evidence that `truth` tells.
    ///
    /// Never more than that: everything is composed with everything, and who provides a variable is left out only where
    /// everybody who reads the variable asks for more than it can give, and can give nothing without. What is measured of a way
    /// as a whole counts as true. Time and space: linear in the model, times the levels that are demanded.
    #[must_use]
    pub fn barred(
        &self,
        knowledge: &KnowledgeBase,
        need: NeedId,
        mut truth: impl FnMut(ContractId, &Watched) -> Truth,
    ) -> (SignalSet, RelationSet) {
        let Joint { certificates, members, observed, .. } = Joint::new(knowledge, Flow::Any, &self.levels);
        let Ok(system) = System::new(certificates) else { return Default::default() };
        let mut evaluation = Evaluation::new(&system);
        let changes = observed.enumerate().map(|(id, observed)| {
            let watched = observed.and_then(|(contract, at)| {
                Some((contract, knowledge.contracts().rows()[contract].evidence.get(at)?))
            });
            let is = |(contract, watched): (ContractId, &Watched)| match watched.source {
                EvidenceSource::Source(_) => Truth::True,
                EvidenceSource::Signal(..) | EvidenceSource::Told => truth(contract, watched),
            };
            (id, watched.map_or(Truth::True, is))
        });
        let changes: Vec<_> = changes.collect();
        evaluation.set_all(&system, changes.into_iter());
        let mut demands = IdVec::filled(system.certificates().services.len(), |_| Vec::new());
        system.certificates().demands.enumerate().for_each(|(id, row)| demands[row.service].push(id));
        let mut offers = IdVec::filled(system.certificates().services.len(), |_| Vec::new());
        system.certificates().guarantees.enumerate().for_each(|(id, row)| offers[row.service].push(id));
        let outlook = Outlook {
            knowledge,
            system: &system,
            evaluation: &evaluation,
            members: &members,
            demands,
            offers,
        };
        outlook.barred(need)
    }
}

/// What can be given at best.
struct Outlook<'a> {
    knowledge: &'a KnowledgeBase,
    system: &'a System,
    evaluation: &'a Evaluation,
    members: &'a BTreeMap<Member, ServiceId>,
    /// What each service asks.
    demands: IdVec<ServiceId, Vec<DemandId>>,
    /// What each service gives.
    offers: IdVec<ServiceId, Vec<GuaranteeId>>,
}

impl Outlook<'_> {
    fn barred(&self, need: NeedId) -> (SignalSet, RelationSet) {
        let mut signals = SignalSet::new();
        let mut relations: BTreeMap<RelationId, bool> = BTreeMap::new();
        let readers = self.readers(need);
        for &member in self.members.keys() {
            match member {
                Member::Signal(id) => {
                    if self.is_barred(member, self.knowledge.signals()[id].variable, &readers) {
                        _ = signals.insert(id);
                    }
                }
                Member::Relation(id, output) => {
                    let is_barred = self.is_barred(member, output, &readers);
                    *relations.entry(id).or_insert(true) &= is_barred;
                }
                Member::Need(_) | Member::Other(_) => {}
            }
        }
        let barred = relations.into_iter().filter(|&(_, is_barred)| is_barred).map(|(id, _)| id);
        (signals, barred.collect())
    }

    /// Who reads each variable: relations, and the need.
    fn readers(&self, need: NeedId) -> BTreeMap<VariableId, Vec<Member>> {
        let mut readers: BTreeMap<VariableId, Vec<Member>> = BTreeMap::new();
        let needed = self.knowledge.needs()[need].variable;
        readers.entry(needed).or_default().push(Member::Need(need));
        for (id, relation) in self.knowledge.relations().enumerate() {
            for &output in &relation.outputs {
                for input in relation.needs(output) {
                    readers.entry(input).or_default().push(Member::Relation(id, output));
                }
            }
        }
        readers
    }

    /// Whether everybody who reads a variable asks more than this provider of it can give.
    fn is_barred(
        &self,
        provider: Member,
        variable: VariableId,
        readers: &BTreeMap<VariableId, Vec<Member>>,
    ) -> bool {
        let readers = readers.get(&variable).map(Vec::as_slice).unwrap_or_default();
        !readers.is_empty() && readers.iter().all(|&reader| self.asks_more(reader, provider, variable))
    }

    /// Whether a reader can give nothing with this provider of a variable.
    fn asks_more(&self, reader: Member, provider: Member, variable: VariableId) -> bool {
        let (Some(&reader), Some(&provider)) = (self.members.get(&reader), self.members.get(&provider))
        else {
            return false;
        };
        let (demands, offers) = (&self.system.certificates().demands, &self.system.certificates().guarantees);
        let name = &self.knowledge.variables()[variable].name;
        let of_variable = |demand: &DemandId| {
            demands[*demand].of.contains(&provider) && demands[*demand].statement.service == *name
        };
        let own = self.demands[reader].iter().copied();
        let unmet: BTreeSet<DemandId> =
            own.filter(|demand| of_variable(demand) && !self.meets(provider, *demand)).collect();
        !self.offers[reader].iter().any(|&given| may_hold(&offers[given].when, &unmet))
    }

    /// Whether a provider can meet a demand at best.
    fn meets(&self, provider: ServiceId, demand: DemandId) -> bool {
        let certificates = self.system.certificates();
        let wanted = &certificates.demands[demand].statement;
        self.offers[provider].iter().any(|&given| {
            certificates.guarantees[given].statement.meets(wanted)
                && self.evaluation.guarantee(self.system, given) == Verdict::Holds
        })
    }
}

/// Whether a condition can hold though these demands are not met.
fn may_hold(tree: &Tree, unmet: &BTreeSet<DemandId>) -> bool {
    match tree {
        Tree::All(parts) => parts.iter().all(|part| may_hold(part, unmet)),
        Tree::Any(parts) => parts.iter().any(|part| may_hold(part, unmet)),
        Tree::AtLeast(count, parts) => {
            parts.iter().filter(|part| may_hold(part, unmet)).count() >= *count as usize
        }
        Tree::Demand(demand) => !unmet.contains(demand),
        Tree::Evidence(_) => true,
    }
}
