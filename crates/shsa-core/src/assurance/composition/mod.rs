//! The contracts of a model, composed over the flow of information that serves a need.
//!
//! Who meets whose demands is not in the contracts: it follows from the substitution in use. Each of those who take part gives
//! what its contract says. A signal without one gives its `integrity`; a relation without one passes on the level that all of
//! its inputs give, and no property; a constant needs nobody's word. No relation gives a level that this program does not
//! give, where it has a contract. So no level is ever raised but by the word of who writes a contract.

mod flow;
mod join;
mod prune;

use super::certificate::{DemandId, EvidenceId, GuaranteeId};
use super::evaluation::{Evaluation, Leaf, System, Verdict};
use crate::interval::Truth;
use crate::knowledge::{ContractId, IdVec, KnowledgeBase, NeedId, Policy, Watched};
use crate::statement::Level;
use crate::substitution::Way;
use alloc::string::String;
use alloc::vec::Vec;
use flow::Flow;
use join::{Joint, Observed};

/// What is demanded in a model, ready to be composed.
#[derive(Clone, Debug)]
pub struct Assurance {
    /// All levels that are demanded or given anywhere, ascending.
    levels: Vec<Level>,
    demands: IdVec<NeedId, bool>,
}

impl Assurance {
    /// Of a model; `None` where no need demands anything: no contract, and no `integrity`. O(contracts + needs).
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Option<Assurance> {
        let contracts = knowledge.contracts();
        let demands = IdVec::filled(knowledge.needs().len(), |need: NeedId| {
            contracts.of_need(need).is_some() || knowledge.needs()[need].integrity.is_some()
        });
        if !demands.iter().any(|demands| *demands) {
            return None;
        }
        let asked =
            contracts.rows().iter().flat_map(|row| &row.asks).filter_map(|asked| asked.statement.level);
        let letters = knowledge.needs().iter().filter_map(|need| need.integrity).map(String::from);
        let scale = crate::knowledge::INTEGRITY_SCALE;
        let integrity = letters.filter_map(|letter| contracts.scales().level(scale, &letter));
        let given = contracts.rows().iter().flat_map(|row| &row.gives).filter_map(|it| it.statement.level);
        let signals = knowledge.signals().iter().filter_map(|it| contracts.integrity(&it.properties));
        let mut levels: Vec<Level> = asked.chain(integrity).chain(given).chain(signals).collect();
        levels.sort_unstable();
        levels.dedup();
        Some(Assurance { levels, demands })
    }

    /// Whether a need demands anything.
    #[must_use]
    pub fn demands(&self, need: NeedId) -> bool {
        self.demands.find(need).is_some_and(|demands| *demands)
    }

    /// What is done while nothing admissible serves a need.
    #[must_use]
    pub fn policy(knowledge: &KnowledgeBase, need: NeedId) -> Policy {
        knowledge.contracts().of_need(need).map(|contract| contract.policy).unwrap_or_default()
    }

    /// Composes the contracts of all who take part while a way serves a need.
    ///
    /// Time and space: linear in them and in the pairs of a demand and a guarantee that it may be met by, times the levels that
    /// are demanded anywhere.
    #[must_use]
    pub fn compose(&self, knowledge: &KnowledgeBase, need: NeedId, way: &Way) -> Composition {
        Composition::new(Joint::new(knowledge, Flow::Way(need, way), &self.levels))
    }
}

/// Contracts that are composed over one flow.
#[derive(Clone, Debug)]
pub struct Composition {
    system: System,
    observed: IdVec<EvidenceId, Observed>,
    /// What the need gives, the best first.
    roots: Vec<GuaranteeId>,
    /// What may be given of what the need asks, the highest level first.
    rungs: Vec<(DemandId, GuaranteeId, Level)>,
}

/// What can be given to a need now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Assessment {
    /// Whether what serves it is admissible: it holds.
    pub verdict: Verdict,
    /// The best that the need itself can give then.
    pub guarantee: Option<GuaranteeId>,
    /// The highest level at which what it asks is given now, met or not; `None` where nothing of it has one.
    pub level: Option<Level>,
}

/// A leaf that would have to change.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Lacking {
    /// Whose it is, as the model names it.
    pub subject: String,
    /// Of the demand or evidence.
    pub name: String,
    /// Which of the two.
    pub leaf: Leaf,
}

impl Composition {
    fn new(joint: Joint<'_>) -> Composition {
        let Joint { certificates, observed, roots, asked, .. } = joint;
        let roots = roots.into_iter().map(|(_, root)| root).collect();
        let system = System::new(certificates).unwrap_or_default();
        let mut rungs: Vec<_> = asked.iter().flat_map(|&(_, demand)| system.rungs(demand)).collect();
        rungs.sort_by_key(|&(_, _, level)| core::cmp::Reverse(level.rank));
        Composition { system, observed, roots, rungs }
    }

    /// What is composed, for an [`Evaluation`].
    #[must_use]
    pub fn system(&self) -> &System {
        &self.system
    }

    /// An evaluation in which all evidence is unknown; to change it allocates nothing.
    #[must_use]
    pub fn evaluation(&self) -> Evaluation {
        Evaluation::new(&self.system)
    }

    /// What the need gives, the best first.
    #[must_use]
    pub fn roots(&self) -> &[GuaranteeId] {
        &self.roots
    }

    /// What is to be measured, with whose it is. A piece that nobody can measure in this flow is left out: it stays unknown.
    pub fn evidence<'k>(
        &'k self,
        knowledge: &'k KnowledgeBase,
    ) -> impl Iterator<Item = (EvidenceId, ContractId, &'k Watched)> {
        let rows = knowledge.contracts().rows();
        let watched = move |(contract, at): (ContractId, usize)| {
            Some((contract, rows.find(contract)?.evidence.get(at)?))
        };
        self.observed.enumerate().filter_map(move |(id, observed)| {
            let (contract, watched) = observed.and_then(watched)?;
            Some((id, contract, watched))
        })
    }

    /// An evaluation in which each piece of evidence that can be measured in this flow is what is supposed of it.
    #[must_use]
    pub fn supposing(&self, truth: impl Fn(EvidenceId) -> Truth) -> Evaluation {
        let mut evaluation = self.evaluation();
        let measured = self.observed.enumerate().filter(|(_, observed)| observed.is_some());
        let changes: Vec<_> = measured.map(|(id, _)| (id, truth(id))).collect();
        evaluation.set_all(&self.system, changes.into_iter());
        evaluation
    }

    /// What can be given under this evidence. Allocates nothing; O(guarantees that the need's demands may be met by).
    #[must_use]
    pub fn assess(&self, evaluation: &Evaluation) -> Assessment {
        let verdict = |root: &GuaranteeId| evaluation.guarantee(&self.system, *root);
        let guarantee = self.roots.iter().copied().find(|root| verdict(root) == Verdict::Holds);
        let given = |&&(demand, given, _): &&(DemandId, GuaranteeId, Level)| {
            let holds = evaluation.guarantee(&self.system, given) == Verdict::Holds;
            holds && (guarantee.is_none() || evaluation.demand(&self.system, demand) == Verdict::Holds)
        };
        Assessment {
            verdict: self.roots.iter().map(verdict).min().unwrap_or(Verdict::Refused),
            guarantee,
            level: self.rungs.iter().find(given).map(|&(_, _, level)| level),
        }
    }

    /// What would have to change for the need to be served: minimal sets of evidence, of which one would do; where evidence
    /// alone cannot, the demands and evidence of the need's own last resort. At most `most` evaluations for each.
    #[must_use]
    pub fn why(&self, evaluation: &Evaluation, most: usize) -> Vec<Vec<Lacking>> {
        let mut sets: Vec<Vec<Lacking>> = Vec::new();
        for &root in &self.roots {
            let (repairs, _) = evaluation.why_no_guarantee(&self.system, root, most);
            let named = repairs
                .sets
                .into_iter()
                .map(|set| set.into_iter().map(|id| self.lacking(Leaf::Evidence(id))).collect());
            sets.extend(named);
        }
        if let (true, Some(&root)) = (sets.is_empty(), self.roots.last()) {
            let missing = evaluation.missing(&self.system, root, most);
            let named =
                missing.sets.into_iter().map(|set| set.into_iter().map(|leaf| self.lacking(leaf)).collect());
            sets.extend(named);
        }
        sets.sort_by_key(Vec::len);
        sets.dedup();
        sets
    }

    fn lacking(&self, leaf: Leaf) -> Lacking {
        let certificates = self.system.certificates();
        let (service, name) = match leaf {
            Leaf::Demand(id) => (certificates.demands[id].service, &certificates.demands[id].name),
            Leaf::Evidence(id) => (certificates.evidence[id].service, &certificates.evidence[id].name),
        };
        Lacking { subject: certificates.services[service].name.clone(), name: name.clone(), leaf }
    }
}
