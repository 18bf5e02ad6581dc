//! The places of a knowledge base's elements in a drawing that somebody else draws: signals on the left, needs on the right.

use super::graph::{Direction, Graph, Marks};
use super::layers::{Edge, Layout, Route, Size, layout};
use shsa_core::knowledge::{KnowledgeBase, NeedId, RelationId, SignalId, VariableId};

/// The height of a node.
pub const NODE_HEIGHT: f64 = 24.0;
/// The width of a character of a node's name, and the room beside the name.
const CHARACTER: f64 = 8.0;
const BESIDE: f64 = 40.0;

/// An element of a knowledge base.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Node {
    /// A signal.
    Signal(SignalId),
    /// A variable.
    Variable(VariableId),
    /// A relation.
    Relation(RelationId),
    /// A need.
    Need(NeedId),
}

impl Node {
    /// The name of the element; a need's is the name of the signal that carries it.
    #[must_use]
    pub fn name(self, knowledge: &KnowledgeBase) -> &str {
        match self {
            Node::Signal(id) => &knowledge.signals()[id].name,
            Node::Variable(id) => &knowledge.variables()[id].name,
            Node::Relation(id) => &knowledge.relations()[id].name,
            Node::Need(id) => &knowledge.needs()[id].signal,
        }
    }
}

/// A placed element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The element.
    pub node: Node,
    /// The centre, x to the right and y downwards, in units of which a node's height has [`NODE_HEIGHT`].
    pub centre: (f64, f64),
    /// The width, with room for the name.
    pub width: f64,
}

/// A line between two elements, in the direction in which information flows.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Where it comes from.
    pub from: Node,
    /// Where it goes to.
    pub to: Node,
    /// Its points, from the one element to the other.
    pub points: Vec<(f64, f64)>,
}

/// A knowledge base with places for all of its elements.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketch {
    /// The elements: signals, variables, relations, needs.
    pub nodes: Vec<Placed>,
    /// The lines between them.
    pub lines: Vec<Line>,
    /// Width and height of the whole.
    pub size: (f64, f64),
}

impl Sketch {
    /// Places the elements of a knowledge base; `None` where there are more than `most`, or too many lines to follow.
    ///
    /// Time: that of a layered layout, below a second for 1,000 elements.
    #[must_use]
    pub fn of(knowledge: &KnowledgeBase, most: usize) -> Option<Sketch> {
        let nodes: Vec<Node> = nodes(knowledge);
        if nodes.len() > most {
            return None;
        }
        let width = |node: &Node| BESIDE + CHARACTER * node.name(knowledge).chars().count() as f64;
        let half = NODE_HEIGHT / 2.0;
        let sizes: Vec<Size> =
            nodes.iter().map(|node| Size { width: width(node), above: half, below: half }).collect();
        let links = links(knowledge);
        let place = |node: &Node| nodes.iter().position(|other| other == node);
        let edges: Option<Vec<Edge>> = links
            .iter()
            .map(|(from, to)| Some(Edge { from: place(from)?, to: place(to)?, weight: 1.0 }))
            .collect();
        let Layout { centres, routes, size } = layout(&sizes, &edges?).ok()?;
        let places = nodes.iter().zip(centres);
        let nodes: Vec<Placed> =
            places.map(|(node, centre)| Placed { node: *node, centre, width: width(node) }).collect();
        let lines = links.iter().zip(&routes).map(|(&(from, to), route)| line(from, to, route, &nodes));
        Some(Sketch { lines: lines.collect(), nodes, size })
    }
}

fn nodes(knowledge: &KnowledgeBase) -> Vec<Node> {
    let signals = knowledge.signals().ids().map(Node::Signal);
    let variables = knowledge.variables().ids().map(Node::Variable);
    let relations = knowledge.relations().ids().map(Node::Relation);
    signals.chain(variables).chain(relations).chain(knowledge.needs().ids().map(Node::Need)).collect()
}

fn links(knowledge: &KnowledgeBase) -> Vec<(Node, Node)> {
    let carried = knowledge.signals().enumerate();
    let carried = carried.map(|(id, signal)| (Node::Signal(id), Node::Variable(signal.variable)));
    let marks = Marks::default();
    let related = Graph::new(knowledge, &marks).links().into_iter().map(|link| {
        let (variable, relation) = (Node::Variable(link.variable), Node::Relation(link.relation));
        match link.flow {
            Direction::Read => (variable, relation),
            Direction::Make => (relation, variable),
        }
    });
    let needed = knowledge.needs().enumerate();
    let needed = needed.map(|(id, need)| (Node::Variable(need.variable), Node::Need(id)));
    carried.chain(related).chain(needed).collect()
}

/// The points of a line; one that closes a cycle goes from the right to the left.
fn line(from: Node, to: Node, route: &Route, nodes: &[Placed]) -> Line {
    let side = |at: usize, sign: f64| {
        nodes.get(at).map(|placed| (placed.centre.0 + sign * placed.width / 2.0, placed.centre.1))
    };
    let bends = route.bends.iter().flat_map(|bend| [(bend.left_x, bend.y), (bend.right_x, bend.y)]);
    let mut points: Vec<(f64, f64)> =
        side(route.left, 1.0).into_iter().chain(bends).chain(side(route.right, -1.0)).collect();
    if nodes.get(route.left).is_some_and(|left| left.node == to) {
        points.reverse();
    }
    Line { from, to, points }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knowledge() -> KnowledgeBase {
        let text = include_str!("../../../models/stop.yaml");
        shsa_model::load(text, "stop.yaml").knowledge
    }

    #[test]
    fn information_flows_to_the_right_and_nothing_overlaps() {
        let knowledge = knowledge();
        let sketch = Sketch::of(&knowledge, 100).unwrap();
        assert_eq!(sketch.nodes.len(), 4 + 4 + 3 + 1);
        assert_eq!(sketch.lines.len(), 4 + 3 + 2 + 2 + 1);
        for line in &sketch.lines {
            let [(first, _), .., (last, _)] = *line.points else { panic!("{line:?}") };
            assert!(first < last, "{line:?}");
        }
        for (at, one) in sketch.nodes.iter().enumerate() {
            for other in &sketch.nodes[at + 1..] {
                let apart_x = (one.centre.0 - other.centre.0).abs() >= (one.width + other.width) / 2.0;
                let apart_y = (one.centre.1 - other.centre.1).abs() >= NODE_HEIGHT;
                assert!(apart_x || apart_y, "{one:?} and {other:?}");
            }
        }
    }

    #[test]
    fn a_large_model_has_no_sketch() {
        assert_eq!(Sketch::of(&knowledge(), 11), None);
    }
}
