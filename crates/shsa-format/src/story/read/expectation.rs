//! What a story expects: events, verdicts, sources, and limits of the values of a need.

use super::Writer;
use crate::story::curve::Curve;
use crate::story::expect::{Between, Expectation, Limit, Times, VERDICTS};
use shsa_core::assurance::Ground;
use shsa_core::engine::{EventKind, Quality};
use shsa_core::knowledge::Text;
use shsa_core::monitor::Symptom;
use shsa_core::statement::Level;
use shsa_core::time::Time;
use shsa_core::unit::Unit;
use shsa_model::reader::{Fields, Keys, Reader};
use shsa_model::tree::{Node, Value};

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

const VALUES: [&str; 11] = [
    "need",
    "values",
    "longest_gap",
    "largest_jump",
    "largest_error",
    "largest_width",
    "quality",
    "level",
    "admitted",
    "truth",
    "between",
];

/// The keys of [`VALUES`] that limit the values.
const LIMITS: &[&str] = VALUES.split_at(1).1.split_at(8).0;

impl Writer<'_, '_> {
    pub(super) fn expectation(&mut self, node: &Node) -> Option<Expectation> {
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
        let level = keys.text("level", "a level, or `none`", "SIL 2");
        let admitted = keys.text("admitted", "a ground", "met");
        let truth = keys.text("truth", "a name under `truth`", "speed");
        let need = self.find_need(&need)?;
        let unit = self.knowledge.variables()[self.knowledge.needs()[need].variable].unit.clone();
        let mut limits = Vec::new();
        limits.extend(none.and_then(|text| self.none(&text)));
        limits.extend(gap.and_then(|text| self.span(&text)).map(Limit::LongestGap));
        limits.extend(jump.and_then(|text| self.amount(&text, unit.as_ref())).map(Limit::LargestJump));
        limits.extend(width.and_then(|text| self.amount(&text, unit.as_ref())).map(Limit::LargestWidth));
        limits.extend(quality.and_then(|text| self.quality(&text)).map(Limit::Quality));
        limits.extend(level.and_then(|text| self.level(&text)).map(Limit::Level));
        limits.extend(admitted.and_then(|text| self.ground(&text)).map(Limit::Admitted));
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

    /// A level with its scale, or `none`.
    fn level(&mut self, text: &Text) -> Option<Option<Level>> {
        let scales = self.knowledge.contracts().scales();
        let level = text.text.split_once(' ').and_then(|(scale, level)| scales.level(scale, level));
        let is_none = text.text == "none";
        if level.is_none() && !is_none {
            let message = format!("`{}` is no level", text.text);
            self.reader.note(text.place, &message, "write it like `SIL 2` or `ASIL B`, or `none`");
            return None;
        }
        Some(level)
    }

    fn ground(&mut self, text: &Text) -> Option<Ground> {
        let found = Ground::ALL.into_iter().find(|ground| ground.name() == text.text);
        self.known(text, "ground", found, Ground::ALL.iter().map(|ground| ground.name()))
    }

    fn error(&mut self, text: &Text, truth: Option<Text>, unit: Option<&Unit>) -> Option<Limit> {
        let Some(truth) = truth else {
            self.reader.note(text.place, "an error is a distance from a truth", "add `truth: NAME`");
            return None;
        };
        let (amount, truth) = (self.amount(text, unit), self.find_truth(&truth));
        Some(Limit::LargestError(amount?, Box::new(truth?)))
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

    fn find_truth(&mut self, name: &Text) -> Option<Curve> {
        let found = self.truths.get(&name.text).cloned();
        let names: Vec<String> = self.truths.keys().cloned().collect();
        self.known(name, "truth", found, names.iter().map(String::as_str))
    }
}

/// The element of an optional name; `None` when there is no such element, which is reported.
fn optional<T>(name: Option<Text>, find: impl FnOnce(&Text) -> Option<T>) -> Option<Option<T>> {
    match name {
        Some(name) => find(&name).map(Some),
        None => Some(None),
    }
}
