//! The inner loops of the filters, for any number of states; unrolled for up to eight, as the compiler knows the number.
//!
//! A matrix is a slice of columns. All loops run down whole columns, so that they become vector instructions. Zeros in a
//! transition or a gradient are skipped, as most entries are zero in most models.

/// Columns of working memory that a kernel may use.
pub(crate) const SCRATCH: usize = 3;

/// The number of rows of a kernel's matrices, which determines the place of their columns.
pub(crate) trait Size: Copy {
    /// The number of rows.
    fn rows(self) -> usize;

    /// The columns of a matrix.
    fn columns(self, matrix: &[f64]) -> impl Iterator<Item = &[f64]>;

    /// The columns of a matrix, mutable.
    fn columns_mut(self, matrix: &mut [f64]) -> impl Iterator<Item = &mut [f64]>;
}

/// A number known at compile time.
#[derive(Clone, Copy)]
struct Known<const N: usize>;

impl<const N: usize> Size for Known<N> {
    #[inline(always)]
    fn rows(self) -> usize {
        N
    }

    #[inline(always)]
    fn columns(self, matrix: &[f64]) -> impl Iterator<Item = &[f64]> {
        matrix.as_chunks::<N>().0.iter().map(<[f64; N]>::as_slice)
    }

    #[inline(always)]
    fn columns_mut(self, matrix: &mut [f64]) -> impl Iterator<Item = &mut [f64]> {
        matrix.as_chunks_mut::<N>().0.iter_mut().map(<[f64; N]>::as_mut_slice)
    }
}

/// Any other number but 0.
#[derive(Clone, Copy)]
struct Any(usize);

impl Size for Any {
    fn rows(self) -> usize {
        self.0
    }

    fn columns(self, matrix: &[f64]) -> impl Iterator<Item = &[f64]> {
        matrix.chunks_exact(self.0)
    }

    fn columns_mut(self, matrix: &mut [f64]) -> impl Iterator<Item = &mut [f64]> {
        matrix.chunks_exact_mut(self.0)
    }
}

/// A computation over matrices of a number of rows.
pub(crate) trait Kernel {
    /// The result.
    type Output;

    /// Computes; `scratch` holds [`SCRATCH`] columns.
    fn run(self, size: impl Size, scratch: &mut [f64]) -> Option<Self::Output>;
}

/// Runs a kernel on matrices of `n` rows; `scratch` holds [`SCRATCH`] times `n` numbers. Up to eight rows each number has code of
/// its own.
pub(crate) fn run<K: Kernel>(kernel: K, n: usize, scratch: &mut [f64]) -> Option<K::Output> {
    match n {
        0 => None,
        1 => kernel.run(Known::<1>, &mut [0.0; SCRATCH]),
        2 => kernel.run(Known::<2>, &mut [0.0; 2 * SCRATCH]),
        3 => kernel.run(Known::<3>, &mut [0.0; 3 * SCRATCH]),
        4 => kernel.run(Known::<4>, &mut [0.0; 4 * SCRATCH]),
        5 => kernel.run(Known::<5>, &mut [0.0; 5 * SCRATCH]),
        6 => kernel.run(Known::<6>, &mut [0.0; 6 * SCRATCH]),
        7 => kernel.run(Known::<7>, &mut [0.0; 7 * SCRATCH]),
        8 => kernel.run(Known::<8>, &mut [0.0; 8 * SCRATCH]),
        _ => kernel.run(Any(n), scratch),
    }
}

/// `to += factor * from`, element by element.
#[inline(always)]
pub(crate) fn add_scaled(to: &mut [f64], factor: f64, from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += factor * from;
    }
}

/// The sum of the products, in two independent parts.
#[inline(always)]
pub(crate) fn dot(one: &[f64], other: &[f64]) -> f64 {
    let ((one, last), (other, other_last)) = (one.as_chunks::<2>(), other.as_chunks::<2>());
    let mut parts = [0.0; 2];
    for ([a, b], [c, d]) in one.iter().zip(other) {
        parts[0] += a * c;
        parts[1] += b * d;
    }
    let rest: f64 = last.iter().zip(other_last).map(|(one, other)| one * other).sum();
    parts[0] + parts[1] + rest
}

/// Whether all numbers are finite. Tests all of them, many at once: zero times any other number is no number.
#[inline]
pub(crate) fn are_finite(numbers: &[f64]) -> bool {
    let (chunks, rest) = numbers.as_chunks::<4>();
    let mut parts = [0.0; 4];
    for chunk in chunks {
        parts.iter_mut().zip(chunk).for_each(|(part, number)| *part += number * 0.0);
    }
    let rest: f64 = rest.iter().map(|number| number * 0.0).sum();
    parts.iter().sum::<f64>() + rest == 0.0
}

/// The first `n` numbers of three columns of working memory.
#[inline(always)]
fn columns(scratch: &mut [f64], n: usize) -> Option<[&mut [f64]; SCRATCH]> {
    let (one, rest) = scratch.split_at_mut_checked(n)?;
    let (other, rest) = rest.split_at_mut_checked(n)?;
    Some([one, other, rest.get_mut(..n)?])
}

/// Copies the lower triangle to the upper one.
#[inline(always)]
fn mirror(p: &mut [f64], n: usize) {
    for j in 1..n {
        for i in 0..j {
            let below = p.get(i * n + j).copied().unwrap_or(0.0);
            if let Some(above) = p.get_mut(j * n + i) {
                *above = below;
            }
        }
    }
}

/// Replaces both triangles by their mean.
#[inline(always)]
pub(crate) fn symmetrise(p: &mut [f64], n: usize) {
    for j in 1..n {
        for i in 0..j {
            let (above, below) = (j * n + i, i * n + j);
            let pair = p.get(above).copied().zip(p.get(below).copied());
            let mean = pair.map_or(0.0, |(above, below)| 0.5 * (above + below));
            for place in [above, below] {
                if let Some(own) = p.get_mut(place) {
                    *own = mean;
                }
            }
        }
    }
}

/// `p <- a p a' + q` for symmetric `p` and `q`; `work` has the size of `p`. n^3 products, 2 n^3 where `a` has no zeros.
pub(crate) struct Propagate<'a> {
    pub(crate) a: &'a [f64],
    pub(crate) p: &'a mut [f64],
    pub(crate) q: &'a [f64],
    pub(crate) work: &'a mut [f64],
}

impl Kernel for Propagate<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, size: impl Size, scratch: &mut [f64]) -> Option<()> {
        let n = size.rows();
        let (a, p) = (self.a.get(..n * n)?, self.p.get_mut(..n * n)?);
        let (q, work) = (self.q.get(..n * n)?, self.work.get_mut(..n * n)?);
        let sum = scratch.get_mut(..n)?;
        // Column k of `work` becomes row k of `p a'`.
        for j in 0..n {
            sum.fill(0.0);
            for (a, p) in size.columns(a).zip(size.columns(p)) {
                let factor = *a.get(j)?;
                if factor != 0.0 {
                    add_scaled(sum, factor, p);
                }
            }
            for (row, sum) in size.columns_mut(work).zip(sum.iter()) {
                *row.get_mut(j)? = *sum;
            }
        }
        for (j, (to, q)) in size.columns_mut(p).zip(size.columns(q)).enumerate() {
            sum.copy_from_slice(q);
            for (a, row) in size.columns(a).zip(size.columns(work)) {
                let factor = *a.get(j)?;
                if factor != 0.0 {
                    add_scaled(sum, factor, row);
                }
            }
            to.copy_from_slice(sum);
        }
        mirror(p, n);
        Some(())
    }
}

/// Processes a scalar measurement, `h' x` with noise, by Joseph's form: `P <- (I - k h') P (I - k h')' + r k k'` with `k = P h /
/// (h' P h + r)`. 4 n^2 products.
pub(crate) struct Absorb<'a> {
    pub(crate) p: &'a mut [f64],
    pub(crate) h: &'a [f64],
    pub(crate) noise: f64,
    /// The measured value minus the expectation before all measurements of this moment.
    pub(crate) apart: f64,
    /// The change of the mean since then.
    pub(crate) step: &'a mut [f64],
}

/// The result of a scalar measurement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Absorbed {
    /// The measured value minus the expectation after the earlier measurements.
    pub(crate) apart: f64,
    /// The variance of `apart`.
    pub(crate) variance: f64,
}

impl Kernel for Absorb<'_> {
    /// No result where the state is certain and measured without noise: the measurement adds nothing.
    type Output = Absorbed;

    #[inline(always)]
    fn run(self, size: impl Size, scratch: &mut [f64]) -> Option<Absorbed> {
        let n = size.rows();
        let (p, h, step) = (self.p.get_mut(..n * n)?, self.h.get(..n)?, self.step.get_mut(..n)?);
        let [ph, gain, rest] = columns(scratch, n)?;
        product(p, h, ph, size);
        let variance = dot(h, ph) + self.noise;
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        let apart = self.apart - dot(h, step);
        gain.iter_mut().zip(ph.iter()).for_each(|(gain, ph)| *gain = ph / variance);
        add_scaled(step, apart, gain);
        for (column, ph) in size.columns_mut(p).zip(ph.iter()) {
            add_scaled(column, -ph, gain);
        }
        // The second factor is computed from `P` again instead of simplified by algebra: this keeps `P` positive.
        product(p, h, rest, size);
        rest.iter_mut().zip(gain.iter()).for_each(|(rest, gain)| *rest = self.noise * gain - *rest);
        for (column, gain) in size.columns_mut(p).zip(gain.iter()) {
            add_scaled(column, *gain, rest);
        }
        // For a measurement far better than the state, one triangle alone loses digits that the mean of both keeps.
        symmetrise(p, n);
        Some(Absorbed { apart, variance })
    }
}

/// `to <- p h`.
#[inline(always)]
fn product(p: &[f64], h: &[f64], to: &mut [f64], size: impl Size) {
    to.fill(0.0);
    for (column, h) in size.columns(p).zip(h) {
        if *h != 0.0 {
            add_scaled(to, *h, column);
        }
    }
}

/// `to <- p v` for a square matrix. n^2 products.
pub(crate) struct Product<'a> {
    pub(crate) p: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) to: &'a mut [f64],
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, size: impl Size, _: &mut [f64]) -> Option<()> {
        let n = size.rows();
        product(self.p.get(..n * n)?, self.v.get(..n)?, self.to.get_mut(..n)?, size);
        Some(())
    }
}

/// A pivot up to this share of its diagonal element counts as zero.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Whether a pivot counts as zero: within rounding of its diagonal element, or so small that its inverse is no number. The
/// variance of a state that forgets its past without noise gets as small as that.
#[inline(always)]
fn is_nothing(pivot: f64, own: f64) -> bool {
    pivot <= ROUNDING * own || pivot < f64::MIN_POSITIVE
}

/// How far rounding alone may bring a pivot below zero, as a share of its diagonal element, while no earlier pivot is small.
const LOST: f64 = 1e-10;

/// How far rounding alone may bring a pivot below zero, as a share of its diagonal element. An earlier pivot is wrong by about
/// [`ROUNDING`] of its own diagonal element; divided by the pivot, this share carries over to all later ones, and is magnified
/// again by each. `magnified` is the product of the diagonal elements so far, in units of their pivots. A negative pivot that is
/// not reported counts as zero all the same.
#[inline(always)]
fn lost(magnified: f64) -> f64 {
    LOST.max(ROUNDING * magnified)
}

/// `p = l diag(d) l'`, of the lower triangle of `p`. n^3 / 2 products.
pub(crate) struct Factor<'a> {
    pub(crate) p: &'a [f64],
    pub(crate) l: &'a mut [f64],
    pub(crate) d: &'a mut [f64],
}

impl Kernel for Factor<'_> {
    /// Place and value of the first pivot that is negative beyond rounding, or not a number.
    type Output = (usize, f64);

    #[inline(always)]
    fn run(self, size: impl Size, scratch: &mut [f64]) -> Option<(usize, f64)> {
        let n = size.rows();
        let (p, l, d) = (self.p.get(..n * n)?, self.l.get_mut(..n * n)?, self.d.get_mut(..n)?);
        let (sum, mut worst, mut magnified) = (scratch.get_mut(..n)?, None, 1.0_f64);
        for (j, column) in size.columns(p).enumerate() {
            sum.copy_from_slice(column);
            for (l, d) in size.columns(l).zip(d.iter()).take(j) {
                add_scaled(sum, -l.get(j)? * d, l);
            }
            let (pivot, own) = (*sum.get(j)?, column.get(j)?.abs());
            let is_number = pivot.is_finite();
            if (pivot < -lost(magnified) * own || !is_number) && worst.is_none() {
                worst = Some((j, pivot));
            }
            let is_zero = is_nothing(pivot, own) || !is_number;
            *d.get_mut(j)? = if is_zero { 0.0 } else { pivot };
            let l = l.get_mut(j * n..(j + 1) * n)?;
            if is_zero {
                l.fill(0.0);
            } else {
                let inverse = 1.0 / pivot;
                magnified *= own * inverse;
                l.iter_mut().zip(sum.iter()).for_each(|(l, sum)| *l = sum * inverse);
                l.get_mut(..j)?.fill(0.0);
            }
            *l.get_mut(j)? = 1.0;
        }
        worst
    }
}

/// Whether the symmetric `p` has no pivot that is negative beyond rounding, or not a number. n^3 / 2 products.
pub(crate) struct Definite<'a> {
    pub(crate) p: &'a [f64],
    /// Working memory of the size of `p`.
    pub(crate) work: &'a mut [f64],
}

impl Kernel for Definite<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self, size: impl Size, scratch: &mut [f64]) -> Option<bool> {
        let n = size.rows();
        let (p, work) = (self.p.get(..n * n)?, self.work.get_mut(..n * n)?);
        work.copy_from_slice(p);
        let (eliminated, mut is_sound, mut magnified) = (scratch.get_mut(..n)?, true, 1.0_f64);
        // Each pivot is eliminated from all later columns at once, which is faster than column by column.
        for j in 0..n {
            let (pivot, own) = (*work.get(j * n + j)?, p.get(j * n + j)?.abs());
            is_sound &= pivot >= -lost(magnified) * own && pivot.is_finite();
            if !is_nothing(pivot, own) {
                eliminated.copy_from_slice(work.get(j * n..(j + 1) * n)?);
                let inverse = 1.0 / pivot;
                magnified *= own * inverse;
                for (column, below) in size.columns_mut(work).zip(eliminated.iter()).skip(j + 1) {
                    add_scaled(column, -below * inverse, eliminated);
                }
            }
        }
        Some(is_sound)
    }
}
