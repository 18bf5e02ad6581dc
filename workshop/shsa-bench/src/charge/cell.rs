//! A cycler's recording.

use anyhow::{Context, bail};
use std::fs;
use std::path::{Path, PathBuf};

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

/// The voltage at which the charger keeps a full cell, less its rounding, and the current at which it counts as full.
const FULL_V: f64 = 4.199;
const FULL_A: f64 = 1.0;

/// A recording of a cell.
pub(super) struct Recording {
    pub(super) file: PathBuf,
    pub(super) rows: Vec<Row>,
}

impl Recording {
    /// Reads a recording whose begin is taken as empty.
    ///
    /// # Errors
    /// As [`read`].
    pub(super) fn new(file: &Path) -> anyhow::Result<Recording> {
        Ok(Recording { file: file.to_owned(), rows: read(file)? })
    }

    /// Reads another recording of the cell, whose charge is counted from where its charger finds the cell full.
    ///
    /// # Errors
    /// As [`read`], or one of the two is never full.
    pub(super) fn as_full_as(file: &Path, other: &Recording) -> anyhow::Result<Recording> {
        let mut new = Recording::new(file)?;
        let apart = other.full_ah()? - new.full_ah()?;
        new.rows.iter_mut().for_each(|row| row.charge_ah += apart);
        Ok(new)
    }

    /// The name by which a model's sources call it.
    pub(super) fn name(&self) -> anyhow::Result<&str> {
        let stem = self.file.file_stem().and_then(|stem| stem.to_str());
        stem.with_context(|| format!("{} has no name", self.file.display()))
    }

    /// The charge where the charger first finds the cell full.
    fn full_ah(&self) -> anyhow::Result<f64> {
        let is_full = |row: &&Row| row.voltage_v >= FULL_V && (0.0..=FULL_A).contains(&row.current_a);
        let full = self.rows.iter().find(is_full).map(|row| row.charge_ah);
        full.with_context(|| format!("in {} the cell is never full", self.file.display()))
    }
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
    after(rows, 0.5)
}

/// The first row after a share of the time.
pub(super) fn after(rows: &[Row], share: f64) -> usize {
    let ends = rows.first().zip(rows.last());
    let from = ends.map_or(0.0, |(first, last)| (1.0 - share) * first.at_s + share * last.at_s);
    rows.partition_point(|row| row.at_s < from)
}
