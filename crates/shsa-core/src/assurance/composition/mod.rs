//! The contracts of a model, composed over the flow of information that serves a need.
//!
//! Contracts do not say which member meets whose demands: that follows from the substitution in use. Each member gives what its
//! contract states. A signal without a contract gives its `integrity`. A relation without a contract passes on the level that all
//! of its inputs give, and no property. A constant needs no guarantee. Where this program has a contract, no relation gives a
//! level that the program does not give. So only the author of a contract can raise a level.

mod flow;
mod join;
mod level_sets;
mod along;
mod bounds;

pub(super) use along::Along;
pub use bounds::Bounds;
pub(super) use level_sets::{Certified, Given};

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
use level_sets::Levels;

/// The levels and demands of a model, ready to be composed.
#[derive(Clone, Debug)]
pub struct Assurance {
    /// All levels that are demanded or given anywhere, ascending.
    levels: Vec<Level>,
    /// The level that each need demands by its key `integrity`.
    integrity: IdVec<NeedId, Option<Level>>,
    pub(super) sets: Levels,
    demands: IdVec<NeedId, bool>,
}

impl Assurance {
    /// The assurance of a model; `None` where no need demands anything: no contract, and no `integrity`. O(contracts + signals + relations + needs), times the levels.
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
        let scale = crate::knowledge::INTEGRITY_SCALE;
        let integrity = IdVec::filled(knowledge.needs().len(), |need: NeedId| {
            let letter = knowledge.needs()[need].integrity.map(String::from)?;
            contracts.scales().level(scale, &letter)
        });
        let given = contracts.rows().iter().flat_map(|row| &row.gives).filter_map(|it| it.statement.level);
        let signals = knowledge.signals().iter().filter_map(|it| contracts.integrity(&it.properties));
        let mut levels: Vec<Level> =
            asked.chain(integrity.iter().copied().flatten()).chain(given).chain(signals).collect();
        levels.sort_unstable();
        levels.dedup();
        let sets = Levels::new(knowledge, &levels, &integrity);
        Some(Assurance { levels, integrity, sets, demands })
    }

    /// Whether a need demands anything.
    #[must_use]
    pub fn demands(&self, need: NeedId) -> bool {
        self.demands.find(need).is_some_and(|demands| *demands)
    }

    /// The policy of a need while no admissible way serves it.
    #[must_use]
    pub fn policy(knowledge: &KnowledgeBase, need: NeedId) -> Policy {
        knowledge.contracts().of_need(need).map(|contract| contract.policy).unwrap_or_default()
    }

    /// Composes the contracts of all members while a way serves a need.
    ///
    /// Time and space: linear in the members and in the pairs of a demand with a guarantee that may meet it, times the number of
    /// levels that are demanded anywhere.
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
    /// The guarantees of the need, the best first.
    roots: Vec<GuaranteeId>,
    /// The guarantees that could meet the need's demands at some level, the highest level first.
    graded: Vec<(DemandId, GuaranteeId, Level)>,
}

/// The result of assessing a composition under the evidence of a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Assessment {
    /// Whether the way is admissible: it is when the verdict is `Holds`.
    pub verdict: Verdict,
    /// The best guarantee of the need that holds.
    pub guarantee: Option<GuaranteeId>,
    /// The highest level that is given now for the demands of the need, met or not; `None` where no guarantee with a level is
    /// given.
    pub level: Option<Level>,
}

/// A leaf that would have to change.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Lacking {
    /// The owner's name in the model.
    pub subject: String,
    /// The name of the demand or evidence.
    pub name: String,
    /// The demand or evidence.
    pub leaf: Leaf,
}

impl Composition {
    fn new(joint: Joint<'_>) -> Composition {
        let Joint { certificates, observed, roots, asked, .. } = joint;
        let roots = roots.into_iter().map(|(_, root)| root).collect();
        let system = System::new(certificates).unwrap_or_default();
        let mut graded: Vec<_> = asked.iter().flat_map(|&(_, demand)| system.graded(demand)).collect();
        graded.sort_by_key(|&(_, _, level)| core::cmp::Reverse(level.rank));
        Composition { system, observed, roots, graded }
    }

    /// The composed certificates, for an [`Evaluation`].
    #[must_use]
    pub fn system(&self) -> &System {
        &self.system
    }

    /// An evaluation in which all evidence is unknown; changing it allocates nothing.
    #[must_use]
    pub fn evaluation(&self) -> Evaluation {
        Evaluation::new(&self.system)
    }

    /// The guarantees of the need, the best first.
    #[must_use]
    pub fn roots(&self) -> &[GuaranteeId] {
        &self.roots
    }

    /// The evidence to be measured, with its contract. Evidence that cannot be measured in this flow is left out and stays
    /// unknown.
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

    /// An evaluation in which each piece of evidence that can be measured in this flow has the supposed truth.
    #[must_use]
    pub fn supposing(&self, truth: impl Fn(EvidenceId) -> Truth) -> Evaluation {
        let mut evaluation = self.evaluation();
        let measured = self.observed.enumerate().filter(|(_, observed)| observed.is_some());
        let changes: Vec<_> = measured.map(|(id, _)| (id, truth(id))).collect();
        evaluation.set_all(&self.system, changes.into_iter());
        evaluation
    }

    /// The assessment under this evidence. Allocates nothing; O(guarantees that may meet the need's demands).
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
            level: self.graded.iter().find(given).map(|&(_, _, level)| level),
        }
    }

    /// Minimal sets of evidence that would have to change for the need to be served; one of them is enough. Where evidence alone
    /// is not enough, sets of the demands and evidence of the need's last guarantee. At most `most` evaluations for each.
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
