//! A Signal K delta, parsed in one pass: the sources, times and values of its updates.

use shsa_message::json::{Broken, Kind, Place, Visitor, unescaped, walk};
use std::borrow::Cow;

/// An update: its source, its time, and the places of its values in the delta.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Update<'a> {
    /// `$source`, or the label of the source, or the available ones of its `src` and `type`.
    pub(super) source: Cow<'a, str>,
    pub(super) timestamp: Option<&'a str>,
    /// Paths and values, as JSON.
    pub(super) values: Vec<(Cow<'a, str>, &'a str)>,
    /// The number of entries without a path or without a value.
    pub(super) incomplete: usize,
}

/// A line.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Delta<'a> {
    /// The vessel or device that the values describe.
    pub(super) context: Option<Cow<'a, str>>,
    pub(super) updates: Vec<Update<'a>>,
}

/// Parses a line. `O(bytes)`.
///
/// # Errors
/// The place where the text ceases to be JSON.
pub(super) fn delta(text: &str) -> Result<Delta<'_>, Broken> {
    let mut reader = Reader { text, delta: Delta::default(), update: Parts::default() };
    walk(text, Node::Root, &mut reader)?;
    Ok(reader.delta)
}

/// A value of the JSON tree, by its path.
#[derive(Clone, Copy)]
enum Node {
    Root,
    Context,
    Updates,
    Update,
    Source,
    Label(usize),
    Timestamp,
    Values,
    Entry,
    Path,
    Value,
}

/// The names of a source, the best first.
const LABELS: [&str; 4] = ["$source", "label", "src", "type"];

/// An update under construction.
#[derive(Default)]
struct Parts<'a> {
    update: Update<'a>,
    labels: [Option<Place>; LABELS.len()],
    path: Option<Place>,
    value: Option<Place>,
}

struct Reader<'a> {
    text: &'a str,
    delta: Delta<'a>,
    update: Parts<'a>,
}

impl<'a> Reader<'a> {
    fn said(&self, place: Place) -> Cow<'a, str> {
        unescaped(place.of(self.text))
    }

    fn end_entry(&mut self) {
        let Parts { update, path, value, .. } = &mut self.update;
        match (path.take().filter(|it| it.kind == Kind::Text), value.take()) {
            (Some(path), Some(value)) => {
                let quote = usize::from(value.kind == Kind::Text);
                let value = self.text.get(value.from - quote..value.to + quote).unwrap_or_default();
                update.values.push((unescaped(path.of(self.text)), value));
            }
            _ => update.incomplete += 1,
        }
    }

    fn end_update(&mut self) {
        let Parts { mut update, labels, .. } = std::mem::take(&mut self.update);
        let label = labels.iter().flatten().next();
        update.source = label.map_or(Cow::Borrowed(""), |label| self.said(*label));
        self.delta.updates.push(update);
    }
}

impl<'a> Visitor for Reader<'a> {
    type Node = Node;

    fn member(&mut self, of: Node, name: &str) -> Option<Node> {
        match (of, name) {
            (Node::Root, "context") => Some(Node::Context),
            (Node::Root, "updates") => Some(Node::Updates),
            (Node::Update, "source") => Some(Node::Source),
            (Node::Update, "$source") => Some(Node::Label(0)),
            (Node::Update, "timestamp") => Some(Node::Timestamp),
            // Old versions have the time within the source.
            (Node::Source, "timestamp") => Some(Node::Timestamp),
            (Node::Source, name) => LABELS.iter().position(|label| *label == name).map(Node::Label),
            (Node::Update, "values") => Some(Node::Values),
            (Node::Entry, "path") => Some(Node::Path),
            (Node::Entry, "value") => Some(Node::Value),
            _ => None,
        }
    }

    fn element(&mut self, of: Node, _index: usize) -> Option<Node> {
        match of {
            Node::Updates => Some(Node::Update),
            Node::Values => Some(Node::Entry),
            _ => None,
        }
    }

    fn enter(&mut self, _node: Node) {}

    fn leave(&mut self, node: Node, place: Place) {
        let is_text = place.kind == Kind::Text;
        match node {
            Node::Context if is_text => self.delta.context = Some(self.said(place)),
            Node::Label(at) if is_text || place.kind == Kind::Number => {
                self.update.labels.get_mut(at).into_iter().for_each(|label| *label = Some(place));
            }
            Node::Timestamp if is_text => {
                self.update.update.timestamp.get_or_insert(self.text.get(place.range()).unwrap_or_default());
            }
            Node::Path => self.update.path = Some(place),
            Node::Value => self.update.value = Some(place),
            Node::Entry => self.end_entry(),
            Node::Update => self.end_update(),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let shown = match delta(text) {
            Err(Broken { at, expected }) => format!("at {at}: {expected}"),
            Ok(Delta { context, updates }) => {
                let update = |it: &Update<'_>| {
                    let Update { source, timestamp, values, incomplete } = it;
                    format!("{source} {timestamp:?} {values:?} {incomplete}")
                };
                let updates: Vec<String> = updates.iter().map(update).collect();
                format!("{}: {}", context.unwrap_or_default(), updates.join("; "))
            }
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn updates_have_sources_times_and_values() {
        check(
            r#"{"updates": [{"values": [{"path": "a.b", "value": {"x": 1}}, {"value": 2}, {"path": "c", "value": "t"}],
               "source": {"src": "1", "label": "n2k"}, "timestamp": "2016"}, {"$source": "gps.1"}], "context": "vessels.x"}"#,
            r#"vessels.x: n2k Some("2016") [("a.b", "{\"x\": 1}"), ("c", "\"t\"")] 1; gps.1 None [] 0"#,
        );
        check("{}", ": ");
        check(r#"{"updates": ["#, "at 13: a value");
    }
}
