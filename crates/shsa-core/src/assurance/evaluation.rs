//! Which guarantees and demands hold under the current evidence, and what would have to change.

use super::certificate::{Certificates, DemandId, EvidenceId, GuaranteeId, Problem, Quantifier};
use super::circuit::{Circuit, NodeId};
use super::fixed_point::FixedPoint;
use super::minimal::{Question, Role, Sets};
use crate::interval::{Interval, Truth};
use crate::knowledge::{Id, IdVec};
use crate::statement::Level;
use crate::time::Time;
use alloc::vec::Vec;

/// Composed certificates: which guarantees can meet which demands is settled.
#[derive(Clone, Debug)]
pub struct System {
    certificates: Certificates,
    circuit: Circuit,
}

impl System {
    /// Composes certificates over the flow that their demands name.
    ///
    /// Time: linear in the certificates and in the pairs of a demand with a guarantee of a service that it asks.
    ///
    /// # Errors
    /// All problems of the certificates.
    pub fn new(certificates: Certificates) -> Result<System, Vec<Problem>> {
        let problems = certificates.problems();
        if !problems.is_empty() {
            return Err(problems);
        }
        let circuit = Circuit::new(&certificates);
        Ok(System { certificates, circuit })
    }

    /// Which nodes rest on which.
    pub(super) fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    /// The certificates.
    #[must_use]
    pub fn certificates(&self) -> &Certificates {
        &self.certificates
    }

    /// The guarantees that meet a demand, whether they hold or not: one asked service after the other.
    pub fn matches(&self, demand: DemandId) -> impl Iterator<Item = GuaranteeId> {
        let (row, all) = (&self.certificates.demands[demand], &self.certificates.guarantees);
        let offered =
            row.of.iter().flat_map(|&service| all.enumerate().filter(move |(_, it)| it.service == service));
        offered.filter(|(_, given)| given.statement.meets(&row.statement)).map(|(id, _)| id)
    }

    /// The guarantees that could meet a demand with a level if the level were left aside: those with a level of the same scale.
    pub(super) fn graded(&self, demand: DemandId) -> impl Iterator<Item = (DemandId, GuaranteeId, Level)> {
        let graded = self.graded_by_service(demand).into_iter().flatten();
        graded.map(move |(given, level)| (demand, given, level))
    }

    /// The guarantees that state what a demand asks, with any level of the same scale; one list for each asked service.
    fn graded_by_service(&self, demand: DemandId) -> Vec<Vec<(GuaranteeId, Level)>> {
        let row = &self.certificates.demands[demand];
        let Some(asked) = row.statement.level else { return Vec::new() };
        let row_of = |(id, given): (GuaranteeId, &super::Guarantee)| {
            let level = given.statement.level.filter(|level| level.scale == asked.scale)?;
            given.statement.says(&row.statement).then_some((id, level))
        };
        let of =
            |service| self.certificates.guarantees.enumerate().filter(move |(_, it)| it.service == service);
        row.of.iter().map(|&service| of(service).filter_map(row_of).collect()).collect()
    }
}

impl Default for System {
    /// The system without certificates.
    fn default() -> System {
        let certificates = Certificates::default();
        System { circuit: Circuit::new(&certificates), certificates }
    }
}

/// Whether a guarantee can be given, or a demand is met, and if not, of which kind the reason is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// The guarantee holds, or the demand is met.
    Holds,
    /// It would hold if all unknown evidence were true.
    Open,
    /// No evidence contradicts it, but it rests on itself.
    Circular,
    /// None of the other three.
    Refused,
}

impl Verdict {
    /// The name of the verdict in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::Open => "open",
            Verdict::Circular => "circular",
            Verdict::Refused => "refused",
        }
    }
}

/// A leaf of a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Leaf {
    /// A demand of the same service.
    Demand(DemandId),
    /// Evidence of the same service.
    Evidence(EvidenceId),
}

/// A level that evidence could give.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Higher {
    /// The level, above the one that is given now.
    pub level: Level,
    /// Minimal sets of evidence that would give the level.
    pub repairs: Sets<EvidenceId>,
}

/// The guarantees and demands of a system that hold now. Evidence is unknown until it is set.
#[derive(Clone, Debug)]
pub struct Evaluation {
    truth: IdVec<EvidenceId, Truth>,
    /// When an observation ceases to count.
    until: IdVec<EvidenceId, Time>,
    /// The nodes that follow from true evidence.
    least: FixedPoint,
    /// The nodes that would follow if unknown evidence were true.
    possible: FixedPoint,
    /// The nodes whose failure is derived; the greatest fixed point has all others.
    failing: FixedPoint,
}

impl Evaluation {
    /// The evaluation of a system whose evidence is all unknown.
    ///
    /// Time and space: linear in the circuit. All later changes of evidence allocate nothing.
    #[must_use]
    pub fn new(system: &System) -> Evaluation {
        let circuit = &system.circuit;
        let fails = |node: NodeId| {
            let children = circuit.children.row(node).len() as u32;
            (children + 1).saturating_sub(circuit.needed[node])
        };
        let count = system.certificates.evidence.len();
        let mut evaluation = Evaluation {
            truth: IdVec::filled(count, |_| Truth::False),
            until: IdVec::filled(count, |_| Time::MAX),
            least: FixedPoint::new(circuit, circuit.needed.clone()),
            possible: FixedPoint::new(circuit, circuit.needed.clone()),
            failing: FixedPoint::new(circuit, IdVec::filled(circuit.needed.len(), fails)),
        };
        for evidence in system.certificates.evidence.ids() {
            evaluation.failing.set(circuit, circuit.evidence_node(evidence), true);
            evaluation.put(system, evidence, Truth::Unknown);
        }
        evaluation.settle(system);
        evaluation
    }

    /// Sets the truth of a piece of evidence.
    ///
    /// Time: linear in what rests on it, at most; no allocation.
    pub fn set(&mut self, system: &System, evidence: EvidenceId, truth: Truth) {
        self.set_all(system, core::iter::once((evidence, truth)));
    }

    /// Sets the truth of several pieces of evidence at once.
    pub fn set_all(&mut self, system: &System, changes: impl Iterator<Item = (EvidenceId, Truth)>) {
        for (evidence, truth) in changes {
            self.until[evidence] = Time::MAX;
            self.put(system, evidence, truth);
        }
        self.settle(system);
    }

    /// Sets evidence by a measurement at a time. The measurement counts for the evidence's `max_age`.
    pub fn observe(&mut self, system: &System, evidence: EvidenceId, measured: Interval, at: Time) {
        let row = &system.certificates.evidence[evidence];
        self.put(system, evidence, row.truth(measured));
        self.until[evidence] = row.max_age.map_or(Time::MAX, |age| at + age);
        self.settle(system);
    }

    /// Lets time pass: evidence that is too old is unknown. Time: linear in the evidence.
    pub fn pass(&mut self, system: &System, now: Time) {
        for evidence in system.certificates.evidence.ids() {
            if self.until[evidence] < now {
                self.until[evidence] = Time::MAX;
                self.put(system, evidence, Truth::Unknown);
            }
        }
        self.settle(system);
    }

    /// The last moment at which no known evidence is too old; `None` if none ever is.
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        self.until.iter().copied().min().filter(|&until| until < Time::MAX)
    }

    fn put(&mut self, system: &System, evidence: EvidenceId, truth: Truth) {
        self.truth[evidence] = truth;
        let (circuit, node) = (&system.circuit, system.circuit.evidence_node(evidence));
        self.least.set(circuit, node, truth.is_true());
        self.possible.set(circuit, node, !truth.is_false());
        self.failing.set(circuit, node, !truth.is_true());
    }

    fn settle(&mut self, system: &System) {
        self.least.settle(&system.circuit);
        self.possible.settle(&system.circuit);
        self.failing.settle(&system.circuit);
    }

    /// The truth of a piece of evidence now.
    #[must_use]
    pub fn truth(&self, evidence: EvidenceId) -> Truth {
        self.truth[evidence]
    }

    /// Whether a guarantee can be given now.
    #[must_use]
    pub fn guarantee(&self, system: &System, guarantee: GuaranteeId) -> Verdict {
        self.verdict(system.circuit.guarantee_node(guarantee))
    }

    /// Whether a demand is met now.
    #[must_use]
    pub fn demand(&self, system: &System, demand: DemandId) -> Verdict {
        self.verdict(system.circuit.demand_node(demand))
    }

    /// Whether a guarantee is in the greatest fixed point. For comparisons in tests: no decision may rest on it.
    #[must_use]
    pub fn is_consistent(&self, system: &System, guarantee: GuaranteeId) -> bool {
        !self.failing.holds(system.circuit.guarantee_node(guarantee))
    }

    fn verdict(&self, node: NodeId) -> Verdict {
        if self.least.holds(node) {
            Verdict::Holds
        } else if self.possible.holds(node) {
            Verdict::Open
        } else if !self.failing.holds(node) {
            Verdict::Circular
        } else {
            Verdict::Refused
        }
    }

    /// Minimal sets of unmet leaves of a guarantee's own condition that would make the condition true, with the rest unchanged.
    ///
    /// At most `most` evaluations.
    #[must_use]
    pub fn missing(&self, system: &System, guarantee: GuaranteeId, most: usize) -> Sets<Leaf> {
        let circuit = &system.circuit;
        let demands = system.certificates.demands.len();
        let own = circuit.guarantee_node(guarantee);
        let role = |node: NodeId| {
            let is_leaf = circuit.evidence_of(node).is_some() || circuit.demand_of(node, demands).is_some();
            match (is_leaf, self.least.holds(node)) {
                (true, true) => Role::Fixed(true),
                (true, false) => Role::Leaf,
                (false, _) => Role::Inner,
            }
        };
        let (sets, _) = Question::new(circuit, &[[own].into()], role).answer(most);
        sets.map(|node| match circuit.evidence_of(node) {
            Some(evidence) => Leaf::Evidence(evidence),
            None => Leaf::Demand(circuit.demand_of(node, demands).unwrap_or(DemandId::from_index(0))),
        })
    }

    /// Minimal sets of evidence that would make a guarantee hold if it were true, and minimal sets of evidence that prevent the
    /// guarantee even if all other evidence were true.
    ///
    /// At most `most` evaluations of what it rests on for each; exponential in the evidence without that bound.
    #[must_use]
    pub fn why_no_guarantee(
        &self,
        system: &System,
        guarantee: GuaranteeId,
        most: usize,
    ) -> (Sets<EvidenceId>, Sets<EvidenceId>) {
        self.why_not(system, &[[system.circuit.guarantee_node(guarantee)].into()], most)
    }

    /// As [`Evaluation::why_no_guarantee`] for a demand.
    #[must_use]
    pub fn why_unmet(
        &self,
        system: &System,
        demand: DemandId,
        most: usize,
    ) -> (Sets<EvidenceId>, Sets<EvidenceId>) {
        self.why_not(system, &[[system.circuit.demand_node(demand)].into()], most)
    }

    fn why_not(
        &self,
        system: &System,
        goal: &[Vec<NodeId>],
        most: usize,
    ) -> (Sets<EvidenceId>, Sets<EvidenceId>) {
        let circuit = &system.circuit;
        let role = |node: NodeId| match circuit.evidence_of(node) {
            Some(_) if self.least.holds(node) => Role::Fixed(true),
            Some(_) => Role::Leaf,
            None => Role::Inner,
        };
        let (repairs, causes) = Question::new(circuit, goal, role).answer(most);
        let evidence = |node: NodeId| EvidenceId::from_index(node.index());
        (repairs.map(evidence), causes.map(evidence))
    }

    /// The highest level of a demand's scale that is given now by guarantees with the demanded type and properties; the level of
    /// the demand itself does not matter. Of several services that must all give a level, the lowest counts. `None`: no level is
    /// given, the demand has no level, or it asks no service.
    #[must_use]
    pub fn highest(&self, system: &System, demand: DemandId) -> Option<Level> {
        highest(system, demand, &self.least)
    }

    /// As [`Evaluation::highest`], if all that is unknown were true.
    #[must_use]
    pub fn highest_if_unknown_true(&self, system: &System, demand: DemandId) -> Option<Level> {
        highest(system, demand, &self.possible)
    }

    /// The levels above the highest that evidence could give, the lowest first.
    ///
    /// At most `most` evaluations for each.
    #[must_use]
    pub fn higher(&self, system: &System, demand: DemandId, most: usize) -> Vec<Higher> {
        let row = &system.certificates.demands[demand];
        let Some(asked) = row.statement.level.filter(|_| !row.of.is_empty()) else { return Vec::new() };
        let levels = system.certificates.scales.get(asked.scale).map_or(0, |scale| scale.levels.len() as u32);
        let first = self.highest(system, demand).map_or(0, |level| level.rank + 1);
        let graded = system.graded_by_service(demand);
        let level = |rank| {
            let goal = goal(system, &graded, row.quantifier, rank);
            let (repairs, _) = self.why_not(system, &goal, most);
            Higher { level: Level { scale: asked.scale, rank }, repairs }
        };
        let could = |higher: &Higher| !higher.repairs.sets.is_empty() || !higher.repairs.is_complete;
        (first..levels).map(level).filter(could).collect()
    }
}

fn highest(system: &System, demand: DemandId, point: &FixedPoint) -> Option<Level> {
    let best = |graded: Vec<(GuaranteeId, Level)>| {
        let given = graded.into_iter().filter(|&(id, _)| point.holds(system.circuit.guarantee_node(id)));
        given.map(|(_, level)| level).max()
    };
    let of_each = system.graded_by_service(demand).into_iter().map(best);
    match system.certificates.demands[demand].quantifier {
        Quantifier::Any => of_each.flatten().max(),
        // A service that gives no level is below all others.
        Quantifier::All => of_each.min().flatten(),
    }
}

/// The goal of a demand that is met at a rank: one node of each group.
fn goal(
    system: &System,
    graded: &[Vec<(GuaranteeId, Level)>],
    quantifier: Quantifier,
    rank: u32,
) -> Vec<Vec<NodeId>> {
    let high = |graded: &Vec<(GuaranteeId, Level)>| {
        let high = graded.iter().filter(|(_, level)| level.rank >= rank);
        high.map(|&(id, _)| system.circuit.guarantee_node(id)).collect::<Vec<_>>()
    };
    let groups: Vec<Vec<NodeId>> = graded.iter().map(high).collect();
    match quantifier {
        Quantifier::Any => Vec::from([groups.concat()]),
        Quantifier::All => groups,
    }
}
