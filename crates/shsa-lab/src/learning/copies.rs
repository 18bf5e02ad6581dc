//! Signals that are computed from another one with its noise: they are no independent witnesses.

use crate::learning::least_squares::solve;
use crate::learning::signal::Seen;

/// A signal that repeats another.
#[derive(Clone, Debug, PartialEq)]
pub struct Copied {
    /// The copy.
    pub signal: usize,
    /// The original.
    pub of: usize,
    /// The factor, in SI units.
    pub factor: f64,
    /// The offset, in SI units.
    pub offset: f64,
}

/// The relative rounding of written numbers.
const ROUNDED: f64 = 2e-6;

/// A signal that moves by less than this many roundings equals others by chance.
const BEYOND_ROUNDING: f64 = 100.0;

/// Signals with fewer different values, and fewer changes between these, equal others by chance.
const LEAST_VALUES: usize = 50;
const LEAST_CHANGES: usize = 15;

/// How many values are compared before all of them.
const SAMPLES: usize = 64;

/// What the comparisons of a signal with each other one need of its values.
struct Shape {
    signal: usize,
    /// The indices of the smallest and of the largest value.
    extremes: [usize; 2],
    /// The largest size of a value.
    largest: f64,
    /// Whether it has enough different values or changes.
    is_varied: bool,
}

impl Shape {
    /// The shape of a signal's values; `None` where there are too few. Time: O(n log n).
    fn of(signal: usize, values: &[f64]) -> Option<Shape> {
        if values.len() < LEAST_VALUES {
            return None;
        }
        let by_value = |one: &usize, other: &usize| values[*one].total_cmp(&values[*other]);
        let extremes = [(0..values.len()).min_by(by_value)?, (0..values.len()).max_by(by_value)?];
        let largest = values.iter().map(|it| it.abs()).fold(0.0, f64::max);
        let is_varied = changes(values) >= LEAST_CHANGES || different(values) >= LEAST_VALUES;
        Some(Shape { signal, extremes, largest, is_varied })
    }
}

/// All copies; of two signals with the same values, the later one counts as the copy.
///
/// Time: O(signals^2), and O(n) for each two signals that look alike.
pub(crate) fn all(seen: &Seen<'_>) -> Vec<Copied> {
    let shape = |signal: usize| Shape::of(signal, seen.curves[signal].values());
    let shapes: Vec<Shape> = (0..seen.signals.len()).filter_map(shape).collect();
    let mut copies: Vec<Copied> = Vec::new();
    for (at, shape) in shapes.iter().enumerate().filter(|(_, shape)| shape.is_varied) {
        let is_original = |it: &&Shape| copies.iter().all(|copy| copy.signal != it.signal);
        let copy = shapes[..at].iter().filter(is_original).find_map(|of| copied(seen, shape, of));
        copies.extend(copy);
    }
    copies
}

fn copied(seen: &Seen<'_>, shape: &Shape, original: &Shape) -> Option<Copied> {
    let (own, other) = (&seen.curves[shape.signal], &seen.curves[original.signal]);
    let have_one_length = own.values().len() == other.values().len();
    if !have_one_length || !look_alike(seen, shape, original) || own.times() != other.times() {
        return None;
    }
    let columns = [other.values().to_vec(), vec![1.0; other.values().len()]];
    let numbers = solve(&columns, own.values(), |_| true)?;
    let (factor, offset) = (numbers[0], numbers[1]);
    let rounded = ROUNDED * (shape.largest + factor.abs() * original.largest);
    let is_exact = |(own, other): (&f64, &f64)| (own - factor * other - offset).abs() <= rounded;
    let is_copy = own.values().iter().zip(other.values()).all(is_exact)
        && crate::order::variance(own.values()).sqrt() > BEYOND_ROUNDING * rounded;
    is_copy.then_some(Copied { signal: shape.signal, of: original.signal, factor, offset })
}

/// Whether some values lie on the line through the original's extremes. A copy is within a rounding of its own line everywhere, so it
/// is within two of this one; twice that is allowed, as the factors of the two lines differ a little.
fn look_alike(seen: &Seen<'_>, shape: &Shape, original: &Shape) -> bool {
    let (own, other) = (seen.curves[shape.signal].values(), seen.curves[original.signal].values());
    let [least, most] = original.extremes;
    let factor = (own[most] - own[least]) / (other[most] - other[least]);
    let offset = own[least] - factor * other[least];
    let rounded = ROUNDED * (shape.largest + factor.abs() * original.largest);
    let mut samples = own.iter().zip(other).step_by(own.len().div_ceil(SAMPLES));
    samples.all(|(own, other)| (own - factor * other - offset).abs() <= 4.0 * rounded)
}

/// The number of different values.
fn different(values: &[f64]) -> usize {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.dedup();
    sorted.len()
}

/// How often a value differs from the one before.
fn changes(values: &[f64]) -> usize {
    values.windows(2).filter(|pair| pair[0] != pair[1]).count()
}
