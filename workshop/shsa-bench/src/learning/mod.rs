//! `shsa-bench learning`: how long `shsa draft` and `shsa learn` take over a recording of many signals, and how much memory.

mod plant;

use crate::program::{Watched, shsa, watch};
use crate::table::Table;
use crate::{Outcome, notice};
use anyhow::Context;
use plant::Size;
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{Write, stdout};
use std::path::Path;
use std::process::Command;

/// Arguments of `shsa-bench learning`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench learning --signals 200

A CSV file of machines with 20 signals each is written to the folder for temporary files (TMPDIR) and removed at the end: 60 MB for \
200 signals at 10 Hz for an hour. Exit status 1: the draft takes 10 s or more, learning 60 s or more, or either 1 GiB or more.")]
pub(crate) struct Arguments {
    /// Signals.
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    signals: u32,
    /// Seconds of data.
    #[arg(long, default_value_t = 3_600, value_parser = clap::value_parser!(u32).range(10..=100_000))]
    seconds: u32,
    /// Rows a second.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    rate: u32,
    /// Print a JSON object for each command instead of a table.
    #[arg(long)]
    json: bool,
}

/// A command, and the seconds that it may take.
const COMMANDS: [(&str, f64); 2] = [("draft", 10.0), ("learn", 60.0)];

/// The memory that each may take.
const MOST_BYTES: f64 = (1_u64 << 30) as f64;

/// A command with what it cost and found.
struct Measured {
    name: &'static str,
    most_seconds: f64,
    watched: Watched,
    /// Variables of the draft, relations that were learned.
    found: usize,
}

impl Measured {
    fn is_within(&self) -> bool {
        self.watched.seconds < self.most_seconds && self.watched.peak_bytes() < MOST_BYTES
    }

    fn to_json(&self) -> Value {
        json!({
            "command": self.name,
            "seconds": self.watched.seconds,
            "processor_seconds": self.watched.processor_seconds,
            "peak_bytes": self.watched.peak_bytes(),
            "found": self.found,
        })
    }

    fn row(&self) -> Vec<String> {
        let found = if self.name == "draft" { "variables" } else { "relations" };
        vec![
            self.name.to_owned(),
            format!("{:.1}", self.watched.seconds),
            format!("{:.1}", self.watched.processor_seconds),
            format!("{:.0}", self.watched.peak_bytes() / f64::from(1 << 20)),
            format!("{} {found}", self.found),
        ]
    }
}

/// Writes the recording, runs both commands over it and prints what they cost; the answer is no where one takes too much.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let size = Size {
        signals: arguments.signals as usize,
        rate: arguments.rate,
        rows: arguments.seconds * arguments.rate,
    };
    let folder = std::env::temp_dir().join(format!("shsa-learning-{}", std::process::id()));
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let measured = measure(&folder, size);
    let _ = fs::remove_dir_all(&folder);
    let measured = measured?;
    let head = ["command", "seconds", "processor seconds", "memory, MiB", "found"].map(str::to_owned);
    let table = Table {
        title: "Drafting and learning".to_owned(),
        note: format!("{} signals, {} s at {} Hz.", size.signals, arguments.seconds, size.rate),
        head: head.into(),
        rows: measured.iter().map(Measured::row).collect(),
    };
    let text = match arguments.json {
        true => measured.iter().map(|it| format!("{}\n", it.to_json())).collect(),
        false => table.to_string(),
    };
    write!(stdout().lock(), "{text}")?;
    Ok(if measured.iter().all(Measured::is_within) { Outcome::Done } else { Outcome::No })
}

fn measure(folder: &Path, size: Size) -> anyhow::Result<Vec<Measured>> {
    let table = folder.join("plant.csv");
    notice(&format!("writing {} rows ...", size.rows));
    File::create(&table)
        .and_then(|file| plant::write(file, size))
        .with_context(|| format!("cannot write {}", table.display()))?;
    COMMANDS.into_iter().map(|(name, most_seconds)| command(&table, name, most_seconds)).collect()
}

fn command(table: &Path, name: &'static str, most_seconds: f64) -> anyhow::Result<Measured> {
    notice(&format!("shsa {name} ..."));
    // Nobody reads a pipe while the process is watched, and a full pipe would block it.
    let output = table.with_extension(name);
    let mut command = Command::new(shsa()?);
    command.arg(name).arg(table).stdout(File::create(&output)?);
    if name == "learn" {
        command.arg("--json");
    }
    let watched = watch(&mut command)?;
    let text = fs::read_to_string(&output)?;
    let found = match name {
        "learn" => {
            let found: Value = serde_json::from_str(&text).context("shsa learn printed no JSON object")?;
            found.get("relations").and_then(Value::as_array).map_or(0, Vec::len)
        }
        _ => shsa_model::load(&text, name).knowledge.variables().len(),
    };
    Ok(Measured { name, most_seconds, watched, found })
}
