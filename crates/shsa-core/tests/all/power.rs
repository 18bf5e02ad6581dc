//! What a comparison is worth: random systems in which an agreement could not have been a conflict, or a fault would show alike on both
//! sides.

use crate::trust::{Run, text};
use proptest::prelude::*;
use shsa_core::engine::EventKind;
use shsa_core::knowledge::{Bounds, Draft, Id, KnowledgeBase, SignalDraft, VariableDraft, build};

/// Signals of one variable within -1000 and 1000, with their errors and the origins of each.
fn knowledge(signals: &[(f64, Vec<usize>)]) -> KnowledgeBase {
    let name = |number: &usize| text(&format!("s{number}"));
    let signal = |(number, (error, derived_from)): (usize, &(f64, Vec<usize>))| SignalDraft {
        name: name(&number),
        variable: Some(text("x")),
        rate: Some(text("2 Hz")),
        value_error: Some(Bounds::One(text(&format!("{error}")))),
        derived_from: derived_from.iter().map(name).collect(),
        ..SignalDraft::default()
    };
    let range = Some((text("-1000"), text("1000")));
    let (knowledge, problems) = build(&Draft {
        variables: vec![VariableDraft { name: text("x"), range, ..VariableDraft::default() }],
        signals: signals.iter().enumerate().map(signal).collect(),
        ..Draft::default()
    });
    let errors: Vec<_> = problems.iter().filter(|it| format!("{it:?}").contains("Error")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

/// A minute and a half of signals at 20, each off by a constant; one of them is off by `fault` from 30 to 50 s. What says nothing has
/// no value.
fn run(signals: &[(f64, Vec<usize>)], off: &[Option<f64>], liar: usize, fault: f64) -> Run {
    let mut run = Run::new(knowledge(signals));
    for step in 0..180_i64 {
        let now = step * 500_000_000;
        run.pass(now);
        for (number, off) in off.iter().enumerate().filter_map(|(number, off)| Some((number, (*off)?))) {
            let is_faulty = number == liar && (60..100).contains(&step);
            run.give(number, now, now, 20.0 + off + if is_faulty { fault } else { 0.0 });
        }
    }
    run
}

fn fault() -> impl Strategy<Value = f64> {
    prop_oneof![-40.0..-6.0_f64, 6.0..40.0_f64]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// What all of them descend from would move all of them alike: it does not explain that one differs.
    #[test]
    fn of_those_with_one_ancestor_the_one_that_differs_is_named(
        off in prop::collection::vec(-0.9..0.9_f64, 3..6),
        liar in 0..6_usize,
        fault in fault(),
        ancestor in prop::option::of(-0.9..0.9_f64),
    ) {
        let liar = 1 + liar % off.len();
        let mut signals = vec![(1.0, Vec::new())];
        signals.extend(off.iter().map(|_| (1.0, vec![0])));
        let off: Vec<Option<f64>> = core::iter::once(ancestor).chain(off.into_iter().map(Some)).collect();
        let run = run(&signals, &off, liar, fault);
        prop_assert!(run.accused().iter().all(|it| it.index() == liar));
        prop_assert_eq!(run.events(EventKind::Failed).len(), 1);
    }

    /// Of two that contradict each other, none is named by signals so inexact that they agree with both.
    #[test]
    fn what_agrees_with_everything_names_nobody(
        vacuous in 0..6_usize,
        error in 520.0..900.0_f64,
        liar in 0..2_usize,
        fault in fault(),
    ) {
        let mut signals = vec![(1.0, Vec::new()); 2];
        signals.extend(vec![(error, Vec::new()); vacuous]);
        let run = run(&signals, &vec![Some(0.0); signals.len()], liar, fault);
        prop_assert_eq!(run.events(EventKind::Failed).len(), 0);
        let accused: Vec<usize> = run.accused().into_iter().map(Id::index).collect();
        prop_assert_eq!(accused, vec![0, 1]);
    }
}
