//! The content of a file: its topics with their fields, rates, gaps and examples of values.

use super::content::{FieldInfo, FileInfo, TopicInfo};
use super::fields::Locator;
use super::topic::{Body, Fields, Listener, Times, Topic, TopicId};
use super::{Place, Warning};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::json::{Kind, Visitor, unescaped, walk};
use std::mem;
use std::path::{Path, PathBuf};

/// The most fields of a topic that are listed.
const FIELDS_MAX: usize = 400;

/// How many messages of a topic are looked into one by one for fields that no message had before.
const ALL_MAX: usize = 1 << 12;

/// The longest text that is shown, characters.
const TEXT_MAX: usize = 40;

/// Collects the content of one file.
pub(super) struct Inventory {
    file: PathBuf,
    topics: Vec<Entry>,
    warnings: Vec<Warning>,
    is_degraded: bool,
}

/// One topic, which several publishers may share.
struct Entry {
    info: TopicInfo,
    fields: Fields,
    /// The paths and places of the listed fields.
    locators: Vec<(String, Locator)>,
    span: Option<(Time, Time)>,
    last: Option<Time>,
    /// How many messages have a time.
    dated: usize,
    is_next_undated: bool,
    is_untimed: bool,
}

impl Inventory {
    pub(super) fn new(file: &Path) -> Inventory {
        Inventory { file: file.into(), topics: Vec::new(), warnings: Vec::new(), is_degraded: false }
    }

    /// The content of the file, which has this format.
    pub(super) fn finish(self, format: &'static str) -> FileInfo {
        let mut topics: Vec<TopicInfo> = self.topics.into_iter().map(Entry::finish).collect();
        topics.sort_by(|a, b| a.source.cmp(&b.source).then_with(|| a.kind.cmp(&b.kind)));
        FileInfo { file: self.file, format, topics, warnings: self.warnings, degraded: self.is_degraded }
    }
}

impl Listener for Inventory {
    fn file(&self) -> &Path {
        &self.file
    }

    fn topic(&mut self, topic: Topic<'_>) -> TopicId {
        let source = topic.choice();
        let known = self.topics.iter().position(|it| it.info.source == source && it.info.kind == topic.kind);
        if let Some(entry) = known.and_then(|known| self.topics.get_mut(known)) {
            entry.extend(&topic.fields);
        }
        TopicId(known.unwrap_or_else(|| {
            self.topics.push(Entry::new(source, &topic));
            self.topics.len() - 1
        }))
    }

    fn is_wanted(&self, _topic: TopicId) -> bool {
        true
    }

    fn needs_time(&self, _topic: TopicId) -> bool {
        false
    }

    fn untimed(&mut self, topic: TopicId, problem: String) {
        if let Some(entry) = self.topics.get_mut(topic.0) {
            entry.is_untimed = true;
        }
        self.note(Place::Whole, problem);
    }

    fn clock(&mut self, topic: TopicId, columns: &[usize]) {
        let Some(entry) = self.topics.get_mut(topic.0) else { return };
        let fields = entry.info.fields.iter_mut().enumerate();
        fields.for_each(|(at, field)| field.is_clock |= columns.contains(&at));
    }

    fn undated(&mut self, topic: TopicId) {
        if let Some(entry) = self.topics.get_mut(topic.0) {
            entry.is_next_undated = true;
        }
    }

    fn has_undated(&mut self, place: Place, problem: String) {
        self.damaged(place, problem);
    }

    fn message(&mut self, topic: TopicId, times: Times, body: Body<'_>) {
        if let Some(entry) = self.topics.get_mut(topic.0) {
            entry.see(times.received, body);
        }
    }

    fn damaged(&mut self, place: Place, problem: String) {
        self.is_degraded = true;
        self.note(place, problem);
    }

    fn note(&mut self, place: Place, what: String) {
        /// The most warnings of a file that are kept.
        const MOST: usize = 20;
        if self.warnings.len() < MOST {
            self.warnings.push(Warning { file: self.file.clone(), place, message: what });
        }
    }
}

impl Entry {
    fn new(source: String, topic: &Topic<'_>) -> Entry {
        let unreadable = match &topic.fields {
            Fields::Unknown(reason) => Some(reason.clone()),
            _ => None,
        };
        let info = TopicInfo {
            name: topic.name.to_owned(),
            source,
            kind: topic.kind.to_owned(),
            unreadable,
            ..TopicInfo::default()
        };
        let mut entry = Entry {
            info,
            fields: topic.fields.clone(),
            locators: Vec::new(),
            span: None,
            last: None,
            dated: 0,
            is_next_undated: false,
            is_untimed: false,
        };
        entry.list();
        entry
    }

    /// Lists the fields of the message type.
    fn list(&mut self) {
        let mut paths = Vec::new();
        match &self.fields {
            Fields::Named(fields) => {
                for (at, field) in fields.iter().enumerate().take(FIELDS_MAX) {
                    let locator = Locator::Named(at, None);
                    self.locators.push((field.name.clone(), locator));
                    self.info.fields.push(FieldInfo::new(&field.name, field.unit.clone()));
                }
            }
            Fields::Ros { types, kind, .. } => {
                if let Err(problem) = types.paths(kind, "", FIELDS_MAX, &mut paths) {
                    self.info.unreadable = Some(problem.to_string());
                }
            }
            Fields::Protobuf(types, kind) => types.paths(kind, "", FIELDS_MAX, &mut paths),
            Fields::Json | Fields::Unknown(_) => {}
        }
        paths.into_iter().for_each(|path| self.add(path));
    }

    /// Lists further fields of a topic that is reported again with them.
    fn extend(&mut self, fields: &Fields) {
        let (Fields::Named(before), Fields::Named(fields)) = (&self.fields, fields) else { return };
        if !fields.starts_with(before) {
            return;
        }
        for (at, field) in fields.iter().enumerate().skip(before.len()).take_while(|(at, _)| *at < FIELDS_MAX)
        {
            self.locators.push((field.name.clone(), Locator::Named(at, None)));
            self.info.fields.push(FieldInfo::new(&field.name, field.unit.clone()));
        }
        self.fields = Fields::Named(fields.clone());
    }

    fn add(&mut self, path: String) {
        if self.locators.len() >= FIELDS_MAX || self.locators.iter().any(|(known, _)| *known == path) {
            return;
        }
        if let Ok(locator) = self.fields.locate(&path) {
            self.info.fields.push(FieldInfo::new(&path, None));
            self.locators.push((path, locator));
        }
    }

    fn see(&mut self, received: Time, body: Body<'_>) {
        self.info.count += 1;
        if !mem::take(&mut self.is_next_undated) {
            self.see_time(received);
        }
        // Examples are taken from fewer and fewer messages, so that the memory does not grow with the content of the messages.
        if self.info.count.is_power_of_two()
            || self.info.count <= ALL_MAX && matches!(self.fields, Fields::Json)
        {
            self.look_into(body);
        } else if self.info.count <= ALL_MAX || matches!(self.fields, Fields::Named(_)) {
            self.look_for(body);
        }
    }

    /// Takes examples of the fields that had none so far.
    fn look_for(&mut self, body: Body<'_>) {
        let open = self.locators.iter().zip(&mut self.info.fields).filter(|(_, info)| info.kind.is_empty());
        open.for_each(|((_, locator), info)| info.look(locator, body));
    }

    fn see_time(&mut self, received: Time) {
        self.dated += 1;
        let (from, to) = self.span.unwrap_or((received, received));
        self.span = Some((from.min(received), to.max(received)));
        if let Some(last) = self.last.replace(received) {
            let longest = self.info.longest_gap.unwrap_or(Span::ZERO);
            self.info.longest_gap = Some(longest.max(received - last));
        }
    }

    fn look_into(&mut self, body: Body<'_>) {
        if let (Fields::Json, Body::Bytes(bytes)) = (&self.fields, body) {
            let text = std::str::from_utf8(bytes).unwrap_or("");
            leaves(text).into_iter().for_each(|path| self.add(path));
        }
        for ((_, locator), info) in self.locators.iter().zip(&mut self.info.fields) {
            info.look(locator, body);
        }
    }

    fn finish(mut self) -> TopicInfo {
        if self.is_untimed {
            return TopicInfo { longest_gap: None, ..self.info };
        }
        self.info.rate_hz = self.span.and_then(|(from, to)| mean_rate(self.dated, from, to));
        self.info.span = self.span;
        self.info
    }
}

/// The mean rate of samples, by the times of the first and the last one.
fn mean_rate(count: usize, first: Time, last: Time) -> Option<f64> {
    let span = (last - first).seconds();
    (count > 1 && span > 0.0).then(|| (count - 1) as f64 / span)
}

impl FieldInfo {
    fn new(path: &str, unit: Option<String>) -> FieldInfo {
        FieldInfo { path: path.to_owned(), unit, ..FieldInfo::default() }
    }

    /// Takes an example from a message, if it has one.
    fn look(&mut self, locator: &Locator, body: Body<'_>) {
        if let Some(value) = locator.value(body, None) {
            self.see(value);
        } else if let Some(text) = locator.text(body) {
            self.kind = "text";
            self.sample = Some(text.chars().take(TEXT_MAX).collect());
        }
    }

    fn see(&mut self, value: RawValue) {
        let (kind, shown) = match value {
            RawValue::Number(number) => ("number", number.to_string()),
            RawValue::Interval { lo, hi } => ("interval", format!("{lo}..{hi}")),
            RawValue::Vector(items) => {
                let shown: Vec<String> = items.iter().take(3).map(f64::to_string).collect();
                let more = if items.len() > 3 { ", .." } else { "" };
                ("list", format!("[{}{more}] ({} elements)", shown.join(", "), items.len()))
            }
        };
        self.kind = kind;
        self.sample = Some(shown);
    }
}

/// The paths of the numbers, texts and lists of numbers in a JSON value; for a list of objects, those of its first object.
fn leaves(text: &str) -> Vec<String> {
    struct Leaves {
        /// For each node the path to it, and whether it has content.
        nodes: Vec<(String, bool)>,
        found: Vec<String>,
    }
    impl Visitor for Leaves {
        type Node = usize;
        fn member(&mut self, of: usize, name: &str) -> Option<usize> {
            let (path, has_parts) = self.nodes.get_mut(of)?;
            *has_parts = true;
            let dot = if path.is_empty() { "" } else { "." };
            let path = format!("{path}{dot}{}", unescaped(name));
            self.push(path)
        }
        fn element(&mut self, of: usize, index: usize) -> Option<usize> {
            let (path, _) = self.nodes.get(of)?;
            let path = format!("{path}[{index}]");
            if index == 0 { self.push(path) } else { None }
        }
        fn enter(&mut self, _node: usize) {}
        fn leave(&mut self, node: usize, place: shsa_message::json::Place) {
            let Some((path, has_parts)) = self.nodes.get(node).cloned() else { return };
            if place.kind == Kind::Object || has_parts {
                return;
            }
            if place.kind == Kind::List {
                // A list of numbers is listed itself, without its first element.
                let first = format!("{path}[0]");
                self.found.retain(|known| *known != first);
                if self.nodes.iter().any(|(known, has_parts)| *known == first && *has_parts) {
                    return;
                }
            }
            self.found.push(path);
        }
    }
    impl Leaves {
        fn push(&mut self, path: String) -> Option<usize> {
            (self.nodes.len() < FIELDS_MAX).then(|| {
                self.nodes.push((path, false));
                self.nodes.len() - 1
            })
        }
    }
    let mut leaves = Leaves { nodes: vec![(String::new(), false)], found: Vec::new() };
    // A text that is no JSON has no parts.
    let _walked = walk(text, 0, &mut leaves);
    leaves.found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_leaves_of_json_are_listed() {
        #[track_caller]
        fn check(text: &str, expected: &[&str]) {
            assert_eq!(leaves(text), expected);
        }
        check("5", &[""]);
        check(
            r#"{"a": 1, "b": {"c": [1, 2], "d": "x"}, "e": [{"f": 1}, {"f": 2}]}"#,
            &["a", "b.c", "b.d", "e[0].f"],
        );
        check("{", &[]);
    }
}
