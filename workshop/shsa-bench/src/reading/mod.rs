//! `shsa-bench reading`: how long recordings take, beside the readers in Python that read the same topics in the same run.

use crate::Outcome;
use crate::oracle::{Recorded, recorded};
use crate::table::Table;
use anyhow::Context;
use shsa_recording::read;
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::slice;
use std::time::Instant;

/// Reads with the usual reader of each format in Python, and prints the seconds.
const READERS: &str = include_str!("readers.py");

/// The manifest of the program that reads with the crates for MCAP and SQLite alone.
const CRATES_ALONE: &str = "workshop/shsa-bench/crates-alone/Cargo.toml";

/// Arguments of `shsa-bench reading`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench reading FOLDER --python venv/bin/python

FOLDER has `expected.json` in it or below, as for `shsa-bench oracle formats`; the fields that it names are read. Exit status 1:
a recording that both read is not so many times as quick as the reader in Python.")]
pub(crate) struct Arguments {
    /// The recordings.
    folder: PathBuf,
    /// A Python interpreter with the readers that `--readers` lists.
    #[arg(long, default_value = "python3")]
    python: String,
    /// How often each is read; the least time counts.
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// How many times as quick it has to be.
    #[arg(long, default_value_t = 5.0)]
    least: f64,
    /// Also read MCAP and SQLite with the usual crate for them, which is built for it in the project's folder.
    #[arg(long)]
    crates: bool,
    /// Print the readers in Python, and read nothing.
    #[arg(long)]
    readers: bool,
}

/// How long a recording takes, seconds.
struct Measured {
    name: String,
    own: f64,
    /// That of the other reader, or why it has none.
    other: Result<f64, String>,
    /// That of the crate for the format, for all messages of the same topics without their fields; `None` where none is asked.
    alone: Option<f64>,
}

/// Measures; the answer is no where the other reader is too near.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if arguments.readers {
        write!(stdout(), "{READERS}")?;
        return Ok(Outcome::Done);
    }
    let mut measured = Vec::new();
    for recording in recorded(&arguments.folder)? {
        measured.push(measure(arguments, &recording)?);
    }
    let is_slow = |it: &Measured| it.other.as_ref().is_ok_and(|other| other / it.own < arguments.least);
    let is_any_slow = measured.iter().any(is_slow);
    let head = ["recording", "ms", "Python, ms", "times as quick", "crate alone, ms", "times its time"];
    let columns = if arguments.crates { head.len() } else { head.len() - 2 };
    let table = Table {
        title: "Reading".to_owned(),
        note: format!("The least of {} rounds; imports are left out.", arguments.rounds),
        head: head.iter().take(columns).map(|name| (*name).to_owned()).collect(),
        rows: measured.iter().map(|it| row(it).into_iter().take(columns).collect()).collect(),
    };
    write!(stdout(), "{table}")?;
    Ok(if is_any_slow { Outcome::No } else { Outcome::Done })
}

fn row(measured: &Measured) -> Vec<String> {
    let ms = |seconds: f64| format!("{:.2}", 1e3 * seconds);
    let (other, ratio) = match &measured.other {
        Ok(other) => (ms(*other), format!("{:.1}", other / measured.own)),
        Err(problem) => (problem.clone(), "-".to_owned()),
    };
    let none = || "-".to_owned();
    let alone = measured.alone.map_or_else(none, ms);
    let times_alone = measured.alone.map_or_else(none, |alone| format!("{:.1}", measured.own / alone));
    vec![measured.name.clone(), ms(measured.own), other, ratio, alone, times_alone]
}

fn measure(arguments: &Arguments, recording: &Recorded) -> anyhow::Result<Measured> {
    let Recorded { path, options, wanted } = recording;
    let mut own = f64::INFINITY;
    for _ in 0..arguments.rounds {
        let begin = Instant::now();
        read(slice::from_ref(path), wanted, options)
            .with_context(|| format!("{} cannot be read", path.display()))?;
        own = own.min(begin.elapsed().as_secs_f64());
    }
    let topics: Vec<&str> = wanted.iter().filter_map(|it| Some(it.source.split_once('#')?.0)).collect();
    let parts: Vec<&str> = path.iter().rev().take(2).filter_map(|part| part.to_str()).collect();
    let name = parts.into_iter().rev().collect::<Vec<_>>().join("/");
    let alone = arguments.crates.then(|| alone(arguments.rounds, path, &topics).ok()).flatten();
    Ok(Measured { name, own, other: in_python(arguments, path, &topics), alone })
}

/// The seconds of the reader in Python, or the last line of its output.
fn in_python(arguments: &Arguments, path: &Path, topics: &[&str]) -> Result<f64, String> {
    let mut command = Command::new(&arguments.python);
    command.args(["-c", READERS]);
    seconds_of(&mut command, arguments.rounds, path, topics)
}

/// The seconds of the crate for the format, or the last line of its output.
fn alone(rounds: u32, path: &Path, topics: &[&str]) -> Result<f64, String> {
    let mut command = Command::new("cargo");
    command.args(["run", "--quiet", "--release", "--manifest-path", CRATES_ALONE, "--"]);
    seconds_of(&mut command, rounds, path, topics)
}

/// The seconds that a program prints, or the last line of its output.
fn seconds_of(command: &mut Command, rounds: u32, path: &Path, topics: &[&str]) -> Result<f64, String> {
    let output = command.arg(rounds.to_string()).arg(path).args(topics).output();
    let output = output.map_err(|problem| problem.to_string())?;
    let last = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().lines().last().unwrap_or("").to_owned();
    last(&output.stdout).parse().map_err(|_| last(&output.stderr).replace('|', " "))
}
