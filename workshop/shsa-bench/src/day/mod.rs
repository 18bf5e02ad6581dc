//! `shsa-bench day`: replays a day of data with `shsa replay`, and records the memory from outside.

mod data;
mod report;

use crate::Outcome;
use crate::program::{Watched, shsa, watch};
use anyhow::Context;
use data::Shape;
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Arguments of `shsa-bench day`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench day --hours 1

A CSV file is written to the folder for temporary files (TMPDIR) and removed at the end: 140 MiB for an hour of \
50 signals at 100 Hz, 3.3 GiB for a day. Another process of this program replays it.")]
pub(crate) struct Arguments {
    /// Hours of data.
    #[arg(long, default_value_t = 24.0, value_parser = hours)]
    hours: f64,
    /// Signals, five of each variable.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1000))]
    signals: u32,
    /// Rows a second.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rate: u32,
    /// Write day.md, its plot and the raw results there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object instead of text.
    #[arg(long)]
    json: bool,
}

fn hours(text: &str) -> Result<f64, String> {
    let hours: f64 = text.parse().map_err(|_| format!("'{text}' is no number of hours"))?;
    if (0.001..=1_000.0).contains(&hours) { Ok(hours) } else { Err("0.001 to 1000 hours".to_owned()) }
}

/// The costs of a replay.
struct Replayed {
    /// Seconds of the whole process, which first scans the file and then replays it.
    seconds: f64,
    /// Resident memory: seconds since the start of the process, bytes.
    memory: Vec<(f64, f64)>,
    /// The report of the replay.
    report: Value,
}

/// The result of the benchmark.
struct Measured {
    shape: Shape,
    file_bytes: f64,
    replayed: Replayed,
}

impl Measured {
    fn peak_bytes(&self) -> f64 {
        self.replayed.memory.iter().map(|(_, bytes)| *bytes).fold(f64::NAN, f64::max)
    }

    /// Resident memory after a share of the time.
    fn memory_at(&self, share: f64) -> f64 {
        let memory = &self.replayed.memory;
        let at = (share * memory.len().saturating_sub(1) as f64) as usize;
        memory.get(at).map_or(f64::NAN, |(_, bytes)| *bytes)
    }

    fn observations(&self) -> f64 {
        self.replayed.report.get("observations").and_then(Value::as_f64).unwrap_or(f64::NAN)
    }

    fn events(&self) -> usize {
        self.replayed.report.get("events").and_then(Value::as_array).map_or(0, Vec::len)
    }

    fn to_json(&self) -> Value {
        json!({
            "hours": self.shape.hours(),
            "signals": self.shape.signals,
            "rate_hz": self.shape.rate,
            "observations": self.observations(),
            "file_bytes": self.file_bytes,
            "seconds": self.replayed.seconds,
            "replay_seconds": self.replayed.report.get("elapsed_s"),
            "events": self.events(),
            "peak_bytes": self.peak_bytes(),
            "quarter_bytes": self.memory_at(0.25),
            "end_bytes": self.memory_at(0.98),
        })
    }
}

/// Writes the data, replays them and prints the result.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let shape = Shape::new(arguments.hours, arguments.signals, arguments.rate);
    let folder = std::env::temp_dir().join(format!("shsa-day-{}", std::process::id()));
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let measured = measure(&folder, shape);
    let _ = fs::remove_dir_all(&folder);
    let measured = measured?;
    let text = if arguments.json { measured.to_json().to_string() } else { report::text(&measured) };
    writeln!(stdout().lock(), "{text}")?;
    if let Some(folder) = &arguments.out {
        report::write(folder, &measured)?;
    }
    Ok(Outcome::Done)
}

fn measure(folder: &Path, shape: Shape) -> anyhow::Result<Measured> {
    let (model, table) = (folder.join("model.yaml"), folder.join("day.csv"));
    fs::write(&model, data::model(&shape)).with_context(|| format!("cannot write {}", model.display()))?;
    crate::notice(&format!("writing {} rows ...", shape.rows));
    File::create(&table)
        .and_then(|file| data::write(file, &shape))
        .with_context(|| format!("cannot write {}", table.display()))?;
    let file_bytes = fs::metadata(&table)?.len() as f64;
    crate::notice("replaying ...");
    let replayed = replay(folder, &model, &table)?;
    Ok(Measured { shape, file_bytes, replayed })
}

/// Replays in another process and records its memory until it ends.
fn replay(folder: &Path, model: &Path, table: &Path) -> anyhow::Result<Replayed> {
    // Standard output goes to a file: nobody reads a pipe while the process is watched, and a full pipe would block it.
    let report_path = folder.join("report.json");
    let mut command = Command::new(shsa()?);
    command.arg("replay").args([model, table]).args(["--json", "--stream"]);
    let Watched { seconds, memory, .. } = watch(command.stdout(File::create(&report_path)?))?;
    let report =
        serde_json::from_str(&fs::read_to_string(&report_path)?).context("the replay said something else")?;
    Ok(Replayed { seconds, memory, report })
}
