//! Faults of a signal's own readings: each detector compared with its definition over the whole past, no false alarms,
//! independence of the order within a moment, and outliers that are neither published nor locked in.

use crate::driven::text;
use proptest::prelude::*;
use shsa_core::alignment::Counts;
use shsa_core::engine::{Engine, Event, EventKind, Input, Options, Output, PublishedValue, Quality};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    Bounds, Draft, Id, KnowledgeBase, NeedDraft, SignalDraft, SignalId, VariableDraft, build,
};
use shsa_core::monitor::Symptom;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::reason::{Amount, Joint, Range, Reason, Reasons};
use shsa_core::time::{Span, Time};
use shsa_core::trust::Verdict;

/// 5 Hz, hence 2 of 4 readings; -50..50 within +-0.1, 2 a second; stamps within 10 ms, at most 300 ms late.
pub(super) const PERIOD: i64 = 200_000_000;
pub(super) const MAX_RATE: f64 = 2.0;
pub(super) const ERROR: f64 = 0.1;

fn knowledge() -> KnowledgeBase {
    let signal = SignalDraft {
        name: text("s"),
        variable: Some(text("x")),
        rate: Some(text("5 Hz")),
        value_error: Some(Bounds::One(text("0.1"))),
        time_error: Some(Bounds::One(text("10 ms"))),
        range: Some((text("-50"), text("50"))),
        max_rate: Some(text("2")),
        max_delay: Some(text("300 ms")),
        timeout: Some(text("1 s")),
        ..SignalDraft::default()
    };
    let need = NeedDraft {
        variable: text("x"),
        max_age: Some(text("10 s")),
        probation: Some(text("5 s")),
        ..NeedDraft::default()
    };
    let (knowledge, problems) = build(&Draft {
        variables: vec![VariableDraft { name: text("x"), ..VariableDraft::default() }],
        signals: vec![signal],
        needs: vec![need],
        ..Draft::default()
    });
    assert!(problems.is_empty(), "{problems:?}");
    knowledge
}

/// Stamp and reception in nanoseconds, and the value.
pub(super) type Reading = (i64, i64, f64);

/// The outputs, and the final state of the engine.
pub(super) struct Run {
    pub(super) engine: Engine,
    outputs: Vec<Output>,
}

impl Run {
    pub(super) fn of(readings: &[Reading]) -> Run {
        let mut engine = Engine::new(knowledge(), Options::default());
        let mut outputs = Vec::new();
        for &(stamp, received, value) in readings {
            engine.handle(Input::Observation(Observation {
                signal: SignalId::from_index(0),
                stamp: Time(stamp),
                received: Time(received),
                value: RawValue::Number(value),
            }));
            outputs.extend(core::iter::from_fn(|| engine.poll()));
        }
        let end = readings.iter().map(|reading| reading.1).max().unwrap_or(0);
        engine.handle(Input::Tick(Time(end)));
        outputs.extend(core::iter::from_fn(|| engine.poll()));
        Run { engine, outputs }
    }

    pub(super) fn events(&self, kind: EventKind) -> Vec<&Event> {
        let of_signal = |event: &&Event| event.kind == kind && event.signal.is_some();
        self.outputs.iter().filter_map(event).filter(of_signal).collect()
    }

    pub(super) fn counts(&self) -> Counts {
        self.engine.monitor().ports()[SignalId::from_index(0)].counts()
    }

    /// The qualities of all published values.
    pub(super) fn qualities(&self) -> Vec<Quality> {
        let quality = |output: &Output| match output {
            Output::Publication(publication) => Some(publication.quality),
            _ => None,
        };
        self.outputs.iter().filter_map(quality).collect()
    }

    /// All published intervals and their times.
    pub(super) fn intervals(&self) -> Vec<(Time, Interval)> {
        let value = |output: &Output| match output {
            Output::Publication(publication) => match &publication.value {
                PublishedValue::Scalar(value) => Some((publication.time, *value)),
                PublishedValue::Vector(_) => None,
            },
            _ => None,
        };
        self.outputs.iter().filter_map(value).collect()
    }

    /// All published values and their times.
    pub(super) fn published(&self) -> Vec<(Time, f64)> {
        self.intervals().into_iter().map(|(time, value)| (time, value.midpoint())).collect()
    }
}

fn event(output: &Output) -> Option<&Event> {
    match output {
        Output::Event(event) => Some(event),
        Output::Publication(_) | Output::Task { .. } | Output::Reloaded(_) => None,
    }
}

/// Readings on time, one in each period.
pub(super) fn regular(values: impl IntoIterator<Item = f64>) -> Vec<Reading> {
    let at = |step: usize| step as i64 * PERIOD;
    values.into_iter().enumerate().map(|(step, value)| (at(step), at(step), value)).collect()
}

/// Readings with all kinds of faults, sometimes several at one moment.
fn readings() -> impl Strategy<Value = Vec<Reading>> {
    let value = prop_oneof![6 => -0.2..0.2, 1 => Just(f64::NAN), 1 => Just(90.0), 1 => Just(20.0)];
    let delay = prop_oneof![6 => Just(0_i64), 1 => Just(PERIOD), 2 => Just(500_000_000)];
    let one = (prop_oneof![5 => Just(1_i64), 1 => Just(0)], delay, value);
    prop::collection::vec(one, 1..80).prop_map(|steps| {
        let mut received = 10 * PERIOD;
        let read = |(gap, delay, value)| {
            received += gap * PERIOD;
            (received - delay, received, value)
        };
        steps.into_iter().map(read).collect()
    })
}

/// The readings by moment of reception, ascending.
fn moments(readings: &[Reading]) -> Vec<Vec<Reading>> {
    let mut moments: Vec<Vec<Reading>> = Vec::new();
    for &reading in readings {
        match moments.last_mut().filter(|moment| moment[0].1 == reading.1) {
            Some(moment) => moment.push(reading),
            None => moments.push(vec![reading]),
        }
    }
    moments
}

/// Whether the newest of the last `n` flags is set, and at least `k` of them.
fn shows(flags: &[bool], n: usize, k: usize) -> bool {
    let window = &flags[flags.len().saturating_sub(n)..];
    window.last() == Some(&true) && window.iter().filter(|flag| **flag).count() >= k
}

/// The first fault by definition, from the whole past of each moment, as long as no value is too fast.
fn first_fault(readings: &[Reading]) -> Option<(Time, Symptom)> {
    let moments = moments(readings);
    let (mut invalid, mut outside, mut back, mut late) = (vec![], vec![], vec![], vec![]);
    for (at, moment) in moments.iter().enumerate() {
        let newest_before =
            at.checked_sub(1).map(|before| moments[before].iter().map(|it| it.0).max().unwrap());
        invalid.push(moment.iter().any(|reading| reading.2.is_nan()));
        outside.push(moment.iter().any(|reading| reading.2.abs() > 50.0 + ERROR));
        late.push(moment.iter().any(|reading| reading.1 - reading.0 > 310_000_000));
        back.push(moment.iter().any(|it| newest_before.is_some_and(|before| it.0 + 20_000_000 < before)));
        let faults = [
            (shows(&invalid, 12, 6), Symptom::Invalid),
            (shows(&outside, 12, 6), Symptom::OutOfRange),
            (shows(&back, 4, 2), Symptom::OutOfOrder),
            (shows(&late, 4, 3), Symptom::Late),
        ];
        if let Some((_, symptom)) = faults.into_iter().find(|(shown, _)| *shown) {
            return Some((Time(moment[0].1), symptom));
        }
    }
    None
}

/// Whether the event reports a fault of a signal's own readings.
fn shows_readings(event: &Event) -> bool {
    event.because.iter().any(|reason| matches!(reason, Reason::Readings { .. }))
}

proptest! {
    #[test]
    fn the_first_fault_is_that_of_the_definition(readings in readings()) {
        // Without jumps and repeated readings, which the definition does not cover.
        let mut readings = readings;
        readings.iter_mut().for_each(|reading| if reading.2 == 20.0 { reading.2 = 90.0 });
        let mut number = 0.0;
        readings.iter_mut().filter(|reading| reading.2.abs() < 1.0).for_each(|reading| {
            number += 1e-6;
            reading.2 = number;
        });
        let run = Run::of(&readings);
        // A timeout of the same signal may be reported first, or drop later readings.
        let expected = first_fault(&readings);
        let failed = run.events(EventKind::Failed);
        let found = failed.iter().find(|event| shows_readings(event));
        let found = found.map(|event| (event.time, event.symptom.unwrap()));
        let is_told_before = |(time, _): &(Time, Symptom)| failed.iter().any(|event| event.time <= *time && !shows_readings(event));
        if !expected.as_ref().is_some_and(is_told_before) {
            prop_assert_eq!(found, expected);
        }
        let count = |is: fn(&Reading) -> bool| readings.iter().filter(|reading| is(reading)).count() as u64;
        prop_assert_eq!(run.counts().invalid, count(|reading| reading.2.is_nan()));
        prop_assert_eq!(run.counts().out_of_range, count(|reading| reading.2 == 90.0));
        prop_assert_eq!(run.counts().late, count(|reading| reading.1 - reading.0 == 500_000_000));
    }

    #[test]
    fn the_order_within_a_moment_makes_no_difference(readings in readings(), seed in any::<u64>()) {
        let mut shuffled = Vec::new();
        for (at, mut moment) in moments(&readings).into_iter().enumerate() {
            if seed >> (at % 64) & 1 == 1 {
                moment.reverse();
            }
            shuffled.extend(moment);
        }
        let (one, other) = (Run::of(&readings), Run::of(&shuffled));
        let events = |run: &Run| format!("{:?}", [EventKind::Failed, EventKind::Silent, EventKind::Restored].map(|kind| run.events(kind).into_iter().cloned().collect::<Vec<_>>()));
        prop_assert_eq!(events(&one), events(&other));
        let counts = |run: &Run| {
            let counts = run.counts();
            (counts.too_fast, counts.late, counts.out_of_order, counts.invalid, counts.out_of_range)
        };
        prop_assert_eq!(counts(&one), counts(&other));
    }

    /// The truth keeps its rate, readings keep their errors, and a value may be held between two measurements.
    #[test]
    fn a_sound_signal_is_never_accused(
        steps in prop::collection::vec((-1.0..=1.0_f64, -1.0..=1.0_f64, -10_000_000..=10_000_000_i64, 0..290_000_000_i64), 2..120),
        hold in 1..5_usize,
    ) {
        let (mut truth, mut readings, mut reading) = (0.0, Vec::new(), 0.0);
        for (at, (slope, error, early, delay)) in steps.into_iter().enumerate() {
            truth += slope * MAX_RATE * 0.2;
            if at % hold == 0 {
                reading = truth + error * ERROR;
            }
            let moment = 1_000_000_000 + at as i64 * PERIOD;
            let (early, delay) = if hold == 1 { (early, delay) } else { (0, 0) };
            readings.push((moment - early, moment + delay, reading));
        }
        readings.sort_by_key(|reading| reading.1);
        let run = Run::of(&readings);
        let counts = run.counts();
        prop_assert_eq!((counts.too_fast, counts.late, counts.invalid, counts.out_of_range), (0, 0, 0, 0));
        let failed = run.events(EventKind::Failed);
        prop_assert!(failed.iter().all(|event| event.symptom == Some(Symptom::OutOfOrder)), "{:?}", failed);
        if counts.out_of_order < 2 {
            prop_assert_eq!(failed.len(), 0);
        }
    }

    /// A few glitches are never published, and accuse no signal.
    #[test]
    fn glitches_are_kept_out_for_good(gaps in prop::collection::vec(4..9_usize, 1..5), height in 5.0..49.0_f64, seed in any::<u32>()) {
        let mut values = Vec::new();
        for (at, gap) in gaps.iter().enumerate() {
            values.extend((0..*gap).map(|step| 0.05 * (step % 2) as f64));
            values.push(if seed >> (at % 32) & 1 == 1 { height } else { -height });
        }
        values.extend([0.0, 0.05, 0.0]);
        let run = Run::of(&regular(values));
        prop_assert_eq!(run.events(EventKind::Failed).len(), 0);
        prop_assert_eq!(run.counts().too_fast, gaps.len() as u64);
        prop_assert!(run.published().iter().all(|(_, value)| value.abs() < 0.1), "{:?}", run.published());
        prop_assert!(run.published().len() > gaps.iter().sum::<usize>() - 2);
    }

    /// A lasting new level is reported once, and published after the probation, as no other source is left: whether the plant or
    /// the sensor jumped is unknown.
    #[test]
    fn a_new_level_is_not_locked_out(before in 4..40_usize, height in 5.0..49.0_f64, is_up in any::<bool>()) {
        let level = if is_up { height } else { -height };
        let noise = |step: usize| 0.05 * (step % 2) as f64;
        let values = (0..before).map(noise).chain((0..60).map(|step| level + noise(step)));
        let run = Run::of(&regular(values));
        let failed = run.events(EventKind::Failed);
        prop_assert_eq!(failed.len(), 1);
        prop_assert_eq!((failed[0].symptom, failed[0].time), (Some(Symptom::TooFast), Time((before as i64 + 1) * PERIOD)));
        prop_assert_eq!(run.events(EventKind::Restored).len(), 0);
        let unproven = run.events(EventKind::Suspected);
        prop_assert_eq!(unproven.len(), 1);
        let wait = unproven[0].time - failed[0].time;
        prop_assert!(wait >= Span::from_millis(5_000) && wait < Span::from_millis(6_500), "{:?}", wait);
        let between = |time: Time| time >= failed[0].time && time < unproven[0].time;
        prop_assert!(!run.published().iter().any(|(time, _)| between(*time)));
        // Neither the new level nor the old one can be excluded.
        let after = run.intervals().into_iter().filter(|(time, _)| *time > failed[0].time);
        let holding = after.filter(|(_, value)| value.contains(level) && value.contains(0.0));
        prop_assert!(holding.count() > 20);
        prop_assert_eq!(run.engine.verdict(SignalId::from_index(0)), Verdict::Unknown);
    }
}

/// Events and publications of a temperature signal that jumps erratically.
#[test]
fn a_signal_that_jumps_about_stays_failed_and_is_not_published() {
    let erratic = (0..200_u64).map(|step| (step.wrapping_mul(7_919) % 97) as f64 - 48.0);
    let run = Run::of(&regular((0..20).map(|_| 0.0).chain(erratic)));
    let failed = run.events(EventKind::Failed);
    assert_eq!(failed.len(), 1);
    assert_eq!(failed[0].symptom, Some(Symptom::TooFast));
    assert_eq!(run.events(EventKind::Restored).len(), 0);
    let after = run.published().into_iter().filter(|(time, _)| *time > failed[0].time).count();
    assert_eq!(after, 0);
}

/// A single outlier is dropped and forgotten; a signal with recurring outliers is faulty until they stop.
#[test]
fn outliers_that_come_again_and_again_are_a_fault() {
    let sound = |step: usize| 0.05 * (step % 2) as f64;
    let spikes = (0..300).map(|step| if step % 10 == 9 { 20.0 } else { sound(step) });
    let run = Run::of(&regular(spikes.chain((0..200).map(sound))));
    let failed = run.events(EventKind::Failed);
    assert_eq!(failed.len(), 1, "{failed:?}");
    assert_eq!(failed[0].symptom, Some(Symptom::TooFast));
    assert!(failed[0].time > Time(40 * PERIOD) && failed[0].time < Time(90 * PERIOD), "{:?}", failed[0]);
    assert_eq!(failed[0].because.iter().last(), Some(&Reason::Readings { bad: 5, of: 64 }));
    let restored = run.events(EventKind::Restored);
    assert_eq!(restored.len(), 1);
    assert!(restored[0].time > Time(300 * PERIOD), "{:?}", restored[0]);
    assert!(run.published().iter().all(|(_, value)| value.abs() < 0.1));
}

#[test]
fn reasons_have_numbers() {
    let late: Vec<Reading> = (5..12).map(|step| (step * PERIOD - 620_000_000, step * PERIOD, 0.0)).collect();
    let run = Run::of(&late);
    let late = Reason::ArrivedLate { after: Span::from_millis(620), allowed: Span::from_millis(300) };
    let expected = Reasons::from(late).then(Joint::With, Reason::Readings { bad: 3, of: 3 });
    assert_eq!(run.events(EventKind::Failed)[0].because, expected);
    let jump = (0..8).map(|step| if step < 4 { 0.001 * f64::from(step) } else { 20.0 });
    let run = Run::of(&regular(jump));
    let range = |value: f64| Range { lo: value - 0.1, hi: value + 0.1, unit: None };
    let failed = run.events(EventKind::Failed);
    let reported: Vec<&Reason> = failed[0].because.iter().collect();
    let [Reason::TooFast { from, to, within, most }, readings] = reported[..] else { panic!("{reported:?}") };
    for (found, expected) in [(from, range(0.003)), (to, range(20.0))] {
        let (lo, hi) = (found.lo - expected.lo, found.hi - expected.hi);
        assert!(lo.abs() < 1e-9 && hi.abs() < 1e-9 && found.unit.is_none(), "{found:?}");
    }
    assert_eq!((*within, most), (Span::from_millis(420), &Amount { value: 2.0, unit: None }));
    assert_eq!(*readings, Reason::Readings { bad: 2, of: 4 });
}
