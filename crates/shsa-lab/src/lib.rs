//! Experiments with recordings: calibrates a model's numbers, rates a model by campaigns of faults, finds the smallest
//! detectable faults, learns relations between signals, drafts models, and proposes learned relations for them.

mod order;
mod curve;
pub mod calibration;
pub mod campaign;
pub mod naming;
pub mod learning;
pub mod drafting;
pub mod proposal;
pub mod doctor;

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
    /// A draft is no valid model, for these reasons: a defect.
    #[error("the draft has an error, which is a defect of this program: {0}")]
    Draft(String),
    /// A recording cannot be read.
    #[error(transparent)]
    Recording(#[from] shsa_recording::RecordingError),
    /// A thread panicked.
    #[error("a run broke off; its reason stands above")]
    BrokeOff,
}
