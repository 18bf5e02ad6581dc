//! What an addition to a model brings, against an analysis of the model that has it.

use super::{WATCH, random_model, with_parts};
use crate::plan_support::{KINDS, Random, knowledge, random};
use shsa_core::analysis::{Analysis, Candidate, Limited, Options, Tolerance, analyze};
use shsa_core::diagnosis::candidates::{Comparison, Component, explain};
use shsa_core::engine::{self, Engine, WatchBudget};
use shsa_core::knowledge::{
    Id, IdVec, KnowledgeBase, Need, Properties, Relation, Signal, SignalId, SignalSet, Switching, ValueError,
    VariableId, WhenUnsure,
};
use shsa_core::time::Span;
use std::collections::BTreeSet;

fn larger(knowledge: &KnowledgeBase, candidate: Candidate) -> KnowledgeBase {
    let (mut relations, mut signals) = (knowledge.relations().clone(), knowledge.signals().clone());
    match candidate {
        Candidate::Sensor(variable) => {
            signals.push(Signal {
                name: "added".to_owned(),
                variable,
                source: String::new(),
                unit: None,
                scaling: None,
                rate_hz: None,
                value_error: ValueError::default(),
                time_error: (Span::ZERO, Span::ZERO),
                delay: Span::ZERO,
                mean_over: Span::ZERO,
                noise: None,
                timeout: None,
                limits: Default::default(),
                derived_from: Vec::new(),
                properties: Properties::new(),
            });
        }
        Candidate::Relation(one, other) => {
            relations.push(Relation {
                name: "added".to_owned(),
                inputs: vec![one, other],
                outputs: vec![one, other],
                formulas: Vec::new(),
                condition: None,
                text: String::new(),
                properties: Properties::new(),
            });
        }
    }
    let needs: Vec<VariableId> = knowledge.needs().iter().map(|need| need.variable).collect();
    with_parts(knowledge, relations, signals, needs)
}

/// What is added brings what a whole new analysis says, though only the part that it can change is looked at.
#[test]
fn additions_bring_what_a_new_analysis_says() {
    let mut helpful = 0;
    for seed in 0..60 {
        let knowledge = with_units(random_model(seed));
        let before = analyze(&knowledge, Options::default());
        if before.limited.iter().any(|limited| !matches!(limited, Limited::Needs { .. })) {
            continue;
        }
        for addition in &before.additions {
            let after = analyze(&larger(&knowledge, addition.candidate), WITHOUT_ADDITIONS);
            let signals = || knowledge.signals().ids();
            let newly = |is: &dyn Fn(&Analysis, SignalId) -> bool| -> SignalSet {
                signals().filter(|&signal| is(&after, signal) && !is(&before, signal)).collect()
            };
            let pairs = |analysis: &Analysis| {
                let told =
                    |signal| signals().filter(|&s| analysis.faults.is_isolable_from(signal, s)).count();
                signals().map(told).sum::<usize>()
            };
            let case = format!("seed {seed}: {:?}", addition.candidate);
            assert_eq!(addition.detectable, newly(&|a, s| a.faults.is_detectable(s)), "{case}");
            assert_eq!(addition.substitutable, newly(&|a, s| a.is_substitutable(s)), "{case}");
            assert_eq!(addition.isolable_pairs, pairs(&after).saturating_sub(pairs(&before)), "{case}");
            for survives in &addition.survives {
                assert_eq!(survives.now, before.needs[survives.need], "{case}");
                assert_eq!(survives.then.survives, after.needs[survives.need].survives, "{case}");
            }
            helpful += 1;
        }
    }
    assert!(helpful > 200, "{helpful}");
}
