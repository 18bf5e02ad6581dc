//! `shsa-bench coverage`: recorded systems, calibrated on one half of the time. On the other half, published values beside independent
//! witnesses, and errors of needs while a sensor lies.

mod recorded;
mod witness;
mod lying;
mod report;

use crate::table::write_document;
use crate::{Outcome, notice};
use anyhow::bail;
use lying::lied;
use recorded::{RECORDED, Recorded};
use report::Found;
use std::io::{Write, stdout};
use std::path::PathBuf;
use witness::covered;

/// Arguments of `shsa-bench coverage`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench coverage --data ../shared/data --out workshop/measured

Exit status 1: a witness excludes more than 0.1 % of its values, needs err more than 1.2 times as far as a median, or a good value is \
further off than its need allows.")]
pub(crate) struct Arguments {
    /// The folder with the recordings.
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// The folder with their models.
    #[arg(long, value_name = "DIR", default_value = "models")]
    models: PathBuf,
    /// These recordings only, by the names of their models.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Write coverage.md there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each row instead of tables.
    #[arg(long)]
    json: bool,
}

const INTRODUCTION: &str = "\
Written by `shsa-bench coverage --data ../shared/data --out workshop/measured`. Each recording is that of a model in `models/`. The model is calibrated on \
the first half of the time, as `shsa calibrate` does; all figures are from the second half.";

/// Judges all recordings.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let is_asked = |name: &str| arguments.only.is_empty() || arguments.only.iter().any(|it| it == name);
    let mut all = Vec::new();
    for (name, recording) in RECORDED.into_iter().filter(|it| is_asked(it.0)) {
        let recording = arguments.data.join(recording);
        if !recording.exists() {
            notice(&format!("SKIPPED: {} is not there", recording.display()));
            continue;
        }
        let model = arguments.models.join(format!("{name}.yaml"));
        let recorded = Recorded::read(name, &model, &recording)?;
        all.push(Found::new(&recorded, covered(&recorded)?, lied(&recorded, arguments.threads)?));
    }
    if all.is_empty() {
        bail!("no recording in {}: nothing is judged, and nothing is written", arguments.data.display());
    }
    let tables = report::tables(&all);
    match arguments.json {
        true => writeln!(stdout().lock(), "{}", report::lines(&all))?,
        false => tables.iter().try_for_each(|table| writeln!(stdout().lock(), "{table}"))?,
    }
    if let Some(folder) = &arguments.out {
        let title = "Published values beside what else is known";
        write_document(folder, "coverage", title, INTRODUCTION, &tables)?;
    }
    Ok(if report::is_right(&all) { Outcome::Done } else { Outcome::No })
}
