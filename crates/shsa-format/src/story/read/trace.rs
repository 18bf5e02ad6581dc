//! The inputs of a story: true values, observations of signals, faults, single observations and orders.

use super::{Writer, required};
use crate::fault::Fault;
use crate::order::OrderForm;
use crate::story::curve::Definitions;
use crate::story::trace::{Echo, Source, Trace};
use shsa_core::engine::Order;
use shsa_core::knowledge::{Id, SignalId, Text};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_core::unit::Unit;
use shsa_model::reader::Keys;
use shsa_model::tree::{Node, Value};
use shsa_recording::Sample;

const TRACE: [&str; 7] = ["duration", "seed", "truth", "signals", "faults", "rows", "orders"];

const ORDER: [&str; 10] =
    ["at", "order", "signal", "relation", "cause", "need", "source", "lasts", "because", "evidence"];

const SOURCE: [&str; 10] =
    ["value", "rate", "from", "to", "jitter", "delay", "latency", "noise", "dead_band", "echo"];

const ROW: [&str; 4] = ["signal", "time", "received", "value"];

/// The most samples that one signal of a story may have.
const MAX_SAMPLES: i64 = 1_000_000;

impl Writer<'_, '_> {
    pub(super) fn trace(&mut self, node: &Node) -> Trace {
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
        let dead_band = keys.text("dead_band", "an amount", "0.2");
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
        let dead_band = dead_band.and_then(|text| self.amount(&text, unit)).unwrap_or(0.0);
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
            dead_band,
        }));
    }

    /// The time between two samples: from the story, else from the model.
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

    /// An order of an operator. Whether the engine can obey it depends on the story.
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
        let (lasts, because, evidence) = (text("lasts"), text("because"), text("evidence"));
        let order = self.reader.text(name?, "an order", "order: forbid")?.text;
        let form = OrderForm { order, signal, relation, cause, need, source, lasts, because, evidence };
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
}

fn hertz() -> Unit {
    Unit::parse("Hz").unwrap_or_else(|_| Unit::one())
}
