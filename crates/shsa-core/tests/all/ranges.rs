//! A computed value outside of its variable's range: evidence against what it is computed from, and of no use to a need. Within the
//! range nothing is shown.

use crate::trust::{Run, text};
use proptest::prelude::*;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Id, KnowledgeBase, NeedDraft, RelationDraft, SignalDraft, VariableDraft, build,
};

const TOP: f64 = 10.0;

/// A level from 0 to 10 that is the difference of two measured numbers, and maybe a sensor of its own.
fn knowledge(has_third: bool) -> KnowledgeBase {
    let variable = |(name, lo, hi): (&str, &str, &str)| VariableDraft {
        name: text(name),
        range: Some((text(lo), text(hi))),
        ..VariableDraft::default()
    };
    let signal = |variable: &str| SignalDraft {
        name: text(&format!("/{variable}")),
        variable: Some(text(variable)),
        rate: Some(text("2 Hz")),
        value_error: Some(Bounds::One(text("0.1"))),
        ..SignalDraft::default()
    };
    let mut signals = vec![signal("over"), signal("gap")];
    signals.extend(has_third.then(|| signal("level")));
    let relation = RelationDraft {
        directions: Some(vec![text("level")]),
        ..RelationDraft::new(text("hung"), BodyDraft::Equation(text("level = over - gap")))
    };
    let need = NeedDraft { variable: text("level"), max_age: Some(text("3 s")), ..NeedDraft::default() };
    let (knowledge, problems) = build(&Draft {
        variables: [("level", "0", "10"), ("over", "0", "100"), ("gap", "0", "100")].map(variable).to_vec(),
        relations: vec![relation],
        signals,
        needs: vec![need],
        ..Draft::default()
    });
    let errors: Vec<_> = problems.iter().filter(|it| format!("{it:?}").contains("Error")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    knowledge
}

/// A minute; the gap is off by `fault` from 20 to 40 s. Where there is a sensor of the level, it is silent from 10 s on.
fn run(level: f64, off: f64, fault: f64, has_third: bool) -> Run {
    let mut run = Run::new(knowledge(has_third));
    for step in 0..120_i64 {
        let now = step * 500_000_000;
        run.pass(now);
        // The inputs move, so that they can be cleared.
        let (over, moved) = (20.0 + 0.01 * (step % 7) as f64, 0.01 * (step % 7) as f64);
        let wrong = if (40..80).contains(&step) { fault } else { 0.0 };
        run.give(0, now, now, over + off);
        run.give(1, now, now, 20.0 - level + moved - off + wrong);
        if has_third && step < 20 {
            run.give(2, now, now, level);
        }
    }
    run
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_is_impossible_accuses_and_serves_nobody(
        level in 0.5..9.5_f64, off in -0.09..0.09_f64, beyond in 0.5..5.0_f64, is_above: bool, has_third: bool,
    ) {
        let fault = if is_above { level - TOP - beyond } else { level + beyond };
        let run = run(level, off, fault, has_third);
        let accused: Vec<usize> = run.accused().iter().map(|id| id.index()).collect();
        prop_assert!(accused.contains(&1) && !accused.contains(&2), "{accused:?}");
        let mut is_back = false;
        for (time, value) in run.trusted() {
            let seconds = time.seconds();
            prop_assert!(0.0 <= value.lo() && value.hi() <= TOP && !value.is_empty(), "{value:?}");
            prop_assert!(value.contains(level), "{value:?} at {seconds} s for {level}");
            is_back |= seconds > 55.0;
        }
        // What agrees with the range again is trusted again.
        prop_assert!(is_back);
    }

    #[test]
    fn what_is_possible_accuses_nobody(
        level in 0.0..10.0_f64, off in -0.09..0.09_f64, share in 0.0..1.0_f64, has_third: bool,
    ) {
        // The fault leaves a level within the range: no other comparison shows it.
        let other = share * TOP;
        let run = run(level, off, level - other, has_third);
        prop_assert!(run.accused().is_empty(), "{:?}", run.accused());
        let within = run.trusted().all(|(_, value)| 0.0 <= value.lo() && value.hi() <= TOP);
        prop_assert!(within);
    }
}
