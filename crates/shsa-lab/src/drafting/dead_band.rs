//! Whether a column was sent on change: as soon as its value had left a dead band, and else now and then to say that the sensor is there.

use crate::order::{quantile, sorted};

/// Fewer changes show no rule.
const LEAST_CHANGES: usize = 20;

/// A gap is the longest, at which a sensor says that it is there, down to this share of it.
const LONGEST: f64 = 0.9;

/// No change within the dead band: the least one is no smaller than this share of the usual one.
const WITHIN: f64 = 0.5;

/// What is read in a rhythm is not sent on change: the ninth tenth of the gaps is more times the first one than that of the changes
/// is, by this factor.
const UNEVEN: f64 = 1.5;

/// The dead band of values with these times and changes from one to the next; `None` where they are not sent on change. O(n log n).
pub(super) fn of(steps: &[(f64, f64)]) -> Option<f64> {
    let longest = steps.iter().map(|step| step.0).fold(0.0, f64::max);
    let by_change = || steps.iter().filter(|step| step.0 < LONGEST * longest);
    let sizes = sorted(by_change().map(|step| step.1.abs()));
    let gaps = sorted(by_change().map(|step| step.0));
    if sizes.len() < LEAST_CHANGES {
        return None;
    }
    let (least, usual) = (quantile(&sizes, 0.02)?, quantile(&sizes, 0.5)?);
    let spread = |of: &[f64]| Some(quantile(of, 0.9)? / quantile(of, 0.1)?);
    let is_sent_on_change = least > WITHIN * usual && spread(&gaps)? > UNEVEN * spread(&sizes)?;
    // A change may be over the band by what happens between two looks of the sensor.
    if is_sent_on_change { quantile(&sizes, 0.9) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A slow wave with noise, read each second.
    fn read(sizes: (f64, f64), seconds: usize, noise: f64, seed: u64) -> Vec<(f64, f64)> {
        let mut state = seed | 1;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let wave = |at: f64| sizes.0 * (at / 700.0).sin() + sizes.1 * (at / 190.0 + 1.0).sin();
        (0..seconds).map(|at| (at as f64, wave(at as f64) + 2.0 * noise * random())).collect()
    }

    fn steps(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        points.windows(2).map(|pair| (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1)).collect()
    }

    proptest! {
        #[test]
        fn what_is_sent_on_change_is_known_by_its_dead_band(
            (one, other) in (2.0..10.0_f64, 0.5..4.0_f64),
            band in 0.2..0.6_f64,
            heartbeat in prop::option::of(300..2_000_usize),
            noise in 0.0..0.05_f64,
            seed in any::<u64>(),
        ) {
            let mut sent: Vec<(f64, f64)> = Vec::new();
            for (at, value) in read((one, other), 20_000, noise, seed) {
                let is_due = sent.last().is_none_or(|(before, last)| {
                    (value - last).abs() >= band || heartbeat.is_some_and(|beat| at - before >= beat as f64)
                });
                if is_due {
                    sent.push((at, value));
                }
            }
            let found = of(&steps(&sent));
            prop_assert!(found.is_some_and(|it| it >= band && it < 1.5 * band + 2.0 * noise), "{band}: {found:?}");
        }

        #[test]
        fn what_is_read_in_a_rhythm_is_not(
            (one, other) in (2.0..10.0_f64, 0.5..4.0_f64),
            (noise, digits) in (0.0..0.5_f64, 0..3_i32),
            (every, lost) in (1..60_usize, 0.0..0.5_f64),
            seed in any::<u64>(),
        ) {
            let places = 10.0_f64.powi(digits);
            let all = read((one, other), 20_000, noise, seed);
            let lots = read((1.0, 1.0), 20_000, 0.5, seed ^ 77);
            let kept = all.iter().zip(lots).step_by(every).filter(|(_, lot)| (lot.1 * 1e6).rem_euclid(1.0) >= lost);
            let kept: Vec<(f64, f64)> = kept.map(|(point, _)| (point.0, (point.1 * places).round() / places)).collect();
            prop_assert_eq!(of(&steps(&kept)), None);
        }
    }
}
