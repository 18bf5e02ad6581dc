//! `shsa-bench scale`: how time and memory grow with the model, up to a million relations.
//!
//! A process of its own loads each model, so that its peak memory is measured alone.

mod measure;
mod model;
mod report;

use crate::Outcome;
use anyhow::{Context, bail};
use measure::Measured;
use std::fs::{self, File};
use std::io::{BufWriter, Write, stdout};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Arguments of `shsa-bench scale`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench scale --sizes 1000,100000 --out workshop/measured")]
pub(crate) struct Arguments {
    /// How many relations the models have; each is rounded to hundreds.
    #[arg(long, value_name = "N,..", value_delimiter = ',', default_values_t = [1_000, 10_000, 100_000, 1_000_000])]
    sizes: Vec<usize>,
    /// What is random in the models.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write scale.md, its plots and raw results there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each size instead of a table.
    #[arg(long)]
    json: bool,
    /// Only measure this model, in this process.
    #[arg(long, value_name = "MODEL", hide = true)]
    measure: Option<PathBuf>,
}

/// The largest model: a file has at most 256 MiB.
const MAX_SIZE: usize = 1_500_000;

/// Makes, loads and plans models of all sizes.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if let Some(model) = &arguments.measure {
        writeln!(stdout().lock(), "{}", measure::measure(model)?.to_json())?;
        return Ok(Outcome::Done);
    }
    if let Some(size) = arguments.sizes.iter().find(|&size| !(100..=MAX_SIZE).contains(size)) {
        bail!("a model of {size} relations cannot be measured: 100 to {MAX_SIZE} can");
    }
    let mut sizes = arguments.sizes.clone();
    sizes.sort_unstable();
    sizes.dedup();
    let mut all = Vec::new();
    for size in sizes {
        crate::notice(&format!("{size} relations ..."));
        let measured = in_a_process(size, arguments.seed)?;
        if arguments.json {
            writeln!(stdout().lock(), "{}", measured.to_json())?;
        }
        all.push(measured);
    }
    if !arguments.json {
        writeln!(stdout().lock(), "{}", report::table(&all))?;
    }
    if let Some(folder) = &arguments.out {
        report::write(folder, arguments, &all)?;
    }
    Ok(Outcome::Done)
}

/// Writes a model, and measures it in another process of this program.
fn in_a_process(size: usize, seed: u64) -> anyhow::Result<Measured> {
    let path = std::env::temp_dir().join(format!("shsa-scale-{}-{size}.json", std::process::id()));
    let measured = write(&path, size, seed).and_then(|()| {
        let program = std::env::current_exe().context("cannot find this program")?;
        let mut command = Command::new(program);
        command.args(["scale", "--measure"]).arg(&path).stderr(Stdio::inherit());
        let output = command.output().context("cannot start another process of this program")?;
        if !output.status.success() {
            bail!("measuring {size} relations ended with {}", output.status);
        }
        Measured::from_json(&output.stdout)
    });
    let _ = fs::remove_file(&path);
    measured
}

fn write(path: &Path, size: usize, seed: u64) -> anyhow::Result<()> {
    let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
    let mut file = BufWriter::new(file);
    model::write(&mut file, size, seed)?;
    file.flush()?;
    Ok(())
}
