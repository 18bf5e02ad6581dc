//! The shape of the file of a story: its keys and their content.

mod trace;
mod expectation;

use super::change;
use super::curve::Curve;
use super::{Loaded, Story, Written};
use crate::drive::Era;
use shsa_core::expression::parse_quantity;
use shsa_core::knowledge::{KnowledgeBase, Model, NeedId, Place, SignalId, Text, VariableId};
use shsa_core::time::{Span, Time};
use shsa_core::unit::{Dimension, Unit, nearest};
use shsa_model::lines::Lines;
use shsa_model::reader::{Fields, Reader};
use shsa_model::tree::{self, Node, Value};
use shsa_model::{Report, shape};
use std::collections::BTreeMap;
use std::path::Path;

const STORY: [&str; 6] = ["story", "why", "model", "trace", "changes", "expect"];
const CHANGE: [&str; 2] = ["at", "change"];

/// See [`super::load`].
pub(super) fn load(text: &str, name: &str, folder: &Path) -> Loaded {
    if text.len() > shsa_model::MAX_YAML_BYTES {
        let report = Report::whole(name, "a story has at most 64 MiB".to_owned(), "is this a story?");
        return Loaded { story: None, report };
    }
    let tree = tree::read(text);
    let Some(root) = &tree.root else {
        let mut report = Report::locate(name, text, tree.problems, &tree.rewritten);
        if report.ok() {
            report = Report::whole(name, "the story is empty".to_owned(), "begin with `story:` and `why:`");
        }
        return Loaded { story: None, report };
    };
    let mut reader = Reader::default();
    let (story, model_report) = story(&mut reader, root, text, folder);
    let mut problems = tree.problems;
    problems.extend(reader.problems);
    let mut report = Report::locate(name, text, problems, &tree.rewritten);
    report.diagnostics.extend(model_report.diagnostics);
    Loaded { story: story.filter(|_| report.ok()), report }
}

fn story(reader: &mut Reader, root: &Node, text: &str, folder: &Path) -> (Option<Story>, Report) {
    let fields = reader.fields(root, "a story: a mapping", &STORY, "story: what happens, in a sentence");
    let mut required = |key| required(reader, root, &fields, key);
    let nodes =
        (required("story"), required("why"), required("model"), required("trace"), required("expect"));
    let (Some(title), Some(why), Some(model), Some(trace), Some(expect)) = nodes else {
        return (None, Report::default());
    };
    let title = reader.text(title, "a sentence", "story: a frozen sensor is found");
    let why = reader.text(why, "a text", "why: nobody notices a sensor that stands still");
    let (knowledge, report) = knowledge(reader, model, folder);
    if !report.ok() {
        return (None, report);
    }
    let mut writer = Writer { reader, knowledge: &knowledge, truths: BTreeMap::new(), end: Time(0) };
    let trace = writer.trace(trace);
    let changes = fields.get("changes").map(|node| writer.changes(node, model)).unwrap_or_default();
    let lines = Lines::new(text);
    let written = |writer: &mut Writer<'_, '_>, node: &Node| {
        let Place { from, to } = node.place;
        let text = text.get(from as usize..to as usize).unwrap_or_default().trim().to_owned();
        let expectation = writer.expectation(node)?;
        Some(Written { text, line: lines.number(from as usize), expectation })
    };
    let items = writer.list(expect, "a list of expectations", "- { event: failed, signal: /a }");
    let expectations = items.iter().filter_map(|node| written(&mut writer, node)).collect();
    let story = title.zip(why).map(|(title, why)| Story {
        title: title.text,
        why: why.text,
        knowledge,
        trace,
        changes,
        expectations,
    });
    (story, report)
}

fn required<'n>(reader: &mut Reader, node: &Node, fields: &Fields<'n>, key: &str) -> Option<&'n Node> {
    let found = fields.get(key);
    if found.is_none() && matches!(node.value, Value::Map(_)) {
        reader.wrong(node, &format!("`{key}` is missing"), &format!("add `{key}:`"));
    }
    found
}

/// The model in the story, or a model in another file with its report.
fn knowledge(reader: &mut Reader, node: &Node, folder: &Path) -> (KnowledgeBase, Report) {
    if let Value::Scalar(path) = &node.value {
        let loaded = shsa_model::load_file(&folder.join(&path.text));
        return (loaded.knowledge, loaded.report);
    }
    let (knowledge, problems) = shape::build(reader, node);
    reader.problems.extend(problems);
    (knowledge, Report::default())
}

/// Reads the parts that refer to a model.
struct Writer<'r, 'k> {
    reader: &'r mut Reader,
    knowledge: &'k KnowledgeBase,
    truths: BTreeMap<String, Curve>,
    end: Time,
}

impl Writer<'_, '_> {
    fn list<'n>(&mut self, node: &'n Node, what: &str, example: &str) -> &'n [Node] {
        match &node.value {
            Value::List(items) => items,
            _ => {
                self.reader.wrong(node, &format!("expected {what}"), &format!("write it like `{example}`"));
                &[]
            }
        }
    }

    /// The later knowledge bases, by time.
    fn changes(&mut self, node: &Node, model: &Node) -> Vec<Era> {
        let example = "- { at: 10 s, change: { signals: { /a: null } } }";
        let mut changes = Vec::new();
        for node in self.list(node, "a list of changes", example) {
            let fields = self.reader.fields(node, "a change", &CHANGE, example);
            let at = self.at(node, &fields);
            let change = required(self.reader, node, &fields, "change");
            changes.extend(at.zip(change));
        }
        changes.sort_by_key(|(at, _)| *at);
        if matches!(model.value, Value::Scalar(_)) {
            self.reader.wrong(model, "only a model that stands in the story can be changed", "write it here");
            return Vec::new();
        }
        // The problems of the model are reported elsewhere.
        let Ok((mut model, _)) = Model::new(shape::draft(&mut Reader::default(), model)) else {
            return Vec::new();
        };
        changes
            .into_iter()
            .filter_map(|(at, node)| change::changed(self.reader, &mut model, node, at))
            .collect()
    }

    fn at(&mut self, node: &Node, fields: &Fields<'_>) -> Option<Time> {
        let node = required(self.reader, node, fields, "at")?;
        let text = self.reader.text(node, "a time", "at: 5 s")?;
        self.moment(&text)
    }

    /// A time within the story.
    fn moment(&mut self, text: &Text) -> Option<Time> {
        let time = Time(0) + self.span(text)?;
        if time > self.end {
            self.reader.note(text.place, "the story is over by then", "name a time within its `duration`");
            return None;
        }
        Some(time)
    }

    /// Reads a time; only 0 needs no unit.
    fn span(&mut self, text: &Text) -> Option<Span> {
        let second = Unit::si(Dimension::TIME);
        let bare = text.text.trim().parse::<f64>().is_ok_and(|number| number != 0.0);
        let seconds = self.quantity(text, Some(&second), false)?;
        if bare || !(0.0..=3.2e9).contains(&seconds) {
            self.reader.note(
                text.place,
                &format!("`{}` is no time", text.text),
                "write it like `300 ms` or `2 s`",
            );
            return None;
        }
        Some(Span::from_seconds(seconds))
    }

    /// Reads an amount, such as the largest difference of two values, in a unit; a plain number takes this unit.
    fn amount(&mut self, text: &Text, unit: Option<&Unit>) -> Option<f64> {
        self.quantity(text, unit, true)
    }

    fn quantity(&mut self, text: &Text, unit: Option<&Unit>, is_difference: bool) -> Option<f64> {
        let read = match parse_quantity(&text.text) {
            Ok(read) => read,
            Err(problem) => {
                self.reader.note(
                    text.place,
                    &problem.message,
                    "write a number, with its unit where it has one",
                );
                return None;
            }
        };
        let (Some(own), Some(unit)) = (&read.unit, unit) else { return Some(read.value) };
        if own.dimension != unit.dimension {
            let message = format!("`{}` does not count in `{unit}`", text.text);
            self.reader.note(text.place, &message, "give it in a unit like this one");
            return None;
        }
        Some(match is_difference {
            true => own.to_si_difference(read.value) / unit.to_si_difference(1.0),
            false => unit.from_si(own.to_si(read.value)),
        })
    }

    fn find_signal(&mut self, name: &Text) -> Option<SignalId> {
        let names = self.knowledge.signals().iter().map(|signal| signal.name.as_str());
        self.known(name, "signal", self.knowledge.signal(&name.text), names)
    }

    fn find_variable(&mut self, name: &Text) -> Option<VariableId> {
        let names = self.knowledge.variables().iter().map(|variable| variable.name.as_str());
        self.known(name, "variable", self.knowledge.variable(&name.text), names)
    }

    fn find_need(&mut self, name: &Text) -> Option<NeedId> {
        let found = self.knowledge.needs_named(&name.text);
        if found.len() > 1 {
            let names = found.iter().map(|&id| self.knowledge.need_name(id)).collect::<Vec<_>>().join(", ");
            let message = format!("`{}` has {} needs", name.text, found.len());
            self.reader.note(name.place, &message, &format!("name one of them: {names}"));
            return None;
        }
        let names: Vec<&str> = self.knowledge.needs().ids().map(|id| self.knowledge.need_name(id)).collect();
        self.known(name, "need", found.first().copied(), names.into_iter())
    }

    /// The element of a name, or a problem with the nearest known name.
    fn known<'a, T>(
        &mut self,
        name: &Text,
        what: &str,
        found: Option<T>,
        names: impl Iterator<Item = &'a str> + Clone,
    ) -> Option<T> {
        if found.is_none() {
            let help = match nearest(&name.text, names.clone()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("known here: {}", names.collect::<Vec<_>>().join(", ")),
            };
            self.reader.note(name.place, &format!("there is no {what} `{}`", name.text), &help);
        }
        found
    }
}
