//! Experiments with recordings: calibrates a model's numbers, rates a model by campaigns of faults, finds the smallest
//! detectable faults, learns relations between signals, and drafts models.

mod order;
mod curve;
pub mod calibration;
pub mod campaign;
pub mod learning;
pub mod drafting;

use thiserror::Error;

/// Why an experiment failed.
#[derive(Debug, Error)]
pub enum LabError {
    /// The model cannot be calibrated.
    #[error(transparent)]
    Calibration(#[from] calibration::Problem),
    /// Recordings, model and settings do not fit each other.
    #[error("{0}")]
    Unfit(String),
    /// A thread panicked.
    #[error("a run broke off; its reason stands above")]
    BrokeOff,
}
