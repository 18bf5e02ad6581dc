//! The engine: for any inputs in any order, it keeps its promises about time, trust and values, and its results are reproducible.

mod contracts;
mod seeds;

use crate::models::{CAR, HUSKY, QUAD, ROVER};
use contracts::{CERTIFIED, Known, changed};
pub use seeds::seeds;
use shsa_core::engine::{Engine, Input, Options, Order, Output, Publication, PublishedValue, Subject, Ticks};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::reason::ServedBy;
use shsa_core::time::{Span, Time};
use shsa_core::trust::Verdict;
use shsa_model::load;
use std::sync::LazyLock;

/// Cases that the shipped models lack: a source without formulas that looks best, relations in both directions, all time
/// operators, undeclared and slow rates, limits of zero and without end, needs of vectors and of variables without a signal.
const CORNERS: &str = "\
shsa: 1
variables:
  a: { max_rate: 10 }
  b: { range: [-50, 50] }
  c: {}
  v: { shape: vector }
  w: { shape: vector }
constants: { k: [0.9, 1.1] }
relations:
  dark: { output: a, inputs: [c], properties: { cost: 1 } }
  both: { equation: a = b + k, error: 1 }
  change: { equation: 'c = derivative(a, 50 ms) / 1 Hz', for: [c], error: 2 }
  sum: { equation: 'c = integral(b) / 1 s + delay(b, 20 ms) - previous(b)', for: [c] }
  go: { equation: a = previous(a) + c * dt / 1 s, for: [a], error: 0.1 }
  near: { equation: b = min(v) + median(w), for: [b] }
  part: { equation: 'w = v[1..100] * 2', for: [w] }
signals:
  a1: { variable: a, rate: 100 Hz, value_error: 0.5, timeout: 50 ms }
  a2: { variable: a, rate: 80 Hz, value_error: 10 %, delay: 30 ms }
  a3: { variable: a, value_error: 0.5, derived_from: [b1] }
  b1: { variable: b, value_error: 0.2, time_error: 5 ms, timeout: none }
  c1: { variable: c, rate: 0.001 Hz }
  v1: { variable: v, rate: 10 Hz, value_error: 0.1 }
  v2: { variable: v, value_error: 0.1, timeout: 1 ms }
needs:
  a: { signal: /a, max_age: 20 ms, max_width: 5, hold: 0 s, probation: 0 s, blend: 100 ms, hysteresis: 5 % }
  b: { signal: /b, hold: 1 h, probation: 30 ms }
  c: { signal: /c, max_age: 1 ms }
  v: { signal: /v }
  w: { signal: /w, max_age: 800000 h }
";

pub(crate) static MODELS: LazyLock<Vec<KnowledgeBase>> = LazyLock::new(|| {
    let knowledge = |text: &&str| {
        let loaded = load(text, "m.yaml");
        assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        loaded.knowledge
    };
    [CORNERS, CAR, ROVER, QUAD, HUSKY, CERTIFIED].iter().map(knowledge).collect()
});

/// What takes the place of the model with contracts, the last one, while it is in use.
static SUCCESSOR: LazyLock<KnowledgeBase> = LazyLock::new(|| {
    let loaded = load(&changed(), "m.yaml");
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    loaded.knowledge
});

/// The most steps of an input, so that it stays within the driver's time.
const MOST_STEPS: usize = 48;

/// The number of observations of each signal in a burst.
const BURST: i64 = 24;

/// The most ticks between two inputs, for every signal and need: each may expire, come back and be checked again.
const MOST_TICKS: usize = 16;

/// The numbers for a byte below 16.
const SPECIAL: [f64; 16] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    5e-324,
    1e-300,
    1e300,
    -1e17,
    49.0,
    4.0,
    3.5,
    0.1,
    1e6,
];

/// The time steps for a byte below 24.
const GAPS_NS: [i64; 24] = [
    0,
    1,
    1_000,
    1_000_000,
    5_000_000,
    10_000_000,
    12_000_000,
    50_000_000,
    50_000_001,
    99_999_999,
    100_000_000,
    250_000_000,
    550_000_000,
    1_000_000_000,
    5_000_000_000,
    60_000_000_000,
    3_600_000_000_000,
    -1,
    -1_000_000,
    -1_000_000_000,
    -3_600_000_000_000,
    i64::MAX / 2,
    i64::MAX,
    i64::MIN,
];

/// The first byte chooses a model, and of the last one after how many inputs its successor takes over (0: never); each step takes four bytes: the signal (or a tick, or a burst of all), the time step, the
/// value, and the shape with the stamp; or an operator's order: its subject, the time step, its kind.
pub fn run(bytes: &[u8]) {
    let (model, steps) = bytes.split_first().unwrap_or((&0, &[]));
    let (reload, model) = (usize::from(*model) / MODELS.len(), usize::from(*model) % MODELS.len());
    let knowledge = &MODELS[model];
    let inputs = inputs(knowledge, steps);
    let successor = (model == MODELS.len() - 1).then_some(&*SUCCESSOR);
    let stated = || Run::of(knowledge, &inputs, reload.checked_sub(1).zip(successor));
    assert_eq!(stated(), stated(), "two runs differ");
}

/// The inputs for four bytes a step, from time zero on.
pub(crate) fn inputs(knowledge: &KnowledgeBase, steps: &[u8]) -> Vec<Input> {
    let mut inputs = Vec::new();
    let mut now = Time::default();
    let (steps, _) = steps.as_chunks::<4>();
    for &[who, gap, what, how] in steps.iter().take(MOST_STEPS) {
        now = now + Span(GAPS_NS.get(usize::from(gap)).copied().unwrap_or(i64::from(gap) * 100_000));
        let count = knowledge.signals().len();
        match usize::from(who) {
            burst @ 160.. => {
                let liar = (burst - 160) % (2 * count);
                inputs.extend((0..BURST).flat_map(|_| {
                    now = now + Span::from_millis(10);
                    let number = |signal: usize| if signal == liar { number(how) } else { number(what) };
                    (0..count).map(move |signal| observe(knowledge, signal, now, number(signal), 0))
                }));
            }
            about @ ORDERS.. => {
                let order = order(knowledge, about - ORDERS, what, how);
                inputs.push(Input::Order { time: now, order });
            }
            tick if tick % (count + 2) == count => inputs.push(Input::Tick(now)),
            signal => inputs.push(observe(knowledge, signal % (count + 2), now, number(what), how)),
        }
    }
    inputs
}

/// A first byte from here on, below a burst, is an order.
const ORDERS: usize = 128;

fn order(knowledge: &KnowledgeBase, about: usize, what: u8, how: u8) -> Order {
    let nth = |names: Vec<String>, at: usize| {
        let at = at % (names.len() + 1);
        names.get(at).cloned().unwrap_or_else(|| "nobody".to_owned())
    };
    let signals = || knowledge.signals().iter().map(|signal| signal.name.clone());
    let relations = || knowledge.relations().iter().map(|relation| relation.name.clone());
    let subject = || match how % 4 {
        0 => Subject::Relation(nth(relations().collect(), about)),
        1 => Subject::Cause(nth(knowledge.causes().iter().map(|cause| cause.name.clone()).collect(), about)),
        _ => Subject::Signal(nth(signals().collect(), about)),
    };
    let need = || nth(knowledge.needs().iter().map(|need| need.signal.clone()).collect(), usize::from(how));
    match what % 9 {
        0 | 1 => Order::Forbid(subject()),
        2 => Order::Allow(subject()),
        3 => {
            let relation =
                |name: String| format!("{} by {name}", nth(signals().collect(), usize::from(how / 8)));
            let sources = signals().chain(relations().map(relation)).collect();
            Order::Force { need: need(), source: nth(sources, about) }
        }
        4 => Order::Release(need()),
        kind @ 6.. => {
            contracts::order(knowledge, kind - 6, about, how).unwrap_or_else(|| Order::Clear(subject()))
        }
        _ => Order::Clear(subject()),
    }
}

fn number(what: u8) -> f64 {
    SPECIAL.get(usize::from(what)).copied().unwrap_or((f64::from(what) - 128.0) / 8.0)
}

/// The low half of `how` is a shape, the high half a stamp.
fn observe(knowledge: &KnowledgeBase, signal: usize, received: Time, number: f64, how: u8) -> Input {
    let signal = SignalId::from_index(signal);
    let known = knowledge.signals().find(signal);
    let is_vector = known.is_some_and(|known| {
        knowledge.variables()[known.variable].shape == shsa_core::knowledge::Shape::Vector
    });
    let value = match how % 16 {
        0..8 if is_vector => RawValue::Vector(vec![number; 288]),
        0..9 => RawValue::Number(number),
        9 => RawValue::Interval { lo: number - 1.0, hi: number + 1.0 },
        10 => RawValue::Interval { lo: 1.0, hi: number },
        11 => RawValue::Vector(Vec::new()),
        12 => RawValue::Vector(vec![number; 20_000]),
        length => RawValue::Vector((0..usize::from(length) * 20).map(|at| number + at as f64).collect()),
    };
    let stamp = match how / 16 {
        0..10 => received,
        10 => received - Span::from_millis(100),
        11 => received + Span::from_millis(100),
        12 => received - Span::from_millis(3_600_000),
        13 => received + Span::from_millis(3_600_000),
        14 => Time::MIN,
        _ => Time::MAX,
    };
    Input::Observation(Observation { signal, stamp, received, value })
}

/// An engine, and all of its outputs.
pub(crate) struct Run<'a> {
    knowledge: &'a KnowledgeBase,
    engine: Engine,
    now: Time,
    known: Known,
    stated: Vec<String>,
}

impl<'a> Run<'a> {
    /// Of a new engine; another knowledge base takes over after so many inputs.
    fn of(
        knowledge: &'a KnowledgeBase,
        inputs: &[Input],
        reload: Option<(usize, &'a KnowledgeBase)>,
    ) -> Vec<String> {
        let engine = shsa_estimate::node::engine(knowledge.clone(), Options::default());
        let mut run = Run::new(knowledge, engine, Time::MIN);
        let Some((after, successor)) = reload else { return run.through(inputs) };
        let (before, rest) = inputs.split_at(after.min(inputs.len()));
        run.give(before);
        run.reload(successor);
        run.through(rest)
    }

    /// A run of an engine of this knowledge base at this time.
    pub(crate) fn new(knowledge: &'a KnowledgeBase, engine: Engine, now: Time) -> Run<'a> {
        Run { knowledge, engine, now, known: Known::default(), stated: Vec::new() }
    }

    /// The outputs for the inputs, with the ticks that are due between them.
    pub(crate) fn through(mut self, inputs: &[Input]) -> Vec<String> {
        self.give(inputs);
        self.pass_until(self.now + Span::from_millis(60_000));
        self.stated
    }

    fn give(&mut self, inputs: &[Input]) {
        for input in inputs {
            let time = input.time();
            self.pass_until(time);
            self.take(input.clone(), time);
        }
    }

    /// Passes the ticks that are due before `moment`: after each one the next is later, and their number is bounded.
    fn pass_until(&mut self, moment: Time) {
        let most = MOST_TICKS * (self.knowledge.signals().len() + self.knowledge.needs().len());
        let mut ticks = 0;
        let mut given = Ticks::before(moment);
        while let Some(due) = given.next(&self.engine) {
            self.take(Input::Tick(due), due);
            let next = self.engine.next_deadline();
            assert!(
                next.is_none_or(|next| next > self.now),
                "still due at {next:?} after {due:?}, now {:?}",
                self.now
            );
            ticks += 1;
            assert!(ticks <= most, "{ticks} ticks until {moment:?}");
        }
    }

    fn take(&mut self, input: Input, time: Time) {
        self.known.receive(&input);
        self.engine.handle(input);
        self.now = self.now.max(time);
        self.listen(None);
    }

    /// Another knowledge base with the same signals and needs takes over. What was decided before is of the old one.
    fn reload(&mut self, successor: &'a KnowledgeBase) {
        self.engine.reload(successor.clone(), self.now);
        self.listen(Some(successor));
    }

    /// Checks all outputs, and how each need is served; `successor` is what the outputs after a change are of.
    fn listen(&mut self, successor: Option<&'a KnowledgeBase>) {
        while let Some(output) = self.engine.poll() {
            match &output {
                Output::Publication(publication) => self.check(publication),
                Output::Event(event) => assert!(event.time <= self.now, "from the future: {event:?}"),
                Output::Reloaded(_) => self.knowledge = successor.unwrap_or(self.knowledge),
                Output::Task { .. } => {}
            }
            self.stated.push(format!("{output:?}"));
        }
        self.check_needs();
    }

    fn check(&self, publication: &Publication) {
        let need = &self.knowledge.needs()[publication.need];
        assert!(
            publication.time <= self.now && publication.validity.from <= publication.validity.to,
            "{publication:?}"
        );
        self.known.check(self.knowledge, publication);
        let age = publication.time - publication.validity.to;
        assert!(age <= need.max_age, "{age:?} old: {publication:?}");
        match &publication.value {
            PublishedValue::Scalar(value) => {
                assert!(value.is_bounded() && !value.is_empty(), "{publication:?}");
                assert!(need.max_width.is_none_or(|most| value.width() <= most), "{publication:?}");
            }
            PublishedValue::Vector(elements) => {
                let is_number = |element: &Interval| !element.lo().is_nan() && !element.hi().is_nan();
                assert!(!elements.is_empty() && elements.iter().all(is_number), "{publication:?}");
            }
        }
    }

    /// The source of a need is trusted, unless an operator has chosen it, and is never forbidden.
    fn check_needs(&self) {
        let orders = self.engine.standing_orders();
        for need in self.knowledge.needs().ids() {
            let status = self.engine.need_status(need);
            let source = status.source.as_ref().and_then(ServedBy::way).unwrap_or_default();
            let (signals, relations) = source.split_once(" by ").unwrap_or((source, ""));
            for name in relations.split(", ") {
                let forbidden = Order::Forbid(Subject::Relation(name.to_owned()));
                assert!(!orders.contains(&forbidden), "{source} serves a need in spite of `{forbidden}`");
            }
            for signal in signals.split(", ").filter_map(|name| self.knowledge.signal(name)) {
                for origin in self.knowledge.origins(signal).iter() {
                    let origin = self.knowledge.witness(origin);
                    let name = self.knowledge.signals()[origin].name.clone();
                    let forbidden = Order::Forbid(Subject::Signal(name));
                    assert!(!orders.contains(&forbidden), "{source} serves a need in spite of `{forbidden}`");
                }
                if status.forced.is_some() {
                    assert_eq!(status.forced.as_deref(), Some(source), "a forced source was replaced");
                    continue;
                }
                let verdict = self.engine.verdict(signal);
                assert!(!matches!(verdict, Verdict::Suspect | Verdict::Failed), "{source} is {verdict:?}");
                let absence = self.engine.absence(signal);
                assert!(absence.is_none(), "{source} is {absence:?}");
            }
        }
    }
}
