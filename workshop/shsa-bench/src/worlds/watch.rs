//! A run of the engine over the readings of a world, and what it says beside the truth.

use super::readings::Reading;
use super::world::{Signal, World};
use super::written::{Names, Order};
use anyhow::bail;
use shsa_core::engine::{
    Engine, Event, EventKind, Input, Options, Output, Publication, PublishedValue, Quality, Ticks,
};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId};
use shsa_core::monitor::Symptom;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_format::words;

/// What is wrong with a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Wrong {
    /// A sound signal or relation is called failed.
    Failed,
    /// A sound signal or relation is suspected.
    Suspected,
    /// A value of this quality leaves out the truth.
    Uncovered(Served),
    /// A value lies outside of the range of its variable.
    OutOfRange,
    /// A value is older than its need allows.
    Stale,
    /// A need is lost in which all values come.
    Lost,
    /// A fault is not told that can be detected.
    Untold,
    /// A fault is not named that can be isolated.
    Unnamed,
    /// A signal is not trusted again long after the fault.
    Untrusted,
    /// The same system, written down otherwise, is judged otherwise.
    Otherwise,
    /// A good value is further off than its need allows.
    FarOff,
}

/// A quality, with an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Served {
    Good,
    Substitute,
    Uncertain,
}

impl Wrong {
    pub(super) fn name(self) -> &'static str {
        match self {
            Wrong::Failed => "failed",
            Wrong::Suspected => "suspected",
            Wrong::Uncovered(Served::Good) => "good without the truth",
            Wrong::Uncovered(Served::Substitute) => "substitute without the truth",
            Wrong::Uncovered(Served::Uncertain) => "uncertain without the truth",
            Wrong::OutOfRange => "out of range",
            Wrong::Stale => "stale",
            Wrong::Lost => "lost",
            Wrong::Untold => "not told",
            Wrong::Unnamed => "not named",
            Wrong::Untrusted => "not trusted again",
            Wrong::Otherwise => "judged otherwise",
            Wrong::FarOff => "good and far off",
        }
    }
}

/// Something wrong: when, and what is said.
#[derive(Clone, Debug)]
pub(super) struct Finding {
    pub(super) wrong: Wrong,
    pub(super) time_s: f64,
    pub(super) signal: Option<usize>,
    pub(super) text: String,
}

/// What came of one world.
pub(super) struct Watched {
    pub(super) world: World,
    pub(super) readings: Vec<Reading>,
    /// What the truth does not keep of the declarations: then nothing else counts.
    pub(super) untrue: Option<String>,
    /// Values that were published, faults that had to be told, and to be named.
    pub(super) counts: [usize; 3],
    pub(super) findings: Vec<Finding>,
    /// Its faults in words.
    pub(super) faults: Vec<String>,
}

/// A run.
pub(super) struct Run {
    pub(super) engine: Engine,
    pub(super) events: Vec<Event>,
    pub(super) publications: Vec<Publication>,
}

/// Worlds begin at this time, so that nothing depends on times being small.
pub(super) const ORIGIN: i64 = 1_700_000_000_000_000_000;

/// The knowledge of a world.
///
/// # Errors
/// The generator has written a model that is none.
pub(super) fn knowledge(model: &str) -> anyhow::Result<KnowledgeBase> {
    let loaded = shsa_model::load(model, "world.yaml");
    if !loaded.report.ok() {
        bail!("{}\n{model}", loaded.report.render(false));
    }
    Ok(loaded.knowledge)
}

/// Runs the engine over readings.
pub(super) fn run(
    world: &World,
    knowledge: KnowledgeBase,
    readings: &[Reading],
    names: Names,
    origin: i64,
) -> Run {
    let id =
        |at: usize| knowledge.signals().enumerate().find(|it| it.1.name == names.signal(at)).map(|it| it.0);
    let ids: Vec<SignalId> = (0..world.signals.len()).filter_map(id).collect();
    let mut run = Run {
        engine: shsa_estimate::node::engine(knowledge, Options::default()),
        events: Vec::new(),
        publications: Vec::new(),
    };
    for reading in readings {
        let received = Time(origin + reading.received);
        run.engine.pass(Ticks::before(received));
        let value = match reading.values.as_slice() {
            [value] if !world.variables[world.signals[reading.signal].variable].is_vector => {
                RawValue::Number(*value)
            }
            values => RawValue::Vector(values.to_vec()),
        };
        let signal = ids[reading.signal];
        run.engine.handle(Input::Observation(Observation {
            signal,
            stamp: Time(origin + reading.stamp),
            received,
            value,
        }));
        run.collect();
    }
    let last = readings.last().map_or(0, |it| it.received);
    run.engine.handle(Input::Tick(Time(origin + last)));
    run.collect();
    run
}

impl Run {
    /// An event in words.
    pub(super) fn told(&self, event: &Event) -> String {
        let knowledge = self.engine.knowledge();
        let of = match (event.signal, event.relation) {
            (Some(signal), _) => knowledge.signals()[signal].name.clone(),
            (_, Some(relation)) => knowledge.relations()[relation].name.clone(),
            _ => String::new(),
        };
        let symptom = event.symptom.map(|it| format!(" {it:?}")).unwrap_or_default();
        format!("{of} {}{symptom}: {}", event.kind.name(), words::reasons(&event.because))
    }

    fn collect(&mut self) {
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Event(event) => self.events.push(event),
                Output::Publication(publication) => self.publications.push(publication),
                Output::Task { .. } | Output::Reloaded(_) => {}
            }
        }
    }
}

/// What a run says that a sound world refutes.
pub(super) fn findings(world: &World, run: &Run) -> Vec<Finding> {
    let mut all: Vec<Finding> = run.events.iter().filter_map(|it| about_event(world, run, it)).collect();
    all.extend(run.publications.iter().filter_map(|it| about_value(world, run, it)));
    all
}

fn about_event(world: &World, run: &Run, event: &Event) -> Option<Finding> {
    if is_by_rule(world, event) {
        return None;
    }
    let is_about_component = event.signal.is_some() || event.relation.is_some() || event.cause.is_some();
    let wrong = match event.kind {
        EventKind::Failed | EventKind::Outlier if is_about_component => Wrong::Failed,
        EventKind::Suspected if is_about_component => Wrong::Suspected,
        EventKind::Unhealable if !world.has_losses => Wrong::Lost,
        _ => return None,
    };
    Some(Finding {
        wrong,
        time_s: seconds(event.time),
        signal: event.signal.map(Id::index),
        text: run.told(event),
    })
}

/// Whether a signal is accused of letting its values overtake each other, or come later than its delay and timeout allow, and
/// does so: this is told of it, whatever they say.
pub(super) fn is_by_rule(world: &World, event: &Event) -> bool {
    let signal = event.signal.and_then(|it| world.signals.get(it.index()));
    match event.symptom {
        Some(Symptom::OutOfOrder) => signal.is_some_and(|it: &Signal| !it.schedule.in_order),
        Some(Symptom::Late) => world.has_losses,
        _ => false,
    }
}

pub(super) fn seconds(time: Time) -> f64 {
    (time.0 - ORIGIN) as f64 * 1e-9
}

/// What is wrong with a published value.
pub(super) fn about_value(world: &World, run: &Run, published: &Publication) -> Option<Finding> {
    let knowledge = run.engine.knowledge();
    let need = &knowledge.needs()[published.need];
    let variable = need.variable.index();
    let elements: &[Interval] = match &published.value {
        PublishedValue::Scalar(value) => std::slice::from_ref(value),
        PublishedValue::Vector(values) => values,
    };
    let quality = match published.quality {
        Quality::Good => Served::Good,
        Quality::Substitute => Served::Substitute,
        Quality::Uncertain => Served::Uncertain,
    };
    let (from, to) = (seconds(published.validity.from), seconds(published.validity.to));
    let finding = |wrong, text: String| {
        Some(Finding {
            wrong,
            time_s: seconds(published.time),
            signal: None,
            text: format!("v{variable} of {from} to {to} s: {text}"),
        })
    };
    let own = &world.variables[variable];
    if is_promised(world, quality) {
        for (element, value) in elements.iter().enumerate() {
            if !world.may_be(variable, element, (from, to), (value.lo(), value.hi())) {
                let truth = own.courses[element](0.5 * (from + to));
                return finding(Wrong::Uncovered(quality), format!("{value:?} beside {truth}"));
            }
        }
    }
    if let Some((lo, hi)) = own.range.filter(|_| own.wraps.is_none()) {
        let rest = 1e-9 * (hi - lo);
        if let Some(value) = elements.iter().find(|it| it.lo() < lo - rest || it.hi() > hi + rest) {
            return finding(Wrong::OutOfRange, format!("{value:?} beside {:?}", own.range));
        }
    }
    let is_old = published.time - published.validity.to > need.max_age;
    let holds = world.signals.iter().any(|it| it.holds);
    if is_old && !holds {
        return finding(Wrong::Stale, format!("published at {} s", seconds(published.time)));
    }
    None
}

/// Whether values of a quality are promised to hold the truth. Without a largest rate, nothing bounds the inputs of a substitute
/// between their values.
fn is_promised(world: &World, quality: Served) -> bool {
    let is_bounded = world.variables.iter().all(|it| it.max_rate.is_some());
    is_bounded || quality == Served::Good && world.relations.is_empty()
}

impl World {
    /// Whether a variable had a value between two bounds at some time within a validity.
    fn may_be(&self, variable: usize, element: usize, (from, to): (f64, f64), (lo, hi): (f64, f64)) -> bool {
        let own = &self.variables[variable];
        // A mean over a time is a value of some moment of it.
        let of_variable = self.signals.iter().filter(|it| it.variable == variable);
        let half = of_variable.map(|it| 0.5 * it.mean_over).fold(0.0, f64::max);
        // Stamps are in whole nanoseconds.
        let (from, to) = (from - half - 2e-9, to + half + 2e-9);
        let count = if to > from + 1e-8 { 40 } else { 1 };
        let truth = |at: i32| own.courses[element](from + (to - from) * f64::from(at) / f64::from(count));
        let extend = |(lo, hi): (f64, f64), it: f64| (lo.min(it), hi.max(it));
        let (least, most) = (0..=count).map(truth).fold((f64::INFINITY, f64::NEG_INFINITY), extend);
        // Between samples of the validity, and by rounding.
        let rest = 0.1 * (most - least) + 1e-9 * (least.abs() + most.abs() + self.size(variable));
        let meets = |shift: f64| least - rest + shift <= hi && most + rest + shift >= lo;
        match own.wraps {
            Some(turn) => {
                let near = ((lo - least) / turn).floor();
                (-1..=2).any(|it| meets(turn * (near + f64::from(it))))
            }
            None => meets(0.0),
        }
    }
}

/// The model and the knowledge of a world.
///
/// # Errors
/// See [`knowledge`].
pub(super) fn known(world: &World) -> anyhow::Result<KnowledgeBase> {
    knowledge(&world.model(Names::Plain, Order::Written))
}
