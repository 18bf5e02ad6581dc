//! A Signal K delta, parsed in one pass: the sources, times and values of its updates.

use shsa_message::json::{Broken, Kind, Place, Visitor, walk};
use std::ops::Range;

/// A line in parts, each by its place in the line. Its memory is used again for the next line.
#[derive(Default)]
pub(super) struct Delta {
    /// The vessel or device that the values describe.
    pub(super) context: Option<Place>,
    pub(super) updates: Vec<Update>,
    /// The paths and values of all updates.
    entries: Vec<Entry>,
    labels: [Option<Place>; LABELS.len()],
    path: Option<Place>,
    value: Option<Place>,
    update: Update,
}

/// An update: its source, its time, and its values.
#[derive(Clone, Default)]
pub(super) struct Update {
    /// `$source`, or the label of the source, or the available ones of its `src` and `type`.
    pub(super) source: Option<Place>,
    pub(super) timestamp: Option<Place>,
    entries: Range<usize>,
    /// The number of entries without a path or without a value.
    pub(super) incomplete: usize,
}

/// A path, and its value as JSON.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub(super) path: Place,
    value: Place,
}

impl Entry {
    /// The value, as JSON.
    pub(super) fn value(self, text: &str) -> &str {
        let quote = usize::from(self.value.kind == Kind::Text);
        text.get(self.value.from - quote..self.value.to + quote).unwrap_or_default()
    }
}

/// A value of the JSON tree, by its path.
#[derive(Clone, Copy)]
pub(super) enum Node {
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

impl Delta {
    /// Parses a line. `O(bytes)`.
    ///
    /// # Errors
    /// The place where the text ceases to be JSON; the parts have no meaning then.
    pub(super) fn read(&mut self, text: &str) -> Result<(), Broken> {
        (self.context, self.labels) = (None, [None; LABELS.len()]);
        (self.path, self.value, self.update) = (None, None, Update::default());
        self.updates.clear();
        self.entries.clear();
        walk(text, Node::Root, self)
    }

    /// The paths and values of an update.
    pub(super) fn entries(&self, update: &Update) -> &[Entry] {
        self.entries.get(update.entries.clone()).unwrap_or_default()
    }

    fn end_entry(&mut self) {
        match (self.path.take().filter(|it| it.kind == Kind::Text), self.value.take()) {
            (Some(path), Some(value)) => self.entries.push(Entry { path, value }),
            _ => self.update.incomplete += 1,
        }
    }

    fn end_update(&mut self) {
        let mut update = std::mem::take(&mut self.update);
        update.source = std::mem::take(&mut self.labels).into_iter().flatten().next();
        update.entries.end = self.entries.len();
        self.update.entries.start = self.entries.len();
        self.updates.push(update);
    }
}

impl Visitor for Delta {
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
            Node::Context if is_text => self.context = Some(place),
            Node::Label(at) if is_text || place.kind == Kind::Number => {
                self.labels.get_mut(at).into_iter().for_each(|label| *label = Some(place));
            }
            Node::Timestamp if is_text => {
                self.update.timestamp.get_or_insert(place);
            }
            Node::Path => self.path = Some(place),
            Node::Value => self.value = Some(place),
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
        let mut delta = Delta::default();
        let shown = match delta.read(text) {
            Err(Broken { at, expected }) => format!("at {at}: {expected}"),
            Ok(()) => {
                let of = |place: Option<Place>| place.map(|place| place.of(text));
                let update = |it: &Update| {
                    let values: Vec<(&str, &str)> = delta
                        .entries(it)
                        .iter()
                        .map(|entry| (entry.path.of(text), entry.value(text)))
                        .collect();
                    let source = of(it.source).unwrap_or_default();
                    format!("{source} {:?} {values:?} {}", of(it.timestamp), it.incomplete)
                };
                let updates: Vec<String> = delta.updates.iter().map(update).collect();
                format!("{}: {}", of(delta.context).unwrap_or_default(), updates.join("; "))
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
