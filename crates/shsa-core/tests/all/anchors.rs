//! What a jump is measured by: a value that stands still is as good an anchor as one that jitters, a wrong first reading is none,
//! and what counts may start again from 0.

use super::detectors::{ERROR, MAX_RATE, PERIOD, Reading, Run, regular};
use proptest::prelude::*;
use shsa_core::engine::{EventKind, Quality};
use shsa_core::knowledge::{Id, SignalId};
use shsa_core::reason::Reason;
use shsa_core::trust::Verdict;

/// More than a sound signal can move in a period, errors of value and time included.
const TOO_FAR: f64 = MAX_RATE * 0.22 + 2.0 * ERROR + 0.01;

/// The probation, with the window in which no jump may show, in readings.
const PROBATION: usize = 40;

fn has_started_anew(run: &Run) -> bool {
    let restored = run.events(EventKind::Restored);
    restored.iter().any(|event| event.because.iter().any(|it| matches!(it, Reason::StartedAnew { .. })))
}

proptest! {
    /// Values that stand still between glitches, or move in steps as those of a converter do: each glitch, too far from the value before
    /// and from the one after it, is refused, and nobody is accused.
    #[test]
    fn a_glitch_in_a_steady_run_is_refused(
        runs in prop::collection::vec((4..12_usize, TOO_FAR + 0.1..40.0_f64, any::<bool>()), 1..5),
        step in prop_oneof![Just(0.0), 0.01..0.1_f64],
    ) {
        let (mut values, mut level) = (Vec::new(), 0.0);
        for (length, height, is_up) in &runs {
            values.extend(core::iter::repeat_n(level, *length));
            values.push(if *is_up { level + height } else { level - height });
            level += step;
        }
        values.extend([level; 3]);
        let run = Run::of(&regular(values.iter().copied()));
        prop_assert_eq!(run.events(EventKind::Failed).len(), 0);
        prop_assert_eq!(run.counts().too_fast, runs.len() as u64);
        prop_assert!(run.published().iter().all(|(_, value)| (-0.01..=level + 0.01).contains(value)), "{:?}", run.published());
        prop_assert_eq!(run.published().len(), values.len() - runs.len());
    }

    /// A value that was held for some readings is followed by a new one, which the next reading repeats: both are sound.
    #[test]
    fn a_held_value_may_change_at_once(hold in 2..5_usize, slopes in prop::collection::vec(-1.0..=1.0_f64, 2..20)) {
        let mut truth = 0.0;
        let values: Vec<f64> = slopes.iter().flat_map(|slope| {
            truth += slope * MAX_RATE * 0.2 * hold as f64;
            vec![truth; hold]
        }).collect();
        let run = Run::of(&regular(values));
        prop_assert_eq!(run.events(EventKind::Failed).len(), 0);
        prop_assert_eq!(run.counts().too_fast, 0);
        // Each new value goes out, at the latest with its first repetition.
        prop_assert!(run.published().len() >= slopes.len() * (hold - 1));
    }

    /// One wrong reading before all others: the signal fails, and is good again by all that came since.
    #[test]
    fn a_wrong_first_reading_is_no_anchor(height in 5.0..40.0_f64, is_up in any::<bool>(), jitter in 0.0..0.09_f64) {
        let level = if is_up { -height } else { height };
        let values = [0.0].into_iter().chain((0..80).map(|at| level + jitter * f64::from(at % 2)));
        let run = Run::of(&regular(values));
        prop_assert_eq!(run.events(EventKind::Failed).len(), 1);
        prop_assert!(has_started_anew(&run));
        prop_assert!(run.qualities().iter().rev().take(80 - PROBATION).all(|quality| *quality == Quality::Good));
    }

    /// What has risen from the beginning starts again from 0, and is good again once it counts on.
    #[test]
    fn a_counter_may_start_again(
        before in 8..40_usize,
        steps in prop::collection::vec(0.2..0.4_f64, 120),
        first in 0.0..0.4_f64,
    ) {
        let run = Run::of(&regular(counted(5.0, before, first, &steps)));
        prop_assert_eq!(run.events(EventKind::Failed).len(), 1);
        prop_assert!(has_started_anew(&run));
        prop_assert_eq!(run.qualities().last().copied(), Some(Quality::Good));
    }

    /// A sensor that falls to 0 and stays there, or one that has fallen before, counts nothing.
    #[test]
    fn what_falls_to_zero_is_no_counter(before in 8..20_usize, has_fallen in any::<bool>(), steps in prop::collection::vec(0.2..0.4_f64, 120)) {
        let mut values = counted(15.0, before, 0.1, &steps);
        for (at, value) in values.iter_mut().enumerate() {
            match has_fallen {
                true if at < before => *value = 30.0 - *value,
                false if at >= before => *value = 0.001 * (at % 3) as f64,
                _ => {}
            }
        }
        let run = Run::of(&regular(values));
        prop_assert!(!has_started_anew(&run));
        prop_assert_eq!(run.engine.verdict(SignalId::from_index(0)), Verdict::Unknown);
        prop_assert!(run.qualities().iter().skip(before).all(|quality| *quality == Quality::Uncertain));
    }
}

/// Readings that count on from a level, then again from `first`.
fn counted(level: f64, before: usize, first: f64, steps: &[f64]) -> Vec<f64> {
    let mut value = level;
    let count = |(at, step): (usize, &f64)| {
        value = if at == before { first } else { value + step };
        value
    };
    steps.iter().enumerate().map(count).collect()
}

/// One glitch as long as the stretch that convicts is a fault, however still the value stood before.
#[test]
fn a_new_level_after_a_steady_run_is_reported() {
    let values = core::iter::repeat_n(0.0, 30).chain(core::iter::repeat_n(20.0, 60));
    let readings: Vec<Reading> = regular(values);
    let run = Run::of(&readings);
    assert_eq!(run.events(EventKind::Failed).len(), 1);
    assert!(!has_started_anew(&run));
    assert!(run.events(EventKind::Failed)[0].time.0 <= 32 * PERIOD);
}
