//! A cycler's recording.

use anyhow::{Context, bail};
use std::fs;
use std::path::Path;

/// A row of the recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    pub(super) at_s: f64,
    /// Positive: charging.
    pub(super) current_a: f64,
    pub(super) voltage_v: f64,
    /// Charge by the cycler's own count, from the begin of the recording, at which the cell is taken as empty.
    pub(super) charge_ah: f64,
}

/// Reads a recording; rows without numbers are left out.
///
/// # Errors
/// A file that cannot be read, a column that is not there, fewer than a hundred rows.
pub(super) fn read(path: &Path) -> anyhow::Result<Vec<Row>> {
    let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let place = |name: &str| {
        let found = head.iter().position(|column| *column == name);
        found.with_context(|| format!("{}: no column `{name}`", path.display()))
    };
    let numbers = [place("Time(s)")?, place("Current(A)")?, place("Voltage(V)")?, place("Capacity(Ah)")?];
    let mode = place("Mode")?;
    let (mut rows, mut before, mut base) = (Vec::<Row>::new(), String::new(), 0.0);
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let found = numbers.map(|place| cells.get(place).and_then(|cell| cell.trim().parse::<f64>().ok()));
        let [Some(at_s), Some(current_a), Some(voltage_v), Some(counted)] = found else { continue };
        let mode = cells.get(mode).copied().unwrap_or("");
        let last = rows.last().map_or(0.0, |row| row.charge_ah);
        if mode != before {
            (before, base) = (mode.to_owned(), last);
        }
        // During a rest the count of the previous phase stays in the file.
        let charge_ah = if mode == "REST" { base } else { base + counted };
        rows.push(Row { at_s, current_a, voltage_v, charge_ah });
    }
    if rows.len() < 100 {
        bail!("{} has {} rows with numbers: too few", path.display(), rows.len());
    }
    Ok(rows)
}

/// The first row of the second half of the time.
pub(super) fn half(rows: &[Row]) -> usize {
    let middle = rows.first().zip(rows.last()).map_or(0.0, |(first, last)| 0.5 * (first.at_s + last.at_s));
    rows.partition_point(|row| row.at_s < middle)
}
