//! One replay of a recording by the built command, and its report.

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;
use std::process::{Command, Stdio};

/// Kinds of events that accuse a signal for certain.
const NAMING: [&str; 2] = ["failed", "silent"];

/// A model with its recording.
#[derive(Clone, Copy)]
pub(super) struct Subject {
    pub(super) model: &'static str,
    pub(super) recording: &'static str,
}

/// A fault that begins at a time and has no end.
#[derive(Clone, Copy)]
pub(super) struct Fault {
    pub(super) kind: &'static str,
    pub(super) signal: &'static str,
    pub(super) start_ms: u32,
}

/// The used part of a replay's JSON object.
#[derive(Deserialize)]
pub(super) struct Report {
    pub(super) observations: u64,
    pub(super) duration_s: f64,
    pub(super) events: Vec<Event>,
    pub(super) needs: BTreeMap<String, Need>,
}

/// A decision about a signal, or without a signal about a need.
#[derive(Deserialize)]
pub(super) struct Event {
    pub(super) time_s: f64,
    pub(super) kind: String,
    pub(super) signal: Option<String>,
}

/// How a need was served.
#[derive(Deserialize)]
pub(super) struct Need {
    pub(super) longest_gap_s: f64,
    /// The error relative to the run without the faults; `None` without faults, or if nothing was published.
    pub(super) rmse: Option<f64>,
}

impl Subject {
    /// The command line that repeats a replay.
    pub(super) fn command(self, faults: &[Fault]) -> String {
        let injected: String = faults.iter().map(|fault| format!(" --inject {fault}")).collect();
        format!("shsa replay {} {}{injected}", self.model, self.recording)
    }

    pub(super) fn is_there(self) -> bool {
        Path::new(self.recording).exists()
    }

    /// Replays with faults. An unmet need (status 1) is a valid result, too.
    pub(super) fn replay(self, program: &Path, faults: &[Fault], seed: u32) -> Result<Report> {
        let mut command = Command::new(program);
        command.args(["replay", self.model, self.recording, "--json", "--seed", &seed.to_string()]);
        for fault in faults {
            command.args(["--inject", &fault.to_string()]);
        }
        let line = self.command(faults);
        let output =
            command.stderr(Stdio::inherit()).output().with_context(|| format!("starting `{line}`"))?;
        if !matches!(output.status.code(), Some(0 | 1)) {
            bail!("`{line}` failed: {}", output.status);
        }
        serde_json::from_slice(&output.stdout).with_context(|| format!("reading what `{line}` prints"))
    }
}

impl Fault {
    pub(super) fn start_s(&self) -> f64 {
        f64::from(self.start_ms) / 1e3
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}@{}s..", self.kind, self.signal, self.start_s())
    }
}

/// When a signal was first suspected, and first named for certain, in seconds of the recording.
pub(super) struct Verdict {
    pub(super) suspected_s: Option<f64>,
    pub(super) named: Option<(String, f64)>,
}

impl Report {
    pub(super) fn verdict(&self, signal: &str) -> Verdict {
        let of_signal = || self.events.iter().filter(move |event| event.signal.as_deref() == Some(signal));
        Verdict {
            suspected_s: of_signal().find(|event| event.kind == "suspected").map(|event| event.time_s),
            named: of_signal()
                .find(|event| NAMING.contains(&&*event.kind))
                .map(|event| (event.kind.clone(), event.time_s)),
        }
    }

    /// Signals except these that were ever suspected.
    pub(super) fn others_suspected(&self, faulty: &[&str]) -> BTreeSet<&str> {
        self.others(faulty, &["suspected"])
    }

    /// Signals except these that ever failed or became silent.
    pub(super) fn others_named(&self, faulty: &[&str]) -> BTreeSet<&str> {
        self.others(faulty, &NAMING)
    }

    fn others(&self, faulty: &[&str], kinds: &[&str]) -> BTreeSet<&str> {
        let reported = self.events.iter().filter(|event| kinds.contains(&&*event.kind));
        reported
            .filter_map(|event| event.signal.as_deref())
            .filter(|signal| !faulty.contains(signal))
            .collect()
    }
}
