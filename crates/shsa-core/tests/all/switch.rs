//! How soon a source is replaced: at its deadline or with its first wrong value, by the known value of the next one.

use crate::driven::text;
use shsa_core::engine::{Engine, Input, Options, Output, Publication, PublishedValue, Quality};
use shsa_core::knowledge::{Bounds, Draft, Id, NeedDraft, SignalDraft, SignalId, VariableDraft, build};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};
use std::ops::Range;

const MS: i64 = 1_000_000;
/// The period of each signal; the three signals are a third of it apart.
const PERIOD_MS: i64 = 99;
/// The first signal is wrong from this time on.
const BREAKS_MS: i64 = 5_000;

fn engine() -> Engine {
    let signal = |name: &str| SignalDraft {
        name: text(name),
        variable: Some(text("v")),
        value_error: Some(Bounds::One(text("0.1"))),
        timeout: Some(text("120 ms")),
        ..SignalDraft::default()
    };
    let draft = Draft {
        variables: vec![VariableDraft { name: text("v"), ..VariableDraft::default() }],
        signals: ["a", "b", "c"].map(signal).into(),
        needs: vec![NeedDraft { variable: text("v"), max_age: Some(text("2 s")), ..NeedDraft::default() }],
        ..Draft::default()
    };
    Engine::new(build(&draft).0, Options::default())
}

/// All outputs for the given values: `said` gets the number of the signal, the time in ms, and the right value.
fn run(stated: impl Fn(i64, i64, f64) -> Option<f64>) -> Vec<Output> {
    go_on(&mut engine(), 0..8_000, stated)
}

/// As [`run`], of an engine and a time.
fn go_on(
    engine: &mut Engine,
    time: Range<i64>,
    stated: impl Fn(i64, i64, f64) -> Option<f64>,
) -> Vec<Output> {
    let mut outputs = Vec::new();
    for ms in time {
        let now = Time(ms * MS);
        while let Some(due) = engine.next_deadline().filter(|due| *due <= now) {
            engine.handle(Input::Tick(due));
            outputs.extend(std::iter::from_fn(|| engine.poll()));
        }
        let Some(at) = (0..3).find(|at| ms % PERIOD_MS == at * PERIOD_MS / 3) else { continue };
        let right = 1.0 + (ms % 7) as f64 * 0.001;
        if let Some(value) = stated(at, ms, right).map(RawValue::Number) {
            let signal = SignalId::from_index(at as usize);
            engine.handle(Input::Observation(Observation { signal, stamp: now, received: now, value }));
            engine.handle(Input::Tick(now));
            outputs.extend(std::iter::from_fn(|| engine.poll()));
        }
    }
    outputs
}

fn publications(outputs: &[Output]) -> impl Iterator<Item = &Publication> {
    outputs.iter().filter_map(|output| match output {
        Output::Publication(publication) => Some(publication),
        _ => None,
    })
}

#[track_caller]
fn check(wrong: Option<f64>, at: Span) {
    let outputs = run(|signal, ms, right| if signal == 0 && ms >= BREAKS_MS { wrong } else { Some(right) });
    let first =
        publications(&outputs).find(|publication| publication.quality == Quality::Substitute).unwrap();
    assert_eq!(first.time, Time(0) + at);
    assert!(first.time - first.validity.to <= Span(PERIOD_MS * MS), "{first:?}");
    // No value is older than an earlier one, and no value is wrong.
    let stamps: Vec<Time> = publications(&outputs).map(|publication| publication.validity.to).collect();
    assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]));
    let is_right = |publication: &Publication| match &publication.value {
        PublishedValue::Scalar(value) => (0.8..1.2).contains(&value.midpoint()),
        PublishedValue::Vector(_) => false,
    };
    assert!(publications(&outputs).all(is_right));
}

/// The last value of the signal is from 4.950 s. The signal is silent when no value comes for longer than 120 ms.
#[test]
fn a_silent_source_is_replaced_at_its_deadline() {
    check(None, Span::from_millis(4_950 + 120) + Span(1));
}

/// The first wrong value would come at 5.049 s.
#[test]
fn a_wrong_value_is_replaced_at_once() {
    check(Some(9.0), Span::from_millis(5_049));
}

/// All signals are silent for two seconds; then the source gives values first, and the others from `others` on.
fn after_a_silence(source: Option<f64>, others: i64) -> Vec<(i64, Quality)> {
    let outputs = run(|signal, ms, right| match ms {
        ..2_000 => Some(right),
        4_000.. if signal == 0 => source.or(Some(right)),
        ms if ms >= others.max(4_000) => Some(right),
        _ => None,
    });
    let after = publications(&outputs).filter(|publication| publication.time >= Time(4_000 * MS));
    let is_source = |publication: &&Publication| match &publication.value {
        PublishedValue::Scalar(value) => source.is_none_or(|source| (value.midpoint() - source).abs() < 0.5),
        PublishedValue::Vector(_) => false,
    };
    after.filter(is_source).map(|publication| (publication.time.0 / MS, publication.quality)).collect()
}

#[test]
fn who_speaks_first_after_a_silence_of_all_is_good_when_another_one_agrees() {
    let good = |reported: &[(i64, Quality)]| {
        reported.iter().find(|reported| reported.1 == Quality::Good).map(|reported| reported.0)
    };
    // The source gives a value at 4.059 s, the next signal at 4.488 s.
    let reported = after_a_silence(None, 4_480);
    assert_eq!(reported.first().map(|reported| reported.1), Some(Quality::Uncertain), "{reported:?}");
    let first = good(&reported).unwrap();
    assert!((4_480..4_700).contains(&first), "{reported:?}");
    // Where no other signal can agree, the source is trusted after a second.
    let reported = after_a_silence(None, 9_000);
    let first = good(&reported).unwrap();
    assert!((5_000..5_300).contains(&first), "{reported:?}");
    // A faulty source is never good.
    assert_eq!(good(&after_a_silence(Some(9.0), 4_480)), None);
}

/// Its time-out passes before its first value, at 1.089 s: it has no fault to recover from, and serves with its next value.
#[test]
fn a_source_that_begins_late_waits_for_no_probation() {
    let outputs = run(|signal, ms, right| (signal != 0 || ms >= 1_000).then_some(right));
    let good = publications(&outputs).find(|publication| publication.quality == Quality::Good).unwrap();
    assert_eq!(good.time, Time((1_089 + PERIOD_MS) * MS));
}

/// What nobody has ever confirmed, where others could have, is not known to be right.
#[test]
fn a_source_whose_witnesses_never_spoke_is_uncertain_until_one_does() {
    let qualities = |others: i64| {
        let outputs = run(|signal, ms, right| (signal == 0 || ms >= others).then_some(right));
        let late = publications(&outputs).filter(|publication| publication.time >= Time(1_000 * MS));
        late.map(|publication| (publication.time.0 / MS, publication.quality)).collect::<Vec<_>>()
    };
    let never = qualities(i64::MAX);
    assert!(never.len() > 60 && never.iter().all(|it| it.1 == Quality::Uncertain), "{never:?}");
    let late = qualities(4_000);
    let is_right = |it: &(i64, Quality)| match it.0 {
        ..4_000 => it.1 == Quality::Uncertain,
        4_000..4_200 => true,
        _ => it.1 == Quality::Good,
    };
    assert!(late.iter().all(is_right), "{late:?}");
    // Whom others have confirmed before they fell silent, is.
    let outputs = run(|signal, ms, right| (signal == 0 || ms < 3_000).then_some(right));
    let after = publications(&outputs).filter(|publication| publication.time >= Time(3_000 * MS));
    assert!(after.map(|publication| publication.quality).all(|it| it == Quality::Good));
    // A restart remembers that, where the state does.
    let mut before = engine();
    go_on(&mut before, 0..3_000, |_, _, right| Some(right));
    for (confirmed, quality) in [(true, Quality::Good), (false, Quality::Uncertain)] {
        let mut snapshot = before.snapshot();
        assert_eq!(snapshot.confirmed, ["a", "b", "c"]);
        snapshot.confirmed.retain(|_| confirmed);
        let mut after = engine();
        after.restore(&snapshot, Time(3_000 * MS));
        let outputs = go_on(&mut after, 3_000..8_000, |signal, _, right| (signal == 0).then_some(right));
        assert!(publications(&outputs).count() > 40);
        assert!(publications(&outputs).all(|publication| publication.quality == quality));
    }
}
