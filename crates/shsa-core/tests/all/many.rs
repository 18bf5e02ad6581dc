//! Many sensors of one variable: comparing each with some others isolates faulty sensors as well as comparing all pairs.

use crate::driven::text;
use proptest::prelude::*;
use shsa_core::engine::{Engine, Input, Options};
use shsa_core::knowledge::{Bounds, Draft, Id, SignalDraft, SignalId, VariableDraft, build};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_core::trust::Verdict;

/// An engine with this many sensors at 1 Hz with an error of 0.3.
fn engine(count: usize) -> Engine {
    let signal = |at| SignalDraft {
        name: text(format!("s{at}")),
        variable: Some(text("x")),
        rate: Some(text("1 Hz")),
        value_error: Some(Bounds::One(text("0.3"))),
        ..SignalDraft::default()
    };
    let draft = Draft {
        variables: vec![VariableDraft { name: text("x"), ..VariableDraft::default() }],
        signals: (0..count).map(signal).collect(),
        ..Draft::default()
    };
    Engine::new(build(&draft).0, Options::default())
}

/// The failed and the suspected sensors, ten seconds after the faults began.
fn verdicts(count: usize, liars: &[(usize, f64)], noise: &[f64]) -> (Vec<usize>, Vec<usize>) {
    let mut engine = engine(count);
    for second in 0..20_i64 {
        for at in 0..count {
            let lie = liars.iter().find(|(liar, _)| *liar == at && second >= 10).map_or(0.0, |(_, lie)| *lie);
            let noise = noise[(at * 7 + second as usize) % noise.len()];
            let now = Time(second * 1_000_000_000 + at as i64 * 1_000);
            let value = RawValue::Number(20.0 + noise + lie);
            let signal = SignalId::from_index(at);
            engine.handle(Input::Observation(Observation {
                signal,
                stamp: Time(second * 1_000_000_000),
                received: now,
                value,
            }));
        }
    }
    engine.handle(Input::Tick(Time(21_000_000_000)));
    let of = |verdict| (0..count).filter(|&at| engine.verdict(SignalId::from_index(at)) == verdict).collect();
    (of(Verdict::Failed), of(Verdict::Suspect))
}

#[test]
fn every_one_of_two_hundred_is_watched() {
    for liar in [3, 40, 150, 199] {
        let (failed, suspect) = verdicts(200, &[(liar, 5.0)], &[0.1, -0.2, 0.0]);
        assert_eq!((failed, suspect), (vec![liar], vec![]));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn several_liars_among_many_are_named(
        count in 20_usize..90, liars in prop::collection::btree_set(0_usize..20, 1..4), noise in prop::collection::vec(-0.25..0.25_f64, 5..30),
    ) {
        let lies: Vec<(usize, f64)> = liars.iter().enumerate().map(|(number, &at)| (at, 4.0 + 3.0 * number as f64)).collect();
        let (failed, suspect) = verdicts(count, &lies, &noise);
        prop_assert_eq!(failed, liars.into_iter().collect::<Vec<_>>());
        prop_assert_eq!(suspect, Vec::<usize>::new());
    }
}
