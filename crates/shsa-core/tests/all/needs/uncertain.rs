//! What goes out while nothing is trusted holds the truth.

use super::{Demand, MS, SEGMENT_MS, Sensor, Stage, knowledge, need, scalar, text};
use proptest::prelude::*;
use shsa_core::engine::{
    Engine, Event, EventKind, Input, Options, Output, Publication, PublishedValue, Quality,
};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Id, KnowledgeBase, NeedDraft, NeedId, RelationDraft, Severity, SignalDraft,
    Text, VariableDraft, build,
};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::plan::{Graph, Limits, Requirements, best_meeting};
use shsa_core::time::{Span, Time};

/// Shortly before [`told`] signals say the truth again.
const LIES_UNTIL: Time = Time(39_950 * MS);

/// Signals of one variable at 10 Hz that say the truth, a slow sine, off by an amount from 20 s to 40 s.
fn told(offsets: &[f64], change: impl Fn(&mut NeedDraft)) -> Stage {
    let sensor = |_| Sensor {
        is_direct: true,
        rate_hz: 10,
        tells_rate: true,
        error: 10,
        delay_ms: 0,
        level: None,
        until: 9,
    };
    let sensors: Vec<Sensor> = (0..offsets.len()).map(sensor).collect();
    let demand = Demand { max_age_ms: 500, max_width: None, level: None, min_rate_hz: None };
    let mut need = need("/n", &demand);
    change(&mut need);
    let mut stage = Stage::new(knowledge(&sensors, vec![need]));
    for tick in 0..900_i64 {
        for (at, offset) in offsets.iter().enumerate() {
            let time = Time((tick * 100 + at as i64) * MS);
            let lie = if (200..400).contains(&tick) { *offset } else { 0.0 };
            stage.say(&Sensor::name(at), time, truth(time) + lie);
        }
    }
    stage
}

fn truth(time: Time) -> f64 {
    (time.0 as f64 / 30e9).sin()
}

fn uncertain(stage: &Stage) -> Vec<&Publication> {
    stage.of(0).filter(|it| it.quality == Quality::Uncertain).collect()
}

fn check_truth(stage: &Stage) {
    for publication in uncertain(stage) {
        let value = scalar(publication);
        // The signals say it as of their own stamps, a few milliseconds apart.
        assert!(
            value.widened(0.01).contains(truth(publication.validity.to)),
            "{value:?} at {:?}",
            publication.time
        );
    }
}

#[test]
fn of_two_that_disagree_the_hull_goes_out_while_it_is_narrow_enough() {
    let stage = told(&[0.0, 0.8], |need| need.max_width = Some(text("2")));
    let hulls = uncertain(&stage);
    assert!(hulls.len() > 100, "{}: {:#?}", hulls.len(), stage.events);
    let is_wide = |it: &&Publication| scalar(it).width() > 0.9 || it.time > LIES_UNTIL;
    assert!(hulls.iter().all(is_wide), "a hull is as wide as both");
    check_truth(&stage);
    assert_eq!(stage.count(0, EventKind::Substituted), 1, "{:#?}", stage.events);
    let last = stage.of(0).last().unwrap();
    assert_eq!(last.quality, Quality::Good, "it ends with the disagreement");
    assert!(stage.count(0, EventKind::Restored) >= 1);
}

#[test]
fn a_hull_that_is_too_wide_is_withheld_and_told_with_its_width() {
    let stage = told(&[0.0, 3.0], |need| need.max_width = Some(text("2")));
    // When both agree again and are not trusted yet, what they say is narrow.
    assert!(uncertain(&stage).iter().all(|it| it.time > LIES_UNTIL), "{:#?}", stage.events);
    let unhealable: Vec<&Event> = stage.events.iter().filter(|it| it.kind == EventKind::Unhealable).collect();
    assert_eq!(unhealable.len(), 1, "{:#?}", stage.events);
    assert!(stage.events.iter().any(|it| it.because.contains("wide, more than 2")), "{:#?}", stage.events);
    assert!(stage.of(0).all(|it| scalar(it).width() <= 2.0));
}

#[test]
fn without_a_width_nothing_uncertain_goes_out_unless_it_is_asked_for() {
    assert_eq!(uncertain(&told(&[0.0, 0.8], |_| ())).len(), 0);
    let withheld = told(&[0.0, 0.8], |need| {
        need.max_width = Some(text("2"));
        need.when_unsure = Some(text("withhold"));
    });
    assert_eq!(uncertain(&withheld).len(), 0);
    let stage = told(&[0.0, 30.0], |need| need.when_unsure = Some(text("hull")));
    assert!(uncertain(&stage).len() > 100);
    check_truth(&stage);
}

#[test]
fn the_last_trusted_value_goes_out_until_it_is_too_old() {
    let stage = told(&[0.0, 0.8], |need| {
        need.when_unsure = Some(text("last"));
        need.max_age = Some(text("5 s"));
    });
    let last = uncertain(&stage);
    assert!(!last.is_empty(), "{:#?}", stage.events);
    let is_one = |it: &&Publication| scalar(it).width() < 0.3 && it.time - it.validity.to <= Span(5_000 * MS);
    assert!(last.iter().all(is_one), "{last:?}");
    assert_eq!(stage.count(0, EventKind::Unhealable), 1, "{:#?}", stage.events);
}

#[test]
fn of_three_that_all_disagree_what_enough_of_them_hold_possible_goes_out() {
    let stage = told(&[0.0, 0.8, -0.9], |need| need.max_width = Some(text("3")));
    assert!(uncertain(&stage).len() > 50, "{:#?}", stage.events);
    check_truth(&stage);
}
