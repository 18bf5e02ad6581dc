//! The charge that a model of the cell serves in the whole loop, with one sensor lost half-way.

use super::cell::{Row, half};
use crate::in_loop::{Recorded, Served};
use crate::table::{Errors, Table};
use anyhow::Context;
use serde_json::json;
use std::io::{Write, stdout};
use std::path::Path;

const METHODS: [&str; 2] = ["extended_kalman", "unscented_kalman"];

/// The needs of the model.
const NEEDS: [&str; 2] = ["/cell/charge", "/cell/voltage"];

/// A run in one scenario.
struct Run {
    method: &'static str,
    lost: Option<&'static str>,
    /// Of the charge, in shares of the capacity.
    charge: Errors,
    /// The longest time between two values, in seconds, of charge and voltage.
    gaps_s: [f64; 2],
}

/// Runs a model with each method and each sensor lost, and prints an object for each run where `is_json`.
///
/// # Errors
/// The model cannot be read, is wrong, or has no fusion by an extended Kalman filter.
pub(super) fn table(model: &Path, recording: &Path, rows: &[Row], is_json: bool) -> anyhow::Result<Table> {
    let text = std::fs::read_to_string(model).with_context(|| format!("cannot read {}", model.display()))?;
    let word = format!("method: {}", METHODS[0]);
    anyhow::ensure!(text.contains(&word), "{} has no `{word}`", model.display());
    let mut runs = Vec::new();
    for method in METHODS {
        let recorded = Recorded::new(&text.replace(&word, &format!("method: {method}")), recording)?;
        for lost in [None, Some("current"), Some("voltage")] {
            runs.push(run(&recorded, method, lost, rows)?);
        }
    }
    for run in runs.iter().filter(|_| is_json) {
        writeln!(
            stdout().lock(),
            "{}",
            json!({
                "model": run.method, "lost": run.lost, "rms": run.charge.rms(), "greatest": run.charge.greatest(),
                "charge_gap_s": run.gaps_s[0], "voltage_gap_s": run.gaps_s[1],
            })
        )?;
    }
    Ok(shown(&runs))
}

fn run(
    recorded: &Recorded,
    method: &'static str,
    lost: Option<&'static str>,
    rows: &[Row],
) -> anyhow::Result<Run> {
    let first_s = rows.first().map_or(0.0, |row| row.at_s);
    let half_s = rows.get(half(rows)).map_or(0.0, |row| row.at_s);
    let fault = lost.map(|signal| format!("drop:{signal}@{}s..", half_s - first_s));
    let served = recorded.serve(fault.as_deref(), NEEDS)?;
    let from_s = if lost.is_some() { half_s } else { first_s + 3600.0 };
    let capacity_ah = rows.iter().map(|row| row.charge_ah).fold(0.0, f64::max);
    let begin = recorded.span()?.0;
    let mut charge = Errors::default();
    let at_s = |served: &Served| first_s + (served.at - begin).seconds();
    for pair in served[0].windows(2) {
        let (at, since) = (at_s(&pair[1]), at_s(&pair[1]) - at_s(&pair[0]));
        if at >= from_s {
            let truth = true_charge(rows, at);
            // Ampere-hours are coulombs inside.
            charge.add((pair[1].value.midpoint() / 3600.0 - truth) / capacity_ah, since);
        }
    }
    let end = recorded.span()?.1;
    let gap = |served: &Vec<Served>| {
        let times = served.iter().map(|it| it.at).chain([end]);
        let gaps = times.clone().skip(1).zip(times).map(|(later, earlier)| (later - earlier).seconds());
        gaps.fold(0.0, f64::max)
    };
    let gaps_s = [gap(&served[0]), gap(&served[1])];
    Ok(Run { method, lost, charge, gaps_s })
}

/// The counted charge at a time, between two rows on the straight line.
fn true_charge(rows: &[Row], at_s: f64) -> f64 {
    let after = rows.partition_point(|row| row.at_s <= at_s).clamp(1, rows.len() - 1);
    let (one, other) = (&rows[after - 1], &rows[after]);
    let share = ((at_s - one.at_s) / (other.at_s - one.at_s)).clamp(0.0, 1.0);
    one.charge_ah + share * (other.charge_ah - one.charge_ah)
}

fn shown(runs: &[Run]) -> Table {
    let row = |run: &Run| {
        vec![
            run.method.to_owned(),
            run.lost.map_or("all is well".to_owned(), |lost| format!("{lost} lost half-way")),
            format!("{:.2} ({:.2})", 100.0 * run.charge.rms(), 100.0 * run.charge.greatest()),
            format!("{:.0}", run.gaps_s[0]),
            format!("{:.0}", run.gaps_s[1]),
        ]
    };
    let head = [
        "method",
        "sensors",
        "error of the charge, % of the capacity",
        "longest gap of the charge, s",
        "of the voltage, s",
    ];
    Table {
        title: "In the loop: what the needs of models/cell-charge.yaml are served with".to_owned(),
        note: "The model's `fusion:` is the only source of the charge that knows the voltage. A need is met while its values are no \
               older than 150 s; rows are up to 60 s apart. The error is the root of its mean square over time (greatest)."
            .to_owned(),
        head: head.map(str::to_owned).into(),
        rows: runs.iter().map(row).collect(),
    }
}
