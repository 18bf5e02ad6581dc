//! Conditional safety certificates: what services guarantee, on which conditions, and what they demand of others.

use crate::interval::{Interval, Truth};
use crate::knowledge::{IdVec, id};
use crate::statement::{self, Scales, Statement};
use crate::time::Span;
use alloc::string::String;
use alloc::vec::Vec;

id! {
    /// A service with a certificate.
    pub ServiceId
    /// A guarantee of a certificate.
    pub GuaranteeId
    /// A demand of a certificate.
    pub DemandId
    /// A piece of evidence of a certificate.
    pub EvidenceId
}

/// Whether a service is an application or a platform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServiceKind {
    /// Horizontal direction: an application gives and takes information.
    Application,
    /// Vertical direction: a platform grants applications time, memory, isolation.
    Platform,
}

/// An application or a platform with a certificate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Service {
    /// The name in files.
    pub name: String,
    /// Application or platform.
    pub kind: ServiceKind,
}

/// A statement that holds on a condition.
#[derive(Clone, Debug, PartialEq)]
pub struct Guarantee {
    /// The name in files.
    pub name: String,
    /// The service that gives the guarantee.
    pub service: ServiceId,
    /// The guaranteed statement.
    pub statement: Statement,
    /// The condition, over demands and evidence of the same service.
    pub when: Tree,
}

/// How many of the services that are asked must meet a demand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantifier {
    /// One of them; of none it is not met.
    Any,
    /// Each of them; of none it is met.
    All,
}

/// A statement that is asked of others.
#[derive(Clone, Debug, PartialEq)]
pub struct Demand {
    /// The name in files.
    pub name: String,
    /// The service that makes the demand.
    pub service: ServiceId,
    /// The demanded statement.
    pub statement: Statement,
    /// The services that are asked: those from which the information, or the resource, comes now.
    pub of: Vec<ServiceId>,
    /// How many of these services must meet the demand.
    pub quantifier: Quantifier,
}

/// An observation that a service makes itself at run time.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// The name in files.
    pub name: String,
    /// The service that makes the observation.
    pub service: ServiceId,
    /// The range of the measured value, in the unit of the measurement; `None` where the evidence is true or false.
    pub within: Option<Interval>,
    /// For how long an observation counts; `None`: for ever.
    pub max_age: Option<Span>,
}

impl Evidence {
    /// The truth by a measurement: true when all of it lies in the range, false when none of it does. Without a range a
    /// measurement decides nothing.
    #[must_use]
    pub fn truth(&self, measured: Interval) -> Truth {
        self.within.map_or(Truth::Unknown, |range| statement::truth(measured, range))
    }
}

/// A condition. It has no negation, so that what holds only grows with what is assumed to hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Tree {
    /// All parts hold; true of no parts.
    All(Vec<Tree>),
    /// One of the parts holds; false of no parts.
    Any(Vec<Tree>),
    /// At least this many of the parts hold.
    AtLeast(u32, Vec<Tree>),
    /// A demand is met.
    Demand(DemandId),
    /// Evidence is true.
    Evidence(EvidenceId),
}

impl Tree {
    /// Holds always.
    pub const ALWAYS: Tree = Tree::All(Vec::new());
}

/// All certificates of a system, before they are composed: rows that refer to each other by id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certificates {
    /// The scales of the levels.
    pub scales: Scales,
    /// The services that have a certificate.
    pub services: IdVec<ServiceId, Service>,
    /// The guarantees of all services.
    pub guarantees: IdVec<GuaranteeId, Guarantee>,
    /// The demands of all services.
    pub demands: IdVec<DemandId, Demand>,
    /// The evidence of all services.
    pub evidence: IdVec<EvidenceId, Evidence>,
}

/// Why certificates cannot be composed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Problem {
    /// A guarantee names a service that is not there.
    GuaranteeOfNobody(GuaranteeId),
    /// A demand names a service that is not there.
    DemandOfNobody(DemandId),
    /// Evidence names a service that is not there.
    EvidenceOfNobody(EvidenceId),
    /// The condition of a guarantee has a leaf that is not there, or is another service's.
    ForeignLeaf(GuaranteeId),
    /// The condition of a guarantee is nested more deeply than [`MAX_DEPTH`].
    TooDeep(GuaranteeId),
    /// A range of a statement is empty: nothing lies in it.
    EmptyRange(ServiceId),
}

/// The deepest nesting of a condition.
pub const MAX_DEPTH: u32 = 64;

impl Certificates {
    /// Everything that is wrong with the certificates, guarantees first.
    ///
    /// Time: linear in the size of the certificates.
    #[must_use]
    pub fn problems(&self) -> Vec<Problem> {
        let guarantees = self.guarantees.enumerate().filter_map(|(id, row)| self.of_guarantee(id, row));
        let demands = self.demands.enumerate().filter_map(|(id, row)| self.of_demand(id, row));
        let evidence = self.evidence.enumerate().filter(|(_, row)| !self.is_known(row.service));
        let evidence = evidence.map(|(id, _)| Problem::EvidenceOfNobody(id));
        guarantees.chain(demands).chain(evidence).collect()
    }

    fn is_known(&self, service: ServiceId) -> bool {
        self.services.find(service).is_some()
    }

    fn of_guarantee(&self, id: GuaranteeId, row: &Guarantee) -> Option<Problem> {
        if !self.is_known(row.service) {
            return Some(Problem::GuaranteeOfNobody(id));
        }
        let tree = self.of_tree(id, row.service, &row.when, 0);
        tree.or_else(|| has_empty_range(&row.statement).then_some(Problem::EmptyRange(row.service)))
    }

    fn of_demand(&self, id: DemandId, row: &Demand) -> Option<Problem> {
        let known = self.is_known(row.service) && row.of.iter().all(|&service| self.is_known(service));
        if !known {
            return Some(Problem::DemandOfNobody(id));
        }
        has_empty_range(&row.statement).then_some(Problem::EmptyRange(row.service))
    }

    fn of_tree(&self, id: GuaranteeId, owner: ServiceId, tree: &Tree, depth: u32) -> Option<Problem> {
        let own = match tree {
            Tree::All(parts) | Tree::Any(parts) | Tree::AtLeast(_, parts) if depth < MAX_DEPTH => {
                return parts.iter().find_map(|part| self.of_tree(id, owner, part, depth + 1));
            }
            Tree::All(_) | Tree::Any(_) | Tree::AtLeast(..) => return Some(Problem::TooDeep(id)),
            Tree::Demand(demand) => self.demands.find(*demand).map(|row| row.service),
            Tree::Evidence(evidence) => self.evidence.find(*evidence).map(|row| row.service),
        };
        (own != Some(owner)).then_some(Problem::ForeignLeaf(id))
    }
}

fn has_empty_range(statement: &Statement) -> bool {
    statement.properties.iter().any(|property| match &property.content {
        statement::Content::Numeric { ranges, .. } => ranges.iter().any(|range| range.is_empty()),
        _ => false,
    })
}
