//! The least set of nodes that hold, kept up to date as evidence changes.
//!
//! Each node that holds is derived from evidence, never from itself. A component of nodes that rest on each other is derived anew
//! from the nodes outside of it whenever one of these ceases to hold, so that no derivation outlives what it rests on. All other
//! nodes only count their children that hold.

use super::circuit::{Circuit, ComponentId, NodeId};
use crate::knowledge::{Id, IdVec};
use alloc::vec::Vec;

/// The least fixed point of a circuit, and the memory to keep it up to date without allocating.
#[derive(Clone, Debug)]
pub(super) struct FixedPoint {
    /// How many children must hold.
    needed: IdVec<NodeId, u32>,
    /// How many children hold.
    count: IdVec<NodeId, u32>,
    holds: IdVec<NodeId, bool>,
    /// The components to derive again, one bit each.
    pending: Vec<u64>,
    /// The pending components of which an input has ceased to hold.
    shrunk: Vec<u64>,
    /// The nodes of one component that have come to hold.
    queue: Vec<NodeId>,
    /// Which members of one component held before.
    before: Vec<bool>,
}

impl FixedPoint {
    /// The fixed point while no source holds. `needed` has the thresholds of the nodes of `circuit`.
    pub(super) fn new(circuit: &Circuit, needed: IdVec<NodeId, u32>) -> FixedPoint {
        let components = circuit.is_cyclic.len();
        let largest = circuit.is_cyclic.ids().map(|id| circuit.members.row(id).len()).max().unwrap_or(0);
        let mut point = FixedPoint {
            count: IdVec::filled(needed.len(), |_| 0),
            holds: IdVec::filled(needed.len(), |_| false),
            needed,
            pending: (0..components.div_ceil(64)).map(|_| 0).collect(),
            shrunk: (0..components.div_ceil(64)).map(|_| 0).collect(),
            queue: Vec::with_capacity(largest),
            before: Vec::with_capacity(largest),
        };
        circuit.is_cyclic.ids().for_each(|component| mark(&mut point.pending, component));
        point.settle(circuit);
        point
    }

    /// Whether a node holds.
    pub(super) fn holds(&self, node: NodeId) -> bool {
        self.holds[node]
    }

    /// Makes a source hold or not; [`FixedPoint::settle`] must follow.
    pub(super) fn set(&mut self, circuit: &Circuit, source: NodeId, holds: bool) {
        if self.holds[source] != holds {
            self.holds[source] = holds;
            self.pass_on(circuit, source, holds);
        }
    }

    /// Derives again all nodes that rest on changed sources.
    ///
    /// Time: linear in the edges of the components of which an input has changed, plus a word for each 64 components.
    pub(super) fn settle(&mut self, circuit: &Circuit) {
        let mut word = 0;
        // Only higher components become pending meanwhile, perhaps of the same word.
        while let Some(bits) = self.pending.get_mut(word) {
            if *bits == 0 {
                word += 1;
                continue;
            }
            let bit = bits.trailing_zeros() as usize;
            *bits &= *bits - 1;
            let mut next = Some(ComponentId::from_index(word * 64 + bit));
            while let Some(component) = next {
                next = self.derive(circuit, component);
            }
        }
    }

    /// Derives a component; returns the one to derive next where that is known without a look at those that are pending, as in a chain.
    fn derive(&mut self, circuit: &Circuit, component: ComponentId) -> Option<ComponentId> {
        let members = circuit.members.row(component);
        match members {
            [only] if !circuit.is_cyclic[component] => {
                let holds = self.count[*only] >= self.needed[*only];
                // A source keeps the value that it was set to.
                if circuit.evidence_of(*only).is_some() || holds == self.holds[*only] {
                    return None;
                }
                self.holds[*only] = holds;
                if let [parent] = circuit.parents.row(*only) {
                    let above = circuit.component[*parent];
                    if !circuit.is_cyclic[above] && self.is_lowest(component, above) {
                        self.recount(*parent, holds);
                        return Some(above);
                    }
                }
                self.pass_on(circuit, *only, holds);
            }
            members if take(&mut self.shrunk, component) => self.derive_anew(circuit, component, members),
            members => self.derive_more(circuit, component, members),
        }
        None
    }

    /// Whether nothing is pending up to `above`, itself included, where nothing is up to `derived`; no where that takes a search.
    fn is_lowest(&self, derived: ComponentId, above: ComponentId) -> bool {
        let word = above.index() / 64;
        let up_to = u64::MAX >> (63 - above.index() % 64);
        word == derived.index() / 64 && self.pending.get(word).is_some_and(|bits| bits & up_to == 0)
    }

    /// Derives further nodes beyond those that hold: no input of the component has ceased to hold.
    fn derive_more(&mut self, circuit: &Circuit, component: ComponentId, members: &[NodeId]) {
        self.queue.clear();
        for &member in members {
            if !self.holds[member] && self.count[member] >= self.needed[member] {
                self.holds[member] = true;
                self.queue.push(member);
            }
        }
        while let Some(member) = self.queue.pop() {
            self.count_inside(circuit, component, member, true);
            self.count_outside(circuit, component, member, true);
        }
    }

    /// Withdraws all nodes that rest on the component itself, and derives the component from its inputs.
    fn derive_anew(&mut self, circuit: &Circuit, component: ComponentId, members: &[NodeId]) {
        self.before.clear();
        self.before.extend(members.iter().map(|&member| self.holds[member]));
        for &member in members {
            if core::mem::take(&mut self.holds[member]) {
                self.count_inside(circuit, component, member, false);
            }
        }
        self.queue.clear();
        for &member in members {
            if self.count[member] >= self.needed[member] {
                self.holds[member] = true;
                self.queue.push(member);
            }
        }
        while let Some(member) = self.queue.pop() {
            self.count_inside(circuit, component, member, true);
        }
        for (at, &member) in members.iter().enumerate() {
            let holds = self.holds[member];
            if self.before.get(at) != Some(&holds) {
                self.count_outside(circuit, component, member, holds);
            }
        }
    }

    /// Counts a node at its parents within the component, and queues the parents that hold by it.
    fn count_inside(&mut self, circuit: &Circuit, component: ComponentId, node: NodeId, holds: bool) {
        for &parent in circuit.parents.row(node) {
            if circuit.component[parent] != component {
                continue;
            }
            self.recount(parent, holds);
            if holds && !self.holds[parent] && self.count[parent] >= self.needed[parent] {
                self.holds[parent] = true;
                self.queue.push(parent);
            }
        }
    }

    fn count_outside(&mut self, circuit: &Circuit, component: ComponentId, node: NodeId, holds: bool) {
        for &parent in circuit.parents.row(node) {
            if circuit.component[parent] != component {
                self.recount(parent, holds);
                let above = circuit.component[parent];
                mark(&mut self.pending, above);
                if !holds && circuit.is_cyclic[above] {
                    mark(&mut self.shrunk, above);
                }
            }
        }
    }

    fn pass_on(&mut self, circuit: &Circuit, node: NodeId, holds: bool) {
        self.count_outside(circuit, circuit.component[node], node, holds);
    }

    fn recount(&mut self, node: NodeId, holds: bool) {
        let count = &mut self.count[node];
        *count = if holds { *count + 1 } else { count.saturating_sub(1) };
    }
}

fn mark(set: &mut [u64], component: ComponentId) {
    if let Some(bits) = set.get_mut(component.index() / 64) {
        *bits |= 1 << (component.index() % 64);
    }
}

/// Takes a component out of the set; returns whether the set had it.
fn take(set: &mut [u64], component: ComponentId) -> bool {
    let bit = 1 << (component.index() % 64);
    let Some(bits) = set.get_mut(component.index() / 64) else { return false };
    let was_in = *bits & bit != 0;
    *bits &= !bit;
    was_in
}
