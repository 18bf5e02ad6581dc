//! Linear least squares with few unknowns.

use nalgebra::{DMatrix, DVector};

/// A column counts as dependent when less than this share of its length is orthogonal to the columns before it.
const DEPENDENT: f64 = 1e-9;

/// The factors by which the columns come nearest to the target over the used rows; `None` where columns are dependent, or rows
/// are fewer than columns. Time: O(rows * columns^2).
pub(crate) fn solve(
    columns: &[Vec<f64>],
    target: &[f64],
    is_used: impl Fn(usize) -> bool,
) -> Option<Vec<f64>> {
    let rows: Vec<usize> = (0..target.len()).filter(|row| is_used(*row)).collect();
    if rows.len() <= columns.len() {
        return None;
    }
    let dot = |one: &[f64], other: &[f64]| rows.iter().map(|row| one[*row] * other[*row]).sum::<f64>();
    let sizes: Vec<f64> = columns.iter().map(|column| dot(column, column).sqrt()).collect();
    if sizes.iter().any(|size| !(*size > 0.0 && size.is_finite())) {
        return None;
    }
    let count = columns.len();
    let normal = DMatrix::from_fn(count, count, |row, column| {
        dot(&columns[row], &columns[column]) / (sizes[row] * sizes[column])
    });
    let right = DVector::from_fn(count, |row, _| dot(&columns[row], target) / sizes[row]);
    let factor = normal.cholesky()?;
    if factor.l_dirty().diagonal().iter().any(|kept| *kept < DEPENDENT.sqrt()) {
        return None;
    }
    let solution = factor.solve(&right);
    Some(solution.iter().zip(&sizes).map(|(number, size)| number / size).collect())
}
