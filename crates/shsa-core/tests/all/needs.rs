//! The demands of needs are kept at run time, whichever source serves; and uncertain values hold the truth.

mod unsure;

use crate::driven::text;
use proptest::prelude::*;
use shsa_core::engine::{
    Engine, Event, EventKind, Input, Options, Output, Publication, PublishedValue, Quality,
};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Id, KnowledgeBase, NeedDraft, NeedId, RelationDraft, Severity, SignalDraft,
    VariableDraft, build,
};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::plan::{Graph, Limits, Requirements, best_meeting};
use shsa_core::reason::{Reason, ServedBy};
use shsa_core::time::{Span, Time};

const MS: i64 = 1_000_000;
const LEVELS: [&str; 4] = ["A", "B", "C", "D"];

/// A sensor of the variable, or of an equal one.
#[derive(Clone, Debug)]
struct Sensor {
    is_direct: bool,
    rate_hz: i64,
    tells_rate: bool,
    /// The error in hundredths.
    error: i64,
    delay_ms: i64,
    level: Option<usize>,
    /// The segment from which on the sensor is silent.
    until: usize,
}

impl Sensor {
    /// A signal of the variable at 10 Hz, with an error of 0.1.
    const PLAIN: Sensor = Sensor {
        is_direct: true,
        rate_hz: 10,
        tells_rate: true,
        error: 10,
        delay_ms: 0,
        level: None,
        until: 9,
    };

    /// Each sensor has a width of its own, which identifies its values.
    fn error(&self, at: usize) -> f64 {
        self.error as f64 / 100.0 + at as f64 * 1e-5
    }

    fn name(at: usize) -> String {
        format!("s{at}")
    }
}

#[derive(Clone, Debug)]
struct Demand {
    max_age_ms: i64,
    max_width: Option<f64>,
    level: Option<usize>,
    min_rate_hz: Option<i64>,
}

impl Demand {
    /// The definition, implemented again.
    fn is_met_by(&self, sensor: &Sensor, at: usize) -> bool {
        let period_ms = 1_000 / sensor.rate_hz;
        self.max_width.is_none_or(|most| 2.0 * sensor.error(at) <= most)
            && self.level.is_none_or(|least| sensor.level.is_some_and(|level| level >= least))
            && self.min_rate_hz.is_none_or(|least| sensor.tells_rate && sensor.rate_hz >= least)
            && sensor.delay_ms <= self.max_age_ms
            && (!sensor.tells_rate || period_ms <= self.max_age_ms)
    }
}

fn sensor() -> impl Strategy<Value = Sensor> {
    (
        (any::<bool>(), prop::sample::select(vec![1_i64, 2, 5, 10, 20]), prop::bool::weighted(0.8)),
        (prop::sample::select(vec![1_i64, 5, 30]), prop::sample::select(vec![0_i64, 0, 100, 500])),
        (prop::option::of(0..4_usize), 1..5_usize),
    )
        .prop_map(|((is_direct, rate_hz, tells_rate), (error, delay_ms), (level, until))| Sensor {
            is_direct,
            // A sensor without a declared rate must come often, as nothing is known in advance.
            rate_hz: if tells_rate { rate_hz } else { 20 },
            tells_rate,
            error,
            delay_ms,
            level,
            until,
        })
}

fn demand() -> impl Strategy<Value = Demand> {
    (
        prop::sample::select(vec![150_i64, 300, 1_200]),
        prop::option::of(prop::sample::select(vec![0.05, 0.2])),
        prop::option::of(0..4_usize),
        prop::option::of(prop::sample::select(vec![2_i64, 8])),
    )
        .prop_map(|(max_age_ms, max_width, level, min_rate_hz)| Demand {
            max_age_ms,
            max_width,
            level,
            min_rate_hz,
        })
}

fn knowledge(sensors: &[Sensor], needs: Vec<NeedDraft>) -> KnowledgeBase {
    built(&Draft { needs, ..draft(sensors) })
}

fn draft(sensors: &[Sensor]) -> Draft {
    let mut draft = Draft::default();
    draft.variables.push(VariableDraft { name: text("v"), ..VariableDraft::default() });
    for (at, sensor) in sensors.iter().enumerate() {
        let other = format!("p{at}");
        if !sensor.is_direct {
            draft.variables.push(VariableDraft { name: text(other.clone()), ..VariableDraft::default() });
            let body = BodyDraft::Equation(text(format!("v = {other}")));
            draft.relations.push(RelationDraft {
                directions: Some(vec![text("v")]),
                properties: vec![(text("cost"), text(format!("{}", 1 + at % 3)))],
                ..RelationDraft::new(text(format!("r{at}")), body)
            });
        }
        draft.signals.push(SignalDraft {
            name: text(Sensor::name(at)),
            variable: Some(text(if sensor.is_direct { "v".to_owned() } else { other })),
            rate: sensor.tells_rate.then(|| text(format!("{} Hz", sensor.rate_hz))),
            timeout: Some(text(format!("{} ms", 3_000 / sensor.rate_hz + 100))),
            delay: Some(text(format!("{} ms", sensor.delay_ms))),
            value_error: Some(Bounds::One(text(format!("{}", sensor.error(at))))),
            properties: sensor
                .level
                .map(|level| (text("integrity"), text(LEVELS[level])))
                .into_iter()
                .collect(),
            ..SignalDraft::default()
        });
    }
    draft
}

fn built(draft: &Draft) -> KnowledgeBase {
    let (knowledge, problems) = build(draft);
    let errors: Vec<_> = problems.iter().filter(|it| it.severity == Severity::Error).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

fn need(name: &str, demand: &Demand) -> NeedDraft {
    NeedDraft {
        variable: text("v"),
        signal: Some(text(name)),
        max_age: Some(text(format!("{} ms", demand.max_age_ms))),
        max_width: demand.max_width.map(|most| text(format!("{most}"))),
        integrity: demand.level.map(|level| text(LEVELS[level])),
        min_rate: demand.min_rate_hz.map(|rate| text(format!("{rate} Hz"))),
        ..NeedDraft::default()
    }
}

/// Feeds an engine and records its outputs.
struct Stage {
    engine: Engine,
    events: Vec<Event>,
    published: Vec<Publication>,
}

impl Stage {
    fn new(knowledge: KnowledgeBase) -> Stage {
        Stage {
            engine: Engine::new(knowledge, Options::default()),
            events: Vec::new(),
            published: Vec::new(),
        }
    }

    fn take(&mut self, input: Input) {
        self.engine.handle(input);
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Event(event) => self.events.push(event),
                Output::Publication(publication) => self.published.push(publication),
                Output::Task { .. } | Output::Reloaded(_) => {}
            }
        }
    }

    fn pass(&mut self, to: Time) {
        while let Some(due) = self.engine.next_deadline().filter(|due| *due <= to) {
            self.take(Input::Tick(due));
        }
        self.take(Input::Tick(to));
    }

    fn say(&mut self, signal: &str, at: Time, value: f64) {
        let signal = self.engine.knowledge().signal(signal).unwrap();
        while let Some(due) = self.engine.next_deadline().filter(|due| *due < at) {
            self.take(Input::Tick(due));
        }
        let observation = Observation { signal, stamp: at, received: at, value: RawValue::Number(value) };
        self.take(Input::Observation(observation));
    }

    fn of(&self, need: usize) -> impl Iterator<Item = &Publication> {
        self.published.iter().filter(move |it| it.need == NeedId::from_index(need))
    }

    fn count(&self, need: usize, kind: EventKind) -> usize {
        let of_it = |event: &&Event| event.need == Some(NeedId::from_index(need)) && event.kind == kind;
        self.events.iter().filter(of_it).count()
    }
}

fn scalar(publication: &Publication) -> Interval {
    match publication.value {
        PublishedValue::Scalar(value) => value,
        PublishedValue::Vector(_) => Interval::EMPTY,
    }
}

/// The length of a segment in milliseconds; at its end, some sensors fall silent for good.
const SEGMENT_MS: i64 = 8_000;

fn run(sensors: &[Sensor], demands: &[Demand]) {
    let needs = demands.iter().enumerate().map(|(at, demand)| need(&format!("/n{at}"), demand));
    let knowledge = knowledge(sensors, needs.collect());
    let mut stage = Stage::new(knowledge);
    for segment in 0..5_usize {
        let begin = segment as i64 * SEGMENT_MS;
        let mut stated: Vec<(i64, usize)> = Vec::new();
        for (at, sensor) in sensors.iter().enumerate().filter(|(_, sensor)| segment < sensor.until) {
            let period = 1_000 / sensor.rate_hz;
            stated.extend((0..SEGMENT_MS / period).map(|tick| (begin + tick * period + at as i64, at)));
        }
        stated.sort_unstable();
        for (ms, at) in stated {
            stage.say(&Sensor::name(at), Time(ms * MS), 3.0);
        }
        let end = Time((begin + SEGMENT_MS - 1) * MS);
        stage.pass(end);
        for (number, demand) in demands.iter().enumerate() {
            let alive =
                |(at, sensor): &(usize, &Sensor)| segment < sensor.until && demand.is_met_by(sensor, *at);
            let meets = sensors.iter().enumerate().filter(alive).count();
            let last = stage.of(number).last().map(|it| end - it.time);
            let context =
                || format!("segment {segment}, need {number} {demand:?}\n{sensors:#?}\n{:#?}", stage.events);
            if meets > 0 {
                let most = Span((demand.max_age_ms + 1_100) * MS);
                assert!(
                    last.is_some_and(|last| last <= most),
                    "{meets} meet it, {last:?} ago: {}",
                    context()
                );
            } else {
                assert!(
                    last.is_none_or(|last| last > Span(2_000 * MS)),
                    "served {last:?} ago: {}",
                    context()
                );
            }
        }
    }
    for (number, demand) in demands.iter().enumerate() {
        for publication in stage.of(number) {
            let age = publication.time - publication.validity.to;
            assert!(age <= Span(demand.max_age_ms * MS), "{age:?} old: {demand:?}");
            let width = scalar(publication).width();
            let known = |(at, sensor): &(usize, &Sensor)| (2.0 * sensor.error(*at) - width).abs() < 5e-6;
            let (at, sensor) = sensors.iter().enumerate().find(known).expect("a sensor of this width");
            assert!(demand.is_met_by(sensor, at), "{sensor:?} served {demand:?}");
            // At the start, a source waits for others to speak.
            let is_starting = publication.time < Time(demand.max_age_ms.max(1_000) * MS);
            assert!(is_starting || publication.quality != Quality::Uncertain);
        }
        // Once for each source that falls silent: before that is sure, values may become too old.
        assert!(stage.count(number, EventKind::Unhealable) <= sensors.len(), "{:#?}", stage.events);
        // A refusal is reported once: no reason repeats.
        let refused = stage.events.iter().filter(|event| event.kind == EventKind::Refused);
        let mut reasons: Vec<_> = refused.map(|it| (it.need, format!("{:?}", it.because))).collect();
        let all = reasons.len();
        reasons.sort_unstable();
        reasons.dedup();
        assert_eq!(reasons.len(), all, "{reasons:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, ..ProptestConfig::default() })]

    /// No published value violates the need's demands, and the need is served while some source meets them; also for several
    /// needs of one variable.
    #[test]
    fn demands_are_kept_and_met(
        sensors in prop::collection::vec(sensor(), 1..7),
        demands in prop::collection::vec(demand(), 1..4),
    ) {
        run(&sensors, &demands);
    }

    /// The engine's source is the one that `best_meeting` finds with the need's requirements.
    #[test]
    fn the_first_source_is_that_of_the_plan(sensors in prop::collection::vec(sensor(), 1..7), demand in demand()) {
        let knowledge = knowledge(&sensors, vec![need("/n", &demand)]);
        let requirements = Requirements::of(&knowledge.needs()[NeedId::from_index(0)]);
        let limits = Limits { expansions: 100_000, states: 100_000 };
        let (graph, variable) = (Graph::new(&knowledge), knowledge.variable("v").unwrap());
        let plan = best_meeting(&knowledge, &graph, variable, &Default::default(), &requirements, 1, limits);
        let engine = Engine::new(knowledge.clone(), Options::default());
        let source = engine.need_status(NeedId::from_index(0)).source;
        prop_assert_eq!(source.is_some(), !plan.substitutions.is_empty());
        if let (Some(ServedBy::Way(source)), Some((substitution, _))) = (source, plan.substitutions.first()) {
            let relation = substitution.relations().first().map(|id| knowledge.relations()[*id].name.clone());
            prop_assert_eq!(source.split_once(" by ").map(|(_, name)| name.to_owned()), relation);
        }
    }
}

/// Shortly before the signals of [`told`] are right again.
const LIES_UNTIL: Time = Time(39_950 * MS);

/// Signals of one variable at 10 Hz that follow the truth, a slow sine, with an offset from 20 s to 40 s.
fn reported(offsets: &[f64], change: impl Fn(&mut NeedDraft)) -> Stage {
    let sensors = vec![Sensor::PLAIN; offsets.len()];
    let demand = Demand { max_age_ms: 500, max_width: None, level: None, min_rate_hz: None };
    let mut need = need("/n", &demand);
    change(&mut need);
    let mut stage = Stage::new(knowledge(&sensors, vec![need]));
    for tick in 0..900_i64 {
        for (at, offset) in offsets.iter().enumerate() {
            let time = Time((tick * 100 + at as i64) * MS);
            let lie = if (200..400).contains(&tick) { *offset } else { 0.0 };
            stage.say(&Sensor::name(at), time, truth(time) + lie);
        }
    }
    stage
}

fn truth(time: Time) -> f64 {
    (time.0 as f64 / 30e9).sin()
}

/// The uncertain values after the start, at which the first source waits for others to speak.
fn uncertain(stage: &Stage) -> Vec<&Publication> {
    let is_late = |it: &&Publication| it.time > Time(1_000 * MS);
    stage.of(0).filter(|it| it.quality == Quality::Uncertain).filter(is_late).collect()
}

fn check_truth(stage: &Stage) {
    for publication in uncertain(stage) {
        let value = scalar(publication);
        // The signals stamp their own moments, a few milliseconds apart.
        assert!(
            value.widened(0.01).contains(truth(publication.validity.to)),
            "{value:?} at {:?}",
            publication.time
        );
    }
}

#[test]
fn of_two_that_disagree_the_hull_goes_out_while_it_is_narrow_enough() {
    let stage = reported(&[0.0, 0.8], |need| need.max_width = Some(text("2")));
    let hulls = uncertain(&stage);
    assert!(hulls.len() > 100, "{}: {:#?}", hulls.len(), stage.events);
    let is_wide = |it: &&Publication| scalar(it).width() > 0.9 || it.time > LIES_UNTIL;
    assert!(hulls.iter().all(is_wide), "a hull is as wide as both");
    check_truth(&stage);
    assert_eq!(stage.count(0, EventKind::Substituted), 1, "{:#?}", stage.events);
    let last = stage.of(0).last().unwrap();
    assert_eq!(last.quality, Quality::Good, "it ends with the disagreement");
    assert!(stage.count(0, EventKind::Restored) >= 1);
}

#[test]
fn a_hull_that_is_too_wide_is_withheld_and_reported_with_its_width() {
    let stage = reported(&[0.0, 3.0], |need| need.max_width = Some(text("2")));
    // When both agree again and are not trusted yet, the uncertain value is narrow.
    assert!(uncertain(&stage).iter().all(|it| it.time > LIES_UNTIL), "{:#?}", stage.events);
    assert_eq!(stage.count(0, EventKind::Unhealable), 1, "{:#?}", stage.events);
    let is_limit = |why: &Reason| matches!(why, Reason::UncertainTooWide { most, .. } if most.value == 2.0);
    assert!(stage.events.iter().any(|it| it.because.iter().any(is_limit)), "{:#?}", stage.events);
    assert!(stage.of(0).all(|it| scalar(it).width() <= 2.0));
}
