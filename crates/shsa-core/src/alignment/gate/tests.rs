//! Jumps round a circle, bursts after a stall, and which of two readings was wrong.

use super::*;
use crate::time::Time;

/// Whether readings of whole degrees, one each second through an open gate, are home after each of them.
fn homes(wraps: Option<f64>, readings: &[f64]) -> std::vec::Vec<bool> {
    let pace = Some(Pace { max_rate: 10.0, period: Span::ZERO });
    let mut gate = Gate { pace, wraps, max_hold: Span::MAX, is_open: true, ..Gate::default() };
    let mut seconds = 0.0;
    let mut of = |gate: &mut Gate, value: f64| {
        seconds += 1.0;
        gate.turn();
        let validity = Validity::at(Time::from_seconds(seconds));
        gate.measure(Sample { validity, value: Interval::new(value - 1.0, value + 1.0) });
        gate.turn();
        gate.has_returned()
    };
    readings.iter().map(|value| of(&mut gate, *value)).collect()
}

#[test]
fn jumps_round_the_circle_come_back() {
    // Long enough to have got anywhere: only the sum of the jumps shows the return. No reading is repeated, as it would count
    // as held.
    let there = |degrees: f64| (0..8).map(move |at| degrees + 0.1 * f64::from(at));
    let round: std::vec::Vec<f64> =
        [0.0, 0.1].into_iter().chain(there(120.0)).chain(there(240.0)).chain([0.0]).collect();
    assert_eq!(homes(Some(360.0), &round).last(), Some(&true));
    assert!(!homes(Some(360.0), &round)[17]);
    assert_eq!(homes(None, &round).last(), Some(&true));
    assert_eq!(homes(None, &[0.0, 0.0, 120.0, 0.0]), [true, true, false, true]);
}

#[test]
fn a_burst_after_a_stall_is_no_jump() {
    let pace = Some(Pace { max_rate: 10.0, period: Span::from_millis(100) });
    let mut gate = Gate { pace, max_hold: Span::MAX, ..Gate::default() };
    // Measured every 100 ms; the machine stalls for 300 ms before the third one.
    let mut measure = |arrival: f64, value: f64| {
        gate.turn();
        let validity = Validity::at(Time::from_seconds(arrival));
        gate.measure(Sample { validity, value: Interval::point(value) })
    };
    for (arrival, value) in [(0.1, 0.0), (0.2, 0.9), (0.5, 1.8), (0.5001, 2.7), (0.5002, 3.6)] {
        assert_eq!(measure(arrival, value), Measured::Possible, "{arrival}");
    }
    assert!(matches!(measure(0.6, 5.0), Measured::TooFast(_)));
}

#[test]
fn the_next_reading_tells_which_of_two_was_wrong() {
    let pace = Some(Pace { max_rate: 1.0, period: Span::ZERO });
    let outcome = |readings: [f64; 4]| {
        let mut gate = Gate { pace, max_hold: Span::MAX, ..Gate::default() };
        let of = |(at, value): (usize, f64)| {
            gate.turn();
            let validity = Validity::at(Time::from_seconds(at as f64));
            gate.measure(Sample { validity, value: Interval::point(value) })
        };
        readings.into_iter().enumerate().map(of).collect::<std::vec::Vec<_>>()
    };
    let second = outcome([0.0, 0.9, -1.0, -1.5]);
    assert!(matches!(second[2..], [Measured::TooFast(_), Measured::Confirming(_)]), "{second:?}");
    let third = outcome([0.0, 0.9, -0.5, 0.8]);
    assert!(matches!(third[2..], [Measured::TooFast(_), Measured::Possible]), "{third:?}");
    let lasting = outcome([0.0, 0.0, 9.0, 9.0]);
    assert!(matches!(lasting[2..], [Measured::TooFast(_), Measured::TooFast(_)]), "{lasting:?}");
}
