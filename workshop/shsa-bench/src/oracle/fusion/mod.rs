//! Recorded estimates: filters, windows and intervals, computed by others in high precision.
//!
//! A covariance is recorded as its upper triangle, row by row. An estimate is equal when the error of each state is at most the
//! tolerance times `s + 0.001 |x|`, and that of each covariance at most the tolerance times `s_i s_j`, plus 1e-15.

mod model;
mod matrices;
mod formulas;
mod out_of_sequence;
mod without_model;
mod distributions;
mod package;

use super::Compared;
use serde::Deserialize;
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::Method;

pub(super) use package::compare as compare_package;

/// A file of `shsa-fusion-oracle-1`.
#[derive(Deserialize)]
pub(super) struct Recorded {
    linear: Vec<matrices::Linear>,
    particle: Vec<matrices::Particles>,
    nonlinear: Vec<formulas::Nonlinear>,
    out_of_sequence: Vec<out_of_sequence::OutOfSequence>,
    gating: Vec<formulas::Gating>,
    masking: Vec<formulas::Masking>,
    intervals: Vec<without_model::Intervals>,
    moving: Vec<without_model::Moving>,
    recursive_average: Vec<without_model::Recursive>,
    weighted_by_confidence: Vec<without_model::Weighted>,
}

/// Compares all cases.
///
/// # Errors
/// When a case is no valid model.
pub(super) fn compare(recorded: &Recorded, compared: &mut Compared) -> anyhow::Result<()> {
    recorded.linear.iter().try_for_each(|case| matrices::compare_linear(case, compared))?;
    recorded.particle.iter().try_for_each(|case| matrices::compare_particles(case, compared))?;
    recorded.nonlinear.iter().try_for_each(|case| formulas::compare_nonlinear(case, compared))?;
    recorded.out_of_sequence.iter().try_for_each(|case| out_of_sequence::compare(case, compared))?;
    recorded.gating.iter().try_for_each(|case| formulas::compare_gating(case, compared))?;
    recorded.masking.iter().try_for_each(|case| formulas::compare_masking(case, compared))?;
    without_model::compare_intervals(&recorded.intervals, compared);
    recorded.moving.iter().try_for_each(|case| without_model::compare_moving(case, compared))?;
    recorded
        .recursive_average
        .iter()
        .try_for_each(|case| without_model::compare_recursive(case, compared))?;
    without_model::compare_weighted(&recorded.weighted_by_confidence, compared);
    Ok(())
}

/// A matrix of rows.
fn matrix(rows: &[Vec<f64>]) -> Matrix {
    let columns = rows.first().map_or(0, Vec::len);
    Matrix::from_fn(rows.len(), columns, |row, column| rows[row].get(column).copied().unwrap_or(f64::NAN))
}

/// The expected estimate.
#[derive(Clone, Copy)]
struct Wanted<'a> {
    x: &'a [f64],
    p: &'a [f64],
    tolerance_x: f64,
    tolerance_p: f64,
}

impl Wanted<'_> {
    /// The differences as text.
    fn differences(&self, label: &str, method: &dyn Method) -> Vec<String> {
        self.differences_of(label, method.mean(), method.spread())
    }

    fn differences_of(&self, label: &str, mean: &[f64], spread: &Matrix) -> Vec<String> {
        let n = self.x.len();
        let places: Vec<(usize, usize)> = (0..n).flat_map(|i| (i..n).map(move |j| (i, j))).collect();
        if mean.len() != n || places.len() != self.p.len() {
            return vec![format!("{label}: {} states, not {n}", mean.len())];
        }
        let diagonal = places.iter().zip(self.p).filter(|((i, j), _)| i == j);
        let s: Vec<f64> = diagonal.map(|(_, p)| p.max(0.0).sqrt()).collect();
        let x = mean.iter().zip(self.x).zip(&s).enumerate().filter_map(|(place, ((found, x), s))| {
            let is_near = (found - x).abs() <= self.tolerance_x * (s + 0.001 * x.abs());
            (!is_near).then(|| format!("{label}: state {place} is {found}, not {x}"))
        });
        let p = places.iter().zip(self.p).filter_map(|((i, j), p)| {
            let found = spread[(*i, *j)];
            let is_near = (found - p).abs() <= self.tolerance_p * s[*i] * s[*j] + 1e-15;
            (!is_near).then(|| format!("{label}: covariance {i} {j} is {found}, not {p}"))
        });
        x.chain(p).collect()
    }
}

/// Whether two numbers are equal within a relative tolerance, or both absent.
fn is_near(found: Option<f64>, wanted: Option<f64>, tolerance: f64) -> bool {
    match (found, wanted) {
        (Some(found), Some(wanted)) => (found - wanted).abs() <= tolerance * (1.0 + wanted.abs()),
        (found, wanted) => found.is_none() && wanted.is_none(),
    }
}

/// The difference of a number as text.
fn number(
    label: &str,
    what: &str,
    found: Option<f64>,
    wanted: Option<f64>,
    tolerance: f64,
) -> Option<String> {
    (!is_near(found, wanted, tolerance)).then(|| format!("{label}: {what} is {found:?}, not {wanted:?}"))
}
