//! Uncertain values of needs: where all sensors disagree, and where all that is trusted is unfit.

use super::*;

#[test]
fn without_a_width_nothing_uncertain_goes_out_unless_it_is_asked_for() {
    assert_eq!(uncertain(&reported(&[0.0, 0.8], |_| ())).len(), 0);
    let withheld = reported(&[0.0, 0.8], |need| {
        need.max_width = Some(text("2"));
        need.when_unsure = Some(text("withhold"));
    });
    assert_eq!(uncertain(&withheld).len(), 0);
    let stage = reported(&[0.0, 30.0], |need| need.when_unsure = Some(text("hull")));
    assert!(uncertain(&stage).len() > 100);
    check_truth(&stage);
}

#[test]
fn the_last_trusted_value_goes_out_until_it_is_too_old() {
    let stage = reported(&[0.0, 0.8], |need| {
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
    let stage = reported(&[0.0, 0.8, -0.9], |need| need.max_width = Some(text("3")));
    assert!(uncertain(&stage).len() > 50, "{:#?}", stage.events);
    check_truth(&stage);
}

/// Two narrow sensors contradict each other from 20 s to 40 s; the third one agrees with both, as its error is a share of its value,
/// and is too wide for the need by then.
fn beside_a_wide_one(share: f64, offset: f64, max_width: f64) -> Stage {
    let mut draft = draft(&[0; 3].map(|_| Sensor::PLAIN));
    draft.signals[2].value_error = Some(Bounds::One(text(format!("{} %", 100.0 * share))));
    let demand = Demand { max_age_ms: 500, max_width: Some(max_width), level: None, min_rate_hz: None };
    draft.needs.push(need("/n", &demand));
    let mut stage = Stage::new(built(&draft));
    for tick in 0..900_i64 {
        for (at, offset) in [0.0, offset, 0.0].into_iter().enumerate() {
            let time = Time((tick * 100 + at as i64) * MS);
            let lie = if (200..400).contains(&tick) { offset } else { 0.0 };
            stage.say(&Sensor::name(at), time, 10.0 + truth(time) + lie);
        }
    }
    stage
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// A trusted source that is too wide does not keep the hull of two suspects back.
    #[test]
    fn what_suspects_hold_possible_goes_out_where_all_that_is_trusted_is_too_wide(
        share in 0.2..0.5_f64,
        offset in 0.4..1.5_f64,
        room in 0.1..0.5_f64,
    ) {
        let stage = beside_a_wide_one(share, offset, offset + 0.2 + room);
        let times: Vec<Time> = stage.of(0).map(|it| it.time).collect();
        let longest = times.windows(2).map(|two| two[1] - two[0]).max().unwrap();
        prop_assert!(longest <= Span(500 * MS), "{longest:?}: {:#?}", stage.events);
        prop_assert_eq!(stage.count(0, EventKind::Unhealable), 0);
        let doubted = uncertain(&stage);
        prop_assert!(doubted.len() > 100, "{}: {:#?}", doubted.len(), stage.events);
        for it in stage.of(0).filter(|it| it.quality != Quality::Good || it.time < Time(20_000 * MS)) {
            let right = 10.0 + truth(it.validity.to);
            prop_assert!(scalar(it).widened(0.01).contains(right), "{:?} beside {}", it, right);
            prop_assert!(scalar(it).width() <= offset + 0.2 + room);
        }
        prop_assert_eq!(stage.of(0).last().unwrap().quality, Quality::Good);
    }
}
