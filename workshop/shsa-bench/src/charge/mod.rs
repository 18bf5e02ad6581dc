//! `shsa-bench charge`: the state of charge of a lithium cell, by counting, by the inverse curve, and by their fusion.
//!
//! D. Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien 2019, chapter 3; the equivalent circuit: G. Plett 2004
//! (doi:10.1016/j.jpowsour.2004.02.031).

mod cell;
mod circuit;
mod methods;

use crate::Outcome;
use crate::table::{Errors, Table, write_document};
use cell::Row;
use circuit::Circuit;
use methods::{Method, Scenario, run_method};
use serde_json::json;
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa-bench charge`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench charge discharge_1c.csv

The recording is that of a cycler: time, current, voltage and the charge counted since a charge or discharge began, in its \
columns Time(s), Current(A), Voltage(V), Capacity(Ah) and Mode. The circuit is fitted to its first half.")]
pub(crate) struct Arguments {
    /// A recording of charges and discharges from empty to full.
    file: PathBuf,
    /// Write charge.md there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each method and scenario instead of a table.
    #[arg(long)]
    json: bool,
}

/// The errors of a method in a scenario, in shares of the capacity.
struct Result {
    method: Method,
    scenario: Scenario,
    errors: Errors,
    /// The resistance learned by the end, in ohm; only of methods that learn one.
    resistance: Option<f64>,
}

/// Runs all methods in all scenarios.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let rows = cell::read(&arguments.file)?;
    let circuit = Circuit::fit(rows.get(..cell::half(&rows)).unwrap_or(&rows))?;
    let mut results = Vec::new();
    for scenario in Scenario::ALL {
        for method in Method::ALL {
            results.push(measure(method, scenario, &circuit, &rows)?);
        }
    }
    for result in results.iter().filter(|_| arguments.json) {
        writeln!(
            stdout().lock(),
            "{}",
            json!({
                "method": result.method.name(), "scenario": result.scenario.name(),
                "rms": result.errors.rms(), "greatest": result.errors.greatest(),
                "resistance_ohm": result.resistance,
            })
        )?;
    }
    let table = table(&results);
    if !arguments.json {
        writeln!(stdout().lock(), "{table}")?;
    }
    if let Some(folder) = &arguments.out {
        write_document(folder, "charge", "State of charge", &introduction(&circuit), &[table])?;
    }
    Ok(Outcome::Done)
}

/// The errors of a method: from the failure on where a sensor fails, else after the first hour.
fn measure(method: Method, scenario: Scenario, circuit: &Circuit, rows: &[Row]) -> anyhow::Result<Result> {
    let half = cell::half(rows);
    let (estimates, resistance) = run_method(method, scenario, circuit, rows)?;
    let mut errors = Errors::default();
    let from = if scenario.fails() { half } else { rows.partition_point(|row| row.at_s < 3600.0) };
    for (pair, estimate) in rows.windows(2).zip(estimates.iter().skip(1)).skip(from) {
        let [before, row] = pair else { continue };
        errors.add((estimate - row.charge_ah) / circuit.capacity_ah, row.at_s - before.at_s);
    }
    Ok(Result { method, scenario, errors, resistance })
}

fn table(results: &[Result]) -> Table {
    let percent =
        |share: f64| if share.is_nan() { "none".to_owned() } else { format!("{:.2}", 100.0 * share) };
    let rows = Method::ALL.map(|method| {
        let own = results.iter().filter(|result| result.method == method);
        let cells = own.map(|result| {
            format!("{} ({})", percent(result.errors.rms()), percent(result.errors.greatest()))
        });
        std::iter::once(method.name().to_owned()).chain(cells).collect()
    });
    let head = std::iter::once("method").chain(Scenario::ALL.map(Scenario::name));
    Table {
        title: "Error of the charge, in percent of the capacity".to_owned(),
        note: "Root of the mean square over time (greatest). Where a sensor fails, from then on; else after the first hour."
            .to_owned(),
        head: head.map(str::to_owned).collect(),
        rows: rows.into(),
    }
}

fn introduction(circuit: &Circuit) -> String {
    format!(
        "Written by `shsa-bench charge discharge_1c.csv --out workshop/measured`.\n\n\
         A cell is charged and discharged four times ([batterysim/equiv-circ-model]\
         (https://github.com/batterysim/equiv-circ-model), MIT). What is true is the count of the cycler itself, which ends each \
         charge within 0.2 % of where the one before did. The circuit, an open-circuit curve of {} points, a resistance of \
         {:.2} milliohm and a pair of {:.2} milliohm and {:.0} s, is fitted to the first half; a sensor that fails is \
         silent from the middle on.\n\n\
         *count*: the current, integrated from the given beginning. *inverse curve*: where the curve has the voltage that is \
         left without resistance and pair. *EKF*, *UKF*: charge, current, voltage of the pair and resistance as states of an \
         extended and an unscented Kalman filter over the same formulas; the resistance is learned. The recording has no \
         temperature.",
        circuit.knots.len(),
        1e3 * circuit.resistance,
        1e3 * circuit.pair,
        circuit::PAIR_S,
    )
}
