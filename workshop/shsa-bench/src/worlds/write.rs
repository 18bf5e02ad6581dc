//! A world as files: the model, the recording and the truth.

use super::readings::Reading;
use super::watch::ORIGIN;
use super::world::World;
use super::written::{Names, Order};
use anyhow::Context;
use serde_json::json;
use std::fmt::Write;
use std::path::Path;

/// Writes `NAME.yaml`, `NAME.jsonl` for `shsa replay`, and `NAME.truth.csv` with 2,000 moments of each variable in SI.
///
/// # Errors
/// The folder cannot be made, or a file not be written.
pub(super) fn write(world: &World, readings: &[Reading], folder: &Path, name: &str) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let mut lines = String::new();
    for reading in readings {
        let is_vector = world.variables[world.signals[reading.signal].variable].is_vector;
        let value = if is_vector { json!(reading.values) } else { json!(reading.values[0]) };
        let signal = Names::Plain.signal(reading.signal);
        let (stamp, received) = (ORIGIN + reading.stamp, ORIGIN + reading.received);
        let line = json!({ "signal": signal, "time_ns": stamp, "received_ns": received, "value": value });
        _ = writeln!(lines, "{line}");
    }
    for (end, text) in
        [("yaml", world.model(Names::Plain, Order::Written)), ("jsonl", lines), ("truth.csv", truth(world))]
    {
        let path = folder.join(format!("{name}.{end}"));
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

fn truth(world: &World) -> String {
    let mut text = "time_s".to_owned();
    for (at, variable) in world.variables.iter().enumerate() {
        for element in 0..variable.courses.len() {
            _ = write!(text, ",{}[{element}]", Names::Plain.variable(at));
        }
    }
    for at in 0..=2000 {
        let time = world.seconds * f64::from(at) / 2000.0;
        _ = write!(text, "\n{time}");
        for course in world.variables.iter().flat_map(|it| &it.courses) {
            _ = write!(text, ",{}", course(time));
        }
    }
    text + "\n"
}
