//! All fusions of a knowledge base, as the engine drives them.

use super::Node;
use shsa_core::engine::{Engine, Fuse, FusionInput, Measurements, Options};
use shsa_core::knowledge::{Id, KnowledgeBase, Lineage, SignalId};
use shsa_core::observation::Observation;
use shsa_core::time::Time;
use std::collections::VecDeque;
use std::fmt;

/// The use of a signal's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// An input of a node, by the places of both.
    Input(usize, usize),
    /// A control input.
    Control(usize, usize),
}

/// The running fusions of a knowledge base.
///
/// An observation costs nothing where no fusion reads its signal, else a step of each filter that does. No allocation after
/// construction.
#[derive(Default)]
pub struct Nodes {
    /// The nodes in the order of the model; `None` for one that could not be set up, which the checks have reported.
    nodes: Vec<Option<Node>>,
    /// The uses of each signal.
    roles: Vec<Vec<Role>>,
    queue: VecDeque<Observation>,
    /// The next node to settle, and the moment of it.
    settling: Option<(usize, Time)>,
}

/// The engine of a knowledge base with its running fusions.
///
/// ```
/// use shsa_core::engine::Options;
/// use shsa_core::knowledge::KnowledgeBase;
///
/// let mut engine = shsa_estimate::node::engine(KnowledgeBase::default(), Options::default());
/// assert_eq!(engine.poll(), None);
/// ```
#[must_use]
pub fn engine(knowledge: KnowledgeBase, options: Options) -> Engine {
    let nodes = Nodes::new(&knowledge);
    Engine::with_estimators(knowledge, options, Box::new(nodes))
}

impl Nodes {
    /// Sets up all fusions of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Nodes {
        let nodes = knowledge.fusions().iter().map(|model| Node::new(knowledge, model).ok()).collect();
        Nodes { nodes, ..Nodes::default() }.wired(knowledge)
    }

    fn wired(mut self, knowledge: &KnowledgeBase) -> Nodes {
        self.roles =
            vec![Vec::new(); if knowledge.fusions().is_empty() { 0 } else { knowledge.signals().len() }];
        let mut total = 0;
        for (node, model) in knowledge.fusions().iter().enumerate() {
            let inputs = model.inputs.iter().map(|input| input.signal).enumerate();
            let inputs = inputs.map(|(place, signal)| (signal, Role::Input(node, place)));
            let controls = model.controls.iter().copied().enumerate();
            let controls = controls.map(|(place, signal)| (signal, Role::Control(node, place)));
            for (signal, role) in inputs.chain(controls) {
                self.roles.get_mut(signal.index()).into_iter().for_each(|roles| roles.push(role));
            }
            total += model.outputs.len() + model.predictions.len();
        }
        self.queue.reserve(total);
        self
    }

    fn node(&mut self, place: usize) -> Option<&mut Node> {
        self.nodes.get_mut(place)?.as_mut()
    }
}

impl fmt::Debug for Nodes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.nodes.iter().flatten().map(|node| &node.model.name)).finish()
    }
}

impl Fuse for Nodes {
    fn observe(&mut self, input: FusionInput<'_>, now: Time) {
        let signal = input.observation.signal.index();
        let count = self.roles.get(signal).map_or(0, Vec::len);
        for place in 0..count {
            let role = self.roles.get(signal).and_then(|roles| roles.get(place)).copied();
            match role {
                Some(Role::Input(node, place)) => {
                    self.node(node).into_iter().for_each(|node| node.measure(place, input, now));
                }
                Some(Role::Control(node, place)) => {
                    self.node(node).into_iter().for_each(|node| node.steer(place, input, now));
                }
                None => {}
            }
        }
    }

    fn settle(&mut self, now: Time) {
        self.settling = Some((0, now));
    }

    /// A node settles when the outputs of all before it were taken: it may read them. The nodes are in that order.
    fn poll(&mut self) -> Option<Observation> {
        while self.queue.is_empty()
            && let Some((place, now)) = self.settling
        {
            let Nodes { nodes, queue, .. } = self;
            self.settling = match nodes.get_mut(place) {
                Some(node) => {
                    node.iter_mut().for_each(|node| node.settle(now, queue));
                    Some((place + 1, now))
                }
                None => None,
            };
        }
        self.queue.pop_front()
    }

    fn next_deadline(&self) -> Option<Time> {
        self.nodes.iter().flatten().filter_map(|node| node.due).min()
    }

    fn reload(&mut self, knowledge: &KnowledgeBase, lineage: &Lineage) {
        let mut old = std::mem::take(self);
        let same_signals = |signals: &[SignalId]| signals.iter().all(|it| lineage.signal(*it) == Some(*it));
        let mut new = Nodes::new(knowledge);
        for (node, model) in new.nodes.iter_mut().zip(knowledge.fusions()) {
            // A node with the same model and inputs, under the same ids, keeps its state; others start again.
            let read: Vec<SignalId> =
                model.inputs.iter().map(|input| input.signal).chain(model.controls.iter().copied()).collect();
            let is_same = |old: &&mut Option<Node>| old.as_ref().is_some_and(|old| old.model == *model);
            let before = old.nodes.iter_mut().find(is_same).filter(|_| same_signals(&read));
            if let Some(before) = before.and_then(Option::take) {
                *node = Some(before);
            }
        }
        *self = new;
    }

    fn measurements(&self, fusion: usize, input: usize) -> Measurements {
        self.nodes
            .get(fusion)
            .and_then(Option::as_ref)
            .map(|node| node.measurements(input))
            .unwrap_or_default()
    }
}
