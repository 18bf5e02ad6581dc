//! Learns from healthy readings after which time a constant signal is frozen.
//!
//! Only a signal with noise in every reading can be called frozen this early. A signal that rests when nothing moves (an encoder,
//! a closed valve) is constant as long as the rest lasts, and the recording may not contain a rest.

use crate::order::median;

/// The least number of readings.
const FEWEST: f64 = 300.0;
/// The largest permitted share of equal neighbours.
const MOST_ALIKE: f64 = 0.5;
/// This many equal neighbours are added to the observed ones.
const UNSEEN: f64 = 3.0;
/// Healthy readings would be constant for half of the time limit only once in this many hours.
const HOURS: f64 = 10_000.0;
/// The least time limit in readings, and in multiples of the longest observed run.
const FEWEST_READINGS: f64 = 10.0;
const LONGEST: f64 = 3.0;
/// The number of successive changes in a window; the quietest window is used.
const QUIET: usize = 100;
/// The largest correlation of a change with the next one for noise: white noise has -0.5, a smooth movement 1.
const NOISY: f64 = -0.2;
/// If a run as long as the longest one is expected less often than this, it is a rest.
const BY_CHANCE: f64 = 0.01;
/// Zero is out of reach if its distance exceeds this many times the range of the readings.
const RANGES: f64 = 3.0;
/// A signal is known at zero by at least this many readings, if the share of repeated ones is at most this many times the usual
/// one.
const AT_ZERO: f64 = 30.0;
const HELD: f64 = 2.0;

/// The time in seconds after which a constant signal is frozen; `None` if healthy readings do not tell it. `points` are time in
/// seconds and reading, by stretch; `period_s` is the usual time between two. Time: O(n log n).
pub(crate) fn frozen_after(points: &[Vec<(f64, f64)>], period_s: f64) -> Option<f64> {
    let count = points.iter().map(Vec::len).sum::<usize>() as f64;
    let changes: Vec<Vec<f64>> =
        points.iter().map(|it| it.windows(2).map(|pair| pair[1].1 - pair[0].1).collect()).collect();
    let alike = (changes.iter().map(|it| same(it)).sum::<usize>() as f64 + UNSEEN) / (count + UNSEEN);
    let runs = points.iter().flat_map(|it| it.chunk_by(|one, next| one.1 == next.1));
    let longest = runs.map(<[_]>::len).max().unwrap_or(0) as f64;
    // A run that is too long for chance is a rest.
    let rests = count * alike.powf(longest - 1.0) < BY_CHANCE;
    if count < FEWEST || alike > MOST_ALIKE || period_s <= 0.0 || rests {
        return None;
    }
    let noise = own_noise(&changes)?;
    if !(is_far_from_zero(points) || is_known_at_zero(points, noise, alike)) {
        return None;
    }
    // A run of equal readings is rarer by the factor `alike` with each further reading.
    let rare = (HOURS * 3600.0 / period_s).ln() / -alike.ln();
    Some(period_s * (2.0 * rare).max(FEWEST_READINGS).max(LONGEST * longest))
}

/// The median change by the signal's own noise, from the quietest window, where nothing else changes the readings.
fn own_noise(changes: &[Vec<f64>]) -> Option<f64> {
    let windows = changes.iter().flat_map(|it| it.chunks_exact(QUIET));
    let quiet = windows.min_by(|one, other| squares(one).total_cmp(&squares(other)))?;
    let is_noise = correlation(quiet) <= NOISY && same(quiet) as f64 <= MOST_ALIKE * QUIET as f64;
    is_noise.then(|| median(quiet.iter().map(|it| it.abs())))
}

/// Resting signals are usually at zero: whether the readings are far from zero,
fn is_far_from_zero(points: &[Vec<(f64, f64)>]) -> bool {
    let values = points.iter().flatten().map(|it| it.1);
    let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), it| (lo.min(it), hi.max(it)));
    lo.max(-hi) > RANGES * (hi - lo)
}

/// or whether many readings were within the noise of zero, and no more of them were repeated than elsewhere.
fn is_known_at_zero(points: &[Vec<(f64, f64)>], noise: f64, alike: f64) -> bool {
    let pairs = points.iter().flat_map(|it| it.windows(2)).map(|pair| (pair[0].1, pair[1].1));
    let (mut count, mut held) = (0.0, 0.0);
    for (one, next) in pairs.filter(|it| it.0.abs() <= noise) {
        count += 1.0;
        held += if one == next { 1.0 } else { 0.0 };
    }
    count >= AT_ZERO && held <= HELD * alike * count
}

fn same(changes: &[f64]) -> usize {
    changes.iter().filter(|it| **it == 0.0).count()
}

fn squares(changes: &[f64]) -> f64 {
    changes.iter().map(|it| it * it).sum()
}

/// The correlation of successive changes; 1 if nothing changes.
fn correlation(changes: &[f64]) -> f64 {
    let products: f64 = changes.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let square = squares(changes);
    if square > 0.0 { products / square } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::chance::Chance;

    const PERIOD_S: f64 = 0.04;

    fn found(reading: impl Fn(f64, &mut Chance) -> f64) -> Option<f64> {
        let mut chance = Chance::new(3);
        let point = |at: u32| {
            let time = f64::from(at) * PERIOD_S;
            (time, reading(time, &mut chance))
        };
        frozen_after(&[(0..5_000).map(point).collect()], PERIOD_S)
    }

    #[test]
    fn noise_that_never_repeats_is_frozen_soon() {
        let gyro = found(|time, chance| 0.3 * (0.05 * time).sin() + 0.01 * chance.normal());
        assert!(gyro.is_some_and(|it| (0.39..0.5).contains(&it)), "{gyro:?}");
        let pressure = found(|time, chance| 101_325.0 + 50.0 * (0.3 * time).sin() + chance.normal());
        assert_eq!(pressure, gyro);
    }

    #[test]
    fn what_repeats_more_often_is_frozen_later() {
        let coarse = found(|_, chance| chance.normal().round());
        assert!(coarse.is_some_and(|it| it > 1.0), "{coarse:?}");
        assert_eq!(found(|_, chance| (0.3 * chance.normal()).round()), None);
    }

    #[test]
    fn what_may_rest_is_left_alone() {
        // A car that never stood still in the recording, and an odometer.
        assert_eq!(found(|time, chance| 14.0 + 6.0 * (0.1 * time).sin() + 0.1 * chance.normal()), None);
        assert_eq!(found(|time, _| time), None);
        // An encoder's speed: noisy while it turns, constant while it does not.
        let encoder = |time: f64, chance: &mut Chance| {
            let turns = (0.05 * time).sin().max(0.0);
            turns * (1.0 + 0.1 * chance.normal())
        };
        assert_eq!(found(encoder), None);
        assert_eq!(found(|_, _| 5.0), None);
    }
}
