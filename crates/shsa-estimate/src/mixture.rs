//! The estimate of several weighted estimates: the mean and the covariance of their mixture.
//!
//! Y. Bar-Shalom, X. R. Li, T. Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation"
//! (doi:10.1002/0471221279), section 1.4.16.

use crate::method::Gaussian;

/// A part with a smaller share of the weight adds nothing to a covariance.
const NEGLIGIBLE: f64 = 1e-15;

/// One of the estimates.
#[derive(Clone, Copy)]
pub(crate) struct Part<'p> {
    /// The logarithm of its weight.
    pub(crate) weight: f64,
    pub(crate) mean: &'p [f64],
    /// Its covariance, column by column.
    pub(crate) spread: &'p [f64],
}

/// Sets an estimate to the mixture of the parts, unless none has a weight. Returns the logarithm of the sum of their weights. No
/// allocation; O(parts n^2) for n states.
pub(crate) fn mix<'p>(to: &mut Gaussian, parts: impl Iterator<Item = Part<'p>> + Clone) -> f64 {
    let greatest = parts.clone().map(|part| part.weight).fold(f64::NEG_INFINITY, f64::max);
    if !greatest.is_finite() {
        return greatest;
    }
    let all: f64 = parts.clone().map(|part| libm::exp(part.weight - greatest)).sum();
    let share = |part: &Part| libm::exp(part.weight - greatest) / all;
    let Gaussian { mean, spread } = to;
    mean.fill(0.0);
    spread.fill(0.0);
    for part in parts.clone() {
        let share = share(&part);
        mean.iter_mut().zip(part.mean).for_each(|(to, own)| *to += share * own);
    }
    for part in parts {
        let share = share(&part);
        if share > NEGLIGIBLE {
            add_around(spread.as_mut_slice(), mean, &part, share);
        }
    }
    greatest + libm::log(all)
}

/// Adds a share of the covariance of a part around another mean.
fn add_around(spread: &mut [f64], mean: &[f64], part: &Part, share: f64) {
    let n = mean.len().max(1);
    let columns = spread.chunks_exact_mut(n).zip(part.spread.chunks_exact(n));
    for ((to, within), (own_column, mean_column)) in columns.zip(part.mean.iter().zip(mean)) {
        let apart = own_column - mean_column;
        let rows = to.iter_mut().zip(within).zip(part.mean.iter().zip(mean));
        rows.for_each(|((to, within), (own, mean))| *to += share * (within + (own - mean) * apart));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;

    #[test]
    fn the_covariance_holds_what_the_means_are_apart() {
        let mut to = Gaussian { mean: vec![9.0, 9.0], spread: Matrix::identity(2, 2) };
        let one = Part { weight: 500.0, mean: &[1.0, 0.0], spread: &[0.5, 0.0, 0.0, 1.0] };
        let other = Part { mean: &[-1.0, 0.0], ..one };
        let none = Part { weight: f64::NEG_INFINITY, ..one };
        assert_eq!(mix(&mut to, [none].into_iter()), f64::NEG_INFINITY);
        assert_eq!(to.mean, [9.0, 9.0]);
        let all = mix(&mut to, [one, other, none].into_iter());
        assert!((all - 500.0 - 2.0_f64.ln()).abs() < 1e-12);
        assert_eq!((to.mean.as_slice(), to.spread.as_slice()), (&[0.0, 0.0][..], &[1.5, 0.0, 0.0, 1.0][..]));
    }
}
