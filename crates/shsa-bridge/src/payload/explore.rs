//! The fields of a payload, for a user who does not know them yet.

use super::metrics::{self, is_metrics};
use super::reader::{Reader, text_of};
use super::scalar::scalar;
use super::typed::{is_message_type, text_in};
use super::{SIZE_LIMIT, Unreadable};
use crate::{Message, Payload};
use shsa_core::observation::RawValue;
use shsa_message::json::{self, Kind, Place, Visitor};
use shsa_message::ros::{Types, full_name};
use shsa_message::source::Field;

/// The most fields of one payload that are reported.
pub const FIELDS_MAX: usize = 1000;
/// The most elements of a list of objects that are reported.
const ELEMENTS_MAX: usize = 16;

/// One field of a payload.
#[derive(Clone, Debug, PartialEq)]
pub struct Leaf {
    /// Its path, as [`Path`](shsa_message::path::Path) reads it; empty: the payload itself.
    pub path: String,
    /// Its content.
    pub content: Content,
}

/// The content of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// A value that a reader can read.
    Value(RawValue),
    /// A text that is not a number.
    Text(String),
    /// Nothing.
    Null,
}

/// All fields of a message, in order: members of objects one by one, lists of numbers as one field, at most [`FIELDS_MAX`].
///
/// # Errors
/// When the payload is too large, no text, or broken JSON.
pub fn explore(message: &Message) -> Result<Vec<Leaf>, Unreadable> {
    match &message.payload {
        Payload::Value(value) => {
            Ok(vec![Leaf { path: String::new(), content: Content::Value(value.clone()) }])
        }
        Payload::Bytes(bytes) if message.message_type.as_deref().is_some_and(is_metrics) => {
            metrics::leaves(message.message_type.as_deref().unwrap_or_default(), bytes)
        }
        Payload::Bytes(bytes) => match message.message_type.as_deref().filter(|name| is_message_type(name)) {
            None => leaves(text_of(bytes, SIZE_LIMIT)?),
            Some(name) => match text_in(name, bytes) {
                Some(text) => leaves(text_of(text?, SIZE_LIMIT)?),
                None => typed_leaves(message, name),
            },
        },
    }
}

/// The fields of the message's type, as far as the message has them.
fn typed_leaves(message: &Message, name: &str) -> Result<Vec<Leaf>, Unreadable> {
    let mut paths = Vec::new();
    Types::standard().paths(&full_name(name), "", FIELDS_MAX, &mut paths)?;
    let fields: Vec<Field> = paths.iter().map(|path| Field { path: path.clone(), stamp: None }).collect();
    let mut reader =
        Reader::new(&fields, SIZE_LIMIT).map_err(|error| Unreadable::Layout(error.to_string()))?;
    let (mut leaves, mut problem) = (Vec::new(), None);
    reader.read(message, |index, reading| match (reading, paths.get(index)) {
        (Ok(reading), Some(path)) => {
            leaves.push(Leaf { path: path.clone(), content: Content::Value(reading.value) });
        }
        (Err(unreadable), _) => problem = Some(unreadable),
        (Ok(_), None) => {}
    });
    problem.filter(|_| leaves.is_empty()).map_or(Ok(leaves), Err)
}

fn leaves(text: &str) -> Result<Vec<Leaf>, Unreadable> {
    if !json::is_likely(text) {
        let trimmed = text.trim_ascii();
        let kind = if trimmed == "null" { Kind::Null } else { Kind::Text };
        let content = content(Place { kind, from: 0, to: trimmed.len() }, trimmed);
        return Ok(content.into_iter().map(|content| Leaf { path: String::new(), content }).collect());
    }
    let mut map = Map { nodes: vec![Node { parent: 0, name: Name::Root, place: None }] };
    json::walk(text, 0, &mut map)?;
    let leaf = |index: usize| Some(Leaf { path: map.path(index), content: map.content(index, text)? });
    Ok((0..map.nodes.len()).filter_map(leaf).collect())
}

/// All values on the paths to the leaves.
struct Map {
    nodes: Vec<Node>,
}

struct Node {
    parent: usize,
    name: Name,
    place: Option<Place>,
}

enum Name {
    Root,
    Member(String),
    Element(usize),
}

impl Visitor for Map {
    type Node = usize;

    fn member(&mut self, of: usize, name: &str) -> Option<usize> {
        self.grow(of, Name::Member(json::unescaped(name).into_owned()))
    }

    fn element(&mut self, of: usize, index: usize) -> Option<usize> {
        (index < ELEMENTS_MAX).then(|| self.grow(of, Name::Element(index))).flatten()
    }

    fn enter(&mut self, _node: usize) {}

    fn leave(&mut self, node: usize, place: Place) {
        self.nodes[node].place = Some(place);
    }
}

impl Map {
    fn grow(&mut self, parent: usize, name: Name) -> Option<usize> {
        if self.nodes.len() > FIELDS_MAX {
            return None;
        }
        self.nodes.push(Node { parent, name, place: None });
        Some(self.nodes.len() - 1)
    }

    /// The content of a leaf: a node that is neither an object nor an element of a list that is reported as a whole.
    fn content(&self, index: usize, text: &str) -> Option<Content> {
        let node = &self.nodes[index];
        let parent = self.nodes[node.parent].place?;
        let is_told_already = index != 0 && parent.kind == Kind::List && content(parent, text).is_some();
        if is_told_already { None } else { content(node.place?, text) }
    }

    /// The path with dots; as a JSON pointer if a name has a special character.
    fn path(&self, mut index: usize) -> String {
        let mut names = Vec::new();
        while index != 0 {
            names.push(&self.nodes[index].name);
            index = self.nodes[index].parent;
        }
        names.reverse();
        let has_meaning = |name: &&Name| match name {
            Name::Member(name) => {
                name.is_empty() || name.contains(['.', '[', ']', '/', '=', '#', '@', '!', ' '])
            }
            Name::Element(_) | Name::Root => false,
        };
        if names.iter().any(has_meaning) { pointer(&names) } else { dotted(&names) }
    }
}

fn pointer(names: &[&Name]) -> String {
    let step = |name: &&Name| match name {
        Name::Root => String::new(),
        Name::Member(name) => format!("/{}", name.replace('~', "~0").replace('/', "~1")),
        Name::Element(index) => format!("/{index}"),
    };
    names.iter().map(step).collect()
}

fn dotted(names: &[&Name]) -> String {
    let mut path = String::new();
    for name in names {
        match name {
            Name::Root => {}
            Name::Member(name) if path.is_empty() => path.push_str(name),
            Name::Member(name) => path.extend([".", name]),
            Name::Element(index) => path.push_str(&format!("[{index}]")),
        }
    }
    path
}

/// `None`: objects, and lists of anything but numbers.
fn content(place: Place, text: &str) -> Option<Content> {
    match place.kind {
        Kind::Null => Some(Content::Null),
        Kind::Object => None,
        Kind::List => {
            let mut values = Some(Vec::new());
            json::elements(text, place, |_, element| {
                let value = if element.kind == Kind::Null { Some(f64::NAN) } else { scalar(element, text) };
                match (value, &mut values) {
                    (Some(value), Some(values)) => values.push(value),
                    _ => values = None,
                }
                values.is_some()
            });
            values.map(|values| Content::Value(RawValue::Vector(values)))
        }
        _ => Some(match scalar(place, text) {
            Some(value) => Content::Value(RawValue::Number(value)),
            None => Content::Text(json::unescaped(place.of(text)).chars().take(200).collect()),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::payload::Reader;
    use shsa_core::time::Time;

    #[track_caller]
    fn check(payload: &str, expected: &[&str]) {
        let message = Message::new("a".into(), Time(0), Payload::Bytes(payload.to_owned().into()));
        let leaves = explore(&message).unwrap();
        let shown: Vec<String> =
            leaves.iter().map(|Leaf { path, content }| format!("{path}: {content:?}")).collect();
        assert_eq!(shown, expected);
        // A reader finds the same value under each path.
        for leaf in leaves {
            let Content::Value(value) = leaf.content else { continue };
            let mut reader = Reader::new(&[Field { path: leaf.path.clone(), stamp: None }], 1 << 20).unwrap();
            reader.read(&message, |_, reading| {
                assert_eq!(format!("{:?}", reading.unwrap().value), format!("{value:?}"), "{}", leaf.path);
            });
        }
    }

    #[test]
    fn fields_are_reported_with_their_paths() {
        check("21.5", &[": Value(Number(21.5))"]);
        check(" open\n", &[": Text(\"open\")"]);
        check("[1, null]", &[": Value(Vector([1.0, NaN]))"]);
        check(
            r#"{"pose": {"x": 1, "name": "ann"}, "on": true, "none": null, "speed [m/s]": 4, "r": [1, 2]}"#,
            &[
                "pose.x: Value(Number(1.0))",
                "pose.name: Text(\"ann\")",
                "on: Value(Number(1.0))",
                "none: Null",
                "/speed [m~1s]: Value(Number(4.0))",
                "r: Value(Vector([1.0, 2.0]))",
            ],
        );
        check(
            r#"{"rooms": [{"t": 20}, {"t": 21}], "names": ["a", "b"]}"#,
            &[
                "rooms[0].t: Value(Number(20.0))",
                "rooms[1].t: Value(Number(21.0))",
                "names[0]: Text(\"a\")",
                "names[1]: Text(\"b\")",
            ],
        );
        check("{}", &[]);
    }

    #[test]
    fn typed_messages_have_the_fields_of_their_type() {
        let shown = |bytes: Vec<u8>| {
            let payload = Payload::Bytes(bytes.into());
            let name = Some("geometry_msgs/msg/Twist".into());
            explore(&Message { message_type: name, ..Message::new("a".into(), Time(0), payload) })
        };
        let numbers = [1.0_f64, 2.0, 3.0, 4.0, 5.0, 6.0].map(f64::to_le_bytes).concat();
        let twist = [&[0, 1, 0, 0], &*numbers].concat();
        let leaves = shown(twist.clone()).unwrap();
        let paths: Vec<&str> = leaves.iter().map(|leaf| &*leaf.path).collect();
        assert_eq!(paths, ["linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"]);
        assert_eq!(leaves[4].content, Content::Value(RawValue::Number(5.0)));
        assert_eq!(shown(twist[..12].to_vec()).unwrap().len(), 1);
        assert!(shown(vec![0, 1, 0, 0]).unwrap_err().to_string().contains("is not within 0 bytes"));
    }

    #[test]
    fn what_is_broken_is_no_field() {
        let message = Message::new("a".into(), Time(0), Payload::Bytes("{\"a\": ".into()));
        assert!(explore(&message).unwrap_err().to_string().starts_with("no JSON: byte 6"));
        let many: String = (0..3000).map(|n| format!("\"k{n}\": {n},")).collect();
        let message =
            Message::new("a".into(), Time(0), Payload::Bytes(format!("{{{many} \"z\": 1}}").into()));
        assert_eq!(explore(&message).unwrap().len(), FIELDS_MAX);
    }
}
