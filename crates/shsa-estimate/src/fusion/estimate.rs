//! What a fusion says of a moment.

use crate::matrix::{Matrix, at};
use crate::method::Bias;
use crate::normal::two_sided;
use shsa_core::interval::Interval;

/// The estimate of a moment.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<'a> {
    /// The mean of the states.
    pub mean: &'a [f64],
    /// The covariance of the states.
    pub spread: &'a Matrix,
    /// How far it may be off by errors within bounds, which the covariance counts as noise.
    pub bias: Option<&'a Bias>,
}

impl Estimate<'_> {
    /// How far a number with these derivatives by the states, and with this variance, may be off within bounds, and the variance that is
    /// noise.
    pub(crate) fn errors(&self, gradient: &[f64], variance: f64) -> (f64, f64) {
        self.bias.map_or((0.0, variance), |bias| bias.along(gradient, variance))
    }

    /// The interval that holds a state with this probability, for normal noise and any errors within bounds; empty for an unknown state.
    #[must_use]
    pub fn interval(&self, state: usize, share: f64) -> Interval {
        let (Some(mean), Some(variance)) = (self.mean.get(state), self.spread.get((state, state))) else {
            return Interval::EMPTY;
        };
        if variance.is_nan() {
            return Interval::EMPTY;
        }
        let of_bias =
            |bias: &Bias| (at(&bias.reach, state, state).max(0.0).sqrt(), at(&bias.counted, state, state));
        let (bound, counted) = self.bias.map_or((0.0, 0.0), of_bias);
        let reach = bound + two_sided(share) * (variance - counted).max(0.0).sqrt();
        Interval::new((mean - reach).next_down(), (mean + reach).next_up())
    }
}
