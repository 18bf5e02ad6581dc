//! The battery: each fault as a drive of its own, with shsa and without, and a table of the errors.

use crate::Outcome;
use shsa_core::time::Span;
use shsa_demo::terminal::{Ink, Terminal};
use shsa_demo::{Decision, Happening, Provision};
use shsa_demos::pack::{Fault, Score, Trial, Values};
use shsa_format::text;
use std::time::Duration;

/// The most decisions of a drive that are shown.
const MOST_SHOWN: usize = 4;

/// Drives with every fault.
///
/// The answer is no if a sensor was named wrongly or not at all, or a cell was below its limit.
///
/// # Errors
/// When standard output is closed.
pub(super) fn run(seed: u64) -> anyhow::Result<Outcome> {
    let mut terminal = Terminal::new(false, false);
    terminal.print_line(
        "A car drives for 8 minutes on the last quarter of its battery, 96 cells in series. Half-way something happens.\n\
         The car needs the charge, the current, the voltage, the lowest voltage of a cell and the hottest module.\n",
    )?;
    let mut rows = Vec::new();
    let (mut is_good, mut readings, mut engine) = (true, 0, Duration::ZERO);
    for fault in Fault::ALL {
        terminal.print_line(&format!("\n{}\n", fault.describe()))?;
        let healed = drive(&mut terminal, seed, fault, Provision::Healed)?;
        let sensors = drive(&mut terminal, seed, fault, Provision::SensorsAlone)?;
        is_good &= healed.is_good(fault);
        (readings, engine) = (readings + healed.readings, engine + healed.engine);
        rows.extend(rows_of(fault, &healed, &sensors));
    }
    let head = ["what happens", "largest error", "charge", "current", "voltage", "lowest", "hottest", "gap"];
    terminal.print_line(&format!("\n{}\n", text::table(&head, rows).trim_end()))?;
    let seconds = Trial::END_S as f64 * Fault::ALL.len() as f64;
    terminal.print_line(&format!(
        "\n{:.0} readings a second of 116 sensors; the engine takes {:.1} us for each\n\
         gap: the longest time without a new value of a need\n\
         without shsa: what was said last stands, and the charge is counted from a beginning that is known\n",
        readings as f64 / seconds,
        engine.as_secs_f64() * 1e6 / readings as f64,
    ))?;
    Ok(if is_good { Outcome::Done } else { Outcome::No })
}

/// One drive, with its first decisions.
fn drive(terminal: &mut Terminal, seed: u64, fault: Fault, provision: Provision) -> anyhow::Result<Score> {
    let mut trial = Trial::new(seed, fault, provision, Trial::END_S)?;
    let mut decided = 0;
    while !trial.is_over() {
        for happening in trial.step() {
            let Happening::Decided(decision) = happening else { continue };
            decided += 1;
            if decided <= MOST_SHOWN {
                terminal.decided(&in_short(decision))?;
            }
        }
    }
    if decided > MOST_SHOWN {
        let more = format!("decisions in all: {decided}");
        terminal.event(trial.now(), "and", Ink::Faint, &more)?;
    }
    Ok(trial.finish())
}

/// A decision without the names of all the cells.
fn in_short(decision: Decision) -> Decision {
    let because = collapsed(&decision.because);
    let substitution = decision.substitution.as_deref().map(collapsed);
    // What takes over is told by the new source.
    let because =
        if substitution.is_some() { "the source before is not trusted".to_owned() } else { because };
    Decision { because, substitution, ..decision }
}

/// Three and more names in a row that differ in numbers only become the first and the last of them.
fn collapsed(text: &str) -> String {
    let kind = |word: &str| word.replace(|sign: char| sign.is_ascii_digit() || sign == ',', "");
    let words: Vec<&str> = text.split(' ').collect();
    let runs = words.chunk_by(|one, other| one.ends_with(',') && kind(one) == kind(other));
    let run = |run: &[&str]| match run {
        [first, _, .., last] => format!("{} .. {last}", first.trim_end_matches(',')),
        few => few.join(" "),
    };
    runs.map(run).collect::<Vec<_>>().join(" ")
}

/// The rows of the table for a fault.
fn rows_of(fault: Fault, healed: &Score, sensors: &Score) -> Vec<Vec<String>> {
    let gap = format!("{:.1} s", healed.longest_gap.seconds());
    let mut rows = Vec::new();
    match healed.named_after.map(Span::seconds) {
        Some(after) => {
            rows.push(row(&format!("until named, {after:.1} s"), healed.until_named, ""));
            rows.push(row("then", healed.after, &gap));
        }
        None => rows.push(row("with shsa", healed.since(), &gap)),
    }
    rows.push(row("without shsa", sensors.since(), ""));
    for (index, row) in rows.iter_mut().enumerate() {
        row.insert(0, if index == 0 { fault.describe().to_owned() } else { String::new() });
    }
    rows
}

fn row(name: &str, errors: Values, gap: &str) -> Vec<String> {
    vec![
        name.to_owned(),
        format!("{:.1} %", 100.0 * errors.charge),
        format!("{:.1} A", errors.current),
        format!("{:.1} V", errors.voltage),
        format!("{:.0} mV", 1e3 * errors.lowest),
        format!("{:.1} K", errors.hottest),
        gap.to_owned(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_differ_in_numbers_are_collapsed() {
        assert_eq!(collapsed("/m/1, /m/2, /m/3 by a_1, a_2"), "/m/1 .. /m/3 by a_1, a_2");
        assert_eq!(collapsed("8 V; /m/1, /m/2, /m/13, /v"), "8 V; /m/1 .. /m/13, /v");
    }
}
