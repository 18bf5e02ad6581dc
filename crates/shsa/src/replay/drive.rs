//! Drives the engine over recorded inputs, with a progress bar on a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use shsa_core::engine::{Input, Options};
use shsa_core::time::Time;
use shsa_format::drive::{Era, Given, Run};
use std::io::{IsTerminal, stderr};

/// The number of inputs between two steps of the progress bar.
pub(super) const PROGRESS_STEP: u64 = 4_096;

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
    let progress = progress(eras.iter().map(|era| era.inputs.len()).sum());
    let mut observations = 0;
    let run = Run::of(eras, span, options, |run, given| {
        observations += u64::from(matches!(given, Given::Input(Input::Observation(_))));
        if observations % PROGRESS_STEP == 0 {
            progress.set_position(observations);
        }
        step(run, given)
    });
    progress.finish_and_clear();
    run
}

/// A progress bar for `length` observations.
pub(super) fn progress(length: usize) -> ProgressBar {
    let target =
        if stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(length as u64), target);
    let style =
        ProgressStyle::with_template("{bar:40} {percent:>3} %  {pos} of {len} observations  {eta} left");
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
