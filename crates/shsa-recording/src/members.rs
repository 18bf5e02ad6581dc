//! Members of JSON values: those that are looked for are found together, in one pass through a message.

use shsa_message::json::{Place, Shapes, Visitor, unescaped};
use shsa_message::path::Step;
use std::borrow::Cow;
use std::mem;
use std::str;

/// The members that are looked for in the messages of a topic, as a tree of steps; its root is the message itself.
pub(super) struct Members {
    nodes: Vec<Node>,
    /// Where the value of each node is in the current message; `None` where it has none.
    places: Vec<Option<Place>>,
    /// What the messages look like.
    shapes: Shapes<usize>,
}

/// A step on the way to a member.
#[derive(Default)]
struct Node {
    /// What leads on from here, and to which node.
    next: Vec<(Step, usize)>,
}

/// The members of one message.
#[derive(Clone, Copy)]
pub(super) struct Found<'a> {
    /// The message.
    pub(super) text: &'a str,
    places: &'a [Option<Place>],
}

impl Found<'_> {
    /// Where the member of this number is; `None` where the message has none.
    pub(super) fn place(&self, member: usize) -> Option<Place> {
        self.places.get(member).copied().flatten()
    }
}

impl Default for Members {
    fn default() -> Members {
        Members { nodes: vec![Node::default()], places: vec![None], shapes: Shapes::default() }
    }
}

impl Members {
    /// Adds a member, and returns its number; `None` where an element that is already looked for has another form of its index.
    pub(super) fn add(&mut self, steps: &[Step]) -> Option<usize> {
        steps.iter().try_fold(0, |node, step| self.step(node, step))
    }

    fn step(&mut self, from: usize, step: &Step) -> Option<usize> {
        let new = self.nodes.len();
        let next = &mut self.nodes.get_mut(from)?.next;
        if let Some((_, node)) = next.iter().find(|(known, _)| known == step) {
            return Some(*node);
        }
        if next.iter().any(|(known, _)| known.index().is_some() && known.index() == step.index()) {
            return None;
        }
        next.push((step.clone(), new));
        self.nodes.push(Node::default());
        self.places.push(None);
        Some(new)
    }

    /// Finds the members of a message; none in what is no JSON. `O(bytes)`; allocates only for another shape of message.
    pub(super) fn find<'a>(&'a mut self, message: &'a [u8]) -> Found<'a> {
        self.places.fill(None);
        let text = str::from_utf8(message).unwrap_or_default();
        let mut shapes = mem::take(&mut self.shapes);
        if shapes.walk(text, 0, self).is_err() {
            self.places.fill(None);
        }
        self.shapes = shapes;
        Found { text, places: &self.places }
    }
}

/// The meaning of a name with escapes; `None` for one without.
fn escaped(name: &str) -> Option<Cow<'_, str>> {
    name.contains('\\').then(|| unescaped(name))
}

impl Visitor for Members {
    type Node = usize;

    fn member(&mut self, of: usize, name: &str) -> Option<usize> {
        let next = &self.nodes.get(of)?.next;
        let find = |name: &str| {
            let is_it = |step: &Step| matches!(step, Step::Key(key) if key == name);
            next.iter().find(|(step, _)| is_it(step)).map(|(_, node)| *node)
        };
        if next.is_empty() { None } else { find(name).or_else(|| find(&escaped(name)?)) }
    }

    fn element(&mut self, of: usize, at: usize) -> Option<usize> {
        self.nodes.get(of)?.next.iter().find(|(step, _)| step.index() == Some(at)).map(|(_, node)| *node)
    }

    fn enter(&mut self, _node: usize) {}

    fn leave(&mut self, node: usize, place: Place) {
        if let Some(found) = self.places.get_mut(node) {
            *found = Some(place);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_message::path::Path;

    #[track_caller]
    fn check(paths: &[&str], message: &str, expected: &[&str]) {
        let mut members = Members::default();
        let numbers: Vec<Option<usize>> =
            paths.iter().map(|path| members.add(&Path::parse(path).unwrap().steps)).collect();
        let found = members.find(message.as_bytes());
        let shown = numbers.into_iter().map(|number| match number {
            Some(number) => found.place(number).map_or("-", |place| place.of(found.text)),
            None => "apart",
        });
        assert_eq!(shown.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn members_are_found_in_one_pass() {
        let message = r#"{"a": {"b": [1, {"c": 2}], "d": "x"}, "e\u0031": null, "a": {"f": 3}}"#;
        check(
            &["a.b[1].c", "a.d", "e1", "a.b", "g", "a.f"],
            message,
            &["2", "x", "null", r#"[1, {"c": 2}]"#, "-", "3"],
        );
        check(&["", "a"], "[1]", &["[1]", "-"]);
        check(&["a"], r#"{"a": 1} x"#, &["-"]);
        check(&["a[0]", "a.0", "a.1"], r#"{"a": [1, 2]}"#, &["1", "apart", "2"]);
    }
}
