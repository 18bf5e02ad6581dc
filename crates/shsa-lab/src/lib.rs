//! Experiments with recordings: calibrates a model's numbers, rates a model by campaigns of faults, finds the smallest
//! detectable faults, learns relations between signals, drafts models, and proposes learned relations for them.
//!
//! A model is only as good as its numbers and relations, and a recording of healthy days contains both. [`drafting`] proposes a first model of
//! the recorded columns, [`learning`] finds the relations that hold in one part of the time and confirms them in another, [`calibration`] finds
//! the errors with which the engine keeps a promised rate of false alarms, and [`campaign`] injects faults and counts which are found.
//! [`doctor`] needs no model: it finds the stretches in which a recording contradicts itself.
//!
//! The crate reads no files and prints nothing: samples in, figures out.
//!
//! # Example
//!
//! A power that is the product of a voltage and a current:
//!
//! ```
//! use shsa_core::unit::Unit;
//! use shsa_lab::learning::{Signal, formula, learn};
//!
//! let signal = |name: &str, unit: &str, value: &dyn Fn(f64) -> f64| Signal {
//!     name: name.to_owned(),
//!     unit: Unit::parse(unit).ok(),
//!     points: (0..400).map(|step| f64::from(step) / 10.0).map(|time| (time, value(time))).collect(),
//! };
//! let (volts, amperes) = (|time: f64| 12.0 + (0.7 * time).sin(), |time: f64| 5.0 + 3.0 * (0.23 * time).cos());
//! let signals = [
//!     signal("voltage", "V", &volts),
//!     signal("current", "A", &amperes),
//!     signal("power", "W", &|time| volts(time) * amperes(time)),
//! ];
//! let learned = learn(&signals, &())?;
//! let name = |signal: usize| signals[signal].name.clone();
//! let found: Vec<String> = learned.relations.iter().map(|it| formula(&signals, it, &name)).collect();
//! assert_eq!(found, ["power = voltage * current"]);
//! # Ok::<(), shsa_lab::LabError>(())
//! ```

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
