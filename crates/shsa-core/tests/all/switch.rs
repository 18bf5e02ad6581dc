//! How soon a source is replaced: at its deadline or with its first wrong value, by what the next one has said already.

use shsa_core::engine::{Engine, Input, Options, Output, Publication, PublishedValue, Quality};
use shsa_core::knowledge::{Bounds, Draft, Id, NeedDraft, SignalDraft, SignalId, Text, VariableDraft, build};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};

const MS: i64 = 1_000_000;
/// Each signal speaks once in so long, the three of them a third of it apart.
const PERIOD_MS: i64 = 99;
/// From then on the first one is wrong.
const BREAKS_MS: i64 = 5_000;

fn text(text: &str) -> Text {
    Text { text: text.to_owned(), ..Text::default() }
}

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

/// Everything that comes out while the first signal says this from the break on; `None`: it says nothing.
fn run(wrong: Option<f64>) -> Vec<Output> {
    let (mut engine, mut outputs) = (engine(), Vec::new());
    for ms in 0..8_000 {
        let now = Time(ms * MS);
        while let Some(due) = engine.next_deadline().filter(|due| *due <= now) {
            engine.handle(Input::Tick(due));
            outputs.extend(std::iter::from_fn(|| engine.poll()));
        }
        let Some(at) = (0..3).find(|at| ms % PERIOD_MS == at * PERIOD_MS / 3) else { continue };
        let right = 1.0 + (ms % 7) as f64 * 0.001;
        let value = if at == 0 && ms >= BREAKS_MS { wrong } else { Some(right) };
        if let Some(value) = value.map(RawValue::Number) {
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
    let outputs = run(wrong);
    let first =
        publications(&outputs).find(|publication| publication.quality == Quality::Substitute).unwrap();
    assert_eq!(first.time, Time(0) + at);
    assert!(first.time - first.validity.to <= Span(PERIOD_MS * MS), "{first:?}");
    // Nothing older comes after something newer, and nothing wrong at all.
    let stamps: Vec<Time> = publications(&outputs).map(|publication| publication.validity.to).collect();
    assert!(stamps.windows(2).all(|pair| pair[0] < pair[1]));
    let is_right = |publication: &Publication| match &publication.value {
        PublishedValue::Scalar(value) => (0.8..1.2).contains(&value.midpoint()),
        PublishedValue::Vector(_) => false,
    };
    assert!(publications(&outputs).all(is_right));
}

/// It spoke last at 4.950 s, and is silent when it has said nothing for longer than 120 ms.
#[test]
fn a_silent_source_is_replaced_at_its_deadline() {
    check(None, Span::from_millis(4_950 + 120) + Span(1));
}

/// Its first wrong value would come at 5.049 s.
#[test]
fn a_wrong_value_is_replaced_at_once() {
    check(Some(9.0), Span::from_millis(5_049));
}
