//! The delay of one way relative to another: the shift with the least spread of their difference.

use crate::calibration::comparison::Comparison;
use crate::curve::Curve;
use crate::order::spread;
use shsa_core::time::Validity;

/// The number of shifts that are tried to either side.
const STEPS: i32 = 40;

/// The most comparisons that are used; they are evenly spaced.
const MOST_COMPARISONS: usize = 2_000;

/// A shift is accepted if the remaining share of the spread in each half of the time is at most this: a tenth less variance.
const WORTH: f64 = 0.948;

/// An accepted delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Delay {
    /// How much later the slower way is than the other, in seconds; negative if it is earlier.
    pub(crate) late_s: f64,
    /// The remaining spread of the difference, as a share of the spread without the shift.
    pub(crate) left: f64,
}

/// The values of a way, each at the end of its validity.
pub(crate) fn curve(outputs: &[(Validity, f64)]) -> Curve {
    Curve::new(outputs.iter().map(|(at, value)| (at.to.seconds(), *value)).collect())
}

/// The delay between the two ways of a pair, within `most_s` to either side. `None` when no shift can be accepted: too much
/// spread remains, the shift lies at the end of the search range, or it does not help in one half of the time. Time: O(shifts *
/// comparisons * log n).
pub(crate) fn between(comparisons: &[Comparison], other: &Curve, most_s: f64) -> Option<Delay> {
    let every = comparisons.len().div_ceil(MOST_COMPARISONS).max(1);
    let used: Vec<&Comparison> = comparisons.iter().step_by(every).collect();
    let halves = used.split_at(used.len() / 2);
    let step = most_s / f64::from(STEPS);
    let left = |used: &[&Comparison], shift: f64| left(used, other, shift, most_s);
    let tried: Vec<f64> = (-STEPS..=STEPS).map(|at| left(&used, f64::from(at) * step)).collect();
    let best = (0..tried.len()).min_by(|one, next| tried[*one].total_cmp(&tried[*next]))?;
    let (before, after) = (tried.get(best.checked_sub(1)?)?, tried.get(best + 1)?);
    // The minimum of the parabola through the best shift and its neighbours.
    let curvature = before - 2.0 * tried[best] + after;
    let off = if curvature > 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    let shift = (best as f64 - f64::from(STEPS) + off) * step;
    let share = left(&used, shift) / left(&used, 0.0);
    let helps = |half: &[&Comparison]| left(half, shift) <= WORTH * left(half, 0.0);
    let is_worth = helps(halves.0) && helps(halves.1);
    is_worth.then_some(Delay { late_s: -shift, left: share })
}

/// The spread of the difference after shifting the other way, over the comparisons that every shift permits.
///
/// The other way is averaged over two of its periods: between two values a straight line has less noise than at them, so a shift
/// by half a period would look like a delay.
fn left(used: &[&Comparison], other: &Curve, shift: f64, most_s: f64) -> f64 {
    let difference = |it: &&Comparison| {
        let (from, to) = (it.validity.from.seconds(), it.validity.to.seconds());
        let around = other.period_s();
        other.read(from - most_s - around).and(other.read(to + most_s + around))?;
        Some(it.value - other.at(from + shift - around, to + shift + around)?)
    };
    let differences: Vec<f64> = used.iter().filter_map(difference).collect();
    spread(&differences)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::time::Time;

    fn wave(time: f64) -> f64 {
        (0.7 * time).sin() + 0.3 * (1.9 * time).cos()
    }

    /// Comparisons with a slower way that is `late_s` late, and whose values are means over `window_s`.
    fn comparisons(late_s: f64, window_s: f64) -> Vec<Comparison> {
        (20..300)
            .map(|at| {
                let to = f64::from(at) * 0.1;
                let mean =
                    (0..=100).map(|part| wave(to - late_s - window_s * f64::from(part) / 100.0)).sum::<f64>()
                        / 101.0;
                let validity =
                    Validity { from: Time::from_seconds(to - window_s), to: Time::from_seconds(to) };
                Comparison { received: validity.to, validity, value: mean, known: 0.0, width: 0.0 }
            })
            .collect()
    }

    #[track_caller]
    fn check(late_s: f64, window_s: f64, expected: Option<f64>) {
        let fast: Vec<(Validity, f64)> = (0..3200)
            .map(|at| f64::from(at) * 0.01)
            .map(|time| (Validity::at(Time::from_seconds(time)), wave(time)))
            .collect();
        let found = between(&comparisons(late_s, window_s), &curve(&fast), 1.0).map(|delay| delay.late_s);
        let is_right = match (found, expected) {
            (Some(found), Some(expected)) => (found - expected).abs() < 0.01,
            (found, expected) => found == expected,
        };
        assert!(is_right, "{found:?} is not {expected:?}");
    }

    #[test]
    fn delays_are_found_whoever_is_late() {
        check(0.37, 0.0, Some(0.37));
        check(-0.37, 0.0, Some(-0.37));
        check(0.2, 0.5, Some(0.2));
    }

    /// Two ways measure the same at the same moments: a shift by half a period of the other averages its noise, and is no delay.
    #[test]
    fn noise_is_no_delay() {
        let mut chance = crate::calibration::chance::Chance::new(3);
        let mut noise = || chance.normal();
        let fast: Vec<(Validity, f64)> =
            (0..400).map(|at| (Validity::at(Time::from_seconds(f64::from(at))), noise())).collect();
        let compared = |(validity, known): &(Validity, f64)| Comparison {
            received: validity.to,
            validity: *validity,
            value: 0.0,
            known: *known,
            width: 0.0,
        };
        let compared: Vec<Comparison> = fast.iter().map(compared).collect();
        assert_eq!(between(&compared, &curve(&fast), 4.0), None);
    }

    #[test]
    fn what_cannot_be_known_is_not_reported() {
        check(1.5, 0.0, None);
        check(0.0, 0.0, None);
    }
}
