//! The normal distribution: its density and its samples in several dimensions, its quantiles in one.

use crate::Error;
use crate::matrix::{Factors, Matrix, check_covariance};
use crate::random::Random;
use std::f64::consts::{PI, SQRT_2, TAU};

/// A normal distribution of n numbers; its covariance may be singular.
#[derive(Clone, Debug)]
pub struct Normal {
    mean: Vec<f64>,
    factors: Factors,
    work: Vec<f64>,
}

impl Normal {
    /// The distribution of this mean and covariance.
    ///
    /// # Errors
    /// The covariance has another size than the mean, or is not positive semidefinite. Time: n^3.
    pub fn new(mean: &[f64], covariance: &Matrix) -> Result<Normal, Error> {
        check_covariance("the covariance", covariance, mean.len())?;
        let mut factors = Factors::new(mean.len());
        factors.factor(covariance, mean.len());
        Ok(Normal { mean: mean.to_vec(), factors, work: vec![0.0; mean.len()] })
    }

    /// The density at a point; for a singular distribution, within its uncertain directions. Time: n^2.
    #[must_use]
    pub fn density(&self, at: &[f64]) -> f64 {
        let mut apart: Vec<f64> = at.iter().zip(&self.mean).map(|(at, mean)| at - mean).collect();
        self.factors.solve_lower(&mut apart);
        let uncertain = apart.iter().zip(&self.factors.d).filter(|(_, d)| **d > 0.0);
        libm::exp(uncertain.map(|(y, d)| log_density(*y, *d)).sum())
    }

    /// Draws a sample into `to`. Time: n^2.
    pub fn sample(&mut self, random: &mut Random, to: &mut [f64]) {
        self.work.iter_mut().for_each(|number| *number = random.normal());
        self.factors.colour(&self.work, to);
        to.iter_mut().zip(&self.mean).for_each(|(to, mean)| *to += mean);
    }
}

/// The logarithm of the density of a number with mean 0 and this variance.
#[must_use]
pub fn log_density(apart: f64, variance: f64) -> f64 {
    -0.5 * (apart * apart / variance + libm::log(TAU * variance))
}

/// How many standard deviations to both sides of the mean hold this share of a normal distribution; infinite from 1, 0 below 0.
///
/// By Newton's method on the error function of `libm`; relative error below 1e-12.
#[must_use]
pub fn two_sided(share: f64) -> f64 {
    if !(share > 0.0 && share < 1.0) {
        return if share >= 1.0 { f64::INFINITY } else { 0.0 };
    }
    let outside = 1.0 - share;
    // The tail is at most exp(-x^2 / 2), so this is not below the answer; the tail's log is concave, so no step leads below.
    let mut x = libm::sqrt(-2.0 * libm::log(outside));
    for _ in 0..60 {
        let tail = libm::erfc(x / SQRT_2);
        let step = tail / (libm::sqrt(2.0 / PI) * libm::exp(-0.5 * x * x)) * libm::log(tail / outside);
        x += step;
        if step.abs() <= 1e-15 * x {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_published_ones() {
        for (share, wanted) in [
            (0.682_689_492_137_085_9, 1.0),
            (0.95, 1.959_963_984_540_054),
            (0.99, 2.575_829_303_548_901),
            (0.999_999, 4.891_638_475_699_01),
            (0.1, 0.125_661_346_855_074),
        ] {
            assert!((two_sided(share) - wanted).abs() < 1e-9, "{share} {}", two_sided(share));
        }
        assert_eq!(two_sided(0.0), 0.0);
        assert_eq!(two_sided(1.0), f64::INFINITY);
        assert_eq!(two_sided(f64::NAN), 0.0);
        // Its square is the threshold of a chi-square test with one degree of freedom.
        assert!((two_sided(0.999).powi(2) - 10.827_566_170_662_733).abs() < 1e-9);
    }
}
