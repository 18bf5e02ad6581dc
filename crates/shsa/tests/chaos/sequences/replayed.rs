//! Whether the replay of a run's journal gives the run's decisions.

use crate::world::Remains;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Kinds of events of the run itself, which no engine decides.
const NOTED: [&str; 13] = [
    "absent",
    "accused",
    "backlog",
    "clock",
    "connected",
    "disconnected",
    "disk",
    "outlier",
    "overload",
    "released",
    "responsible",
    "trouble",
    "undelivered",
];

/// The decisions of engines, one line each.
pub(super) fn lines(decisions: &[Value]) -> Vec<String> {
    let decided = decisions.iter().filter(|it| !NOTED.contains(&it["kind"].as_str().unwrap()));
    let field = |decision: &Value, name: &str| decision[name].as_str().unwrap_or_default().to_owned();
    decided
        .map(|it| ["kind", "signal", "variable", "because"].map(|name| field(it, name)).join(" | "))
        .collect()
}

/// All events with their times, one line each.
pub(super) fn story(decisions: &[Value]) -> String {
    let begun = decisions.first().and_then(|it| it["time_ns"].as_i64()).unwrap_or(0);
    let text = |decision: &Value, name: &str| decision[name].as_str().unwrap_or_default().to_owned();
    let line = |decision: &Value| {
        let at = (decision["time_ns"].as_i64().unwrap_or(0) - begun) as f64 / 1e9;
        let [kind, signal, because] = ["kind", "signal", "because"].map(|name| text(decision, name));
        format!("{at:8.3} {kind} {signal}: {because}\n")
    };
    decisions.iter().map(line).collect()
}

/// The decisions in a replay of a journal's file, as lines.
fn of_file(model: &str, journal: &Path) -> Result<Vec<String>, String> {
    let replay =
        Command::new(env!("CARGO_BIN_EXE_shsa")).args(["replay", "--json", model]).arg(journal).output();
    let replay = replay.map_err(|error| error.to_string())?;
    let report: Value = serde_json::from_slice(&replay.stdout)
        .map_err(|error| format!("{error}: {}", String::from_utf8_lossy(&replay.stderr)))?;
    Ok(lines(report["events"].as_array().ok_or("no events")?))
}

/// How many decisions of a run its journal's replay repeats, and how many there were. A journal of several files has a hole, so
/// only the first file is compared.
///
/// # Errors
/// The difference.
pub(super) fn same(remains: &Remains) -> Result<(usize, usize), String> {
    let decided = lines(&remains.decisions);
    let journals = remains.journals();
    let has_hole = journals.len() > 1;
    let first = journals.first().ok_or("there is no journal")?;
    let replayed = of_file(&remains.model, first)?;
    let expected = if has_hole { &decided[..replayed.len().min(decided.len())] } else { &decided[..] };
    if replayed != expected {
        let at = replayed.iter().zip(expected).position(|(one, other)| one != other);
        let at = at.unwrap_or(replayed.len().min(expected.len()));
        return Err(format!(
            "decision {at} is {:?} when {} is replayed, and was {:?}",
            replayed.get(at),
            first.display(),
            expected.get(at)
        ));
    }
    for later in &journals[1..] {
        of_file(&remains.model, later)?;
    }
    Ok((replayed.len(), decided.len()))
}
