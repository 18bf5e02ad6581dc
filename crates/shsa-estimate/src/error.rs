//! Errors of estimation models, with their numbers.

/// Why an estimator cannot be made, or cannot give an answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A matrix or a vector of a wrong size.
    #[error("{what} has {found} entries, and {wanted} are wanted")]
    Size {
        /// The matrix or vector.
        what: &'static str,
        /// The number of its entries.
        found: usize,
        /// The right number of entries.
        wanted: usize,
    },
    /// A covariance that is not positive semidefinite.
    #[error("{what} is not positive semidefinite: pivot {place} is {pivot}")]
    NotDefinite {
        /// The covariance.
        what: &'static str,
        /// The row of the first negative pivot, from 0.
        place: usize,
        /// The pivot.
        pivot: f64,
    },
    /// A number outside of its range.
    #[error("{what} is {value}, and must be {range}")]
    Range {
        /// The number's name.
        what: &'static str,
        /// The number.
        value: f64,
        /// The allowed range.
        range: &'static str,
    },
    /// A formula that has a memory, or uses symbols outside the model.
    #[error("the formula of {what} {reason}")]
    Formula {
        /// The quantity of the formula.
        what: String,
        /// Why it cannot be used.
        reason: String,
    },
    /// Nothing was measured.
    #[error("all inputs are missing")]
    Nothing,
    /// A value with a variance of zero, which leaves the others no weight.
    #[error("input {place} has the variance zero: leave such inputs out, or give them one")]
    ZeroVariance {
        /// The value's place among the inputs, from 0.
        place: usize,
    },
}
