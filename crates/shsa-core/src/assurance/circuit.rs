//! Composed certificates as one circuit of thresholds: a node holds when enough of its children do.
//!
//! Evidence, demands, guarantees and the inner nodes of conditions are all nodes; and, or, n-of-m, "one of these services"
//! and "each of them" differ in the threshold only. Nodes that rest on each other form a component; components are numbered
//! so that each rests only on lower ones.

use super::certificate::{
    Certificates, Demand, DemandId, EvidenceId, GuaranteeId, Quantifier, ServiceId, Tree,
};
use crate::knowledge::{Id, IdVec, Rows, id};
use alloc::vec::Vec;

id! {
    /// A node: evidence first, then guarantees, then demands, then gates.
    pub(super) NodeId
    /// Nodes that rest on each other.
    pub(super) ComponentId
}

/// Which nodes rest on which.
#[derive(Clone, Debug)]
pub(super) struct Circuit {
    /// How many children must hold; without meaning for evidence.
    pub(super) needed: IdVec<NodeId, u32>,
    /// The nodes on which a node rests, with repetitions.
    pub(super) children: Rows<NodeId, NodeId>,
    /// The nodes that rest on a node, with repetitions.
    pub(super) parents: Rows<NodeId, NodeId>,
    /// The component of each node.
    pub(super) component: IdVec<NodeId, ComponentId>,
    /// The nodes of each component.
    pub(super) members: Rows<ComponentId, NodeId>,
    /// Whether a node of the component rests on itself, directly or through others.
    pub(super) is_cyclic: IdVec<ComponentId, bool>,
    evidence: usize,
    guarantees: usize,
}

/// The circuit while it is built.
struct Builder<'c> {
    certificates: &'c Certificates,
    /// The guarantees of each service.
    offers: Rows<ServiceId, GuaranteeId>,
    needed: IdVec<NodeId, u32>,
    edges: Vec<(NodeId, NodeId)>,
}

impl Circuit {
    /// The circuit of certificates without problems.
    ///
    /// Time: linear in the certificates and in the pairs of a demand with a guarantee of a service that it asks.
    pub(super) fn new(certificates: &Certificates) -> Circuit {
        let (evidence, guarantees) = (certificates.evidence.len(), certificates.guarantees.len());
        let fixed = evidence + guarantees + certificates.demands.len();
        let offers = certificates.guarantees.enumerate().map(|(id, row)| (row.service, id));
        let mut builder = Builder {
            certificates,
            offers: Rows::grouped(certificates.services.len(), offers),
            needed: IdVec::filled(fixed, |_| 0),
            edges: Vec::new(),
        };
        for (id, row) in certificates.guarantees.enumerate() {
            builder.fill(NodeId::from_index(evidence + id.index()), &row.when);
        }
        for (id, row) in certificates.demands.enumerate() {
            builder.demand(NodeId::from_index(evidence + guarantees + id.index()), row);
        }
        let count = builder.needed.len();
        let children: Rows<NodeId, NodeId> = Rows::grouped(count, builder.edges.iter().copied());
        let parents = Rows::grouped(count, builder.edges.iter().map(|&(parent, child)| (child, parent)));
        let component = components(&children, count);
        let last = component.iter().copied().max().map_or(0, |last| last.index() + 1);
        let members = Rows::grouped(last, component.enumerate().map(|(node, &component)| (component, node)));
        let mut is_cyclic = IdVec::filled(last, |component| members.row(component).len() > 1);
        for &(parent, child) in &builder.edges {
            if parent == child {
                is_cyclic[component[parent]] = true;
            }
        }
        Circuit {
            needed: builder.needed,
            children,
            parents,
            component,
            members,
            is_cyclic,
            evidence,
            guarantees,
        }
    }

    pub(super) fn evidence_node(&self, id: EvidenceId) -> NodeId {
        NodeId::from_index(id.index())
    }

    pub(super) fn guarantee_node(&self, id: GuaranteeId) -> NodeId {
        NodeId::from_index(self.evidence + id.index())
    }

    pub(super) fn demand_node(&self, id: DemandId) -> NodeId {
        NodeId::from_index(self.evidence + self.guarantees + id.index())
    }

    /// The evidence of a node; `None` for another node.
    pub(super) fn evidence_of(&self, node: NodeId) -> Option<EvidenceId> {
        (node.index() < self.evidence).then(|| EvidenceId::from_index(node.index()))
    }

    /// The demand of a node; `None` for another node. `demands` is the number of demands.
    pub(super) fn demand_of(&self, node: NodeId, demands: usize) -> Option<DemandId> {
        let index = node.index().checked_sub(self.evidence + self.guarantees)?;
        (index < demands).then(|| DemandId::from_index(index))
    }
}

impl Builder<'_> {
    /// Makes a node hold when its condition does.
    fn fill(&mut self, node: NodeId, tree: &Tree) {
        let (needed, parts) = match tree {
            Tree::All(parts) => (parts.len() as u32, parts.as_slice()),
            Tree::Any(parts) => (1, parts.as_slice()),
            Tree::AtLeast(needed, parts) => (*needed, parts.as_slice()),
            leaf => (1, core::slice::from_ref(leaf)),
        };
        self.needed[node] = needed;
        for part in parts {
            let child = self.part(part);
            self.edges.push((node, child));
        }
    }

    /// The node for a part of a condition.
    fn part(&mut self, tree: &Tree) -> NodeId {
        let certificates = self.certificates;
        match tree {
            Tree::Evidence(id) => NodeId::from_index(id.index()),
            Tree::Demand(id) => {
                NodeId::from_index(certificates.evidence.len() + certificates.guarantees.len() + id.index())
            }
            gate => {
                let node = self.needed.push(0);
                self.fill(node, gate);
                node
            }
        }
    }

    /// Makes a node hold when the demand is met.
    fn demand(&mut self, node: NodeId, demand: &Demand) {
        match demand.quantifier {
            Quantifier::Any => {
                self.needed[node] = 1;
                for &service in &demand.of {
                    self.offered(node, service, demand);
                }
            }
            Quantifier::All => {
                self.needed[node] = demand.of.len() as u32;
                for &service in &demand.of {
                    let one = self.needed.push(1);
                    self.edges.push((node, one));
                    self.offered(one, service, demand);
                }
            }
        }
    }

    /// Adds each guarantee of a service that meets the demand as a child.
    fn offered(&mut self, node: NodeId, service: ServiceId, demand: &Demand) {
        let evidence = self.certificates.evidence.len();
        for &id in self.offers.row(service) {
            if self.certificates.guarantees[id].statement.meets(&demand.statement) {
                self.edges.push((node, NodeId::from_index(evidence + id.index())));
            }
        }
    }
}

/// Strongly connected components, each numbered above those on which it rests: O(nodes + edges).
///
/// Tarjan 1972, doi:10.1137/0201010, with a stack of its own, as a chain of certificates may be long.
fn components(children: &Rows<NodeId, NodeId>, count: usize) -> IdVec<NodeId, ComponentId> {
    let mut search = Search {
        component: IdVec::filled(count, |_| ComponentId::from_index(0)),
        number: IdVec::filled(count, |_| 0),
        lowest: IdVec::filled(count, |_| 0),
        is_done: IdVec::filled(count, |_| false),
        open: Vec::new(),
        found: 0,
        visited: 0,
    };
    let mut path: Vec<(NodeId, usize)> = Vec::new();
    for start in (0..count).map(NodeId::from_index) {
        if search.number[start] == 0 {
            search.enter(start);
            path.push((start, 0));
        }
        while let Some((node, next)) = path.pop() {
            if let Some(&child) = children.row(node).get(next) {
                path.push((node, next + 1));
                if search.number[child] == 0 {
                    search.enter(child);
                    path.push((child, 0));
                } else {
                    search.look(node, child);
                }
            } else {
                search.leave(node);
                if let Some(&(parent, _)) = path.last() {
                    search.look(parent, node);
                }
            }
        }
    }
    search.component
}

struct Search {
    component: IdVec<NodeId, ComponentId>,
    /// When a node was visited, counted from 1; 0: not yet.
    number: IdVec<NodeId, u32>,
    /// The earliest open node that is reached.
    lowest: IdVec<NodeId, u32>,
    is_done: IdVec<NodeId, bool>,
    open: Vec<NodeId>,
    found: usize,
    visited: u32,
}

impl Search {
    fn enter(&mut self, node: NodeId) {
        self.visited += 1;
        self.lowest[node] = self.visited;
        self.number[node] = self.visited;
        self.open.push(node);
    }

    fn look(&mut self, node: NodeId, child: NodeId) {
        if !self.is_done[child] {
            self.lowest[node] = self.lowest[node].min(self.lowest[child]);
        }
    }

    /// Closes the component of a node that reaches nothing earlier.
    fn leave(&mut self, node: NodeId) {
        if self.lowest[node] != self.number[node] {
            return;
        }
        while let Some(member) = self.open.pop() {
            self.component[member] = ComponentId::from_index(self.found);
            self.is_done[member] = true;
            if member == node {
                break;
            }
        }
        self.found += 1;
    }
}
