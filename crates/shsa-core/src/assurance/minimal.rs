//! Minimal sets of leaves that make a goal hold, and minimal sets that prevent it.
//!
//! A circuit without negation is a monotone function of its leaves. Its minimal true sets (**repairs**) and the minimal sets
//! without which it is false (**causes**) are the minimal hitting sets of each other. A hitting-set tree in breadth (Reiter 1987,
//! doi:10.1016/0004-3702(87)90062-2) finds the causes. Its labels are repairs: evaluation finds a true set, and leaving leaves
//! out makes the set minimal. The repairs are then the hitting sets of the causes.

use super::circuit::{Circuit, NodeId};
use crate::knowledge::{Id, IdVec, id};
use alloc::collections::{BTreeSet, VecDeque};
use alloc::vec::Vec;

/// Minimal sets, each ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sets<T> {
    /// Ascending by size, then by their elements.
    pub sets: Vec<Vec<T>>,
    /// Whether the list is complete. If not, the bound of work was reached: each set is minimal, but there may be more.
    pub is_complete: bool,
}

impl<T> Sets<T> {
    pub(super) fn map<U>(self, change: impl Fn(T) -> U) -> Sets<U> {
        let sets = self.sets.into_iter().map(|set| set.into_iter().map(&change).collect()).collect();
        Sets { sets, is_complete: self.is_complete }
    }
}

/// The role of a node in a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The node holds, or does not, and is not asked about.
    Fixed(bool),
    /// The node is asked about.
    Leaf,
    /// The node follows from its children.
    Inner,
}

id! {
    /// A node within the cone of a question.
    pub(super) Local
}

/// A goal, of which one node of each group must hold, and all nodes on which it rests.
pub(super) struct Question {
    needed: IdVec<Local, u32>,
    children: IdVec<Local, Vec<Local>>,
    parents: IdVec<Local, Vec<Local>>,
    /// The nodes that hold anyway.
    given: Vec<Local>,
    /// Ascending by their node.
    leaves: Vec<(Local, NodeId)>,
    goal: Vec<Vec<Local>>,
    /// The order in which nodes were derived, counted from 1; 0: not derived.
    order: IdVec<Local, u32>,
    count: IdVec<Local, u32>,
    queue: Vec<Local>,
}

/// Positions of leaves, ascending.
type Leaves = Vec<usize>;

impl Question {
    /// A question about all nodes on which the goal rests. Time: linear in the whole circuit.
    pub(super) fn new(circuit: &Circuit, goal: &[Vec<NodeId>], role: impl Fn(NodeId) -> Role) -> Question {
        let mut local: IdVec<NodeId, Option<Local>> = IdVec::filled(circuit.needed.len(), |_| None);
        let mut nodes: IdVec<Local, NodeId> = IdVec::new();
        for &node in goal.iter().flatten() {
            local[node].get_or_insert_with(|| nodes.push(node));
        }
        let mut children: IdVec<Local, Vec<Local>> = IdVec::new();
        while children.len() < nodes.len() {
            let node = nodes[Local::from_index(children.len())];
            let below = if role(node) == Role::Inner { circuit.children.row(node) } else { &[] };
            children.push(
                below.iter().map(|&child| *local[child].get_or_insert_with(|| nodes.push(child))).collect(),
            );
        }
        let mut parents: IdVec<Local, Vec<Local>> = IdVec::filled(nodes.len(), |_| Vec::new());
        for (parent, children) in children.enumerate() {
            children.iter().for_each(|&child| parents[child].push(parent));
        }
        let own = |nodes: &Vec<NodeId>| nodes.iter().filter_map(|&node| local[node]).collect();
        let leaves = with_role(&nodes, &role, Role::Leaf).into_iter();
        let mut leaves: Vec<(Local, NodeId)> = leaves.map(|at| (at, nodes[at])).collect();
        leaves.sort_unstable_by_key(|&(_, node)| node);
        Question {
            given: with_role(&nodes, &role, Role::Fixed(true)),
            leaves,
            needed: IdVec::filled(nodes.len(), |at| match role(nodes[at]) {
                Role::Inner => circuit.needed[nodes[at]],
                _ => u32::MAX,
            }),
            children,
            parents,
            goal: goal.iter().map(own).collect(),
            order: IdVec::filled(nodes.len(), |_| 0),
            count: IdVec::filled(nodes.len(), |_| 0),
            queue: Vec::new(),
        }
    }

    /// Repairs and causes, with at most `most` evaluations or steps for each.
    pub(super) fn answer(&mut self, most: usize) -> (Sets<NodeId>, Sets<NodeId>) {
        let mut repairs: BTreeSet<Leaves> = BTreeSet::new();
        let mut work = most;
        let (causes, is_complete) = hitting_sets(most, |hit| {
            if let Some(known) = repairs.iter().find(|repair| !meet(repair, hit)) {
                return Label::Set(known.clone());
            }
            match self.repair_without(hit, &mut work) {
                Found::None => Label::Hit,
                Found::TooMuch => Label::TooMuch,
                Found::Some(repair) => {
                    repairs.insert(repair.clone());
                    Label::Set(repair)
                }
            }
        });
        let mut all: Vec<Leaves> = repairs.into_iter().collect();
        let mut has_all = false;
        if is_complete {
            let (found, is_complete) = hitting_sets(most, |hit| {
                let missed = causes.iter().find(|cause| !meet(cause, hit));
                missed.map_or(Label::Hit, |cause| Label::Set(cause.clone()))
            });
            has_all = is_complete;
            if is_complete {
                all = found;
            }
        }
        (self.named(all, has_all), self.named(causes, is_complete))
    }

    fn named(&self, mut sets: Vec<Leaves>, is_complete: bool) -> Sets<NodeId> {
        sets.sort_by(|a, b| a.len().cmp(&b.len()).then_with(|| a.cmp(b)));
        let name = |at: usize| self.leaves.get(at).map(|&(_, node)| node);
        let sets = sets.into_iter().map(|set| set.into_iter().filter_map(name).collect()).collect();
        Sets { sets, is_complete }
    }

    /// A minimal set of leaves that makes the goal hold without those of `hit`.
    fn repair_without(&mut self, hit: &[usize], work: &mut usize) -> Found {
        let all: Leaves = (0..self.leaves.len()).filter(|leaf| !hit.contains(leaf)).collect();
        if !self.evaluate(&all, work) {
            return if *work == 0 { Found::TooMuch } else { Found::None };
        }
        let mut kept = self.support();
        for leaf in kept.clone() {
            let rest: Leaves = kept.iter().copied().filter(|&other| other != leaf).collect();
            if self.evaluate(&rest, work) {
                kept = rest;
            }
        }
        if *work == 0 { Found::TooMuch } else { Found::Some(kept) }
    }

    /// Whether the goal holds when these leaves do. Time: linear in the cone.
    fn evaluate(&mut self, leaves: &[usize], work: &mut usize) -> bool {
        if *work == 0 {
            return false;
        }
        *work -= 1;
        self.order.iter_mut().for_each(|order| *order = 0);
        self.count.iter_mut().for_each(|count| *count = 0);
        self.queue.clear();
        let chosen = leaves.iter().filter_map(|&leaf| self.leaves.get(leaf)).map(|&(at, _)| at);
        let empty = self.needed.enumerate().filter(|(_, needed)| **needed == 0).map(|(at, _)| at);
        self.queue.extend(self.given.iter().copied().chain(chosen).chain(empty));
        let mut next = 0;
        while let Some(&node) = self.queue.get(next) {
            next += 1;
            if self.order[node] != 0 {
                continue;
            }
            self.order[node] = next as u32;
            for &parent in &self.parents[node] {
                self.count[parent] += 1;
                if self.count[parent] == self.needed[parent] {
                    self.queue.push(parent);
                }
            }
        }
        self.goal.iter().all(|group| group.iter().any(|&node| self.order[node] != 0))
    }

    /// The leaves from which the last evaluation derived the goal: for each node as many children as it needs, the first ones.
    fn support(&self) -> Leaves {
        let first = |nodes: &[Local], many: usize| {
            let mut derived: Vec<Local> =
                nodes.iter().copied().filter(|&node| self.order[node] != 0).collect();
            derived.sort_by_key(|&node| self.order[node]);
            derived.truncate(many);
            derived
        };
        let mut open: Vec<Local> = self.goal.iter().flat_map(|group| first(group, 1)).collect();
        let mut seen: BTreeSet<Local> = BTreeSet::new();
        while let Some(node) = open.pop() {
            if seen.insert(node) && self.needed[node] != u32::MAX {
                open.extend(first(&self.children[node], self.needed[node] as usize));
            }
        }
        let is_used = |&(_, (at, _)): &(usize, &(Local, NodeId))| seen.contains(at);
        self.leaves.iter().enumerate().filter(is_used).map(|(leaf, _)| leaf).collect()
    }
}

fn with_role(nodes: &IdVec<Local, NodeId>, role: &impl Fn(NodeId) -> Role, wanted: Role) -> Vec<Local> {
    nodes.enumerate().filter(|(_, node)| role(**node) == wanted).map(|(at, _)| at).collect()
}

enum Found {
    Some(Leaves),
    None,
    TooMuch,
}

/// The answer to the question whether a set hits all sets.
enum Label {
    /// A set that is not hit.
    Set(Leaves),
    /// All sets are hit.
    Hit,
    /// The bound was reached.
    TooMuch,
}

/// All minimal sets that hit each set of `label`, after trying at most `most`; and whether these are all.
fn hitting_sets(most: usize, mut label: impl FnMut(&[usize]) -> Label) -> (Vec<Leaves>, bool) {
    let mut found: Vec<Leaves> = Vec::new();
    let mut seen: BTreeSet<Leaves> = BTreeSet::new();
    let mut open: VecDeque<Leaves> = VecDeque::from([Vec::new()]);
    let mut looked = 0;
    while let Some(set) = open.pop_front() {
        if found.iter().any(|smaller| covers(&set, smaller)) {
            continue;
        }
        looked += 1;
        if looked > most || seen.len() > most {
            return (found, false);
        }
        match label(&set) {
            Label::Hit => found.push(set),
            Label::TooMuch => return (found, false),
            Label::Set(elements) => {
                for element in elements {
                    let mut larger = set.clone();
                    let at = larger.partition_point(|&other| other < element);
                    larger.insert(at, element);
                    if seen.insert(larger.clone()) {
                        open.push_back(larger);
                    }
                }
            }
        }
    }
    (found, true)
}

/// Whether two ascending sets share an element.
fn meet(one: &[usize], other: &[usize]) -> bool {
    one.iter().any(|element| other.binary_search(element).is_ok())
}

/// Whether all elements of `part` are in `set`.
fn covers(set: &[usize], part: &[usize]) -> bool {
    part.iter().all(|element| set.binary_search(element).is_ok())
}
