//! RTLola's interpreter on the same check. It is run by a separate program, so that the shipped one does not depend on it.

use anyhow::{Context, bail};
use serde_json::{Value, json};
use std::process::{Command, Stdio};

/// The manifest of the program that runs RTLola.
const MANIFEST: &str = "workshop/shsa-bench/rtlola/Cargo.toml";

/// How observations arrive: the case, and the two keys of the program's JSON.
const ARRIVALS: [(&str, &str, &str); 2] = [
    ("interval check, one by one", "rtlola", "ours"),
    ("interval check, three at once", "rtlola_joint", "ours_joint"),
];

/// Observations a second of RTLola's interpreter and of ours, measured in turns by one program.
pub(super) struct Rival {
    pub(super) case: &'static str,
    pub(super) rtlola: f64,
    pub(super) ours: f64,
}

impl Rival {
    /// Builds and runs the program; the present folder must be the project's.
    pub(super) fn measure(turn_s: f64) -> anyhow::Result<Vec<Rival>> {
        let mut command = Command::new("cargo");
        command.args(["run", "--quiet", "--release", "--manifest-path", MANIFEST, "--", "--turn"]);
        command.arg(turn_s.to_string()).stderr(Stdio::inherit());
        let output = command.output().context("cannot start cargo, which builds the program beside ours")?;
        if !output.status.success() {
            bail!("{MANIFEST} ended with {}; it is found in the project's folder only", output.status);
        }
        let text = String::from_utf8_lossy(&output.stdout);
        let line = text.lines().rev().find(|line| line.starts_with('{')).unwrap_or_default();
        let value: Value =
            serde_json::from_str(line).context("the program beside ours said something else")?;
        let number = |key: &str| value.get(key).and_then(Value::as_f64).context(format!("no {key}"));
        let arrival = |&(case, rtlola, ours): &(&'static str, &str, &str)| {
            Ok(Rival { case, rtlola: number(rtlola)?, ours: number(ours)? })
        };
        ARRIVALS.iter().map(arrival).collect()
    }

    /// How many times faster ours is.
    pub(super) fn ratio(&self) -> f64 {
        self.ours / self.rtlola
    }

    pub(super) fn to_json(&self) -> Value {
        json!({
            "case": self.case, "observations_per_second": self.ours,
            "rtlola_observations_per_second": self.rtlola, "ratio": self.ratio(),
        })
    }
}
