//! Measurements whose errors are not new: the estimates of another filter.
//!
//! The errors of an estimate are those of the measurements in it, so the estimates of a filter err alike for long, and together with what
//! else is made of the same measurements. Taken for independent they would make the estimate as certain as one likes. Covariance
//! intersection is right however they are correlated: it counts the own estimate by a share and the measurement by the rest, each with
//! its variance divided by that (S. Julier, J. Uhlmann 1997, doi:10.1109/ACC.1997.609105).

/// The least share of the own estimate. A single state would be replaced by what measures it, and particles would be lost.
const LEAST: f64 = 0.5;

/// The share of an estimate of so many states that leaves the least volume of covariance, for an expectation that is so many times as
/// uncertain as the measurement: the zero of the derivative of `ln det(share P^-1 + (1 - share) h h' / r)`.
pub(super) fn share(states: usize, ratio: f64) -> f64 {
    let n = states as f64;
    if ratio > n { ((n - 1.0) * ratio / (n * (ratio - 1.0))).max(LEAST) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// No other share leaves a smaller volume.
        #[test]
        fn the_share_is_the_best_one(states in 1_usize..6, ratio in 0.01..100.0_f64, other in 0.5..1.0_f64) {
            let n = states as f64;
            // Of the inverse covariance, in units of the own one.
            let volume = |own: f64| (n - 1.0) * own.ln() + (own + (1.0 - own) * ratio).ln();
            prop_assert!(volume(share(states, ratio)) >= volume(other) - 1e-12);
        }
    }
}
