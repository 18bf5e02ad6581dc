//! Two faults of the car at once.

use super::CAR;
use super::faults::{GNSS, PAIR_KINDS, WHEELS, car_pairs};
use super::markdown::{self, code, names, served, table};
use super::notes;
use super::replay::{Fault, Report};
use anyhow::Result;
use std::path::Path;

/// The delays of the second fault.
const LATER_MS: [u32; 4] = [0, 100, 500, 10_000];

/// Counts over pairs of faults with the same first kind.
#[derive(Default)]
struct Tally {
    runs: usize,
    both_named: usize,
    not_isolated: usize,
    missed: usize,
    healthy_suspected: usize,
    healthy_named: usize,
}

pub(super) fn section(program: &Path) -> Result<String> {
    let shown = shown();
    let example = shown.first().map(|pair| CAR.command(pair)).unwrap_or_default();
    let mut rows = Vec::new();
    for pair in &shown {
        rows.push(row(pair, &CAR.replay(program, pair, 1)?));
    }
    let header = [
        "first",
        "verdict",
        "second",
        "verdict",
        "others suspected",
        "others failed",
        "longest gap",
        "rmse (m/s)",
    ];
    let each = table(&header, &rows);
    Ok(format!("One row: `{example}`\n\n{each}{}{}{}", notes::PAIRS, grid(program)?, notes::GRID))
}

/// Pairs with a row each: two wheels with equal and with different biases, a wheel and the GNSS.
fn shown() -> Vec<[Fault; 2]> {
    let at_20 = |kind, signal| Fault { kind, signal, start_ms: 20_000 };
    let wheels = || car_pairs().into_iter().filter(|(_, other)| *other != GNSS);
    let alike = wheels().map(|(one, other)| [at_20("bias=2", one), at_20("bias=2", other)]);
    let unlike = wheels().map(|(one, other)| [at_20("bias=2", one), at_20("bias=3", other)]);
    let mixed = WHEELS.into_iter().flat_map(|wheel| {
        [[at_20("bias=2", wheel), at_20("bias=2", GNSS)], [at_20("spoof=0", wheel), at_20("scale=1.3", GNSS)]]
    });
    let later = Fault { kind: "bias=2", signal: WHEELS[1], start_ms: 25_000 };
    alike.chain(unlike).chain(mixed).chain([[at_20("bias=2", WHEELS[0]), later]]).collect()
}

fn row(pair: &[Fault; 2], report: &Report) -> Vec<String> {
    let faulty = pair.map(|fault| fault.signal);
    let found = |fault: &Fault| {
        let [found, after] = markdown::verdict(&report.verdict(fault.signal), fault);
        [code(&fault.to_string()), format!("{found} {after}").trim_end().to_owned()]
    };
    let others = [names(&report.others_suspected(&faulty)), names(&report.others_named(&faulty))];
    pair.iter().flat_map(found).chain(others).chain(served(report.needs.get("speed"))).collect()
}

/// All combinations of kinds, on all pairs of signals; the delay of the second fault changes from run to run.
fn grid(program: &Path) -> Result<String> {
    let mut rows = Vec::new();
    for (number, one) in PAIR_KINDS.into_iter().enumerate() {
        let mut tally = Tally::default();
        for (other_number, other) in PAIR_KINDS.into_iter().enumerate() {
            for (pair_number, (first, second)) in car_pairs().into_iter().enumerate() {
                let later_ms = LATER_MS[(number + other_number + pair_number) % LATER_MS.len()];
                let start_ms = 20_000;
                let faults = [
                    Fault { kind: one, signal: first, start_ms },
                    Fault { kind: other, signal: second, start_ms: start_ms + later_ms },
                ];
                tally.add(&CAR.replay(program, &faults, 1)?, [first, second]);
            }
        }
        rows.push(tally.row(one));
    }
    let header = [
        "first",
        "runs",
        "both named",
        "not isolated",
        "missed",
        "healthy one suspected",
        "healthy one failed",
    ];
    Ok(table(&header, &rows))
}

impl Tally {
    fn add(&mut self, report: &Report, faulty: [&str; 2]) {
        let verdicts = faulty.map(|signal| report.verdict(signal));
        let named = |verdict: &super::replay::Verdict| verdict.named.is_some();
        let accused = |verdict: &super::replay::Verdict| named(verdict) || verdict.suspected_s.is_some();
        self.runs += 1;
        self.both_named += usize::from(verdicts.iter().all(named));
        self.not_isolated += usize::from(verdicts.iter().all(accused) && !verdicts.iter().all(named));
        self.missed += usize::from(!verdicts.iter().all(accused));
        self.healthy_suspected += usize::from(!report.others_suspected(&faulty).is_empty());
        self.healthy_named += usize::from(!report.others_named(&faulty).is_empty());
    }

    fn row(&self, kind: &str) -> Vec<String> {
        let counts = [
            self.runs,
            self.both_named,
            self.not_isolated,
            self.missed,
            self.healthy_suspected,
            self.healthy_named,
        ];
        [code(kind)].into_iter().chain(counts.map(|count| count.to_string())).collect()
    }
}
