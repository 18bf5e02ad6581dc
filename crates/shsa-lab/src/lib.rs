//! What is found out from recordings: numbers of a model by calibration, what a model is worth by campaigns of faults, and how small
//! a fault may be so that it is seen.

mod order;
mod curve;
pub mod calibration;
pub mod campaign;
pub mod learning;

use thiserror::Error;

/// Why nothing was found out.
#[derive(Debug, Error)]
pub enum LabError {
    /// The model cannot be calibrated.
    #[error(transparent)]
    Calibration(#[from] calibration::Problem),
    /// Recordings, model and what is wanted do not fit each other.
    #[error("{0}")]
    Unfit(String),
    /// A thread panicked.
    #[error("a run broke off; its reason stands above")]
    BrokeOff,
}
