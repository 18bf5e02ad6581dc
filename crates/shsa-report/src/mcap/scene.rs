//! The knowledge graph as an update of a scene: each element with its verdict, and the ways in use.

use serde_json::{Value, json};
use shsa_core::engine::Engine;
use shsa_core::knowledge::NeedId;
use shsa_core::time::{Span, Time};
use shsa_drawing::{Line, NODE_HEIGHT, Node, Placed, Sketch};
use shsa_format::event;
use std::collections::BTreeSet;

/// The most elements of a model whose graph is drawn.
const MOST: usize = 200;
/// The shortest time between two drawings: each has the whole graph, so that a viewer needs the newest one only.
const APART: Span = Span::from_millis(1_000);
/// How often it is drawn without a decision: a signal becomes healthy without one.
const AGAIN: Span = Span::from_millis(10_000);

/// Colours that colour-blind people tell apart, after Okabe and Ito.
const BLUE: [f64; 3] = [0.0, 0.447, 0.698];
const GREEN: [f64; 3] = [0.0, 0.62, 0.451];
const ORANGE: [f64; 3] = [0.902, 0.624, 0.0];
const RED: [f64; 3] = [0.835, 0.369, 0.0];
const GREY: [f64; 3] = [0.45, 0.5, 0.55];
const PALE: [f64; 3] = [0.62, 0.66, 0.7];

/// The drawing of the graph as it goes along.
#[derive(Default)]
pub(super) struct Scene {
    /// `None` for a model that is too large.
    sketch: Option<Sketch>,
    is_due: bool,
    last: Option<Time>,
}

impl Scene {
    /// Follows another model.
    pub(super) fn follow(&mut self, engine: &Engine) {
        self.sketch = Sketch::of(engine.knowledge(), MOST);
        self.is_due = true;
    }

    /// Notes that a verdict or a source may have changed.
    pub(super) fn note(&mut self) {
        self.is_due = true;
    }

    /// Width and height of the drawing for a model; `None` where there is none.
    pub(super) fn size_for(engine: &Engine) -> Option<(f64, f64)> {
        let sketch = Sketch::of(engine.knowledge(), MOST)?;
        Some((scaled(sketch.size.0), scaled(sketch.size.1)))
    }

    /// The drawing at a moment, where there may be something new; `is_last`: however short ago the last one was.
    pub(super) fn news(&mut self, engine: &Engine, now: Time, is_last: bool) -> Option<Value> {
        let is_older_than = |age: Span| self.last.is_none_or(|last| now - last >= age);
        let is_wanted = is_last || is_older_than(AGAIN) || self.is_due && is_older_than(APART);
        let sketch = self.sketch.as_ref().filter(|_| is_wanted)?;
        (self.is_due, self.last) = (false, Some(now));
        Some(drawn(sketch, engine, now))
    }
}

fn scaled(length: f64) -> f64 {
    length / NODE_HEIGHT
}

/// One entity for the lines, and one for each element: a click on it tells its name.
fn drawn(sketch: &Sketch, engine: &Engine, now: Time) -> Value {
    let used = used(engine);
    let lines: Vec<Value> = sketch.lines.iter().map(|it| line(it, &used)).collect();
    let time = json!({ "sec": now.0.div_euclid(1_000_000_000), "nsec": now.0.rem_euclid(1_000_000_000) });
    let entity = |id: String, lines: Vec<Value>, cubes: Vec<Value>, texts: Vec<Value>| {
        json!({
            "timestamp": time,
            "frame_id": "shsa",
            "id": id,
            "lifetime": { "sec": 0, "nsec": 0 },
            "frame_locked": false,
            "metadata": [],
            "arrows": [], "cubes": cubes, "spheres": [], "cylinders": [], "lines": lines, "triangles": [],
            "texts": texts, "models": [],
        })
    };
    let nodes = sketch.nodes.iter().map(|placed| {
        let look = Look::of(placed.node, engine, &used);
        let id = format!("{} {}", look.what, placed.node.name(engine.knowledge()));
        entity(id, Vec::new(), vec![cube(placed, &look)], vec![text(placed, &look)])
    });
    let entities: Vec<Value> =
        std::iter::once(entity("lines".to_owned(), lines, Vec::new(), Vec::new())).chain(nodes).collect();
    // Elements of an earlier model go.
    json!({ "deletions": [{ "timestamp": time, "type": 1, "id": "" }], "entities": entities })
}

/// What the sources of the needs consist of.
fn used(engine: &Engine) -> BTreeSet<Node> {
    let needs = engine.knowledge().needs().ids();
    needs.flat_map(|need| used_by(engine, need)).collect()
}

fn used_by(engine: &Engine, need: NeedId) -> Vec<Node> {
    let source = engine.need_status(need).source;
    let Some(words) = source.as_ref().and_then(|source| source.way()) else { return Vec::new() };
    let knowledge = engine.knowledge();
    let Some(way) = engine.ways_to_serve(need).find(|way| way.describe(knowledge) == *words) else {
        return Vec::new();
    };
    let signals = way.inputs().map(Node::Signal);
    let relations = way.substitution.steps.iter().map(|step| Node::Relation(step.relation));
    let variables = way.substitution.variables().into_iter().map(Node::Variable);
    signals.chain(relations).chain(variables).chain([Node::Need(need)]).collect()
}

/// How an element looks.
struct Look {
    what: &'static str,
    words: String,
    color: [f64; 3],
    is_filled: bool,
}

impl Look {
    fn of(node: Node, engine: &Engine, used: &BTreeSet<Node>) -> Look {
        let name = node.name(engine.knowledge());
        let is_used = used.contains(&node);
        let look = |what, sign: &str, color| Look {
            what,
            words: format!("{sign}{name}"),
            color: if is_used { GREEN } else { color },
            is_filled: is_used,
        };
        match node {
            Node::Variable(_) => look("variable", "", GREY),
            Node::Relation(_) => look("relation", "= ", GREY),
            Node::Need(need) if engine.need_status(need).source.is_none() => {
                Look { color: RED, ..look("need", "✗ ", RED) }
            }
            Node::Need(_) => look("need", "▸ ", GREY),
            Node::Signal(signal) => {
                let verdict = event::verdict(engine.absence(signal), engine.verdict(signal));
                let (sign, color) = match verdict {
                    "healthy" => ("✓ ", BLUE),
                    "failed" => ("✗ ", RED),
                    "silent" => ("○ ", RED),
                    "suspect" => ("? ", ORANGE),
                    _ => ("· ", GREY),
                };
                look("signal", sign, color)
            }
        }
    }
}

fn color([r, g, b]: [f64; 3], a: f64) -> Value {
    json!({ "r": r, "g": g, "b": b, "a": a })
}

/// A place, y upwards; what is higher hides what is lower.
fn point((x, y): (f64, f64), height: f64) -> Value {
    json!({ "x": scaled(x), "y": -scaled(y), "z": height })
}

fn pose(centre: (f64, f64), height: f64) -> Value {
    json!({ "position": point(centre, height), "orientation": { "x": 0, "y": 0, "z": 0, "w": 1 } })
}

fn cube(placed: &Placed, look: &Look) -> Value {
    json!({
        "pose": pose(placed.centre, 0.0),
        "size": { "x": scaled(placed.width), "y": 1.0, "z": 0.1 },
        "color": color(look.color, if look.is_filled { 0.9 } else { 0.45 }),
    })
}

fn text(placed: &Placed, look: &Look) -> Value {
    json!({
        "pose": pose(placed.centre, 0.2),
        "billboard": true,
        "font_size": 0.6,
        "scale_invariant": false,
        "color": color([1.0, 1.0, 1.0], 1.0),
        "text": look.words,
    })
}

fn line(line: &Line, used: &BTreeSet<Node>) -> Value {
    let is_used = used.contains(&line.from) && used.contains(&line.to);
    let points: Vec<Value> = line.points.iter().map(|&it| point(it, -0.1)).collect();
    json!({
        "type": 0,
        "pose": pose((0.0, 0.0), 0.0),
        "thickness": if is_used { 4.0 } else { 1.5 },
        "scale_invariant": true,
        "points": points,
        "color": if is_used { color(GREEN, 1.0) } else { color(PALE, 0.8) },
        "colors": [],
        "indices": [],
    })
}
