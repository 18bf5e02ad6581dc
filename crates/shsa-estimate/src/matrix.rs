//! Small symmetric matrices: propagation, factors and repair without allocation; zero pivots are allowed.
//!
//! Matrices are those of `nalgebra`, whose columns are contiguous.

use crate::Error;
use crate::kernel::{self, Definite, Factor, Product, Propagate, add_scaled, dot};
use nalgebra::DMatrix;

/// A dense matrix of `f64`.
pub type Matrix = DMatrix<f64>;

/// An element; 0 beyond the end.
#[inline]
pub(crate) fn at(matrix: &Matrix, row: usize, column: usize) -> f64 {
    matrix.as_slice().get(column * matrix.nrows() + row).copied().unwrap_or(0.0)
}

/// Sets an element.
#[inline]
pub(crate) fn put(matrix: &mut Matrix, row: usize, column: usize, value: f64) {
    let place = column * matrix.nrows() + row;
    if let Some(element) = matrix.as_mut_slice().get_mut(place) {
        *element = value;
    }
}

/// Column `column` of a matrix with `rows` rows.
#[inline]
pub(crate) fn column(matrix: &Matrix, column: usize) -> &[f64] {
    let rows = matrix.nrows();
    matrix.as_slice().get(column * rows..(column + 1) * rows).unwrap_or(&[])
}

/// Column `column` of a matrix, mutable.
#[inline]
pub(crate) fn column_mut(matrix: &mut Matrix, column: usize) -> &mut [f64] {
    let rows = matrix.nrows();
    matrix.as_mut_slice().get_mut(column * rows..(column + 1) * rows).unwrap_or(&mut [])
}

/// `to = matrix * vector` for a square matrix.
#[inline]
pub(crate) fn multiply(matrix: &Matrix, vector: &[f64], to: &mut [f64]) {
    kernel::run(Product { p: matrix.as_slice(), v: vector, to }, matrix.nrows(), &mut []);
}

/// `h' p h`. O(n^2).
pub(crate) fn variance_along(p: &Matrix, h: &[f64]) -> f64 {
    h.iter().enumerate().map(|(place, factor)| factor * dot(column(p, place), h)).sum()
}

/// `p <- a p a' + q` for symmetric `p` and `q`, all n by n; `work` has three columns more. O(n^3), less where `a` has zeros.
pub fn propagate(a: &Matrix, p: &mut Matrix, q: &Matrix, work: &mut Matrix) {
    let n = p.ncols();
    let Some((work, scratch)) = work.as_mut_slice().split_at_mut_checked(n * n) else { return };
    let (a, q) = (a.as_slice(), q.as_slice());
    kernel::run(Propagate { a, p: p.as_mut_slice(), q, work }, n, scratch);
}

/// Working memory of [`propagate`] for n rows.
#[must_use]
pub fn work(n: usize) -> Matrix {
    Matrix::zeros(n, n + kernel::SCRATCH)
}

/// Replaces both triangles by their mean. O(n^2).
pub fn symmetrise(p: &mut Matrix) {
    let n = p.ncols();
    kernel::symmetrise(p.as_mut_slice(), n);
}

/// The factors of `p = l diag(d) l'` of a symmetric positive semidefinite matrix, with ones on the diagonal of `l`.
#[derive(Clone, Debug)]
pub struct Factors {
    /// Lower triangular, ones on the diagonal; zeros below a pivot that is zero.
    pub l: Matrix,
    /// The pivots, none negative.
    pub d: Vec<f64>,
    size: usize,
    scratch: Vec<f64>,
    /// A copy of a part of a matrix, and of its factor.
    part: Vec<f64>,
}

impl Factors {
    /// Memory for matrices of up to `n` rows.
    #[must_use]
    pub fn new(n: usize) -> Factors {
        Factors {
            l: Matrix::zeros(n, n),
            d: vec![0.0; n],
            size: n,
            scratch: vec![0.0; kernel::SCRATCH * n],
            part: vec![0.0; 2 * n * n],
        }
    }

    /// Factors the first `n` rows and columns of a matrix, from its lower triangle. Returns place and value of the first pivot
    /// that is negative beyond rounding, or not a number; this pivot counts as zero. O(n^3 / 6).
    ///
    /// G. Golub, C. Van Loan, "Matrix Computations", 4.1.2 and 4.2.8 (2013, doi:10.56021/9781421407944).
    pub fn factor(&mut self, p: &Matrix, n: usize) -> Option<(usize, f64)> {
        self.size = n.min(p.nrows()).min(self.l.nrows());
        let (size, whole) = (self.size, self.l.nrows());
        let (l, d) = (self.l.as_mut_slice(), self.d.as_mut_slice());
        if p.nrows() == whole && size == whole {
            let factor = Factor { p: p.as_slice(), l, d };
            return kernel::run(factor, size, &mut self.scratch);
        }
        // The columns of a part are copied together, and copied back.
        let (part, factors) = self.part.split_at_mut(size * size);
        for (to, from) in part.chunks_exact_mut(size.max(1)).zip(p.column_iter()) {
            to.iter_mut().zip(from.as_slice()).for_each(|(to, from)| *to = *from);
        }
        let worst = kernel::run(Factor { p: part, l: factors, d }, size, &mut self.scratch);
        for (from, to) in factors.chunks_exact(size.max(1)).zip(l.chunks_exact_mut(whole.max(1))).take(size) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        worst
    }

    /// `v <- l^-1 v`. O(n^2).
    pub fn solve_lower(&self, v: &mut [f64]) {
        for k in 0..self.size {
            let known = v.get(k).copied().unwrap_or(0.0);
            if known != 0.0 {
                let below = column(&self.l, k).get(k + 1..self.size).unwrap_or(&[]);
                add_scaled(v.get_mut(k + 1..).unwrap_or(&mut []), -known, below);
            }
        }
    }

    /// `to <- l diag(sqrt d) v`: standard normal numbers become correlated ones. O(n^2).
    pub fn colour(&self, v: &[f64], to: &mut [f64]) {
        to.fill(0.0);
        for (k, (v, d)) in v.iter().zip(&self.d).take(self.size).enumerate() {
            let factor = v * d.sqrt();
            add_scaled(
                to.get_mut(k..).unwrap_or(&mut []),
                factor,
                column(&self.l, k).get(k..).unwrap_or(&[]),
            );
        }
    }

    /// Puts the product of the factors into the first rows and columns of a matrix. O(n^3 / 3).
    pub fn product(&self, p: &mut Matrix) {
        for j in 0..self.size {
            for i in j..self.size {
                let terms = (0..=j).zip(&self.d).map(|(k, d)| at(&self.l, i, k) * d * at(&self.l, j, k));
                let sum = terms.sum();
                put(p, i, j, sum);
                put(p, j, i, sum);
            }
        }
    }
}

/// Repairs a symmetric covariance after rounding errors: negative pivots become zero. Returns whether there were any. `work` is
/// that of [`propagate`]. O(n^3 / 2).
pub(crate) fn heal(p: &mut Matrix, factors: &mut Factors, work: &mut Matrix) -> bool {
    let n = p.ncols();
    let Some((work, scratch)) = work.as_mut_slice().split_at_mut_checked(n * n) else { return false };
    let is_sound = kernel::run(Definite { p: p.as_slice(), work }, n, scratch).unwrap_or(true);
    if !is_sound {
        factors.factor(p, n);
        factors.product(p);
    }
    !is_sound
}

/// Whether a matrix is a covariance of `n` numbers.
///
/// # Errors
/// A wrong size, a negative pivot, or an entry that is not a number.
pub fn check_covariance(what: &'static str, p: &Matrix, n: usize) -> Result<(), Error> {
    if p.shape() != (n, n) {
        return Err(Error::Size { what, found: p.len(), wanted: n * n });
    }
    if let Some((place, pivot)) = Factors::new(n).factor(p, n) {
        return Err(Error::NotDefinite { what, place, pivot });
    }
    let mut rebuilt = p.clone();
    let mut factors = Factors::new(n);
    factors.factor(p, n);
    factors.product(&mut rebuilt);
    // A zero pivot hides the rest of its column: an entry that is not rebuilt was a correlation with something certain.
    for (place, (found, wanted)) in rebuilt.iter().zip(p).enumerate() {
        let (i, j) = (place % n.max(1), place / n.max(1));
        let scale = (at(p, i, i) * at(p, j, j)).sqrt();
        if (found - wanted).abs() > 1e-9 * scale + f64::MIN_POSITIVE {
            return Err(Error::NotDefinite { what, place: i.max(j), pivot: 0.0 });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn zero_pivots_are_no_loss_and_negative_ones_are_reported() {
        let mut factors = Factors::new(2);
        let mut p = Matrix::from_row_slice(2, 2, &[0.0, 0.0, 0.0, 4.0]);
        assert_eq!(factors.factor(&p, 2), None);
        assert_eq!(factors.d, [0.0, 4.0]);
        p = Matrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        assert_eq!(factors.factor(&p, 2), Some((1, -3.0)));
        assert!(heal(&mut p, &mut factors, &mut work(2)));
        assert_eq!(p, Matrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]));
        assert!(!heal(&mut p, &mut factors, &mut work(2)));
    }

    #[test]
    fn a_variance_that_has_vanished_costs_the_others_nothing() {
        let vanished = 5e-324;
        let p = Matrix::from_row_slice(3, 3, &[4.0, 0.0, 1.0, 0.0, vanished, 0.0, 1.0, 0.0, 9.0]);
        let (mut factors, mut healed) = (Factors::new(3), p.clone());
        assert_eq!(factors.factor(&p, 3), None);
        assert_eq!(factors.d, [4.0, 0.0, 8.75]);
        assert!(!heal(&mut healed, &mut factors, &mut work(3)));
        assert_eq!(healed, p);
    }

    #[test]
    fn covariances_are_checked() {
        let check = |numbers: &[f64]| check_covariance("P0", &Matrix::from_row_slice(2, 2, numbers), 2);
        assert_eq!(check(&[1.0, 0.5, 0.5, 1.0]), Ok(()));
        assert_eq!(check(&[0.0, 0.0, 0.0, 0.0]), Ok(()));
        assert!(check(&[1.0, 2.0, 2.0, 1.0]).is_err());
        assert!(check(&[0.0, 1.0, 1.0, 1.0]).is_err());
        assert!(check(&[f64::NAN, 0.0, 0.0, 1.0]).is_err());
        assert!(check(&[1.0, 0.5, 0.2, 1.0]).is_err());
    }

    proptest! {
        /// The first two rows are almost parallel where `beside` is small: then rounding is magnified. Where they are closer still, a
        /// pivot may be nothing but rounding, and no factors without an exchange of rows give the matrix again.
        #[test]
        fn factors_give_the_matrix_again(numbers in prop::collection::vec(-3.0..3.0_f64, 12), beside in -3.0..0.5_f64) {
            let mut half = Matrix::from_row_slice(4, 3, &numbers);
            let near = half.row(0) + half.row(1) * 10_f64.powf(beside);
            half.set_row(1, &near);
            let p = &half * half.transpose();
            let mut factors = Factors::new(4);
            prop_assert_eq!(factors.factor(&p, 4), None);
            let mut sound = p.clone();
            prop_assert!(!heal(&mut sound, &mut Factors::new(4), &mut work(4)));
            let mut again = Matrix::zeros(4, 4);
            factors.product(&mut again);
            // A pivot within rounding of zero is taken for zero with its column, which is as large as the root of the pivot. How far
            // rounding goes is what `lost` says.
            let kept = (0..4).filter(|i| factors.d[*i] > 0.0).map(|i| p[(i, i)] / factors.d[i]);
            let share = 4.0 * (16.0 * f64::EPSILON * kept.product::<f64>()).sqrt();
            prop_assert!((&again - &p).amax() <= share * p.amax(), "{share} {again} {p}");
        }

        #[test]
        fn propagation_is_that_of_nalgebra(numbers in prop::collection::vec(-3.0..3.0_f64, 27)) {
            let a = Matrix::from_row_slice(3, 3, &numbers[..9]);
            let half = Matrix::from_row_slice(3, 3, &numbers[9..18]);
            let (mut p, q) = (&half * half.transpose(), Matrix::identity(3, 3));
            let wanted = &a * &p * a.transpose() + &q;
            propagate(&a, &mut p, &q, &mut work(3));
            prop_assert!((&p - &wanted).amax() < 1e-9);
        }
    }
}
