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

/// All copies; of two signals with the same values, the later one counts as the copy.
pub(crate) fn all(seen: &Seen<'_>) -> Vec<Copied> {
    let mut copies: Vec<Copied> = Vec::new();
    for signal in 0..seen.signals.len() {
        let originals = (0..signal).filter(|it| copies.iter().all(|copy| copy.signal != *it));
        let copy = originals.filter_map(|of| copied(seen, signal, of)).next();
        copies.extend(copy);
    }
    copies
}

fn copied(seen: &Seen<'_>, signal: usize, of: usize) -> Option<Copied> {
    let (own, other) = (&seen.curves[signal], &seen.curves[of]);
    if own.times() != other.times() || own.values().len() < LEAST_VALUES {
        return None;
    }
    let mut different = own.values().to_vec();
    different.sort_by(f64::total_cmp);
    different.dedup();
    if different.len() < LEAST_VALUES && changes(own.values()) < LEAST_CHANGES {
        return None;
    }
    let columns = [other.values().to_vec(), vec![1.0; other.values().len()]];
    let numbers = solve(&columns, own.values(), |_| true)?;
    let (factor, offset) = (numbers[0], numbers[1]);
    let largest = |values: &[f64]| values.iter().map(|it| it.abs()).fold(0.0, f64::max);
    let rounded = ROUNDED * (largest(own.values()) + factor.abs() * largest(other.values()));
    let is_exact = |(own, other): (&f64, &f64)| (own - factor * other - offset).abs() <= rounded;
    let is_copy = own.values().iter().zip(other.values()).all(is_exact)
        && crate::order::variance(own.values()).sqrt() > BEYOND_ROUNDING * rounded;
    is_copy.then_some(Copied { signal, of, factor, offset })
}

/// How often a value differs from the one before.
fn changes(values: &[f64]) -> usize {
    values.windows(2).filter(|pair| pair[0] != pair[1]).count()
}
