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

/// How many times the largest error of rounding a signal has to move: what moves less equals others by chance; less in units that are
/// known, in which only one line is tried.
const BEYOND_ROUNDING: f64 = 10.0;
const BEYOND_IN_UNITS: f64 = 3.0;

/// The error of two roundings is known: an error of 50 values that is larger by this factor has noise of its own in it.
const OWN_NOISE: f64 = 1.15;

/// How far from a multiple of the step of rounding a value may be, in steps.
const OFF_GRID: f64 = 0.05;

/// The resolution of numbers of single precision, as a share of the largest one, and how many times as large a step is.
const SINGLE: f64 = 1.2e-7;
const FINEST: f64 = 20.0;

/// Of two values that are next to each other, at least two are not more steps apart.
const MOST_STEPS: u32 = 10;

/// Two grids of the same step show the same values of one measurement: then the copy is exact, and no matter of rounding.
const ONE_GRID: f64 = 0.02;

/// The step to which values are rounded: all of them are multiples of it; 0 where there is none. Time: O(n log n).
pub(super) fn step(values: &[f64]) -> f64 {
    let sorted = crate::order::sorted(values.iter().copied());
    let resolved = SINGLE * values.iter().map(|it| it.abs()).fold(0.0, f64::max);
    let apart = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|it| *it > resolved);
    let least = apart.fold(f64::INFINITY, f64::min);
    if !least.is_finite() || least <= FINEST * resolved {
        return 0.0;
    }
    let of = |parts: u32| on_grid(&sorted, least / f64::from(parts), OFF_GRID + resolved / least);
    (1..=MOST_STEPS).find_map(of).unwrap_or(0.0)
}

/// The step of a grid that is near to this one and on which all values lie, which are in order; `None` where one is off it by more
/// steps.
fn on_grid(sorted: &[f64], mut step: f64, off: f64) -> Option<f64> {
    let lowest = sorted.first()?;
    let off_grid = |value: &f64, step: f64| {
        let steps = (value - lowest) / step;
        (steps - steps.round()).abs()
    };
    // The last digits of each value are wrong, so a step is the more exact the more of them lie between two values.
    for value in sorted {
        let count = ((value - lowest) / step).round();
        if count >= 1.0 && off_grid(value, step) < 0.25 {
            step = (value - lowest) / count;
        }
    }
    sorted.iter().all(|value| off_grid(value, step) < off).then_some(step)
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
    let (factor, beyond) = line(seen, own.0, of.0, numbers[0], most)?;
    let left: Vec<f64> = values.iter().zip(others).map(|(own, other)| own - factor * other).collect();
    let (low, high) =
        left.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(*it), high.max(*it)));
    let offset = 0.5 * (low + high);
    let expected = ((steps[0].powi(2) + steps[1].powi(2)) / 12.0).sqrt();
    let is_rounding = high - low <= 2.02 * most && variance(&left).sqrt() <= OWN_NOISE * expected;
    let are_apart = (steps[0] / steps[1] - 1.0).abs() > ONE_GRID && most > 0.0;
    let is_copy = is_rounding && are_apart && spread(own.0) > beyond * most;
    is_copy.then_some(Copied { signal: own.0, of: of.0, factor, offset })
}

/// The factor from one signal to another by their units, and by how many errors of rounding they have to move: in units that are known
/// the values are equal, else the factor is one between units. `None` where it is none. A line is right where it is off by no more
/// than the largest error of rounding: values that are cut off are off by half a step.
fn line(seen: &Seen<'_>, own: usize, of: usize, fitted: f64, most: f64) -> Option<(f64, f64)> {
    let [values, others] = [own, of].map(|signal| seen.curves[signal].values());
    let reach = variance(others).sqrt();
    let is_it = |factor: &f64| (fitted - factor).abs() * reach <= 0.5 * most;
    match (&seen.signals[own].unit, &seen.signals[of].unit) {
        (Some(one), Some(other)) => {
            let from_zeros = other.offset - one.offset;
            let off = mean(values) - mean(others) - from_zeros;
            let is_same = one.dimension == other.dimension && is_it(&1.0) && off.abs() <= 1.01 * most;
            is_same.then_some((1.0, BEYOND_IN_UNITS))
        }
        _ => Some((conversions().find(is_it)?, BEYOND_ROUNDING)),
    }
}

/// All factors between two units.
fn conversions() -> impl Iterator<Item = f64> {
    let both = CONVERSIONS.into_iter().flat_map(|factor| [factor, 1.0 / factor]);
    both.flat_map(|factor| (-MOST_TENS..=MOST_TENS).map(move |tens| factor * 10.0_f64.powi(tens)))
}
