//! A campaign: a grid of faults on recordings, and the shares that are detected, isolated and healed.
//!
//! `recordings -> Baseline (the clean run) -> Grid (cells, trials) -> measure (one run each, all cores) -> Campaign -> JSON`
//!
//! A **cell** is a kind of fault with an amount for one signal; a **trial** is a cell at one onset with one seed. Each trial is a
//! replay with one fault, up to the end of its fault; later effects are not considered. The recordings are read once and shared;
//! a thread holds one engine and the samples of one signal. The results are in the order of the grid, so they do not depend on
//! the number of threads. [`LEGEND`] defines the figures.

pub(crate) mod parallel;
mod kind;
mod onset;
mod size;
mod grid;
mod baseline;
mod smallest;
mod amount;
mod tally;
mod compare;
mod detectable;

pub use amount::{AmountSpec, instead};
pub use baseline::{Alarm, Baseline, Measured, Served};
pub use compare::{Change, Comparison, check_settings};
pub use detectable::{DRIFT_REACHES, Detectable, HalfSpec, calibrated};
pub use grid::{Cell, Grid, GridSpec, Reason, Trial, Untried};
pub use kind::{Kind, What};
pub use onset::{Onset, Recorded};
pub use parallel::Progress;
pub use smallest::{Found, Limit, SearchSpec, Smallest};
pub use tally::{Campaign, LEGEND, Tally, settings};

use crate::LabError;
use parallel::on_all_cores;
use std::num::NonZeroUsize;

/// Runs all trials; the results are in the order of the trials, `None` for a fault that changes no value.
///
/// # Errors
/// When a run panicked.
pub fn measure(
    baselines: &[Baseline<'_>],
    grid: &Grid,
    threads: Option<NonZeroUsize>,
    progress: &dyn Progress,
) -> Result<Vec<Option<Measured>>, LabError> {
    on_all_cores(grid.trials.len(), threads, progress, "runs", |number| {
        let trial = grid.trials.get(number)?;
        baselines.get(trial.session)?.measure(trial, grid.cells.get(trial.cell)?.signal)
    })
}

/// A number with four significant digits.
#[must_use]
pub fn rounded(value: f64) -> String {
    let text = format!("{value:.3e}");
    text.parse::<f64>().map_or(text, |value| value.to_string())
}
