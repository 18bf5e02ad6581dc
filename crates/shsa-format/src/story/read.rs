//! The shape of a story's file: which keys there are and what they hold.

use super::change;
use super::curve::{Curve, Definitions};
use super::expect::{Between, Expectation, Limit, Times, VERDICTS};
use super::trace::{Echo, Source, Trace};
use super::{Loaded, Story, Written};
use crate::drive::Era;
use crate::fault::Fault;
use crate::model::lines::Lines;
use crate::model::reader::{Fields, Keys, Reader};
use crate::model::tree::{self, Node, Value};
use crate::model::{self, Report, shape};
use crate::order::OrderForm;
use crate::recording::Sample;
use shsa_core::engine::{EventKind, Order, Quality};
use shsa_core::expression::parse_quantity;
use shsa_core::knowledge::{Id, KnowledgeBase, Model, NeedId, Place, SignalId, Text, VariableId, build_from};
use shsa_core::monitor::Symptom;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_core::unit::{Dimension, Unit, nearest};
use std::collections::BTreeMap;
use std::path::Path;

const STORY: [&str; 6] = ["story", "why", "model", "trace", "changes", "expect"];
const TRACE: [&str; 7] = ["duration", "seed", "truth", "signals", "faults", "rows", "orders"];
const ORDER: [&str; 7] = ["at", "order", "signal", "relation", "cause", "need", "source"];
const SOURCE: [&str; 9] = ["value", "rate", "from", "to", "jitter", "delay", "latency", "noise", "echo"];
const CHANGE: [&str; 2] = ["at", "change"];
const ROW: [&str; 4] = ["signal", "time", "received", "value"];
const EVENT: [&str; 10] = [
    "event",
    "never",
    "signal",
    "variable",
    "need",
    "symptom",
    "because",
    "substitution",
    "between",
    "times",
];
const VERDICT: [&str; 3] = ["verdict", "signal", "at"];
const SERVED: [&str; 3] = ["need", "source", "at"];
const VALUES: [&str; 9] = [
    "need",
    "values",
    "longest_gap",
    "largest_jump",
    "largest_error",
    "largest_width",
    "quality",
    "truth",
    "between",
];
/// Of these, what limits the values.
const LIMITS: [&str; 6] =
    ["values", "longest_gap", "largest_jump", "largest_error", "largest_width", "quality"];

/// The most samples that one signal of a story may have.
const MAX_SAMPLES: i64 = 1_000_000;

/// See [`super::load`].
pub(super) fn load(text: &str, name: &str, folder: &Path) -> Loaded {
    if text.len() > model::MAX_YAML_BYTES {
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

/// The model that is written in the story, or the one in a file of its own with its report.
fn knowledge(reader: &mut Reader, node: &Node, folder: &Path) -> (KnowledgeBase, Report) {
    if let Value::Scalar(path) = &node.value {
        let loaded = model::load_file(&folder.join(&path.text));
        return (loaded.knowledge, loaded.report);
    }
    let (knowledge, problems) = build_from(&mut shape::Model::new(reader, node, None));
    reader.problems.extend(problems);
    (knowledge, Report::default())
}

/// Reads what refers to a model.
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

    fn trace(&mut self, node: &Node) -> Trace {
        let fields = self.reader.fields(node, "a trace's keys", &TRACE, "duration: 40 s");
        let duration = required(self.reader, node, &fields, "duration");
        let duration = duration.and_then(|node| self.reader.text(node, "a time", "duration: 40 s"));
        let duration = duration.and_then(|text| self.span(&text)).unwrap_or(Span::ZERO);
        self.end = Time(0) + duration;
        let mut trace = Trace { duration, seed: 1, ..Trace::default() };
        if let Some(seed) = fields.get("seed").and_then(|node| self.reader.text(node, "a number", "seed: 7"))
        {
            trace.seed = seed.text.parse().unwrap_or_else(|_| {
                self.reader.note(seed.place, "a seed is a whole number", "write it like `seed: 7`");
                1
            });
        }
        let definitions = fields.get("truth").map(|node| self.definitions(node)).unwrap_or_default();
        for (name, node) in fields
            .get("signals")
            .map_or(&[][..], |node| self.reader.entries(node, "signals", "/a: { value: 5 }"))
        {
            self.signal(&mut trace, name, node, &definitions);
        }
        let items = |writer: &mut Self, key, example| {
            fields.get(key).map_or(&[][..], |node| writer.list(node, "a list", example))
        };
        let faults = items(self, "faults", "faults: [\"stuck:/a@10s..\"]");
        trace.faults = faults.iter().filter_map(|node| self.fault(node)).collect();
        let rows = items(self, "rows", "- { signal: /a, time: 5 s, value: 3 }");
        trace.rows = rows.iter().filter_map(|node| self.row(node)).collect();
        let orders = items(self, "orders", "- { at: 5 s, order: forbid, signal: /a }");
        trace.orders = orders.iter().filter_map(|node| self.order(node)).collect();
        trace
    }

    /// The knowledge bases that take over in the middle, by time.
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
        // Its problems are known already.
        let Ok((mut model, _)) = Model::new(shape::draft(&mut Reader::default(), model)) else {
            return Vec::new();
        };
        changes
            .into_iter()
            .filter_map(|(at, node)| change::changed(self.reader, &mut model, node, at))
            .collect()
    }

    fn definitions(&mut self, node: &Node) -> Definitions {
        let mut definitions = Definitions::default();
        for (name, node) in self.reader.entries(node, "names with formulas of `t`", "speed: 20 m/s") {
            let text = self.reader.text(node, "a formula of `t`", "speed: 20 m/s");
            let curve = text.and_then(|text| definitions.define(self.reader, name, &text));
            self.truths.extend(curve.map(|curve| (name.text.clone(), curve)));
        }
        definitions
    }

    fn signal(&mut self, trace: &mut Trace, name: &Text, node: &Node, definitions: &Definitions) {
        let Some(signal) = self.find_signal(name) else { return };
        let fields =
            self.reader.fields(node, "what is observed", &SOURCE, "/a: { value: 20 m/s, rate: 10 Hz }");
        let described = &self.knowledge.signals()[signal];
        let mut keys = Keys { reader: self.reader, fields };
        let echo = keys.text("echo", "the variable of a need", "speed");
        let value = keys.text("value", "a formula of `t`", "20 + 0.5 * sin(t * 1 rad/s)");
        let rate = keys.text("rate", "a frequency", "10 Hz");
        let noise = keys.text("noise", "an amount", "0.05");
        let times = ["from", "to", "jitter", "delay", "latency"].map(|key| keys.span(key));
        let [from, to, jitter, delay, latency] = times.map(|text| text.and_then(|text| self.span(&text)));
        let latency = latency.unwrap_or(Span::ZERO);
        if let Some(echo) = echo {
            trace.echoes.extend(self.find_need(&echo).map(|need| Echo { signal, need, latency }));
            return;
        }
        let Some(value) = value else {
            self.reader.note(name.place, "nothing is observed here", "give it a `value` or an `echo`");
            return;
        };
        let unit = described.unit.as_ref();
        let curve = definitions.curve(self.reader, &value, unit);
        let noise = noise.and_then(|text| self.amount(&text, unit)).unwrap_or(0.0);
        let (from, to) = (from.unwrap_or(Span::ZERO), to.unwrap_or(trace.duration));
        let Some(period) = self.period(name, rate, described.rate_hz, to - from) else { return };
        let spans = (jitter.unwrap_or(Span::ZERO), delay.unwrap_or(Span::ZERO));
        let (jitter, delay) = spans;
        trace.sources.extend(curve.map(|curve| Source {
            signal,
            curve,
            period,
            from,
            to,
            jitter,
            delay,
            latency,
            noise,
        }));
    }

    /// Time between two samples: as the story says, else as the model does.
    fn period(
        &mut self,
        name: &Text,
        rate: Option<Text>,
        declared: Option<f64>,
        length: Span,
    ) -> Option<Span> {
        let hertz = match &rate {
            Some(text) => self.quantity(text, Some(&hertz()), false),
            None => declared,
        };
        let place = rate.map_or(name.place, |text| text.place);
        let Some(hertz) = hertz.filter(|hertz| *hertz > 0.0 && hertz.is_finite()) else {
            self.reader.note(place, "this signal has no rate, here nor in the model", "add `rate: 10 Hz`");
            return None;
        };
        let period = Span::from_seconds(1.0 / hertz).max(Span(1));
        if length.0 / period.0 > MAX_SAMPLES {
            let help = "sample more slowly or shorten the story";
            self.reader.note(place, &format!("these are more than {MAX_SAMPLES} samples"), help);
            return None;
        }
        Some(period)
    }

    fn fault(&mut self, node: &Node) -> Option<(Fault, SignalId)> {
        let text = self.reader.text(node, "a fault", "stuck:/a@10s..")?;
        let fault: Fault = match text.text.parse() {
            Ok(fault) => fault,
            Err(error) => {
                self.reader.note(text.place, &format!("{error}"), "write it as for `shsa replay --inject`");
                return None;
            }
        };
        let signal = self.find_signal(&Text { text: fault.signal.clone(), place: text.place })?;
        Some((fault, signal))
    }

    fn row(&mut self, node: &Node) -> Option<Sample> {
        let example = "{ signal: /a, time: 5 s, value: 3 }";
        let fields = self.reader.fields(node, "an observation", &ROW, example);
        let mut required = |key| required(self.reader, node, &fields, key);
        let (signal, time, value) = (required("signal"), required("time"), required("value"));
        let signal = signal.and_then(|node| self.reader.text(node, "a signal", "/a"));
        let signal = signal.and_then(|name| self.find_signal(&name));
        let (time, received) = (self.time(time), self.time(fields.get("received")));
        let value = value.and_then(|node| self.raw(node))?;
        let (wanted, time) = (signal?.index(), time?);
        Some(Sample { wanted, time, received: received.unwrap_or(time), value })
    }

    /// What an operator orders. Whether it can be obeyed is up to the story.
    fn order(&mut self, node: &Node) -> Option<(Time, Order)> {
        let fields = self.reader.fields(node, "an order", &ORDER, "{ at: 5 s, order: forbid, signal: /a }");
        let at = self.at(node, &fields);
        let name = required(self.reader, node, &fields, "order");
        let mut text = |key: &str| {
            let text = self.reader.text(fields.get(key)?, "a name", "signal: /a")?;
            Some(text.text)
        };
        let (signal, relation, cause) = (text("signal"), text("relation"), text("cause"));
        let (need, source) = (text("need"), text("source"));
        let order = self.reader.text(name?, "an order", "order: forbid")?.text;
        let form = OrderForm { order, signal, relation, cause, need, source };
        match form.order() {
            Ok(order) => Some((at?, order)),
            Err(error) => {
                self.reader.wrong(
                    node,
                    &error.to_string(),
                    "write it like `{ at: 5 s, order: forbid, signal: /a }`",
                );
                None
            }
        }
    }

    fn time(&mut self, node: Option<&Node>) -> Option<Time> {
        let text = self.reader.text(node?, "a time", "5 s")?;
        Some(Time(0) + self.span(&text)?)
    }

    /// A number (also `nan` and `inf`), a list of them, or `{ lo: .., hi: .. }`.
    fn raw(&mut self, node: &Node) -> Option<RawValue> {
        let number = |node: &Node| match &node.value {
            Value::Scalar(text) => text.text.trim_start_matches('.').parse::<f64>().ok(),
            _ => None,
        };
        let value = match &node.value {
            Value::Scalar(_) => number(node).map(RawValue::Number),
            Value::List(items) => items.iter().map(number).collect::<Option<_>>().map(RawValue::Vector),
            Value::Map(_) => {
                let fields = self.reader.fields(node, "bounds", &["lo", "hi"], "{ lo: 1, hi: 2 }");
                let bound = |key| fields.get(key).and_then(number);
                bound("lo").zip(bound("hi")).map(|(lo, hi)| RawValue::Interval { lo, hi })
            }
            Value::Null | Value::Unread => None,
        };
        if value.is_none() {
            let help = "write a number in the signal's unit, a list of numbers, or `{ lo: 1, hi: 2 }`";
            self.reader.wrong(node, "this is no observed value", help);
        }
        value
    }

    fn expectation(&mut self, node: &Node) -> Option<Expectation> {
        let has = |key: &str| match &node.value {
            Value::Map(entries) => entries.iter().any(|(name, _)| name.text == key),
            _ => false,
        };
        if has("event") || has("never") {
            self.events(node)
        } else if has("verdict") {
            self.verdict(node)
        } else if has("source") {
            self.served(node)
        } else {
            self.values(node)
        }
    }

    fn events(&mut self, node: &Node) -> Option<Expectation> {
        let example = "{ event: failed, signal: /a, between: [15 s, 20 s] }";
        let fields = self.reader.fields(node, "an expectation", &EVENT, example);
        let between = self.between(&fields);
        let texts = |reader: &mut Reader, key| {
            let names = fields.get(key).map(|node| reader.names(node, "texts", "because: [/a says]"));
            names.unwrap_or_default().into_iter().map(|text| text.text).collect()
        };
        let (because, substitution) = (texts(self.reader, "because"), texts(self.reader, "substitution"));
        let mut keys = Keys { reader: self.reader, fields };
        let never = keys.text("never", "a kind of event, or `anything`", "failed");
        let event = keys.text("event", "a kind of event", "failed");
        let times = keys.text("times", "a number", "1");
        let symptom = keys.text("symptom", "how a signal misbehaves", "drifting");
        let (signal, variable) =
            (keys.text("signal", "a signal", "/a"), keys.text("variable", "a variable", "speed"));
        let need = keys.text("need", "a need", "speed");
        let kind = match never.as_ref().or(event.as_ref()) {
            Some(text) if never.is_some() && text.text == "anything" => None,
            text => Some(self.kind(text?)?),
        };
        let symptom = optional(symptom, |name| self.symptom(name))?;
        let times = match times {
            _ if never.is_some() => Times::Exactly(0),
            Some(text) => Times::Exactly(self.count(&text)?),
            None => Times::AtLeastOnce,
        };
        let signal = optional(signal, |name| self.find_signal(name))?;
        let variable = optional(variable, |name| self.find_variable(name))?;
        let need = optional(need, |name| self.find_need(name))?;
        Some(Expectation::Events {
            kind,
            signal,
            variable,
            need,
            symptom,
            because,
            substitution,
            between,
            times,
        })
    }

    fn verdict(&mut self, node: &Node) -> Option<Expectation> {
        let example = "{ verdict: unknown, signal: /a, at: 5 s }";
        let fields = self.reader.fields(node, "an expectation", &VERDICT, example);
        let at = self.at(node, &fields);
        let mut keys = Keys { reader: self.reader, fields };
        let (verdict, signal) =
            (keys.text("verdict", "a verdict", "failed"), keys.text("signal", "a signal", "/a"));
        let known = VERDICTS.iter().map(|(name, _)| *name);
        let verdict = verdict.and_then(|text| {
            let found = VERDICTS.iter().find(|(name, _)| *name == text.text).map(|(_, verdict)| *verdict);
            self.known(&text, "verdict", found, known)
        });
        let signal = signal.and_then(|name| self.find_signal(&name));
        Some(Expectation::Verdict { signal: signal?, verdict: verdict?, at: at? })
    }

    fn served(&mut self, node: &Node) -> Option<Expectation> {
        let example = "{ need: speed, source: /gps, at: 12 s }";
        let fields = self.reader.fields(node, "an expectation", &SERVED, example);
        let at = self.at(node, &fields);
        let source = fields.get("source").map(|node| self.reader.names(node, "texts", "source: /gps"));
        let texts: Vec<String> = source.unwrap_or_default().into_iter().map(|text| text.text).collect();
        let need = Keys { reader: self.reader, fields }.text("need", "a need's variable", "speed");
        let need = need.and_then(|name| self.find_need(&name));
        let source = (texts != ["nothing"]).then_some(texts);
        Some(Expectation::Source { need: need?, source, at: at? })
    }

    fn values(&mut self, node: &Node) -> Option<Expectation> {
        let example = "{ need: speed, longest_gap: 200 ms }";
        let fields = self.reader.fields(node, "an expectation", &VALUES, example);
        let between = self.between(&fields);
        let limited = LIMITS.iter().any(|key| fields.get(key).is_some());
        let mut keys = Keys { reader: self.reader, fields };
        let Some(need) = keys.text("need", "a need's variable", "speed") else {
            let message = "an expectation names an `event`, `never`, a `verdict` or a `need`";
            keys.reader.wrong(node, message, "write it like `{ event: failed, signal: /a }`");
            return None;
        };
        if !limited {
            keys.reader.wrong(
                node,
                "nothing is expected of these values",
                &format!("write it like `{example}`"),
            );
        }
        let none = keys.text("values", "`none`", "none");
        let gap = keys.span("longest_gap");
        let jump = keys.text("largest_jump", "an amount", "0.3 m/s");
        let error = keys.text("largest_error", "an amount", "0.3 m/s");
        let width = keys.text("largest_width", "an amount", "0.3 m/s");
        let quality = keys.text("quality", "`good`, `substitute` or `uncertain`", "good");
        let truth = keys.text("truth", "a name under `truth`", "speed");
        let need = self.find_need(&need)?;
        let unit = self.knowledge.variables()[self.knowledge.needs()[need].variable].unit.clone();
        let mut limits = Vec::new();
        limits.extend(none.and_then(|text| self.none(&text)));
        limits.extend(gap.and_then(|text| self.span(&text)).map(Limit::LongestGap));
        limits.extend(jump.and_then(|text| self.amount(&text, unit.as_ref())).map(Limit::LargestJump));
        limits.extend(width.and_then(|text| self.amount(&text, unit.as_ref())).map(Limit::LargestWidth));
        limits.extend(quality.and_then(|text| self.quality(&text)).map(Limit::Quality));
        limits.extend(error.and_then(|text| self.error(&text, truth, unit.as_ref())));
        Some(Expectation::Values { need, between, limits })
    }

    fn none(&mut self, text: &Text) -> Option<Limit> {
        let found = (text.text == "none").then_some(Limit::None);
        self.known(text, "word", found, ["none"].into_iter())
    }

    fn quality(&mut self, text: &Text) -> Option<Quality> {
        let found = Quality::ALL.into_iter().find(|quality| quality.name() == text.text);
        self.known(text, "quality", found, Quality::ALL.iter().map(|quality| quality.name()))
    }

    fn error(&mut self, text: &Text, truth: Option<Text>, unit: Option<&Unit>) -> Option<Limit> {
        let Some(truth) = truth else {
            self.reader.note(text.place, "an error is a distance from a truth", "add `truth: NAME`");
            return None;
        };
        let (amount, truth) = (self.amount(text, unit), self.find_truth(&truth));
        Some(Limit::LargestError(amount?, Box::new(truth?)))
    }

    fn at(&mut self, node: &Node, fields: &Fields<'_>) -> Option<Time> {
        let node = required(self.reader, node, fields, "at")?;
        let text = self.reader.text(node, "a time", "at: 5 s")?;
        self.moment(&text)
    }

    fn between(&mut self, fields: &Fields<'_>) -> Between {
        let whole = Between { from: Time(0), to: self.end };
        let pair =
            fields.get("between").and_then(|node| self.reader.pair(node, "two times", "between: [5 s, 9 s]"));
        let Some((from, to)) = pair else { return whole };
        let (Some(begin), Some(end)) = (self.moment(&from), self.moment(&to)) else { return whole };
        if begin > end {
            self.reader.note(from.place, "this ends before it begins", "write the earlier time first");
        }
        Between { from: begin, to: end }
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

    fn kind(&mut self, text: &Text) -> Option<EventKind> {
        let found = EventKind::ALL.into_iter().find(|kind| kind.name() == text.text);
        self.known(text, "event", found, EventKind::ALL.iter().map(|kind| kind.name()))
    }

    fn symptom(&mut self, text: &Text) -> Option<Symptom> {
        let found = Symptom::ALL.into_iter().find(|symptom| symptom.name() == text.text);
        self.known(text, "symptom", found, Symptom::ALL.iter().map(|symptom| symptom.name()))
    }

    fn count(&mut self, text: &Text) -> Option<usize> {
        let count = text.text.parse().ok();
        if count.is_none() {
            self.reader.note(text.place, "this is no number of times", "write it like `times: 1`");
        }
        count
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

    /// Reads an amount, such as the most that two values may differ, into a unit; a plain number counts in it.
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

    fn find_truth(&mut self, name: &Text) -> Option<Curve> {
        let found = self.truths.get(&name.text).cloned();
        let names: Vec<String> = self.truths.keys().cloned().collect();
        self.known(name, "truth", found, names.iter().map(String::as_str))
    }

    /// What was found, or a problem with the nearest known name.
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

/// What a name that may be left away stands for; `None` when it stands for nothing, which is reported.
fn optional<T>(name: Option<Text>, find: impl FnOnce(&Text) -> Option<T>) -> Option<Option<T>> {
    match name {
        Some(name) => find(&name).map(Some),
        None => Some(None),
    }
}

fn hertz() -> Unit {
    Unit::parse("Hz").unwrap_or_else(|_| Unit::one())
}
