//! What can be given for a need at best, whatever way serves it: the signals and relations on which no admissible way rests.

use super::Assurance;
use super::flow::{Flow, Member};
use super::join::{Joint, Observed};
use crate::assurance::certificate::{DemandId, EvidenceId, GuaranteeId, ServiceId, Tree};
use crate::assurance::evaluation::System;
use crate::assurance::fixed_point::FixedPoint;
use crate::assurance::reading::Read;
use crate::knowledge::{
    EvidenceSource, Id, IdVec, KnowledgeBase, NeedId, RelationSet, Rows, SignalId, SignalSet, VariableId,
};
use crate::substitution::{Step, Substitution, Way};
use alloc::vec::Vec;

/// What no admissible way for a need rests on, kept up to date as evidence changes.
///
/// All members of a model are composed with all. A provider of a variable is barred only where each reader of the variable demands
/// more than the provider can give at best, and can give nothing itself without. Evidence measured on a whole way counts as true.
#[derive(Clone, Debug)]
pub struct Bounds {
    /// The variable of the need.
    sink: VariableId,
    system: System,
    observed: IdVec<EvidenceId, Observed>,
    /// The guarantees that can be given at best.
    best: FixedPoint,
    /// The same of the last judgement.
    given: IdVec<GuaranteeId, bool>,
    statics: Statics,
    is_barred: IdVec<ServiceId, bool>,
    barred: (SignalSet, RelationSet),
    /// Variables that no admissible way gives; empty where nothing is barred.
    unobtainable: Vec<bool>,
}

/// What does not depend on evidence.
#[derive(Clone, Debug)]
struct Statics {
    members: IdVec<ServiceId, Member>,
    /// The guarantees of each service.
    offers: Rows<ServiceId, GuaranteeId>,
    /// The variable of each demand on the provider of a variable.
    asks: IdVec<DemandId, Option<VariableId>>,
    /// The relations and needs that read a variable.
    readers: Rows<VariableId, ServiceId>,
    /// Variables whose providers need not guarantee anything.
    is_spared: IdVec<VariableId, bool>,
}

impl Assurance {
    /// Prepares the bounds of the ways for a need, while no evidence is true.
    ///
    /// Time and space: linear in the pairs of a demand with a guarantee that may meet it, over all members of the model, times the
    /// number of levels that are demanded anywhere.
    #[must_use]
    pub fn bounds(&self, knowledge: &KnowledgeBase, need: NeedId) -> Bounds {
        let Joint { certificates, members, observed, parties, .. } =
            Joint::new(knowledge, Flow::Any(need), &self.levels);
        let system = System::new(certificates).unwrap_or_default();
        let best = FixedPoint::new(system.circuit(), system.circuit().needed.clone());
        let statics = Statics::new(knowledge, &system, members.into_iter(), parties);
        let mut bounds = Bounds {
            sink: knowledge.needs()[need].variable,
            given: IdVec::filled(system.certificates().guarantees.len(), |_| false),
            is_barred: IdVec::filled(statics.members.len(), |_| false),
            barred: Default::default(),
            unobtainable: Vec::new(),
            system,
            observed,
            best,
            statics,
        };
        let all: Vec<ServiceId> = bounds.statics.members.ids().collect();
        bounds.judge(knowledge, &all);
        bounds
    }
}

impl Bounds {
    /// Takes in the truth of all evidence.
    ///
    /// Time: linear in the evidence and in what follows from what has changed; where something has changed, linear in the model.
    pub fn read(&mut self, knowledge: &KnowledgeBase, read: Read<'_>) {
        let nothing = Substitution { sink: self.sink, steps: Vec::new(), sources: Vec::new() };
        let nothing = Way { substitution: nothing, signals: Vec::new() };
        let mut has_changed = false;
        for (id, observed) in self.observed.enumerate() {
            let watched = observed.and_then(|(contract, at)| {
                Some((contract, knowledge.contracts().rows()[contract].evidence.get(at)?))
            });
            let is_true = watched.is_none_or(|(contract, watched)| match watched.source {
                EvidenceSource::Source(_) => true,
                EvidenceSource::Signal(..) | EvidenceSource::Specification(_) | EvidenceSource::Attested => {
                    read(contract, watched, &nothing).truth.is_true()
                }
            });
            let node = self.system.circuit().evidence_node(id);
            has_changed |= self.best.holds(node) != is_true;
            self.best.set(self.system.circuit(), node, is_true);
        }
        if has_changed {
            self.best.settle(self.system.circuit());
            let changed = self.changed();
            self.judge(knowledge, &changed);
        }
    }

    /// The signals and relations on which no admissible way rests.
    #[must_use]
    pub fn barred(&self) -> &(SignalSet, RelationSet) {
        &self.barred
    }

    /// Whether anything is barred.
    #[must_use]
    pub fn prune(&self) -> bool {
        !self.unobtainable.is_empty()
    }

    /// Whether a signal may be part of an admissible way.
    #[must_use]
    pub fn may_use(&self, signal: SignalId) -> bool {
        !self.barred.0.contains(signal)
    }

    /// Whether a step may be part of an admissible way: all of its inputs can be obtained.
    #[must_use]
    pub fn may_take(&self, knowledge: &KnowledgeBase, step: &Step) -> bool {
        let is_lost = |input: VariableId| self.unobtainable.get(input.index()).copied().unwrap_or(false);
        self.unobtainable.is_empty()
            || !self.barred.1.contains(step.relation)
                && !knowledge.relations()[step.relation].needs(step.output).any(is_lost)
    }

    /// The services of which a guarantee can be given now and could not, or the other way round.
    fn changed(&mut self) -> Vec<ServiceId> {
        let Bounds { system, best, given, .. } = self;
        let mut changed = Vec::new();
        for (id, row) in system.certificates().guarantees.enumerate() {
            let holds = best.holds(system.circuit().guarantee_node(id));
            if core::mem::replace(&mut given[id], holds) != holds && changed.last() != Some(&row.service) {
                changed.push(row.service);
            }
        }
        changed
    }

    /// Decides again about services, and what follows.
    fn judge(&mut self, knowledge: &KnowledgeBase, changed: &[ServiceId]) {
        for &service in changed {
            self.is_barred[service] = self.asked_for_more(knowledge, service);
        }
        let (mut signals, mut relations, mut free) =
            (SignalSet::new(), RelationSet::new(), RelationSet::new());
        for (service, member) in self.statics.members.enumerate() {
            match (member, self.is_barred[service]) {
                (Member::Signal(id), true) => _ = signals.insert(*id),
                (Member::Relation(id, _), true) => _ = relations.insert(*id),
                (Member::Relation(id, _), false) => _ = free.insert(*id),
                _ => {}
            }
        }
        free.iter().for_each(|id| relations.remove(id));
        self.barred = (signals, relations);
        self.unobtainable = self.unobtainable(knowledge);
    }

    /// Whether each reader of what a service provides demands more than the service can give.
    fn asked_for_more(&self, knowledge: &KnowledgeBase, provider: ServiceId) -> bool {
        let variable = match self.statics.members[provider] {
            Member::Signal(id) => knowledge.signals()[id].variable,
            Member::Relation(_, output) => output,
            Member::Need(_) | Member::Other(_) => return false,
        };
        let readers = self.statics.readers.row(variable);
        let is_content = |&reader: &ServiceId| {
            self.statics.can_give(&self.system, reader, variable, |demand| self.meets(provider, demand))
        };
        !self.statics.is_spared[variable] && !readers.is_empty() && !readers.iter().any(is_content)
    }

    /// Whether a provider can meet a demand at best.
    fn meets(&self, provider: ServiceId, demand: DemandId) -> bool {
        let certificates = self.system.certificates();
        let wanted = &certificates.demands[demand].statement;
        self.statics.offers.row(provider).iter().any(|&given| {
            self.best.holds(self.system.circuit().guarantee_node(given))
                && certificates.guarantees[given].statement.meets(wanted)
        })
    }

    /// The variables that no signal or relation gives that is not barred; empty where nothing is barred.
    fn unobtainable(&self, knowledge: &KnowledgeBase) -> Vec<bool> {
        let (signals, relations) = &self.barred;
        if signals.is_empty() && relations.is_empty() {
            return Vec::new();
        }
        let mut missing = IdVec::filled(self.statics.members.len(), |_| 0_usize);
        let mut lost = IdVec::filled(knowledge.variables().len(), |_: VariableId| true);
        let mut open: Vec<VariableId> = Vec::new();
        for (service, member) in self.statics.members.enumerate() {
            if let &Member::Relation(relation, output) = member {
                missing[service] = knowledge.relations()[relation].needs(output).count();
                if missing[service] == 0 && !relations.contains(relation) {
                    open.push(output);
                }
            }
        }
        open.extend(knowledge.variables().ids().filter(|&variable| {
            knowledge.variables()[variable].constant.is_some()
                || knowledge.carriers(variable).iter().any(|&signal| !signals.contains(signal))
        }));
        while let Some(variable) = open.pop() {
            if !core::mem::take(&mut lost[variable]) {
                continue;
            }
            for &reader in self.statics.readers.row(variable) {
                let Member::Relation(relation, output) = self.statics.members[reader] else { continue };
                missing[reader] = missing[reader].saturating_sub(1);
                if missing[reader] == 0 && !relations.contains(relation) {
                    open.push(output);
                }
            }
        }
        lost.iter().copied().collect()
    }
}

impl Statics {
    fn new(
        knowledge: &KnowledgeBase,
        system: &System,
        members: impl Iterator<Item = (Member, ServiceId)>,
        asks: IdVec<DemandId, Option<VariableId>>,
    ) -> Statics {
        let certificates = system.certificates();
        let mut by_service: Vec<(ServiceId, Member)> = members.map(|(member, id)| (id, member)).collect();
        by_service.sort_unstable();
        let mut members = IdVec::new();
        by_service.into_iter().for_each(|(_, member)| _ = members.push(member));
        let reads = |(id, member): (ServiceId, &Member)| -> Vec<(VariableId, ServiceId)> {
            match *member {
                Member::Relation(relation, output) => {
                    knowledge.relations()[relation].needs(output).map(|input| (input, id)).collect()
                }
                Member::Need(need) => Vec::from([(knowledge.needs()[need].variable, id)]),
                Member::Signal(_) | Member::Other(_) => Vec::new(),
            }
        };
        let reads: Vec<(VariableId, ServiceId)> = members.enumerate().flat_map(reads).collect();
        let offers = certificates.guarantees.enumerate().map(|(id, row)| (row.service, id));
        let mut statics = Statics {
            offers: Rows::grouped(members.len(), offers),
            readers: Rows::grouped(knowledge.variables().len(), reads.into_iter()),
            is_spared: IdVec::filled(knowledge.variables().len(), |_| false),
            members,
            asks,
        };
        statics.spare(knowledge, system);
        statics
    }

    /// Finds the variables whose providers need not guarantee anything: a reader can do without their guarantee, or what the reader
    /// computes need not be guaranteed either.
    fn spare(&mut self, knowledge: &KnowledgeBase, system: &System) {
        let does_without = |variable: &VariableId| {
            let mut readers = self.readers.row(*variable).iter();
            readers.any(|&reader| self.can_give(system, reader, *variable, |_| false))
        };
        let mut open: Vec<VariableId> = knowledge.variables().ids().filter(does_without).collect();
        while let Some(variable) = open.pop() {
            if core::mem::replace(&mut self.is_spared[variable], true) {
                continue;
            }
            for &relation in knowledge.producers(variable) {
                open.extend(knowledge.relations()[relation].needs(variable));
            }
        }
    }

    /// Whether a reader can guarantee something when these of its demands on a variable are met.
    fn can_give(
        &self,
        system: &System,
        reader: ServiceId,
        variable: VariableId,
        is_met: impl Fn(DemandId) -> bool,
    ) -> bool {
        let guarantees = &system.certificates().guarantees;
        let may_be_met = |demand| self.asks[demand] != Some(variable) || is_met(demand);
        self.offers.row(reader).iter().any(|&given| may_hold(&guarantees[given].when, &may_be_met))
    }
}

/// Whether a condition can hold while only these demands may be met.
fn may_hold(tree: &Tree, may_be_met: &impl Fn(DemandId) -> bool) -> bool {
    match tree {
        Tree::All(parts) => parts.iter().all(|part| may_hold(part, may_be_met)),
        Tree::Any(parts) => parts.iter().any(|part| may_hold(part, may_be_met)),
        Tree::AtLeast(count, parts) => {
            parts.iter().filter(|part| may_hold(part, may_be_met)).count() >= *count as usize
        }
        Tree::Demand(demand) => may_be_met(*demand),
        Tree::Evidence(_) => true,
    }
}
