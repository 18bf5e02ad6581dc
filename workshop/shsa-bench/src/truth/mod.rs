//! `shsa-bench truth`: calibrates random plants with known truth and watches them; compares the promised with the measured false
//! alarms, and reports the smallest detected fault.

mod plant;
mod measure;
mod report;

use crate::Outcome;
use anyhow::{Context, anyhow};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use measure::{Measured, Recorded, measure};
use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// Arguments of `shsa-bench truth`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench truth --plants 300 --hours 20 --out workshop/measured

Each plant has 2 to 12 sensors of variables that 1 to 6 relations tie together, with noise of eight kinds, delays, unequal rates
and offsets that differ between sessions. It is calibrated on an hour and on four quarters of an hour, of which the second half
is not fitted, and watched for other hours. Beside it, how small a step is told, as a multiple of what a likelihood ratio test
sees that knows all about the noise and gives false alarms as often.")]
pub(crate) struct Arguments {
    /// Plants.
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..))]
    plants: u64,
    /// Hours that each calibrated plant is watched for.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..))]
    hours: u64,
    /// The number of the first plant.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// False alarms of a plant an hour that are promised.
    #[arg(long, value_name = "PER_HOUR", default_value_t = 0.5)]
    promise: f64,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Write truth.md and the raw results there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each calibration, and one for all, instead of a table.
    #[arg(long)]
    json: bool,
}

/// Calibrates and watches all plants.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let all = all(arguments)?;
    let text = if arguments.json {
        report::lines(&all, arguments.promise)
    } else {
        report::text(&all, arguments.promise)
    };
    writeln!(stdout().lock(), "{text}")?;
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        for (name, text) in [
            ("truth.md", report::document(&all, arguments)),
            ("truth.jsonl", format!("{}\n", report::lines(&all, arguments.promise))),
        ] {
            let path = folder.join(name);
            std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        }
    }
    Ok(Outcome::Done)
}

/// All plants with both ways of recording; the order does not depend on the threads.
fn all(arguments: &Arguments) -> anyhow::Result<Vec<Measured>> {
    let target =
        if stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(2 * arguments.plants), target);
    let style =
        ProgressStyle::with_template("{bar:40} {percent:>3} %  {pos} of {len} calibrations  {eta} left");
    let bar = bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let next = AtomicU64::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= 2 * arguments.plants {
                return done;
            }
            let recorded = if number.is_multiple_of(2) { Recorded::Hour } else { Recorded::Quarters };
            let plant = arguments.seed + number / 2;
            done.extend(measure(plant, recorded, arguments.hours, arguments.promise).map(|it| (number, it)));
            bar.inc(1);
        }
    };
    let mut done = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..arguments.threads.max(1)).map(|_| scope.spawn(work)).collect();
        let mut done = Vec::new();
        for worker in workers {
            done.extend(worker.join().map_err(|_| anyhow!("a plant broke off; its reason stands above"))?);
        }
        Ok::<_, anyhow::Error>(done)
    })?;
    bar.finish_and_clear();
    done.sort_unstable_by_key(|(number, _)| *number);
    Ok(done.into_iter().map(|(_, it)| it).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Few plants and few hours. `shsa-bench truth` shows that the promise holds; this test shows that no result is far from it,
    /// and that the same seeds give the same results.
    #[test]
    fn calibrated_plants_keep_what_is_promised() {
        let arguments =
            Arguments { plants: 2, hours: 4, seed: 9_001, promise: 0.5, threads: 2, out: None, json: false };
        let found = all(&arguments).unwrap();
        assert!(found.len() >= 2, "{found:?}");
        for one in &found {
            assert!(one.verdicts.failed == 0 && one.verdicts.alarms <= 2, "{one:?}");
        }
        let again = measure(9_001, Recorded::Hour, 4, 0.5).map(|it| (it.verdicts, it.factor.to_bits()));
        let first = found.iter().find(|it| it.plant == 9_001 && it.recorded == Recorded::Hour);
        assert_eq!(again, first.map(|it| (it.verdicts, it.factor.to_bits())));
    }
}
