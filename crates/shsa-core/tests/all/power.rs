//! What a comparison is worth: random systems in which an agreement could not have been a conflict, or a fault would show alike on both
//! sides.

use crate::trust::{Run, text};
use proptest::prelude::*;
use shsa_core::engine::EventKind;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Id, KnowledgeBase, RelationDraft, SignalDraft, VariableDraft, build,
};

/// Signals of variables within -1000 and 1000, with equations for one variable each.
fn knowledge(variables: &[&str], equations: &[(&str, &str)], signals: Vec<SignalDraft>) -> KnowledgeBase {
    let variable = |name: &&str| VariableDraft {
        name: text(name),
        range: Some((text("-1000"), text("1000"))),
        ..VariableDraft::default()
    };
    let relation = |(equation, of): &(&str, &str)| RelationDraft {
        directions: Some(vec![text(of)]),
        ..RelationDraft::new(text(&format!("to_{of}")), BodyDraft::Equation(text(equation)))
    };
    let (knowledge, problems) = build(&Draft {
        variables: variables.iter().map(variable).collect(),
        relations: equations.iter().map(relation).collect(),
        signals,
        ..Draft::default()
    });
    let errors: Vec<_> = problems.iter().filter(|it| format!("{it:?}").contains("Error")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

/// A minute and a half of signals at 20, each off by a constant; one of them is off by `fault` from 30 to 50 s. What says nothing has
/// no value.
fn run(knowledge: KnowledgeBase, off: &[Option<f64>], liar: usize, fault: f64) -> Run {
    let mut run = Run::new(knowledge);
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

/// A level, and two sensors of how fast it rises.
fn level_and_rates() -> KnowledgeBase {
    let signal = |(name, variable, error): (&str, &str, &str)| SignalDraft {
        name: text(name),
        variable: Some(text(variable)),
        rate: Some(text("10 Hz")),
        value_error: Some(Bounds::One(text(error))),
        ..SignalDraft::default()
    };
    let variable = |name| VariableDraft { name: text(name), ..VariableDraft::default() };
    let rising = RelationDraft {
        directions: Some(vec![text("rise")]),
        error: Some(Bounds::One(text("0.1"))),
        ..RelationDraft::new(text("rising"), BodyDraft::Equation(text("rise = derivative(level, 1 s)")))
    };
    let (knowledge, problems) = build(&Draft {
        variables: ["level", "rise"].map(variable).into(),
        relations: vec![rising],
        signals: [("float", "level", "0.02"), ("in", "rise", "0.05"), ("out", "rise", "0.05")]
            .map(signal)
            .into(),
        ..Draft::default()
    });
    let errors: Vec<_> = problems.iter().filter(|it| format!("{it:?}").contains("Error")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// What all of them descend from would move all of them alike: it does not explain that one differs. The others agree by more than
    /// a little: with two that only just agree, the one that differs would stay suspect, alone.
    #[test]
    fn of_those_with_one_ancestor_the_one_that_differs_is_named(
        off in prop::collection::vec(-0.7..0.7_f64, 3..6),
        liar in 0..6_usize,
        fault in fault(),
        ancestor in prop::option::of(-0.7..0.7_f64),
    ) {
        let liar = 1 + liar % off.len();
        let one = |number| SignalDraft {
            derived_from: if number > 0 { vec![text("s0")] } else { Vec::new() },
            ..signal_of((number, &("x", 1.0, 0.01)))
        };
        let knowledge = knowledge(&["x"], &[], (0..=off.len()).map(one).collect());
        let off: Vec<Option<f64>> = core::iter::once(ancestor).chain(off.into_iter().map(Some)).collect();
        let run = run(knowledge, &off, liar, fault);
        prop_assert!(run.accused().iter().all(|it| it.index() == liar));
        prop_assert_eq!(run.events(EventKind::Failed).len(), 1);
    }

    /// Of two that contradict each other, none is named because others, so inexact that they would agree anyway, agree with it.
    #[test]
    fn what_agrees_with_everything_names_nobody(
        vacuous in 0..7_usize,
        error in 520.0..900.0_f64,
        priors in (0.01..0.06_f64, 0.01..0.06_f64),
        liar in 0..2_usize,
        fault in fault(),
    ) {
        let mut signals = vec![("x", 1.0, priors.0), ("w", 1.0, priors.1)];
        signals.extend(vec![("z", error, 0.01); vacuous]);
        let signals: Vec<SignalDraft> = signals.iter().enumerate().map(signal_of).collect();
        // What the second one measures is also known by the others, and not what the first one measures.
        let knowledge = knowledge(&["x", "w", "z"], &[("x = w", "x"), ("z = w", "z")], signals);
        let run = run(knowledge, &vec![Some(0.0); 2 + vacuous], liar, fault);
        prop_assert_eq!(run.events(EventKind::Failed).len(), 0);
        let accused: Vec<usize> = run.accused().into_iter().map(Id::index).collect();
        prop_assert_eq!(accused, vec![0, 1]);
    }

    /// A level that has jumped, as its rates say, is off until it jumps back, also for a program that was restarted meanwhile.
    #[test]
    fn rates_that_agree_do_not_restore_a_level_after_a_restart(
        jump in prop_oneof![-40.0..-3.0_f64, 3.0..40.0_f64],
        pace in -1.0..1.0_f64,
        at in prop::option::of(36..56_i64),
    ) {
        let mut run = Run::new(level_and_rates());
        for step in 0..1_100_i64 {
            let (now, seconds) = (step * 100_000_000, step as f64 * 0.1);
            run.pass(now);
            if at.is_some_and(|at| step == 10 * at) {
                run.restart(level_and_rates(), now);
            }
            let off = if (300..600).contains(&step) { jump } else { 0.0 };
            run.give(0, now, now, 50.0 + pace * seconds + off);
            run.give(1, now, now, pace);
            run.give(2, now, now, pace);
        }
        prop_assert_eq!(run.events(EventKind::Failed).len(), 1);
        let restored: Vec<_> = run.events(EventKind::Restored).iter().map(|event| event.time.0 / 1_000_000_000).collect();
        prop_assert!(matches!(restored[..], [at] if at >= 60), "{:?}", restored);
    }
}

fn signal_of((number, &(variable, error, prior)): (usize, &(&str, f64, f64))) -> SignalDraft {
    SignalDraft {
        name: text(&format!("s{number}")),
        variable: Some(text(variable)),
        rate: Some(text("2 Hz")),
        value_error: Some(Bounds::One(text(&format!("{error}")))),
        properties: vec![(text("prior"), text(&format!("{prior}")))],
        ..SignalDraft::default()
    }
}
