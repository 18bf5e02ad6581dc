//! Signals that show one measurement in two units, or with fewer digits: they differ by their rounding alone.

use super::least_squares::solve;
use super::shape::Copied;
use super::signal::Seen;
use crate::order::{mean, variance};

/// Factors between units of one quantity, besides powers of ten: foot, fathom and metre; knot, mile an hour, km/h and m/s; degF and
/// degC; degree and radian; minute and hour, and second; psi and kPa; inch and cm; pound and kg; horsepower and kW.
const CONVERSIONS: [f64; 18] = [
    0.3048, 1.8288, 6.0, 0.514_444, 1.852, 1.150_779, 0.447_04, 1.609_344, 3.6, 1.8, 57.295_78, 60.0,
    3_600.0, 6.894_757, 2.54, 0.453_592, 0.745_7, 1.0,
];

/// The largest power of ten between two units of one quantity.
const MOST_TENS: i32 = 6;

/// How many times the largest error of rounding a signal has to move: what moves less equals others by chance.
const BEYOND_ROUNDING: f64 = 10.0;

/// The error of two roundings is known: an error of 50 values that is larger by this factor has noise of its own in it.
const OWN_NOISE: f64 = 1.15;

/// How far from a multiple of the step of rounding a value may be, in steps.
const OFF_GRID: f64 = 0.05;

/// Two grids of the same step show the same values of one measurement: then the copy is exact, and no matter of rounding.
const ONE_GRID: f64 = 0.02;

/// The step to which values are rounded: all of them are multiples of it; 0 where there is none. Time: O(n log n).
pub(super) fn step(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let largest = values.iter().map(|it| it.abs()).fold(0.0, f64::max);
    // Of equal numbers that were computed, the last digits differ.
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|it| *it > 1e-9 * largest);
    let least = steps.fold(f64::INFINITY, f64::min);
    let is_multiple = |value: &f64| {
        let count = (value - sorted[0]) / least;
        (count - count.round()).abs() < OFF_GRID
    };
    if least.is_finite() && sorted.iter().all(is_multiple) { least } else { 0.0 }
}

/// What one of two signals, with these steps of rounding, repeats of the other; the copy is the coarser one. Both have their values at
/// the same times. Time: O(n).
pub(super) fn of(seen: &Seen<'_>, later: (usize, f64), earlier: (usize, f64)) -> Option<Copied> {
    let spread = |signal: usize| variance(seen.curves[signal].values()).sqrt();
    // Rounding errors have the same size everywhere, so the better resolved of two signals moves by more of its steps.
    let is_finer = later.1 * spread(earlier.0) < (1.0 - ONE_GRID) * earlier.1 * spread(later.0);
    let (own, of) = if is_finer { (earlier, later) } else { (later, earlier) };
    let [values, others] = [own.0, of.0].map(|signal| seen.curves[signal].values());
    let numbers = solve(&[others.to_vec(), vec![1.0; others.len()]], values, |_| true)?;
    let steps = [own.1, numbers[0].abs() * of.1];
    let most = 0.5 * (steps[0] + steps[1]);
    let (factor, offset) = line(seen, own.0, of.0, numbers[0], most)?;
    let left: Vec<f64> =
        values.iter().zip(others).map(|(own, other)| own - factor * other - offset).collect();
    let expected = ((steps[0].powi(2) + steps[1].powi(2)) / 12.0).sqrt();
    let is_rounding = left.iter().all(|it| it.abs() <= 1.01 * most)
        && (mean(&left).powi(2) + variance(&left)).sqrt() <= OWN_NOISE * expected;
    let are_apart = (steps[0] / steps[1] - 1.0).abs() > ONE_GRID && most > 0.0;
    let is_copy = is_rounding && are_apart && spread(own.0) > BEYOND_ROUNDING * most;
    is_copy.then_some(Copied { signal: own.0, of: of.0, factor, offset })
}

/// The line from one signal to another by their units: in units that are known the values are equal, else the factor is one between
/// units. `None` where it is none. A line is right where it is off by no more than the largest error of rounding.
fn line(seen: &Seen<'_>, own: usize, of: usize, fitted: f64, most: f64) -> Option<(f64, f64)> {
    let [values, others] = [own, of].map(|signal| seen.curves[signal].values());
    let reach = variance(others).sqrt();
    let is_it = |factor: &f64| (fitted - factor).abs() * reach <= 0.5 * most;
    let offset = |factor: f64| mean(values) - factor * mean(others);
    match (&seen.signals[own].unit, &seen.signals[of].unit) {
        (Some(one), Some(other)) => {
            let is_same = one.dimension == other.dimension && is_it(&1.0) && offset(1.0).abs() <= most;
            is_same.then_some((1.0, 0.0))
        }
        _ => conversions().find(is_it).map(|factor| (factor, offset(factor))),
    }
}

/// All factors between two units.
fn conversions() -> impl Iterator<Item = f64> {
    let both = CONVERSIONS.into_iter().flat_map(|factor| [factor, 1.0 / factor]);
    both.flat_map(|factor| (-MOST_TENS..=MOST_TENS).map(move |tens| factor * 10.0_f64.powi(tens)))
}
