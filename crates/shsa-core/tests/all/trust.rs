//! Random small systems with a known truth: which signals are accused, and that trust returns after a fault whatever the
//! derivations; and wrong time stamps.

use proptest::prelude::*;
use shsa_core::engine::{Engine, Event, EventKind, Input, Options, Output, PublishedValue, Quality};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    Bounds, Draft, Id, KnowledgeBase, NeedDraft, SignalDraft, SignalId, Text, VariableDraft, build,
};
use shsa_core::monitor::Symptom;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_core::trust::Verdict;

const PERIOD: i64 = 500_000_000;
const SECOND: i64 = 1_000_000_000;

pub(crate) fn text(text: &str) -> Text {
    Text { text: text.into(), ..Text::default() }
}

/// Signals of one variable, each with an error of 1, its origins and its common causes.
fn knowledge(signals: &[(Vec<usize>, Vec<usize>)], max_rate: Option<&str>) -> KnowledgeBase {
    let name = |number: &usize| text(&format!("s{number}"));
    let signal = |(number, (derived_from, shares)): (usize, &(Vec<usize>, Vec<usize>))| SignalDraft {
        name: name(&number),
        variable: Some(text("x")),
        rate: Some(text("2 Hz")),
        value_error: Some(Bounds::One(text("1"))),
        derived_from: derived_from.iter().map(name).collect(),
        shares: shares.iter().map(|cause| (text(&format!("c{cause}")), None)).collect(),
        ..SignalDraft::default()
    };
    let need = NeedDraft {
        variable: text("x"),
        max_age: Some(text("3 s")),
        probation: Some(text("5 s")),
        ..NeedDraft::default()
    };
    let (knowledge, problems) = build(&Draft {
        variables: vec![VariableDraft {
            name: text("x"),
            max_rate: max_rate.map(text),
            ..VariableDraft::default()
        }],
        signals: signals.iter().enumerate().map(signal).collect(),
        needs: vec![need],
        ..Draft::default()
    });
    let errors: Vec<_> = problems.iter().filter(|it| format!("{it:?}").contains("Error")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

pub(crate) struct Run {
    engine: Engine,
    outputs: Vec<Output>,
}

impl Run {
    pub(crate) fn new(knowledge: KnowledgeBase) -> Run {
        Run { engine: Engine::new(knowledge, Options::default()), outputs: Vec::new() }
    }

    pub(crate) fn give(&mut self, signal: usize, stamp: i64, received: i64, value: f64) {
        self.engine.handle(Input::Observation(Observation {
            signal: SignalId::from_index(signal),
            stamp: Time(stamp),
            received: Time(received),
            value: RawValue::Number(value),
        }));
        self.outputs.extend(core::iter::from_fn(|| self.engine.poll()));
    }

    pub(crate) fn restart(&mut self, knowledge: KnowledgeBase, now: i64) {
        let snapshot = self.engine.snapshot();
        self.engine = Engine::new(knowledge, Options::default());
        self.engine.restore(&snapshot, Time(now));
        self.outputs.extend(core::iter::from_fn(|| self.engine.poll()));
    }

    /// Lets time pass as a driver does.
    pub(crate) fn pass(&mut self, until: i64) {
        while let Some(due) = self.engine.next_deadline().filter(|due| due.0 < until) {
            self.engine.handle(Input::Tick(due));
            self.outputs.extend(core::iter::from_fn(|| self.engine.poll()));
        }
    }

    pub(crate) fn events(&self, kind: EventKind) -> Vec<&Event> {
        let of_kind = |event: &&Event| event.kind == kind && event.signal.is_some();
        self.outputs.iter().filter_map(event).filter(of_kind).collect()
    }

    pub(crate) fn accused(&self) -> Vec<SignalId> {
        let all = [EventKind::Suspected, EventKind::Failed].map(|kind| self.events(kind));
        all.into_iter().flatten().filter_map(|event| event.signal).collect()
    }

    /// The trusted values, each with the middle of its validity.
    pub(crate) fn trusted(&self) -> impl Iterator<Item = (Time, Interval)> + '_ {
        self.outputs.iter().filter_map(|output| match output {
            Output::Publication(it) if matches!(it.quality, Quality::Good | Quality::Substitute) => {
                match it.value {
                    PublishedValue::Scalar(value) => Some((it.validity.centre(), value)),
                    PublishedValue::Vector(_) => None,
                }
            }
            _ => None,
        })
    }

    fn last_quality(&self) -> Option<(Time, Quality)> {
        self.outputs.iter().rev().find_map(|output| match output {
            Output::Publication(published) => Some((published.time, published.quality)),
            _ => None,
        })
    }
}

fn event(output: &Output) -> Option<&Event> {
    match output {
        Output::Event(event) => Some(event),
        Output::Publication(_) | Output::Task { .. } | Output::Reloaded(_) => None,
    }
}

/// The error of a sound signal, within 0.9 of its bound.
#[derive(Clone, Copy, Debug)]
enum Errs {
    Not,
    Constantly(f64),
    Uniformly,
    AtTwoPoints,
}

impl Errs {
    fn at(self, number: usize, step: usize) -> f64 {
        let random = (((step * 7919 + number * 104_729 + 13) * 2_654_435_761) % 10_007) as f64 / 10_007.0;
        match self {
            Errs::Not => 0.0,
            Errs::Constantly(by) => by,
            Errs::Uniformly => 0.9 * (2.0 * random - 1.0),
            Errs::AtTwoPoints => {
                if random < 0.5 {
                    -0.9
                } else {
                    0.9
                }
            }
        }
    }
}

type Member = (Errs, Vec<usize>, Vec<usize>);

fn members() -> impl Strategy<Value = Vec<Member>> {
    let errs = prop_oneof![
        Just(Errs::Not),
        (-0.9..0.9_f64).prop_map(Errs::Constantly),
        Just(Errs::Uniformly),
        Just(Errs::AtTwoPoints),
    ];
    // Derived from earlier signals only.
    let one = (errs, any::<u8>(), prop::collection::btree_set(0..2_usize, 0..2));
    prop::collection::vec(one, 2..5).prop_map(|all| {
        let member =
            |(at, (errs, derived, shares)): (usize, (Errs, u8, std::collections::BTreeSet<usize>))| {
                let derived_from = (0..at).filter(|from| derived % 3 == 0 && derived >> (from + 2) & 1 == 1);
                (errs, derived_from.collect(), shares.into_iter().collect())
            };
        all.into_iter().enumerate().map(member).collect()
    })
}

/// A minute and a half of the system, with `fault` added to the faulty signal from 30 to 50 s.
fn run(members: &[Member], liar: usize, fault: f64, max_rate: Option<&str>) -> Run {
    run_with_restart(members, liar, fault, max_rate, None)
}

/// The same, with a new engine that goes on from the snapshot of the old one at the step `restart`.
fn run_with_restart(
    members: &[Member],
    liar: usize,
    fault: f64,
    max_rate: Option<&str>,
    restart: Option<usize>,
) -> Run {
    let described: Vec<_> = members.iter().map(|(_, from, shares)| (from.clone(), shares.clone())).collect();
    let mut run = Run::new(knowledge(&described, max_rate));
    for step in 0..180 {
        let now = step as i64 * PERIOD;
        run.pass(now);
        if restart == Some(step) {
            run.restart(knowledge(&described, max_rate), now);
        }
        for (number, (errs, ..)) in members.iter().enumerate() {
            let is_faulty = number == liar && (60..100).contains(&step);
            run.give(number, now, now, 20.0 + errs.at(number, step) + if is_faulty { fault } else { 0.0 });
        }
    }
    run.engine.handle(Input::Tick(Time(180 * PERIOD)));
    run.outputs.extend(core::iter::from_fn(|| run.engine.poll()));
    run
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn one_liar_is_accused_and_no_sound_one_fails_and_all_are_trusted_again(
        members in members(),
        liar in 0..4_usize,
        fault in prop_oneof![Just(6.0), Just(-9.0)],
        is_limited in any::<bool>(),
    ) {
        let liar = liar % members.len();
        let run = run(&members, liar, fault, is_limited.then_some("0.5"));
        let accused = run.accused();
        let is_reported = accused.contains(&SignalId::from_index(liar));
        prop_assert!(is_reported, "the liar is not told: {:?}", accused);
        for event in run.events(EventKind::Failed) {
            prop_assert_eq!(event.signal, Some(SignalId::from_index(liar)), "{:?}", event.because);
        }
        for number in 0..members.len() {
            let verdict = run.engine.verdict(SignalId::from_index(number));
            prop_assert!(verdict <= Verdict::Healthy, "s{} is {:?} 40 s after the fault", number, verdict);
        }
        let (last, quality) = run.last_quality().unwrap();
        prop_assert_eq!((last >= Time(179 * PERIOD), quality), (true, Quality::Good));
    }

    #[test]
    fn a_restart_in_the_middle_fails_no_sound_one_and_all_are_trusted_again(
        members in members(),
        liar in 0..4_usize,
        restart in 58..125_usize,
        is_limited in any::<bool>(),
    ) {
        let liar = liar % members.len();
        let run = run_with_restart(&members, liar, 6.0, is_limited.then_some("0.5"), Some(restart));
        let is_reported = run.accused().contains(&SignalId::from_index(liar));
        prop_assert!(is_reported, "the liar is not told: {:?}", run.accused());
        for event in run.events(EventKind::Failed) {
            prop_assert_eq!(event.signal, Some(SignalId::from_index(liar)), "{:?}", event.because);
        }
        for number in 0..members.len() {
            let verdict = run.engine.verdict(SignalId::from_index(number));
            prop_assert!(verdict <= Verdict::Healthy, "s{} is {:?} after the fault", number, verdict);
        }
        let (last, quality) = run.last_quality().unwrap();
        prop_assert_eq!((last >= Time(179 * PERIOD), quality), (true, Quality::Good));
    }

    #[test]
    fn nobody_is_accused_on_sound_data(members in members()) {
        let run = run(&members, 0, 0.0, Some("0.5"));
        let accused = run.accused();
        prop_assert!(accused.is_empty(), "{:?}", accused);
    }
}

/// A suspect whose rival has fallen silent is not known to be sound: it serves as a substitute, and not earlier.
#[test]
fn a_suspect_that_nobody_contradicts_any_more_is_unknown() {
    let mut run = Run::new(knowledge(&[(vec![], vec![]), (vec![], vec![])], None));
    for step in 0..200_usize {
        let now = step as i64 * PERIOD;
        run.pass(now);
        let error = |number| Errs::Uniformly.at(number, step);
        run.give(0, now, now, 20.0 + error(0));
        if step < 60 {
            run.give(1, now, now, 20.0 + error(1) + if step >= 40 { 6.0 } else { 0.0 });
        }
    }
    let verdict = run.engine.verdict(SignalId::from_index(0));
    assert_eq!((run.events(EventKind::Failed).len(), verdict), (0, Verdict::Unknown));
    let (last, quality) = run.last_quality().unwrap();
    assert!(last >= Time(198 * PERIOD) && quality != Quality::Good, "{last:?} {quality:?}");
}

/// Three signals at 2 Hz, with `stamp` for the first one.
fn clock(stamp: impl Fn(i64) -> i64, others: i64) -> Run {
    let mut run = Run::new(knowledge(&[(vec![], vec![]), (vec![], vec![]), (vec![], vec![])], None));
    let start = 1_700_000_000 * SECOND;
    for step in 0..240_usize {
        let now = step as i64 * PERIOD;
        run.pass(start + now);
        for number in 0..3 {
            let stamp = if number == 0 { stamp(now) } else { now + others };
            let value = 20.0 + Errs::Uniformly.at(number, step);
            run.give(number, start + stamp, start + now + number as i64, value);
        }
    }
    run
}

#[track_caller]
fn is_reported(run: &Run, between: std::ops::Range<i64>, restored: bool) {
    let start = 1_700_000_000 * SECOND;
    let failed = run.events(EventKind::Failed);
    let reported: Vec<_> = failed.iter().map(|it| (it.signal.map(Id::index), it.symptom)).collect();
    assert_eq!(reported, [(Some(0), Some(Symptom::WrongClock))], "{failed:?}");
    let after = (failed[0].time.0 - start) / SECOND;
    assert!(between.contains(&after), "told after {after} s: {:?}", failed[0].because);
    assert_eq!(run.events(EventKind::Restored).len(), usize::from(restored));
}

#[test]
fn a_clock_that_is_set_is_reported_within_seconds_and_trusted_when_it_is_right_again() {
    for off in [-3600 * SECOND, 3600 * SECOND, -20 * SECOND, 3 * SECOND] {
        let set = |now: i64| now + if (20 * SECOND..60 * SECOND).contains(&now) { off } else { 0 };
        is_reported(&clock(set, 0), 20..26, true);
        is_reported(&clock(|now| now + if now >= 20 * SECOND { off } else { 0 }, 0), 20..26, false);
    }
}

#[test]
fn a_clock_that_is_wrong_from_the_start_is_reported_by_the_others() {
    is_reported(&clock(|now| now - 3600 * SECOND, 0), 0..10, false);
}

#[test]
fn stamps_that_stand_still_are_reported() {
    is_reported(&clock(|now| now.min(20 * SECOND), 0), 20..32, false);
    is_reported(&clock(|_| -1_700_000_000 * SECOND, 0), 0..12, false);
}

#[test]
fn clocks_that_are_all_off_alike_are_right() {
    let run = clock(|now| now - 3600 * SECOND, -3600 * SECOND);
    assert!(run.accused().is_empty(), "{:?}", run.accused());
}

/// The stamps of all signals are 5 s in the future from one moment on: it is the clock of the receiver that was set back.
#[test]
fn a_receiver_that_was_set_back_accuses_no_clock() {
    let mut run = Run::new(knowledge(&[(vec![], vec![]), (vec![], vec![]), (vec![], vec![])], None));
    for step in 0..240_usize {
        let now = step as i64 * PERIOD;
        let lead = if step < 60 { 0 } else { 5 * SECOND };
        run.pass(now);
        for number in 0..3 {
            run.give(number, now + lead, now + number as i64, 20.0 + Errs::Uniformly.at(number, step));
        }
    }
    let clocks =
        run.events(EventKind::Failed).into_iter().filter(|it| it.symptom == Some(Symptom::WrongClock));
    assert_eq!(clocks.count(), 0);
}

/// Values from the future cannot be used, so the reason for that must be reported.
#[test]
fn clocks_that_are_all_ahead_are_wrong_although_they_are_alike() {
    let run = clock(|now| now + 3600 * SECOND, 3600 * SECOND);
    let failed = run.events(EventKind::Failed);
    assert_eq!(failed.len(), 3, "{failed:?}");
    assert!(failed.iter().all(|it| it.symptom == Some(Symptom::WrongClock)), "{failed:?}");
    assert!(failed.iter().all(|it| it.time < Time(1_700_000_012 * SECOND)), "{failed:?}");
}

/// Readings held up for half a minute come at once: they are late, and the clock is right.
#[test]
fn what_comes_at_once_after_a_stall_has_no_wrong_clock() {
    let mut run = Run::new(knowledge(&[(vec![], vec![]), (vec![], vec![])], None));
    for step in 0..240_usize {
        let now = step as i64 * PERIOD;
        run.pass(now);
        let error = |number, step| 20.0 + Errs::Uniformly.at(number, step);
        let is_held = (60..120).contains(&step);
        let from = if step == 120 { 60 } else { step };
        for held in (from..=step).filter(|_| !is_held) {
            run.give(0, held as i64 * PERIOD, now + (held - from) as i64 * 1_000_000, error(0, held));
        }
        run.give(1, now, now + 100_000_000, error(1, step));
    }
    let clocks =
        run.events(EventKind::Failed).into_iter().filter(|it| it.symptom == Some(Symptom::WrongClock));
    assert_eq!(clocks.count(), 0);
}
