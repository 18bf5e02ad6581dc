//! An engine with a new knowledge base: unaffected parts go on byte for byte.

use super::drafts::{need, relation, remove, signal, two_patient_systems, two_systems, variable};
use proptest::prelude::*;
use shsa_core::engine::{Engine, Event, EventKind, Input, Options, Order, Output, Subject};
use shsa_core::knowledge::{Bounds, Draft, Edit, KnowledgeBase, Model, Section, SignalDraft};
use shsa_core::monitor::{WatchedWay, WayIndex};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::reason::{Joint, Reason, Reasons, ServedBy};
use shsa_core::time::Time;
use shsa_core::trust::Verdict;

/// A value on the bus: its sensor, time and value.
type Row = (&'static str, f64, f64);

/// A fault of a sensor from one second to another: silence for `None`, else this is added.
#[derive(Clone, Debug)]
struct Fault {
    signal: &'static str,
    from: f64,
    to: f64,
    added: Option<f64>,
}

const SENSORS: [(&str, f64); 7] = [
    ("wheel_1", 25.0),
    ("wheel_2", 20.0),
    ("gnss", 10.0),
    ("wheel_3", 20.0),
    ("barometer", 20.0),
    ("lidar", 10.0),
    ("vario", 25.0),
];

fn truth(signal: &str, seconds: f64) -> f64 {
    match signal {
        "barometer" | "lidar" => 100.0 - 4.0 * (seconds / 4.0).cos(),
        "vario" => (seconds / 4.0).sin(),
        _ => 14.0 + 6.0 * (seconds / 8.0).sin(),
    }
}

/// The values of both systems' sensors for some seconds, with faults, by time.
fn rows(seconds: f64, faults: &[Fault]) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for (number, (name, rate)) in SENSORS.iter().enumerate() {
        for step in 0..(seconds * rate) as u32 {
            let time = (f64::from(step) + 0.1 * number as f64) / rate;
            let noise = 0.1 * f64::from(step * 7919 % 13) / 13.0;
            let hit =
                faults.iter().find(|fault| fault.signal == *name && (fault.from..fault.to).contains(&time));
            match hit.map(|fault| fault.added) {
                Some(None) => {}
                added => rows.push((name, time, truth(name, time) + noise + added.flatten().unwrap_or(0.0))),
            }
        }
    }
    rows.sort_by(|one, other| one.1.total_cmp(&other.1));
    rows
}

/// A running engine and its outputs, with names in place of ids.
struct Stage {
    model: Model,
    engine: Engine,
    /// The knowledge base of the next output's ids.
    speaking: KnowledgeBase,
    stated: Vec<(String, String)>,
    events: Vec<Event>,
}

impl Stage {
    fn new(draft: Draft) -> Stage {
        let (model, _) = Model::new(draft).unwrap();
        let engine = Engine::new(model.knowledge().clone(), Options::default());
        Stage { speaking: model.knowledge().clone(), model, engine, stated: Vec::new(), events: Vec::new() }
    }

    fn run(&mut self, rows: &[Row]) {
        for &(name, seconds, value) in rows {
            let Some(signal) = self.engine.knowledge().signal(name) else { continue };
            let at = Time::from_seconds(seconds);
            self.pass(at);
            let value = RawValue::Number(value);
            self.engine.handle(Input::Observation(Observation { signal, stamp: at, received: at, value }));
            self.listen();
        }
    }

    fn pass(&mut self, until: Time) {
        while let Some(due) = self.engine.next_deadline().filter(|due| *due < until) {
            self.engine.handle(Input::Tick(due));
            self.listen();
        }
    }

    fn change(&mut self, seconds: f64, edits: &[Edit]) {
        self.model.edit(edits).unwrap();
        self.pass(Time::from_seconds(seconds));
        self.engine.reload(self.model.knowledge().clone(), Time::from_seconds(seconds));
        self.listen();
    }

    /// Records the engine's outputs, each with its signal, or its need's variable.
    fn listen(&mut self) {
        while let Some(output) = self.engine.poll() {
            let known = &self.speaking;
            let (about, text) = match output {
                Output::Task { .. } => continue,
                Output::Reloaded(_) => {
                    self.speaking = self.engine.knowledge().clone();
                    continue;
                }
                Output::Event(event) => {
                    let variable = event.variable.map(|id| known.variables()[id].name.clone());
                    let signal = event.signal.map(|id| known.signals()[id].name.clone());
                    self.events.push(event.clone());
                    let Event { time, kind, because, substitution, .. } = event;
                    let text = format!("{time:?} {kind:?} {because:?} {substitution:?}");
                    (signal.or(variable).unwrap_or_default(), text)
                }
                Output::Publication(it) => {
                    let variable = known.needs()[it.need].variable;
                    let text = format!("{:?} {:?} {:?} {:?}", it.time, it.validity, it.value, it.quality);
                    (known.variables()[variable].name.clone(), text)
                }
            };
            self.stated.push((about, text));
        }
    }

    fn about(&self, names: &[&str]) -> Vec<&(String, String)> {
        self.stated.iter().filter(|(about, _)| names.contains(&about.as_str())).collect()
    }

    fn source(&self, need: usize) -> Option<String> {
        let need = self.engine.knowledge().needs().ids().nth(need)?;
        self.engine.need_status(need).source.and_then(|it| it.way().map(str::to_owned))
    }

    fn verdict(&self, signal: &str) -> Verdict {
        self.engine.verdict(self.engine.knowledge().signal(signal).unwrap())
    }

    fn last_event(&self, kind: EventKind) -> &Event {
        self.events.iter().rev().find(|event| event.kind == kind).unwrap()
    }
}

const BALLOON: [&str; 6] = ["height", "climb", "gain", "barometer", "lidar", "vario"];

/// Possible changes of the vehicle's part of the model, each after the earlier ones.
fn vehicle_changes() -> Vec<Vec<Edit>> {
    let wider = SignalDraft {
        value_error: Some(Bounds::One(super::drafts::text("0.8"))),
        ..signal("gnss", "speed", "10 Hz", "")
    };
    vec![
        vec![Edit::Signal(signal("wheel_3", "speed", "20 Hz", "0.5"))],
        vec![remove(Section::Signals, "wheel_1")],
        vec![Edit::Signal(wider)],
        vec![
            Edit::Variable(variable("twice", "m/s", "")),
            Edit::Relation(relation("doubled", "twice = 2 * speed", "", "")),
        ],
        vec![Edit::Signal(signal("fast", "twice", "50 Hz", "1"))],
        vec![remove(Section::Needs, "speed")],
        vec![Edit::Signal(signal("wheel_1", "speed", "25 Hz", "0.5")), Edit::Need(need("speed", "400 ms"))],
        vec![Edit::Variable(variable("speed", "m/s", "9 m/s^2"))],
        vec![Edit::Available(super::drafts::text("gnss"), false)],
        vec![],
    ]
}

fn fault() -> impl Strategy<Value = Fault> {
    let added = prop_oneof![Just(None), (2..8).prop_map(|added| Some(f64::from(added)))];
    (0..SENSORS.len(), 10..200_u32, 10..100_u32, added).prop_map(|(sensor, from, length, added)| {
        let (from, length) = (f64::from(from) / 10.0, f64::from(length) / 10.0);
        Fault { signal: SENSORS[sensor].0, from, to: from + length, added }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn what_a_change_leaves_alone_goes_on_byte_for_byte(
        faults in proptest::collection::vec(fault(), 0..4),
        mut moments in proptest::collection::vec(5..290_u32, 1..6),
        first in 0..10_usize,
    ) {
        moments.sort_unstable();
        let rows = rows(30.0, &faults);
        let (mut steady, mut changed) = (Stage::new(two_systems()), Stage::new(two_systems()));
        steady.run(&rows);
        let mut rest = rows.as_slice();
        let changes = vehicle_changes();
        for (moment, edits) in moments.iter().zip(changes.iter().cycle().skip(first)) {
            let seconds = f64::from(*moment) / 10.0;
            let now = rest.partition_point(|row| row.1 < seconds);
            changed.run(&rest[..now]);
            rest = &rest[now..];
            // In the given order, some changes are invalid: the model then stays.
            let mut model = changed.model.clone();
            if model.edit(edits).is_ok() {
                changed.change(seconds, edits);
            }
        }
        changed.run(rest);
        prop_assert!(steady.about(&BALLOON).len() > 200);
        prop_assert_eq!(super::difference(&steady.about(&BALLOON), &changed.about(&BALLOON)), None);
    }

    #[test]
    fn a_change_of_nothing_changes_nothing(
        faults in proptest::collection::vec(fault(), 0..5),
        moments in proptest::collection::btree_set(1..290_u32, 1..20),
    ) {
        let rows = rows(30.0, &faults);
        let (mut steady, mut changed) = (Stage::new(two_systems()), Stage::new(two_systems()));
        steady.run(&rows);
        let mut rest = rows.as_slice();
        for moment in moments {
            let seconds = f64::from(moment) / 10.0;
            let now = rest.partition_point(|row| row.1 < seconds);
            changed.run(&rest[..now]);
            rest = &rest[now..];
            changed.change(seconds, &[]);
        }
        changed.run(rest);
        prop_assert_eq!(super::difference(&steady.stated, &changed.stated), None);
        let statuses = |stage: &Stage| {
            let needs = stage.engine.knowledge().needs().ids();
            needs.map(|need| format!("{:?}", stage.engine.need_status(need))).collect::<Vec<_>>()
        };
        prop_assert_eq!(statuses(&steady), statuses(&changed));
        prop_assert_eq!(records(&steady), records(&changed));
    }
}

/// The records of the ways at the end, in 12 decimals: after a change, sums are added in another order.
fn records(stage: &Stage) -> Vec<String> {
    let monitor = stage.engine.monitor();
    let figures = |(index, way): (WayIndex, &WatchedWay)| {
        let name = way.computation.way().describe(stage.engine.knowledge());
        format!("{name}: {:.12?}", monitor.figures(index, Time::from_seconds(30.0)))
    };
    (0..).map(WayIndex).zip(monitor.ways()).map(figures).collect()
}

/// The rows of ten seconds, cut in the middle.
fn halves() -> (Vec<Row>, Vec<Row>) {
    rows(10.0, &[]).into_iter().partition(|row| row.1 < 5.0)
}

#[test]
fn a_source_that_the_change_takes_away_is_replaced_at_once() {
    let (before, after) = halves();
    let mut stage = Stage::new(two_systems());
    stage.run(&before);
    let lost = stage.source(0).unwrap();
    stage.change(5.0, &[remove(Section::Signals, &lost)]);
    let event = stage.last_event(EventKind::Substituted);
    assert_eq!(event.time, Time::from_seconds(5.0));
    assert_eq!(event.because.iter().next(), Some(&Reason::Gone { names: vec![lost] }));
    assert_eq!(stage.source(0).map(ServedBy::Way), event.substitution);
    stage.run(&after);
    let need = stage.engine.knowledge().needs().ids().next().unwrap();
    assert!(stage.engine.need_status(need).longest_gap.seconds() < 0.1);
}

#[test]
fn a_need_without_a_source_is_reported_and_goes_on_when_there_is_one_again() {
    let (before, after) = halves();
    let mut stage = Stage::new(two_patient_systems());
    stage.run(&before);
    // From now on the climb can only be computed, and later not even that.
    stage.change(5.0, &[remove(Section::Signals, "vario")]);
    let computed = stage.source(2).unwrap();
    assert!(computed.ends_with(" by climbing"), "{computed}");
    let structure = super::drafts::structure("climbing", &["climb"], &["height"]);
    stage.change(5.0, &[Edit::Relation(structure)]);
    let gone = Reasons::from(Reason::ServesNoMore { source: computed });
    let because = gone.then(Joint::And, Reason::NothingElseTrusted);
    let mut unhealable = stage.events.iter().filter(|event| event.kind == EventKind::Unhealable);
    assert!(unhealable.any(|event| event.because == because), "{:?}", stage.events);
    assert_eq!(stage.source(2), None);
    stage.change(5.0, &[Edit::Signal(signal("vario", "climb", "25 Hz", "0.4"))]);
    stage.run(&after);
    assert_eq!(stage.source(2).as_deref(), Some("vario"));
    assert_eq!(stage.last_event(EventKind::Restored).because, Reason::ServedAgain.into());
}

#[test]
fn a_signal_that_has_never_spoken_does_not_take_over_until_it_does() {
    let (before, after) = halves();
    let mut stage = Stage::new(two_systems());
    stage.run(&before);
    let best = SignalDraft {
        properties: super::drafts::properties(&[("accuracy", "1")]),
        ..signal("wheel_3", "speed", "20 Hz", "0.1")
    };
    let source = stage.source(0).unwrap();
    let mut edits = vec![Edit::Signal(best)];
    let worse = [("wheel_1", "25 Hz"), ("wheel_2", "20 Hz"), ("gnss", "10 Hz")];
    edits.extend(worse.map(|(name, _)| Edit::Property {
        section: Section::Signals,
        element: super::drafts::text(name),
        name: super::drafts::text("accuracy"),
        value: Some(super::drafts::text("0.5")),
    }));
    stage.change(5.0, &edits);
    assert_eq!(stage.source(0).as_ref(), Some(&source));
    stage.run(&after);
    assert_eq!(stage.source(0).as_deref(), Some("wheel_3"), "the most exact of equals is preferred");
}

#[test]
fn verdicts_stay_with_their_evidence_and_go_with_it() {
    let fault = Fault { signal: "gnss", from: 2.0, to: 60.0, added: Some(5.0) };
    let (before, after): (Vec<Row>, Vec<Row>) = rows(20.0, &[fault]).into_iter().partition(|row| row.1 < 5.0);
    // Only the other signals can show that it is wrong.
    let mut compared = two_systems();
    compared.signals.iter_mut().for_each(|signal| signal.max_rate = Some(super::drafts::text("none")));
    let mut stage = Stage::new(compared.clone());
    stage.run(&before);
    assert_eq!(stage.verdict("gnss"), Verdict::Failed);
    let failures =
        |stage: &Stage| stage.events.iter().filter(|event| event.kind == EventKind::Failed).count();
    stage.change(5.0, &[remove(Section::Relations, "gaining"), remove(Section::Needs, "gain")]);
    assert_eq!(stage.verdict("gnss"), Verdict::Failed);
    stage.change(5.0, &[remove(Section::Signals, "wheel_1")]);
    assert_eq!((stage.verdict("gnss"), failures(&stage)), (Verdict::Failed, 1));
    // Without a witness, nothing could ever clear the signal.
    let mut alone = Stage::new(compared);
    alone.run(&before);
    let witnesses = [remove(Section::Signals, "wheel_1"), remove(Section::Signals, "wheel_2")];
    alone.change(5.0, &witnesses);
    assert_eq!(alone.verdict("gnss"), Verdict::Unknown);
    assert_eq!(alone.last_event(EventKind::Restored).because, Reason::ComparisonsGone.into());
    // A fault of its own readings stays; without the accusing comparisons, the signal is unknown.
    let mut jumped = Stage::new(two_systems());
    jumped.run(&before);
    jumped.change(5.0, &witnesses);
    assert_eq!((jumped.verdict("gnss"), failures(&jumped)), (Verdict::Failed, 1));
    jumped.run(&after);
    assert_eq!(jumped.verdict("gnss"), Verdict::Unknown);
    let is_unproven = |event: &Event| {
        let is_it = |reason: &Reason| matches!(reason, Reason::NothingEitherWay { .. });
        event.kind == EventKind::Suspected && event.because.iter().any(is_it)
    };
    assert!(jumped.events.iter().any(is_unproven), "{:?}", jumped.events);
    let is_cleared = |event: &Event| event.kind == EventKind::Restored && event.signal.is_some();
    assert!(!jumped.events.iter().any(is_cleared), "{:?}", jumped.events);
    // A signal that is described anew is judged anew, and fails again.
    stage.change(5.0, &[Edit::Signal(signal("gnss", "speed", "10 Hz", "0.4"))]);
    assert_eq!(stage.last_event(EventKind::Restored).because, Reason::DescribedAnew.into());
    stage.run(&after);
    assert_ne!(stage.verdict("gnss"), Verdict::Healthy);
}

#[test]
fn silence_is_remembered_and_what_is_new_has_time_to_speak() {
    let silent = Fault { signal: "lidar", from: 2.0, to: 60.0, added: None };
    let (before, after): (Vec<Row>, Vec<Row>) =
        rows(10.0, &[silent]).into_iter().partition(|row| row.1 < 5.0);
    let mut stage = Stage::new(two_systems());
    stage.run(&before);
    let silences =
        |stage: &Stage| stage.events.iter().filter(|event| event.kind == EventKind::Silent).count();
    assert_eq!(silences(&stage), 1);
    let new = ["never", "wheel_3"].map(|name| Edit::Signal(signal(name, "speed", "20 Hz", "0.5")));
    stage.change(5.0, &new);
    stage.run(&after);
    assert_eq!(silences(&stage), 2, "the new signal that never speaks");
    let event = stage.last_event(EventKind::Silent);
    assert!(event.time > Time::from_seconds(5.2), "{event:?}");
    assert_eq!(event.because.iter().last(), Some(&Reason::NoValueEver));
}

#[test]
fn orders_outlast_a_change_as_long_as_what_they_name_does() {
    let (before, after) = halves();
    let mut stage = Stage::new(two_patient_systems());
    stage.run(&before);
    let forbid = Order::Forbid(Subject::Signal("gnss".to_owned()));
    let force = Order::Force { need: "climb".to_owned(), source: "barometer by climbing".to_owned() };
    for order in [&forbid, &force] {
        stage.engine.order(order, Time::from_seconds(5.0)).unwrap();
    }
    stage.listen();
    let refusals = |stage: &Stage| -> Vec<Reasons> {
        let refused = stage.events.iter().filter(|event| event.kind == EventKind::Refused);
        refused.map(|event| event.because.clone()).collect()
    };
    assert_eq!(stage.source(2).as_deref(), Some("barometer by climbing"));
    // The forbidden signal is described anew, and stays forbidden.
    let anew = Edit::Signal(signal("gnss", "speed", "10 Hz", "0.4"));
    stage.change(5.0, &[anew, remove(Section::Signals, "wheel_2")]);
    assert_eq!(stage.engine.standing_orders().len(), 2);
    assert_eq!(stage.source(2).as_deref(), Some("barometer by climbing"));
    assert!(refusals(&stage).is_empty());
    let (soon, later): (Vec<Row>, Vec<Row>) = after.into_iter().partition(|row| row.1 < 7.0);
    stage.run(&soon);
    assert_ne!(stage.source(0).as_deref(), Some("gnss"));
    // The named elements are gone: this is reported, and the need chooses by itself.
    stage.change(7.0, &[remove(Section::Signals, "gnss"), remove(Section::Signals, "barometer")]);
    stage.run(&later);
    assert_eq!(stage.engine.standing_orders(), []);
    assert_eq!(stage.source(2).as_deref(), Some("vario"));
    let [signal, source] = &refusals(&stage)[..] else { panic!("{:?}", refusals(&stage)) };
    let refused = |reasons: &Reasons| reasons.iter().take(2).cloned().collect::<Vec<_>>();
    let no_signal = Reason::NoSignal { name: "gnss".to_owned() };
    assert_eq!(refused(signal), [Reason::NoMoreInForce { order: forbid }, no_signal]);
    let (need, name) = ("/healed/climb".to_owned(), "barometer by climbing".to_owned());
    let order = Order::Force { need: need.clone(), source: name.clone() };
    assert_eq!(refused(source), [Reason::NoMoreInForce { order }, Reason::NoSource { need, name }]);
}

#[test]
fn a_thousand_changes_leave_nothing_behind() {
    let rows = rows(8.0, &[]);
    let mut stage = Stage::new(two_systems());
    stage.run(&rows);
    let changes = [
        vec![remove(Section::Signals, "wheel_1"), remove(Section::Needs, "gain")],
        vec![Edit::Signal(signal("wheel_1", "speed", "25 Hz", "0.5")), Edit::Need(need("gain", "500 ms"))],
    ];
    let mut model = stage.model.clone();
    let knowledge = changes.map(|edits| {
        model.edit(&edits).unwrap();
        model.knowledge().clone()
    });
    let mut reload = |rounds: std::ops::Range<u32>| {
        allocation_counter::measure(|| {
            for round in rounds {
                let at = Time::from_seconds(10.0 + f64::from(round) / 100.0);
                stage.engine.reload(knowledge[round as usize % 2].clone(), at);
                while stage.engine.poll().is_some() {}
            }
        })
        .bytes_current
    };
    reload(0..20);
    let grown = reload(20..1_020);
    assert!(grown.abs() < 1_024, "{grown} bytes");
    assert!(stage.engine.knowledge().version() >= 1_020);
}
