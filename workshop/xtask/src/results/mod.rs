//! `workshop/measured/results.md`: the results of the command on real recordings, clean and with injected faults.
//!
//! The figures come from the run and do not depend on machine or date, so the same command writes the same bytes. The section
//! [chaos] is measured in real time, and has a command of its own.

mod replay;
mod faults;
mod markdown;
mod pairs;
mod motes;
mod notes;
pub(crate) mod chaos;

use crate::command;
use anyhow::{Context, Result};
use faults::{FLIGHT_MS, GNSS, ROVER_MS, Row, WHEELS};
use markdown::{code, names, served, table};
use replay::{Fault, Subject};
use std::path::{Path, PathBuf};
use std::{env, fs};

const CAR: Subject = Subject { model: "models/car.yaml", recording: "../shared/data/comma2k19" };
const QUAD: Subject = Subject { model: "models/quad.yaml", recording: "../shared/data/quad" };
const HUSKY: Subject = Subject { model: "models/husky.yaml", recording: "../shared/data/husky" };
const MOTES: Subject = Subject { model: "models/motes.yaml", recording: "../shared/data/suthaharan" };

/// The number of seeds for injected noise.
const SEEDS: u32 = 20;

/// The output file.
const DOCUMENT: &str = "workshop/measured/results.md";

/// Builds the command, replays everything, and writes the text; writes nothing if the recordings are missing.
///
/// # Errors
/// When the command does not build, a replay fails, or the text cannot be written.
pub(crate) fn write() -> Result<()> {
    let absent = [CAR, QUAD, HUSKY, MOTES].into_iter().find(|subject| !subject.is_there());
    if let Some(absent) = absent {
        println!("SKIPPED: {} is not there, so {DOCUMENT} stays as it is", absent.recording);
        return Ok(());
    }
    command::run(&["cargo", "build", "--release", "--locked", "--package", "shsa"])?;
    let program = program();
    let mut text = notes::HEAD.to_owned();
    for (title, section) in SECTIONS {
        println!("{title}");
        text += &format!("\n## {title}\n\n{}", section(&program)?);
    }
    text += chaos::kept(&fs::read_to_string(DOCUMENT).unwrap_or_default());
    fs::create_dir_all("workshop/measured").context("making the folder workshop/measured")?;
    fs::write(DOCUMENT, text).with_context(|| format!("writing {DOCUMENT}"))
}

/// A section's title, and the function that writes its text.
type Section = (&'static str, fn(&Path) -> Result<String>);

const SECTIONS: [Section; 7] = [
    ("Clean recordings", clean),
    ("A car: one fault", car),
    ("A car: noise with other seeds", seeds),
    ("A car: two faults at once", pairs::section),
    ("A quadrotor: one fault", quad),
    ("A rover: one fault", husky),
    ("Motes: labelled events", motes::section),
];

fn program() -> PathBuf {
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    target.join("release/shsa")
}

fn clean(program: &Path) -> Result<String> {
    let mut rows = Vec::new();
    for subject in [CAR, QUAD, HUSKY, MOTES] {
        let report = subject.replay(program, &[], 1)?;
        rows.push(vec![
            code(&subject.command(&[])),
            report.observations.to_string(),
            format!("{:.0} s", report.duration_s),
            report.events.len().to_string(),
        ]);
    }
    Ok(table(&["command", "observations", "duration", "events"], &rows) + notes::CLEAN)
}

/// A row for each fault: the verdicts about its signal and about others, and the effect on the need.
fn singles(program: &Path, subject: Subject, faults: &[(Fault, Option<&str>)], unit: &str) -> Result<String> {
    let mut rows = Vec::new();
    for (fault, need) in faults {
        let report = subject.replay(program, &[*fault], 1)?;
        let [found, after] = markdown::verdict(&report.verdict(fault.signal), fault);
        let [gap, rmse] = served(need.and_then(|need| report.needs.get(need)));
        let suspected = names(&report.others_suspected(&[fault.signal]));
        let named = names(&report.others_named(&[fault.signal]));
        rows.push(vec![code(&fault.to_string()), found, after, suspected, named, gap, rmse]);
    }
    let error = format!("rmse{unit}");
    let header = ["fault", "verdict", "after", "others suspected", "others failed", "longest gap", &error];
    let example = faults.first().map(|(fault, _)| subject.command(&[*fault])).unwrap_or_default();
    Ok(format!("One row: `{example}`\n\n{}", table(&header, &rows)))
}

fn car(program: &Path) -> Result<String> {
    let faults: Vec<_> = faults::car().into_iter().map(|fault| (fault, Some("speed"))).collect();
    Ok(singles(program, CAR, &faults, " (m/s)")? + notes::CAR)
}

fn quad(program: &Path) -> Result<String> {
    Ok(singles(program, QUAD, &of_rows(faults::QUAD, FLIGHT_MS), "")? + notes::QUAD)
}

fn husky(program: &Path) -> Result<String> {
    Ok(singles(program, HUSKY, &of_rows(faults::HUSKY, ROVER_MS), "")? + notes::HUSKY)
}

fn of_rows(rows: &'static [Row], start_ms: u32) -> Vec<(Fault, Option<&'static str>)> {
    rows.iter().flat_map(|row| row.faults(start_ms).map(|fault| (fault, row.need))).collect()
}

fn seeds(program: &Path) -> Result<String> {
    let mut rows = Vec::new();
    for signal in WHEELS.into_iter().chain([GNSS]) {
        rows.push(seeds_of(program, Fault { kind: "noise=3", signal, start_ms: 20_000 })?);
    }
    let header = ["fault", "seeds", "named alone", "slowest", "largest gap", "largest rmse (m/s)"];
    let fault = Fault { kind: "noise=3", signal: WHEELS[0], start_ms: 20_000 };
    let example = CAR.command(&[fault]);
    Ok(format!("One row: `{example} --seed 1`, and so on\n\n{}", table(&header, &rows)))
}

fn seeds_of(program: &Path, fault: Fault) -> Result<Vec<String>> {
    let (mut alone, mut slowest_s, mut gap_s, mut rmse) = (0, 0.0_f64, 0.0_f64, 0.0_f64);
    for seed in 1..=SEEDS {
        let report = CAR.replay(program, &[fault], seed)?;
        let others =
            report.others_suspected(&[fault.signal]).len() + report.others_named(&[fault.signal]).len();
        if let (Some((_, named_s)), 0) = (report.verdict(fault.signal).named, others) {
            alone += 1;
            slowest_s = slowest_s.max(named_s - fault.start_s());
        }
        if let Some(need) = report.needs.get("speed") {
            gap_s = gap_s.max(need.longest_gap_s);
            rmse = rmse.max(need.rmse.unwrap_or(f64::INFINITY));
        }
    }
    let figures = [format!("{slowest_s:.2} s"), format!("{gap_s:.2} s"), format!("{rmse:.3}")];
    let counts = [code(&fault.to_string()), format!("1 to {SEEDS}"), alone.to_string()];
    Ok(counts.into_iter().chain(figures).collect())
}
