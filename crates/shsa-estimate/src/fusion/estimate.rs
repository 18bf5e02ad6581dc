//! What a fusion says of a moment.

use crate::matrix::Matrix;
use crate::normal::two_sided;
use shsa_core::interval::Interval;

/// The estimate of a moment.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<'a> {
    /// The mean of the states.
    pub mean: &'a [f64],
    /// The covariance of the states.
    pub spread: &'a Matrix,
}

impl Estimate<'_> {
    /// The interval that holds a state with this probability, for a normal distribution; empty for an unknown state.
    #[must_use]
    pub fn interval(&self, state: usize, share: f64) -> Interval {
        let (Some(mean), Some(variance)) = (self.mean.get(state), self.spread.get((state, state))) else {
            return Interval::EMPTY;
        };
        if variance.is_nan() {
            return Interval::EMPTY;
        }
        let reach = two_sided(share) * variance.max(0.0).sqrt();
        Interval::new((mean - reach).next_down(), (mean + reach).next_up())
    }
}
