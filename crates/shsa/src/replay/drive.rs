//! Drives the engine over recorded inputs, with a progress bar on a terminal.

use crate::progress::Observations;
use shsa_core::engine::Options;
use shsa_core::time::Time;
use shsa_format::drive::{Era, Given, Run};

/// Drives a new engine over all eras to the end; `step` passes on each input, including ticks.
///
/// # Errors
/// Errors of `step`.
pub(crate) fn drive(
    eras: &[Era],
    span: Option<(Time, Time)>,
    options: Options,
    mut step: impl FnMut(&mut Run, Given<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<Run> {
    let mut bar = Observations::of(eras);
    Run::of(eras, span, options, |run, given| {
        bar.count(&given);
        step(run, given)
    })
}
