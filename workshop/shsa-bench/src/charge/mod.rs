//! `shsa-bench charge`: the state of charge of a lithium cell, by counting, by the inverse curve, and by their fusion.
//!
//! D. Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien 2019, chapter 3; the equivalent circuit: G. Plett 2004
//! (doi:10.1016/j.jpowsour.2004.02.031).

mod cell;
mod circuit;
mod methods;
mod detailed;
mod modelled;
mod further;

use crate::table::{Errors, Table, write_document};
use crate::{Outcome, notice};
use anyhow::{Context, bail};
use cell::{Recording, Row};
use circuit::Circuit;
use detailed::Detailed;
use methods::{Method, Scenario, run_method};
use serde_json::json;
use std::fs;
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa-bench charge`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench charge discharge_1c.csv

The recording is that of a cycler: time, current, voltage and the charge counted since a charge or discharge began, in its \
columns Time(s), Current(A), Voltage(V), Capacity(Ah) and Mode. The circuit is fitted to its first half.")]
pub(crate) struct Arguments {
    /// A recording of charges and discharges from empty to full.
    file: PathBuf,
    /// The model of the cell, models/cell-charge.yaml, to be run in the loop over the recording.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Run the model by its own method only, not also by those that it is compared with.
    #[arg(long, requires = "model")]
    own_method: bool,
    /// Run the model without a failure and with these only: `--failure bias=3:current`. `--further` then only adds the other recording.
    #[arg(long, value_name = "KIND:SIGNAL", requires = "model")]
    failure: Vec<String>,
    /// Also run the model with other failures at other times, and over this other recording of the cell.
    #[arg(long, value_name = "FILE", requires = "model")]
    further: Option<PathBuf>,
    /// A model whose circuit is fitted to that other recording, models/cell-pulses.yaml: its failures are run by this model.
    #[arg(long, value_name = "FILE", requires = "further")]
    further_model: Option<PathBuf>,
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
    let recording = Recording::new(&arguments.file)?;
    let rows = &recording.rows;
    let half = cell::half(rows);
    let circuit = Circuit::fit(rows.get(..half).unwrap_or(rows))?;
    let mut results = Vec::new();
    for scenario in Scenario::ALL {
        for method in Method::ALL {
            results.push(measure(method, scenario, &circuit, rows)?);
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
    let mut tables = vec![table(&results)];
    match &arguments.model {
        Some(model) => tables.extend(in_the_loop(model, &recording, arguments)?),
        None => notice("SKIPPED: the model in the loop: no --model FILE"),
    }
    if !arguments.json {
        tables.iter().try_for_each(|table| writeln!(stdout().lock(), "{table}"))?;
    }
    if let Some(folder) = &arguments.out {
        write_document(
            folder,
            "charge",
            "State of charge",
            &introduction(&circuit, &Detailed::fit(rows)?, rows),
            &tables,
        )?;
    }
    Ok(Outcome::Done)
}

/// The tables of a model in the loop: over its recording with the failures that it knows, and, where it is asked for, with others, and over
/// another recording.
fn in_the_loop(model: &Path, recording: &Recording, arguments: &Arguments) -> anyhow::Result<Vec<Table>> {
    let text = fs::read_to_string(model).with_context(|| format!("cannot read {}", model.display()))?;
    has_circuit(model, &text, &Detailed::fit(&recording.rows)?)?;
    let methods = if arguments.own_method { &modelled::METHODS[..1] } else { &modelled::METHODS };
    let failures = modelled::wanted(&arguments.failure);
    let runs = modelled::runs(&text, methods, &failures, recording, arguments.json)?;
    let title = "In the loop: what the needs of models/cell-charge.yaml are served with";
    let mut tables = vec![modelled::table(title, modelled::NOTE, &runs, &failures)];
    if let Some(other) = &arguments.further {
        if arguments.failure.is_empty() {
            let title = "Other failures, at other times";
            tables.push(further::table(title, OFFSET, &text, recording, arguments.json)?);
        }
        tables.extend(over_another(&text, recording, other, &failures, arguments)?);
    }
    Ok(tables)
}

/// The tables of another recording: by a model that is not fitted to it, and by one that is, where there is one. Then the first runs without
/// failures only.
fn over_another(
    text: &str,
    recording: &Recording,
    file: &Path,
    failures: &[modelled::Failure],
    arguments: &Arguments,
) -> anyhow::Result<Vec<Table>> {
    let other = Recording::as_full_as(file, recording)?;
    let text = text.replace(&format!("{}#", recording.name()?), &format!("{}#", other.name()?));
    let method = &modelled::METHODS[..1];
    let own = if arguments.further_model.is_some() { &[] } else { failures };
    let runs = modelled::runs(&text, method, own, &other, arguments.json)?;
    let mut tables = vec![modelled::table("Another recording of the cell", PULSES, &runs, own)];
    if let Some(model) = &arguments.further_model {
        let text = fs::read_to_string(model).with_context(|| format!("cannot read {}", model.display()))?;
        let other = Recording::new(file)?;
        let circuit = Detailed::fit(&other.rows)?;
        has_circuit(model, &text, &circuit)?;
        let runs = modelled::runs(&text, method, failures, &other, arguments.json)?;
        let title = "The other recording by a model of its own, models/cell-pulses.yaml";
        tables.push(modelled::table(title, &own_note(&circuit, &other.rows), &runs, failures));
        if arguments.failure.is_empty() {
            let title = "Other failures over the other recording, at other times";
            tables.push(further::table(title, LARGE, &text, &other, arguments.json)?);
        }
    }
    Ok(tables)
}

fn own_note(circuit: &Detailed, rows: &[Row]) -> String {
    let errors = circuit.errors(rows);
    format!(
        "The circuit is fitted to the first half of this recording: one charge with 10 A and three discharges of 3 Ah with their pulses. \
         It is {:.1} mV off there (root of the mean square, above a tenth of the capacity), and {:.1} mV (at most {:.0}) on the second half, \
         in which the sensors fail. Its begin is taken as empty. As the test holds 10 A for 2.9 h, and a rest one voltage for 34 min, a sensor is \
         only found frozen by the time alone after 4 h and 1 h: what is stuck is found by the filter (`stuck`). {} So the model's voltage has a \
         noise of 0.5 mV, its `misfit` one of 0.05 mV per root of a second at rest, and its current 0.003 A until the charger holds 4.2 V. \
         Where the curve is off, it stays so while the cell rests, and is off otherwise 2 Ah further: so the error of the curve is a state of its \
         own (`curve_error`), with the error of the circuit above as its standard deviation. The circuit is fitted to more hours of charging than of discharging, in \
         which the cell shows less resistance: the share by which the slower two pairs are off is another state (`slower`). The model before \
         had neither, and a pair of 600 s in the place of those of 200 and 2000 s; it began with a current within 1 A of none, so the 10 A with which the \
         recording begins were outliers to it, and it took the sensors for faulty from then on. It was 0.35 % off with all well, and 2.9 % \
         with a current scaled by 0.9, and its voltage 10 mV with all well. With a silent voltage it is most off where the cell is nearly empty: below a tenth of the \
         capacity, the circuit is 75 mV off on the second half. \
         Just after a change of the load the circuit is less exact: how much so (0.05 and 0.1 mV/A of the change, and 0.02 mV/A until the last pair has followed) was chosen on this recording. \
         For how long its errors are alike (`evidence_every`) is the time of its brief pair. The failures half-way of both tables, of this and of the other recording, \
         were looked at while the filter was changed. The model was then chosen among 27 by up to eight of these failures and by its states with all well, \
         `models/cell-charge.yaml` among six by up to ten. The failures after 75 % decided nothing.",
        1e3 * errors[0].rms(),
        1e3 * errors[1].rms(),
        1e3 * errors[1].greatest(),
        wandering(&circuit.wander(rows)),
    )
}

const OFFSET: &str = "\
One is more than 2 % off: an offset of 500 mV at 75 %, four minutes before the charger holds its voltage.";

const LARGE: &str = "None is more than 2 % off.";

const PULSES: &str = "\
Discharges of 3 Ah with pulses between them (`hppc_25c.csv`, of the same cell), to which nothing is fitted. Its charge is counted from where \
the charger finds the cell full, as that of the other recording. The charge is not within 1 % even while all is well: \
the circuit, fitted to hours of constant current, is 24 mV off on average in pulses of 30 A, in which the cell shows 1.7 of the 2.4 milliohm, \
and 18 mV while the cell is charged with 10 A. The filter takes these errors for faults of the current. Besides, sensors that are well show one \
value for longer than the model allows (10 A for 2.9 h, one voltage at rest for 34 min), so they are accused as frozen.";

/// Checks that what a model says of the cell is what the first half of the recording gives.
///
/// # Errors
/// It is not.
fn has_circuit(model: &Path, text: &str, circuit: &Detailed) -> anyhow::Result<()> {
    match circuit.texts().into_iter().find(|part| !text.contains(part)) {
        None => Ok(()),
        Some(part) => bail!("{} has not the circuit that fits: no `{part}`", model.display()),
    }
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

fn introduction(circuit: &Circuit, detailed: &Detailed, rows: &[Row]) -> String {
    let errors = detailed.errors(rows);
    format!(
        "Written by `shsa-bench charge discharge_1c.csv --model models/cell-charge.yaml --further hppc_25c.csv --further-model models/cell-pulses.yaml --out workshop/measured`.\n\n\
         A cell is charged and discharged four times ([batterysim/equiv-circ-model]\
         (https://github.com/batterysim/equiv-circ-model), MIT). What is true is the count of the cycler itself, which ends each \
         charge within 0.2 % of where the one before did. The circuit, an open-circuit curve of {} points, a resistance of \
         {:.2} milliohm and a pair of {:.2} milliohm and {:.0} s, is fitted to the first half; a sensor that fails is \
         silent from the middle on.\n\n\
         *count*: the current, integrated from the given beginning. *inverse curve*: where the curve has the voltage that is \
         left without resistance and pair. *EKF*, *UKF*: charge, current, voltage of the pair and resistance as states of an \
         extended and an unscented Kalman filter over the same formulas; the resistance is learned. The recording has no \
         temperature.\n\n\
         The circuit of the model has a curve of 28 points and pairs of 20, 200 and 2000 s, the slower two with resistances that depend on the \
         charge, fitted to the first half, too. Above a tenth of the capacity it is {:.1} mV off there (root of the mean square), and \
         {:.1} mV (at most {:.0}) on the second half. {}",
        circuit.knots.len(),
        1e3 * circuit.resistance,
        1e3 * circuit.pair,
        circuit::PAIR_S,
        1e3 * errors[0].rms(),
        1e3 * errors[1].rms(),
        1e3 * errors[1].greatest(),
        wandering(&detailed.wander(rows)),
    )
}

/// What the noise of a model's voltage and of its `misfit` is chosen by.
fn wandering(wander: &[Errors; 2]) -> String {
    format!(
        "On the first half its error changes within a minute by {:.1} mV at rest and {:.1} mV under load (root of the mean square, from two \
         minutes after a change of the load on); the voltage is written in steps of 1 mV.",
        1e3 * wander[0].rms(),
        1e3 * wander[1].rms(),
    )
}
