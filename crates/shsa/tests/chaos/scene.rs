//! Common parts of the scenarios: a model of three wheels, settled runs, routers, and programs run by a command.

use crate::plant::Plant;
use crate::real::Script;
use crate::running::{Folder, Running};
use serde_json::{Value, json};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::{fs, thread, time};

pub(crate) const WHEELS: [&str; 3] = ["wheel_1", "wheel_2", "wheel_3"];

/// Three wheels of one speed, and an independent counter.
const MODEL: &str = "
shsa: 1
variables:
  speed: { unit: m/s, range: [-10, 90], max_rate: 6 m/s^2 }
  distance: { unit: m }
signals:
  wheel_1: { variable: speed, source: chaos/wheel_1#value@at, unit: m/s, rate: 50 Hz, value_error: 0.5, timeout: 500 ms, properties: { accuracy: 0.95 } }
  wheel_2: { variable: speed, source: chaos/wheel_2#value@at, unit: m/s, rate: 50 Hz, value_error: 0.5, timeout: 500 ms, properties: { accuracy: 0.9 } }
  wheel_3: { variable: speed, source: chaos/wheel_3#value@at, unit: m/s, rate: 50 Hz, value_error: 0.5, timeout: 500 ms, properties: { accuracy: 0.85 } }
  counter: { variable: distance, source: chaos/counter#value@at, unit: m }
needs:
  speed: { signal: chaos/speed, max_age: 300 ms, max_width: 3 m/s }
";

/// Writes the model into a folder.
pub(crate) fn model(folder: &Folder) -> String {
    let path = folder.path("chaos.yaml");
    fs::write(&path, MODEL).unwrap();
    text(&path)
}

pub(crate) fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

/// The verdict about a signal.
pub(crate) fn verdict<'s>(state: &'s Value, signal: &str) -> &'s str {
    state["models"]["chaos"]["signals"][signal]["verdict"].as_str().unwrap_or_default()
}

/// Whether the verdict about a signal is healthy or unknown.
pub(crate) fn is_trusted(state: &Value, signal: &str) -> bool {
    ["healthy", "unknown"].contains(&verdict(state, signal))
}

/// Waits until the need's own source serves the speed, and every wheel is trusted.
#[track_caller]
pub(crate) fn settle(run: &Running, plant: &mut Plant) {
    run.until("every wheel is heard, and the speed is served", |state| {
        let signals = &state["models"]["chaos"]["signals"];
        let is_heard = |wheel: &&str| signals[*wheel]["accepted"].as_u64() > Some(30);
        WHEELS.iter().all(|wheel| is_heard(wheel) && is_trusted(state, wheel))
            && state["models"]["chaos"]["needs"]["speed"]["quality"] == "Good"
    });
    let from = plant.now();
    plant.first(from, "a good value", |seen| seen.is_good());
}

/// The kinds of the decisions, each with its subject.
pub(crate) fn kinds_of(decisions: &[Value]) -> Vec<String> {
    let about = |decision: &Value| {
        let signal = decision["signal"].as_str().unwrap_or_default();
        format!("{} {signal}", decision["kind"].as_str().unwrap()).trim().to_owned()
    };
    decisions.iter().map(about).collect()
}

/// An independent router of Zenoh.
pub(crate) fn router(python: &Path, config: &Value) -> Script {
    let mut all = json!({ "mode": "router", "scouting/multicast/enabled": false });
    all.as_object_mut().unwrap().extend(config.as_object().unwrap().clone());
    Script::start(python, "../../../shsa-bridge/tests/python/zenoh_client.py", &all)
}

/// A script that runs a program by a command: `exec COMMAND PROGRAM "$@"`.
pub(crate) fn under(folder: &Folder, name: &str, command: &[&str], program: &Path) -> PathBuf {
    let path = folder.path(name);
    let line = format!("#!/bin/sh\nexec {} {} \"$@\"\n", command.join(" "), program.display());
    fs::write(&path, line).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path
}

/// Runs a command of the system.
///
/// # Errors
/// The command, if it fails: it needs root, and containers may forbid it even to root.
pub(crate) fn system(line: &str) -> Result<(), String> {
    let words: Vec<&str> = line.split(' ').collect();
    let status = std::process::Command::new(words[0]).args(&words[1..]).status();
    if status.is_ok_and(|status| status.success()) {
        Ok(())
    } else {
        Err(format!("`{line}` is not allowed here"))
    }
}

pub(crate) fn wait(seconds: f64) {
    thread::sleep(time::Duration::from_secs_f64(seconds));
}
