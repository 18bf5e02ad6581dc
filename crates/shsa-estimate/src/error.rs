//! What is wrong with a model of estimation, with its numbers.

/// Why an estimator cannot be made, or cannot give an answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A matrix or a vector has another shape than the model wants.
    #[error("{what} has {found} entries, and {wanted} are wanted")]
    Size {
        /// Which one.
        what: &'static str,
        /// Its entries.
        found: usize,
        /// The right number.
        wanted: usize,
    },
    /// A covariance that is none.
    #[error("{what} is not positive semidefinite: pivot {place} is {pivot}")]
    NotDefinite {
        /// Which one.
        what: &'static str,
        /// The row of the first negative pivot, from 0.
        place: usize,
        /// The pivot.
        pivot: f64,
    },
    /// A number outside of its range.
    #[error("{what} is {value}, and must be {range}")]
    Range {
        /// Which one.
        what: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// A formula that remembers its past, or uses what the model does not have.
    #[error("the formula of {what} {reason}")]
    Formula {
        /// Of which quantity.
        what: String,
        /// Why it cannot be used.
        reason: String,
    },
    /// Nothing was measured.
    #[error("all inputs are missing")]
    Nothing,
    /// A value that is certain leaves the others no weight.
    #[error("input {place} has the variance zero: leave such inputs out, or give them one")]
    ZeroVariance {
        /// Its place among the inputs, from 0.
        place: usize,
    },
}
