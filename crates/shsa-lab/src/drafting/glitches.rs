//! Values that leave their neighbours and come back at once: a few of them say nothing about how a quantity moves.

use crate::order::{quantile, sorted};

/// The most values of one glitch.
const LONGEST: usize = 3;

/// The jumps into a glitch and out of it are as many times as large as nearly all other changes: those of noise are at most three
/// times as large.
const BEYOND: f64 = 8.0;

/// The share of its changes that nearly all other changes are.
const NEARLY_ALL: f64 = 0.95;

/// How far the values around a glitch may be apart, as a share of the jump: a step stays where it went.
const COMES_BACK: f64 = 0.2;

/// The largest share of values in glitches: what happens more often is a way in which the quantity moves.
const RARE: f64 = 0.005;

/// The least changes that tell how a quantity moves.
const LEAST_CHANGES: usize = 30;

/// The places of the values of glitches, in order; none where they are not rare. `breaks` are the places at which sessions begin.
///
/// Time: O(n log n).
pub(super) fn of(points: &[(f64, f64)], breaks: &[usize]) -> Vec<usize> {
    let changes = points.windows(2).map(|pair| (pair[1].1 - pair[0].1).abs()).filter(|it| *it > 0.0);
    let changes = sorted(changes);
    let usual = quantile(&changes, NEARLY_ALL).filter(|_| changes.len() >= LEAST_CHANGES);
    let Some(usual) = usual else { return Vec::new() };
    let mut found = Vec::new();
    let mut at = 0;
    while at < points.len() {
        let session_end = breaks.iter().copied().find(|it| *it > at).unwrap_or(points.len());
        let is_first = at == 0 || breaks.contains(&at);
        let length = length(&points[..session_end], at, is_first, BEYOND * usual);
        found.extend(at..at + length);
        at += length.max(1);
    }
    let most = (RARE * points.len() as f64).max(LONGEST as f64);
    if found.len() as f64 > most { Vec::new() } else { found }
}

/// The number of values of the glitch that begins at a place; 0 where none does. The points end with the session.
fn length(points: &[(f64, f64)], at: usize, is_first: bool, least: f64) -> usize {
    let value = |place: usize| points.get(place).map(|point| point.1);
    let before = at.checked_sub(1).filter(|_| !is_first).and_then(value);
    let Some(first) = value(at).filter(|it| before.is_none_or(|before| (it - before).abs() > least)) else {
        return 0;
    };
    let is_over = |length: &usize| {
        let (Some(last), after) = (value(at + length - 1), value(at + length)) else { return false };
        match (before, after) {
            (Some(before), Some(after)) => {
                let jump = (first - before).abs().min((last - after).abs());
                jump > least && (after - before).abs() <= COMES_BACK * jump
            }
            (None, Some(after)) => (last - after).abs() > least,
            (before, None) => before.is_some(),
        }
    };
    (1..=LONGEST).find(is_over).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slow wave with noise of the last digit, in which some values are replaced.
    #[track_caller]
    fn check(replaced: &[(usize, f64)], expected: &[usize]) {
        let value = |at: usize| 70.0 + 2.0 * (at as f64 / 90.0).sin() + 0.01 * (at * 7 % 5) as f64;
        let mut points: Vec<(f64, f64)> = (0..1_000).map(|at| (at as f64, value(at))).collect();
        replaced.iter().for_each(|(at, value)| points[*at].1 = *value);
        assert_eq!(of(&points, &[500]), expected);
    }

    #[test]
    fn what_comes_back_at_once_is_a_glitch() {
        check(&[], &[]);
        check(&[(300, 0.0)], &[300]);
        check(&[(300, -127.0), (301, -127.0), (700, 850.0)], &[300, 301, 700]);
        check(&[(0, 0.0), (500, 0.0), (999, 0.0)], &[0, 500, 999]);
    }

    #[test]
    fn a_step_and_what_is_not_rare_are_no_glitches() {
        let step: Vec<(usize, f64)> =
            (400..1_000).map(|at| (at, 90.0 + 0.01 * (at * 7 % 5) as f64)).collect();
        check(&step, &[]);
        let often: Vec<(usize, f64)> = (0..40).map(|at| (10 + 20 * at, 0.0)).collect();
        check(&often, &[]);
        let noise = |at: u32| f64::from(at.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        let points: Vec<(f64, f64)> = (0..5_000).map(|at| (f64::from(at), noise(at))).collect();
        assert_eq!(of(&points, &[]), [] as [usize; 0]);
    }
}
