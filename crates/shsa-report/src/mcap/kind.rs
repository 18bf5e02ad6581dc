//! The kinds of messages, each with its schema.

use serde_json::{Map, Value, json};

/// A kind of message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An input of the run, a line of the journal.
    Journal,
    /// A value with its bounds.
    Interval,
    /// A published value of a need.
    Need,
    /// The verdict on a signal.
    Verdict,
    /// A decision with its reasons.
    Decision,
    /// A decision as a line for a log.
    Log,
    /// The knowledge graph as a drawing.
    Graph,
}

impl Kind {
    /// The name of the schema. Foxglove recognises its own schemas by their names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Kind::Journal => "shsa.Journal",
            Kind::Interval => "shsa.Interval",
            Kind::Need => "shsa.Need",
            Kind::Verdict => "shsa.Verdict",
            Kind::Decision => "shsa.Decision",
            Kind::Log => "foxglove.Log",
            Kind::Graph => "foxglove.SceneUpdate",
        }
    }

    /// The schema, a JSON Schema.
    #[must_use]
    pub fn schema(self) -> String {
        object(self.name(), self.fields()).to_string()
    }

    fn fields(self) -> Vec<(&'static str, Value)> {
        match self {
            Kind::Journal => Vec::new(),
            Kind::Interval => numbers(&["lo", "mid", "hi", "width"]),
            Kind::Need => [numbers(&["lo", "mid", "hi", "width"]), texts(&["quality", "source"])].concat(),
            Kind::Verdict => texts(&["verdict", "symptom"]),
            Kind::Decision => texts(&["kind", "signal", "variable", "because", "substitution"]),
            Kind::Log => {
                let ends = [("file", plain("string")), ("line", plain("integer"))];
                let begins = [("timestamp", time("time")), ("level", plain("integer"))];
                [begins.to_vec(), texts(&["message", "name"]), ends.to_vec()].concat()
            }
            Kind::Graph => vec![("deletions", list(deletion())), ("entities", list(entity()))],
        }
    }
}

fn plain(kind: &str) -> Value {
    json!({ "type": kind })
}

fn numbers(names: &[&'static str]) -> Vec<(&'static str, Value)> {
    names.iter().map(|&name| (name, plain("number"))).collect()
}

fn texts(names: &[&'static str]) -> Vec<(&'static str, Value)> {
    names.iter().map(|&name| (name, plain("string"))).collect()
}

fn object(title: &str, fields: Vec<(&'static str, Value)>) -> Value {
    let properties: Map<String, Value> =
        fields.into_iter().map(|(name, kind)| (name.to_owned(), kind)).collect();
    json!({ "type": "object", "title": title, "properties": properties })
}

fn list(items: Value) -> Value {
    json!({ "type": "array", "items": items })
}

fn time(title: &str) -> Value {
    object(title, vec![("sec", plain("integer")), ("nsec", plain("integer"))])
}

fn vector() -> Value {
    object("foxglove.Vector3", numbers(&["x", "y", "z"]))
}

fn color() -> Value {
    object("foxglove.Color", numbers(&["r", "g", "b", "a"]))
}

fn pose() -> Value {
    let orientation = object("foxglove.Quaternion", numbers(&["x", "y", "z", "w"]));
    object("foxglove.Pose", vec![("position", vector()), ("orientation", orientation)])
}

fn deletion() -> Value {
    let fields = vec![("timestamp", time("time")), ("type", plain("integer")), ("id", plain("string"))];
    object("foxglove.SceneEntityDeletion", fields)
}

fn entity() -> Value {
    let pair = object("foxglove.KeyValuePair", texts(&["key", "value"]));
    let cube = vec![("pose", pose()), ("size", vector()), ("color", color())];
    let text = vec![
        ("pose", pose()),
        ("billboard", plain("boolean")),
        ("font_size", plain("number")),
        ("scale_invariant", plain("boolean")),
        ("color", color()),
        ("text", plain("string")),
    ];
    let line = vec![
        ("type", plain("integer")),
        ("pose", pose()),
        ("thickness", plain("number")),
        ("scale_invariant", plain("boolean")),
        ("points", list(object("foxglove.Point3", numbers(&["x", "y", "z"])))),
        ("color", color()),
        ("colors", list(color())),
        ("indices", list(plain("integer"))),
    ];
    let fields = vec![
        ("timestamp", time("time")),
        ("frame_id", plain("string")),
        ("id", plain("string")),
        ("lifetime", time("duration")),
        ("frame_locked", plain("boolean")),
        ("metadata", list(pair)),
        ("cubes", list(object("foxglove.CubePrimitive", cube))),
        ("lines", list(object("foxglove.LinePrimitive", line))),
        ("texts", list(object("foxglove.TextPrimitive", text))),
    ];
    object("foxglove.SceneEntity", fields)
}
