//! `shsa-bench monitor`: the costs of monitoring, compared with the published programs.

mod model;
mod measure;
mod rival;
mod report;

use crate::Outcome;
use measure::{Measured, default_mode, thesis_mode};
use rival::Rival;
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa-bench monitor`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench monitor --turn 0.2")]
pub(crate) struct Arguments {
    /// How many seconds a turn lasts; of five turns the fastest counts.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.5, value_parser = turn)]
    turn: f64,
    /// Also compare with RTLola's interpreter: in the project's folder only, as cargo builds it.
    #[arg(long)]
    rtlola: bool,
    /// Write monitor.md, its plot and the raw results there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each measurement instead of tables.
    #[arg(long)]
    json: bool,
}

/// The numbers of ways of one variable with which growth is measured.
const CROWDS: [usize; 5] = [2, 4, 8, 16, 32];

fn turn(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("'{text}' is no number of seconds"))?;
    if (0.001..=60.0).contains(&seconds) { Ok(seconds) } else { Err("0.001 to 60 seconds".to_owned()) }
}

/// All results.
struct Found {
    cases: Vec<Measured>,
    crowds: Vec<Measured>,
    rivals: Vec<Rival>,
}

/// Measures all systems, one after the other on one core.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let found = measure(arguments)?;
    if !arguments.json {
        writeln!(stdout().lock(), "{}", report::text(&found))?;
    }
    if let Some(folder) = &arguments.out {
        report::write(folder, arguments, &found)?;
    }
    Ok(Outcome::Done)
}

fn measure(arguments: &Arguments) -> anyhow::Result<Found> {
    let show = |measured: Measured| -> anyhow::Result<Measured> {
        match arguments.json {
            true => writeln!(stdout().lock(), "{}", measured.to_json())?,
            false => crate::notice(&format!("{} ...", measured.case)),
        }
        Ok(measured)
    };
    let turn = arguments.turn;
    let generic = model::generic()?;
    let cases = vec![
        show(default_mode("generic", &generic, turn))?,
        show(thesis_mode("generic, thesis mode", &generic, turn))?,
        show(default_mode("plant", &model::plant()?, turn))?,
        show(default_mode("plant, computed", &model::computed_plant()?, turn))?,
        show(default_mode("scan and image row", &model::scans()?, turn))?,
    ];
    let crowd = |&ways: &usize| show(default_mode("one variable", &model::crowd(ways)?, turn));
    let crowds = CROWDS.iter().map(crowd).collect::<anyhow::Result<_>>()?;
    let rivals = if arguments.rtlola { Rival::measure(turn)? } else { Vec::new() };
    for rival in rivals.iter().filter(|_| arguments.json) {
        writeln!(stdout().lock(), "{}", rival.to_json())?;
    }
    Ok(Found { cases, crowds, rivals })
}
