//! The signals and relations on which no admissible way can rest, whatever else serves a need.

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
    /// The signals and relations on which no admissible way for a need can rest, given the truth of evidence by `truth`.
    ///
    /// The sets have no signal or relation on which an admissible way rests: all members are composed with all. A provider of a
    /// variable is barred only where each reader of the variable demands more than the provider can give, and can give nothing
    /// itself without. Evidence measured on a whole way counts as true. Time: linear in the model, times the number of demanded
    /// levels and the length of the longest chain of relations.
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
        let best_case = BestCase {
            knowledge,
            system: &system,
            evaluation: &evaluation,
            members: &members,
            demands,
            offers,
        };
        best_case.barred(need)
    }
}

/// The readers of each variable: relations, and the need.
type Readers = BTreeMap<VariableId, Vec<Member>>;

/// The guarantees that can be given at best.
struct BestCase<'a> {
    knowledge: &'a KnowledgeBase,
    system: &'a System,
    evaluation: &'a Evaluation,
    members: &'a BTreeMap<Member, ServiceId>,
    /// The demands of each service.
    demands: IdVec<ServiceId, Vec<DemandId>>,
    /// The guarantees of each service.
    offers: IdVec<ServiceId, Vec<GuaranteeId>>,
}

impl BestCase<'_> {
    fn barred(&self, need: NeedId) -> (SignalSet, RelationSet) {
        let mut signals = SignalSet::new();
        let mut relations: BTreeMap<RelationId, bool> = BTreeMap::new();
        let readers = self.readers(need);
        let spared = self.spared(&readers);
        for &member in self.members.keys() {
            match member {
                Member::Signal(id) => {
                    if self.is_barred(member, self.knowledge.signals()[id].variable, &readers, &spared) {
                        _ = signals.insert(id);
                    }
                }
                Member::Relation(id, output) => {
                    let is_barred = self.is_barred(member, output, &readers, &spared);
                    *relations.entry(id).or_insert(true) &= is_barred;
                }
                Member::Need(_) | Member::Other(_) => {}
            }
        }
        let barred = relations.into_iter().filter(|&(_, is_barred)| is_barred).map(|(id, _)| id);
        (signals, barred.collect())
    }

    fn readers(&self, need: NeedId) -> Readers {
        let mut readers = Readers::new();
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

    /// The relations that need not guarantee anything: a reader of their output can do without their guarantee, or need not
    /// guarantee anything itself.
    fn spared(&self, readers: &Readers) -> BTreeSet<Member> {
        let mut spared = BTreeSet::new();
        loop {
            let is_new = |member: &Member| {
                let &Member::Relation(_, output) = member else { return false };
                let mut of_output = readers.get(&output).into_iter().flatten();
                let without =
                    |reader| self.can_give(reader, output, |demand| !self.is_asked(demand, *member));
                !spared.contains(member)
                    && of_output.any(|&reader| spared.contains(&reader) || without(reader))
            };
            let found: Vec<Member> = self.members.keys().copied().filter(is_new).collect();
            if found.is_empty() {
                return spared;
            }
            spared.extend(found);
        }
    }

    /// Whether each reader of a variable that has to guarantee something demands more than this provider can give.
    fn is_barred(
        &self,
        provider: Member,
        variable: VariableId,
        readers: &Readers,
        spared: &BTreeSet<Member>,
    ) -> bool {
        let readers = readers.get(&variable).map(Vec::as_slice).unwrap_or_default();
        let met = |demand| !self.is_asked(demand, provider) || self.meets(provider, demand);
        let asks_more = |&reader: &Member| !spared.contains(&reader) && !self.can_give(reader, variable, met);
        !readers.is_empty() && readers.iter().all(asks_more)
    }

    /// Whether a reader can guarantee something when these of its demands on a variable are met.
    fn can_give(&self, reader: Member, variable: VariableId, is_met: impl Fn(DemandId) -> bool) -> bool {
        let Some(&reader) = self.members.get(&reader) else { return true };
        let (demands, offers) = (&self.system.certificates().demands, &self.system.certificates().guarantees);
        let name = &self.knowledge.variables()[variable].name;
        let own = self.demands[reader].iter().copied();
        let unmet: BTreeSet<DemandId> =
            own.filter(|&demand| demands[demand].statement.service == *name && !is_met(demand)).collect();
        self.offers[reader].iter().any(|&given| may_hold(&offers[given].when, &unmet))
    }

    /// Whether a demand is asked of a provider in some flow.
    fn is_asked(&self, demand: DemandId, provider: Member) -> bool {
        let service = self.members.get(&provider);
        service.is_some_and(|service| self.system.certificates().demands[demand].of.contains(service))
    }

    /// Whether a provider can meet a demand at best.
    fn meets(&self, provider: Member, demand: DemandId) -> bool {
        let Some(&provider) = self.members.get(&provider) else { return true };
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
