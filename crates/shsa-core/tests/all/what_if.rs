//! The predicted sources after losses of signals, before the losses.

use crate::analysis::{WITHOUT_ADDITIONS, is_known, losses, random_model};
use crate::models::{System, car, climber, rover};
use shsa_core::analysis::tolerances;
use shsa_core::engine::{Engine, Options, Order, Subject, WhatIf};
use shsa_core::knowledge::{SignalId, SignalSet};
use shsa_core::substitution::Way;
use shsa_core::time::Time;

/// What would serve is what serves when it has come to it: whatever is lost, by order.
#[test]
fn what_would_serve_is_what_an_engine_turns_to() {
    let (mut compared, mut unhealed) = (0, 0);
    for System { knowledge, .. } in [car(), climber(), rover()] {
        let what_if = WhatIf::new(knowledge.clone());
        for lost in losses(knowledge.signals().len()) {
            let lost: Vec<SignalId> = lost.iter().collect();
            let mut engine = Engine::new(knowledge.clone(), Options::default());
            for &signal in &lost {
                let name = knowledge.signals()[signal].name.clone();
                engine.order(&Order::Forbid(Subject::Signal(name)), Time(0)).unwrap();
            }
            for need in knowledge.needs().ids() {
                let would: Vec<Way> = what_if.ways(need, &lost).into_iter().map(|(way, _)| way).collect();
                let does: Vec<Way> = engine.ways_to_serve(need).cloned().collect();
                assert_eq!(would, does, "without {lost:?}");
                compared += 1;
                unhealed += usize::from(would.is_empty());
            }
        }
    }
    assert!(compared > 40 && unhealed > 2, "{compared} compared, {unhealed} unhealed");
}

#[test]
fn what_is_survived_after_a_loss_is_what_trying_all_others_says() {
    for seed in 0..300 {
        let knowledge = random_model(seed);
        let signals = knowledge.signals().len();
        if signals > 8 {
            continue;
        }
        for lost in knowledge.signals().ids() {
            let needs = tolerances(&knowledge, &SignalSet::from_iter([lost]), WITHOUT_ADDITIONS);
            let more = |more: &SignalSet| more.iter().chain([lost]).collect::<SignalSet>();
            for (id, need) in knowledge.needs().enumerate() {
                let is_known = |lost: &SignalSet| is_known(&knowledge, need.variable, &more(lost));
                assert_eq!(needs[id].known, is_known(&SignalSet::new()), "seed {seed}");
                let others = losses(signals).into_iter().filter(|it| !it.contains(lost));
                let fewest = others.into_iter().find(|lost| !is_known(lost)).map(|lost| lost.len());
                if needs[id].known {
                    assert_eq!(needs[id].survives, fewest.map(|fewest| fewest - 1), "seed {seed}");
                }
            }
        }
    }
}
