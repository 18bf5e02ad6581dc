//! The wanted values of a payload as a tree of names, with their places in the last payload.

use shsa_message::json::{self, Broken, Place, Visitor};
use shsa_message::path::Step;
use std::ops::Range;

/// A wanted value, or a value on the path to one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Node(usize);

/// The payload itself.
pub(super) const ROOT: Node = Node(0);

/// The names of wanted values, and their places in the last payload.
#[derive(Clone, Debug)]
pub(super) struct Wanted {
    branches: Vec<Branch>,
    places: Vec<Option<Place>>,
}

#[derive(Clone, Debug)]
struct Branch {
    step: Step,
    /// The index of the element, if the step can be one.
    index: Option<usize>,
    children: Vec<Node>,
}

impl Wanted {
    pub(super) fn new() -> Wanted {
        let root = Branch { step: Step::Index(0), index: None, children: Vec::new() };
        Wanted { branches: vec![root], places: vec![None] }
    }

    /// The node at the end of a path; equal paths give the same node.
    pub(super) fn add(&mut self, from: Node, steps: &[Step]) -> Node {
        steps.iter().fold(from, |node, step| self.child(node, step).unwrap_or_else(|| self.grow(node, step)))
    }

    fn child(&self, of: Node, step: &Step) -> Option<Node> {
        self.branches[of.0].children.iter().copied().find(|child| self.branches[child.0].step == *step)
    }

    fn grow(&mut self, from: Node, step: &Step) -> Node {
        let node = Node(self.branches.len());
        let index = match step {
            Step::Index(index) => Some(*index),
            Step::Key(key) => key.parse().ok(),
            Step::Each => None,
        };
        self.branches.push(Branch { step: step.clone(), index, children: Vec::new() });
        self.branches[from.0].children.push(node);
        self.places.push(None);
        node
    }

    /// The member of a node, if [`Wanted::add`] has made it.
    pub(super) fn member(&self, of: Node, name: &str) -> Option<Node> {
        let is_it = |child: &Node| matches!(&self.branches[child.0].step, Step::Key(key) if key == name);
        self.branches[of.0].children.iter().copied().find(is_it)
    }

    /// The place of a value; `None`: the payload lacks it.
    pub(super) fn place(&self, node: Node) -> Option<Place> {
        self.places[node.0]
    }

    /// Finds all places in a text.
    pub(super) fn find(&mut self, text: &str) -> Result<(), Broken> {
        self.forget();
        json::walk(text, ROOT, self)
    }

    /// Sets a payload that is a single value of this kind, at this place.
    pub(super) fn set_root(&mut self, kind: json::Kind, range: Range<usize>) {
        self.forget();
        self.places[ROOT.0] = Some(Place { kind, from: range.start, to: range.end });
    }

    fn forget(&mut self) {
        self.places.fill(None);
    }

    fn forget_below(&mut self, node: Node) {
        for at in 0..self.branches[node.0].children.len() {
            let child = self.branches[node.0].children[at];
            self.places[child.0] = None;
            self.forget_below(child);
        }
    }
}

impl Visitor for Wanted {
    type Node = Node;

    fn member(&mut self, of: Node, name: &str) -> Option<Node> {
        if name.contains('\\') {
            Wanted::member(self, of, &json::unescaped(name))
        } else {
            Wanted::member(self, of, name)
        }
    }

    fn element(&mut self, of: Node, index: usize) -> Option<Node> {
        self.branches[of.0].children.iter().copied().find(|child| self.branches[child.0].index == Some(index))
    }

    /// If a name occurs twice, the last value counts, and nothing of the first one is kept.
    fn enter(&mut self, node: Node) {
        if self.places[node.0].take().is_some() {
            self.forget_below(node);
        }
    }

    fn leave(&mut self, node: Node, place: Place) {
        self.places[node.0] = Some(place);
    }
}
