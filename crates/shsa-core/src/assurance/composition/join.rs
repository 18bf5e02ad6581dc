//! The contracts of the members of a flow, joined into certificates.

use super::flow::{Flow, Member};
use crate::assurance::certificate::{
    Certificates, Demand, DemandId, Evidence, EvidenceId, Guarantee, GuaranteeId, Quantifier, Service,
    ServiceId, ServiceKind, Tree,
};
use crate::knowledge::{
    Asked, CONSUMER, Condition, Contract, ContractId, EvidenceSource, Given, HEALER, IdVec, KnowledgeBase,
    Measure, NeedId, Party, Subject, VariableId, dependence,
};
use crate::statement::{Level, Statement};
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// A piece of evidence, by its contract and its index there; `None` where it is not measured in this flow.
pub(super) type Observed = Option<(ContractId, usize)>;

/// Certificates while they are joined.
pub(super) struct Joint<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    flow: Flow<'a>,
    /// All levels that are demanded anywhere: those that relations without a contract can pass on.
    levels: &'a [Level],
    pub(super) certificates: Certificates,
    pub(super) members: BTreeMap<Member, ServiceId>,
    queue: Vec<Member>,
    /// The source of each piece of evidence.
    pub(super) observed: IdVec<EvidenceId, Observed>,
    /// The guarantees of each need, the best first.
    pub(super) roots: Vec<(NeedId, GuaranteeId)>,
    /// The demands of each need on its source.
    pub(super) asked: Vec<(NeedId, DemandId)>,
    /// The variable whose provider each demand asks.
    pub(super) parties: IdVec<DemandId, Option<VariableId>>,
}

impl<'a> Joint<'a> {
    /// Joins the contracts of all members, and of all that these demand something of.
    pub(super) fn new(knowledge: &'a KnowledgeBase, flow: Flow<'a>, levels: &'a [Level]) -> Joint<'a> {
        let certificates =
            Certificates { scales: knowledge.contracts().scales().clone(), ..Certificates::default() };
        let mut joint = Joint {
            knowledge,
            flow,
            levels,
            certificates,
            members: BTreeMap::new(),
            queue: Vec::new(),
            observed: IdVec::new(),
            roots: Vec::new(),
            asked: Vec::new(),
            parties: IdVec::new(),
        };
        for member in flow.members(knowledge) {
            joint.service(member);
        }
        let mut next = 0;
        while let Some(&member) = joint.queue.get(next) {
            joint.fill(member);
            next += 1;
        }
        joint
    }

    /// The service of a member, which is added to the flow.
    fn service(&mut self, member: Member) -> ServiceId {
        if let Some(&known) = self.members.get(&member) {
            return known;
        }
        let subject = |id: ContractId| self.knowledge.contracts().rows()[id].subject;
        let kind = match member {
            Member::Other(id) if subject(id) == Subject::Platform => ServiceKind::Platform,
            _ => ServiceKind::Application,
        };
        let name = member.name(self.knowledge).to_string();
        let id = self.certificates.services.push(Service { name, kind });
        self.members.insert(member, id);
        self.queue.push(member);
        id
    }

    fn fill(&mut self, member: Member) {
        match (member.contract(self.knowledge), member) {
            (Some(id), _) => self.contracted(member, id),
            (None, Member::Signal(id)) => {
                let signal = &self.knowledge.signals()[id];
                let level = self.knowledge.contracts().integrity(&signal.properties);
                self.plain(member, signal.variable, level, Tree::ALWAYS);
            }
            (None, Member::Relation(id, output)) => self.passing_on(member, id, output),
            (None, Member::Need(need)) => self.needing(member, need, None, &[]),
            (None, Member::Other(_)) => {}
        }
    }

    /// Adds the contract of a member.
    fn contracted(&mut self, member: Member, id: ContractId) {
        let knowledge = self.knowledge;
        let contract = &knowledge.contracts().rows()[id];
        let demands: Vec<DemandId> = contract.asks.iter().map(|asked| self.demand(member, asked)).collect();
        let evidence: Vec<EvidenceId> =
            (0..contract.evidence.len()).filter_map(|at| self.evidence(member, contract, id, at)).collect();
        let tree = |condition: &Condition| tree(condition, &demands, &evidence);
        if let Member::Need(need) = member {
            let modes: Vec<(&Given, Tree)> =
                contract.gives.iter().map(|given| (given, tree(&given.when))).collect();
            let all = demands.iter().map(|&id| Tree::Demand(id));
            let all = Tree::All(all.chain(evidence.iter().map(|&id| Tree::Evidence(id))).collect());
            let from_source = contract.asks.iter().zip(&demands);
            let from_source = from_source.filter(|(asked, _)| matches!(asked.of, Party::Provider(_)));
            self.asked.extend(from_source.map(|(_, &id)| (need, id)));
            return self.needing(member, need, Some(all), &modes);
        }
        for given in &contract.gives {
            let about = match member {
                Member::Relation(_, output) => given.statement.service == knowledge.variables()[output].name,
                _ => true,
            };
            if about {
                let when = self.independent(contract, given, tree(&given.when));
                self.guarantee(member, &given.name, given.statement.clone(), when);
            }
        }
    }

    /// The condition; or one that never holds, where a claim of redundancy is wrong in this flow.
    fn independent(&self, contract: &Contract, given: &Given, when: Tree) -> Tree {
        let Some(pair) = given.redundant else { return when };
        let grounds = pair.map(|at| match contract.asks.get(at).map(|asked| asked.of) {
            Some(Party::Provider(variable)) => self.flow.grounds(self.knowledge, variable),
            _ => Default::default(),
        });
        match dependence(self.knowledge, self.knowledge.contracts(), &grounds).is_empty() {
            true => when,
            false => Tree::Any(Vec::new()),
        }
    }

    fn guarantee(&mut self, member: Member, name: &str, statement: Statement, when: Tree) -> GuaranteeId {
        let service = self.service(member);
        let when = match (member, statement.level) {
            (Member::Relation(..), Some(level)) => self.computed(service, level, when),
            _ => when,
        };
        self.certificates.guarantees.push(Guarantee { name: name.to_string(), service, statement, when })
    }

    /// Limits the level of computed values to the level that this program gives, where it has a contract.
    fn computed(&mut self, service: ServiceId, level: Level, when: Tree) -> Tree {
        let Some(healer) = self.knowledge.contracts().of(Subject::Healer) else { return when };
        let of = Vec::from([self.service(Member::Other(healer))]);
        let statement = Statement { service: HEALER.to_string(), level: Some(level), properties: Vec::new() };
        let name = format!("computed at {}", self.certificates.scales.written(level));
        let demand = Demand { name, service, statement, of, quantifier: Quantifier::Any };
        self.parties.push(None);
        let demand = self.certificates.demands.push(demand);
        Tree::All(Vec::from([when, Tree::Demand(demand)]))
    }

    /// Adds a guarantee of a level without properties.
    fn plain(
        &mut self,
        member: Member,
        variable: VariableId,
        level: Option<Level>,
        when: Tree,
    ) -> GuaranteeId {
        let service = self.knowledge.variables()[variable].name.clone();
        let name =
            level.map_or_else(|| "as it is".to_string(), |level| self.certificates.scales.written(level));
        self.guarantee(member, &name, Statement { service, level, properties: Vec::new() }, when)
    }

    /// Adds a relation without a contract: it passes on a level that all of its inputs give, and no property.
    fn passing_on(&mut self, member: Member, id: crate::knowledge::RelationId, output: VariableId) {
        let relation = &self.knowledge.relations()[id];
        let contracts = self.knowledge.contracts();
        let levels = self.levels.iter().filter(|&&level| contracts.passes_on(&relation.properties, level));
        for level in levels.map(|&level| Some(level)).chain([None]) {
            let inputs: Vec<VariableId> = relation.needs(output).collect();
            let demands = inputs.into_iter().map(|input| self.level_of(member, input, level));
            let when = Tree::All(demands.collect());
            self.plain(member, output, level, when);
        }
    }

    /// The demand for a level, without properties, on the provider of a variable.
    fn level_of(&mut self, member: Member, variable: VariableId, level: Option<Level>) -> Tree {
        let service = self.knowledge.variables()[variable].name.clone();
        let name = match level {
            Some(level) => format!("{service} at {}", self.certificates.scales.written(level)),
            None => service.clone(),
        };
        let statement = Statement { service, level, properties: Vec::new() };
        Tree::Demand(self.demand(member, &Asked { name, statement, of: Party::Provider(variable) }))
    }

    fn demand(&mut self, member: Member, asked: &Asked) -> DemandId {
        let (members, quantifier) = match asked.of {
            Party::Provider(variable) => match self.flow.providers(self.knowledge, member, variable) {
                Some(members) => (members, Quantifier::Any),
                // No member has to guarantee a constant.
                None => (Vec::new(), Quantifier::All),
            },
            Party::Producer(signal) => (Vec::from([Member::Signal(signal)]), Quantifier::Any),
            Party::Contract(id) => (Vec::from([Member::Other(id)]), Quantifier::Any),
            Party::Consumers => (Vec::from([self.flow.consumer()]), Quantifier::All),
        };
        let service = self.service(member);
        let of = members.into_iter().map(|member| self.service(member)).collect();
        let (name, statement) = (asked.name.clone(), asked.statement.clone());
        self.parties.push(match asked.of {
            Party::Provider(variable) if quantifier == Quantifier::Any => Some(variable),
            _ => None,
        });
        self.certificates.demands.push(Demand { name, service, statement, of, quantifier })
    }

    fn evidence(
        &mut self,
        member: Member,
        contract: &Contract,
        id: ContractId,
        at: usize,
    ) -> Option<EvidenceId> {
        let watched = contract.evidence.get(at)?;
        let service = self.service(member);
        let (within, max_age) = (watched.within, watched.max_age);
        let row = Evidence { name: watched.name.clone(), service, within, max_age };
        // The source of a need is measured at its output, not at a relation on the way.
        let is_measured = match (watched.source, member, self.flow) {
            (
                EvidenceSource::Source(Measure::Value | Measure::Width),
                Member::Relation(_, output),
                Flow::Way(_, way),
            ) => output == way.substitution.sink,
            _ => true,
        };
        self.observed.push(is_measured.then_some((id, at)));
        Some(self.certificates.evidence.push(row))
    }

    /// Adds the guarantees of a need: those of its contract, or one that holds when all its demands are met.
    fn needing(&mut self, member: Member, need: NeedId, all: Option<Tree>, modes: &[(&Given, Tree)]) {
        let row = &self.knowledge.needs()[need];
        let contracts = self.knowledge.contracts();
        let integrity = row.integrity.and_then(|letter| {
            let name = String::from(letter);
            contracts.scales().level(crate::knowledge::INTEGRITY_SCALE, &name)
        });
        let integrity = integrity.map(|level| self.level_of(member, row.variable, Some(level)));
        if let Some(Tree::Demand(id)) = integrity {
            self.asked.push((need, id));
        }
        let also = |when: Tree| match &integrity {
            Some(level) => Tree::All(Vec::from([when, level.clone()])),
            None => when,
        };
        let statement = Statement { service: CONSUMER.to_string(), level: None, properties: Vec::new() };
        if modes.is_empty() {
            let when = also(all.unwrap_or(Tree::ALWAYS));
            let root = self.guarantee(member, "served", statement, when);
            return self.roots.push((need, root));
        }
        for (given, when) in modes {
            let root = self.guarantee(member, &given.name, given.statement.clone(), also(when.clone()));
            self.roots.push((need, root));
        }
    }
}

/// A condition as a tree over the demands and the evidence of one service.
fn tree(condition: &Condition, demands: &[DemandId], evidence: &[EvidenceId]) -> Tree {
    let parts = |parts: &[Condition]| parts.iter().map(|part| tree(part, demands, evidence)).collect();
    let leaf = |leaf: Option<Tree>| leaf.unwrap_or(Tree::Any(Vec::new()));
    match condition {
        Condition::All(all) => Tree::All(parts(all)),
        Condition::Any(any) => Tree::Any(parts(any)),
        Condition::AtLeast(count, of) => Tree::AtLeast(*count, parts(of)),
        Condition::Asked(at) => leaf(demands.get(*at).map(|&id| Tree::Demand(id))),
        Condition::Watched(at) => leaf(evidence.get(*at).map(|&id| Tree::Evidence(id))),
    }
}
