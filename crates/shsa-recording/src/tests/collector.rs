//! A listener that keeps the reports of a reader for tests.

use super::super::topic::{Body, Fields, Listener, Times, Topic, TopicId, Value};
use super::*;

/// The reports of one topic.
#[derive(Default)]
pub(in super::super) struct Reported {
    pub(in super::super) name: String,
    /// The full name, with the tags.
    pub(in super::super) full: String,
    fields: Vec<String>,
    units: Vec<String>,
    /// `received value value ..` for each message; the text of bodies in bytes.
    pub(in super::super) messages: Vec<(Times, Vec<String>)>,
}

/// Keeps all reports.
#[derive(Default)]
pub(in super::super) struct Collector {
    pub(in super::super) topics: Vec<Reported>,
    pub(in super::super) damages: Vec<(Place, String)>,
    pub(in super::super) notes: Vec<(Place, String)>,
}

impl Collector {
    /// The messages of a topic by its full name: times since the epoch in ns, and the shown values of a field.
    pub(in super::super) fn column(&self, full: &str, field: &str) -> Vec<(i64, String)> {
        let (list, element) = match field.strip_suffix(']').and_then(|open| open.rsplit_once('[')) {
            Some((list, element)) => (list, element.parse::<usize>().ok()),
            None => (field, None),
        };
        let mut found = Vec::new();
        for topic in self.topics.iter().filter(|topic| topic.full == full) {
            let (at, element) = match topic.fields.iter().position(|it| it == field) {
                Some(at) => (at, None),
                None => (topic.fields.iter().position(|it| it == list).unwrap_or(usize::MAX), element),
            };
            for (times, values) in &topic.messages {
                let value = values.get(at).cloned().unwrap_or_default();
                let items: Vec<&str> = value.trim_matches(['[', ']']).split(", ").collect();
                let value = element.map_or(value.clone(), |at| (*items.get(at).unwrap_or(&"")).to_owned());
                found.push((times.received.0, value));
            }
        }
        found
    }

    /// `name full: field [unit], ..` for each topic, and the number of its messages.
    pub(in super::super) fn shown(&self) -> Vec<String> {
        let show = |topic: &Reported| {
            let unit = |unit: &String| if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
            let fields: Vec<String> = topic
                .fields
                .iter()
                .zip(&topic.units)
                .map(|(field, it)| format!("{field}{}", unit(it)))
                .collect();
            format!("{} {}: {} x{}", topic.name, topic.full, fields.join(", "), topic.messages.len())
        };
        self.topics.iter().map(show).collect()
    }

    pub(in super::super) fn count(&self) -> usize {
        self.topics.iter().map(|topic| topic.messages.len()).sum()
    }
}

impl Listener for Collector {
    fn file(&self) -> &Path {
        Path::new("log")
    }

    fn topic(&mut self, topic: Topic<'_>) -> TopicId {
        let fields = match &topic.fields {
            Fields::Named(fields) => fields.to_vec(),
            _ => Vec::new(),
        };
        self.topics.push(Reported {
            name: topic.name.to_owned(),
            full: topic.choice(),
            fields: fields.iter().map(|field| field.name.clone()).collect(),
            units: fields.iter().map(|field| field.unit.clone().unwrap_or_default()).collect(),
            messages: Vec::new(),
        });
        TopicId(self.topics.len() - 1)
    }

    fn is_wanted(&self, _topic: TopicId) -> bool {
        true
    }

    fn message(&mut self, topic: TopicId, times: Times, body: Body<'_>) {
        let show = |value: &Value<'_>| match value {
            Value::Missing => "-".to_owned(),
            Value::Number(number) => number.to_string(),
            Value::Whole(whole) => whole.to_string(),
            Value::Text(text) => format!("'{text}'"),
            Value::List(items) => format!("{items:?}"),
            Value::Interval(lo, hi) => format!("{lo}..{hi}"),
        };
        let values = match body {
            Body::Values(values) => values.iter().map(show).collect(),
            Body::Columns(columns) => (0..columns.count()).map(|at| show(&columns.value(at))).collect(),
            Body::Bytes(bytes) => vec![String::from_utf8_lossy(bytes).into_owned()],
            Body::Members(members) => vec![members.text.to_owned()],
        };
        self.topics[topic.0].messages.push((times, values));
    }

    fn damaged(&mut self, place: Place, problem: String) {
        self.damages.push((place, problem));
    }

    fn note(&mut self, place: Place, what: String) {
        self.notes.push((place, what));
    }
}
