//! `shsa-bench worlds`: random systems with known truth over the whole language of models, and what the engine says of them.

mod unit;
mod course;
mod sensor;
mod world;
mod written;
mod readings;
mod declared;
mod kinds;
mod watch;
mod write;
mod sound;
mod hidden;
mod fault;
mod faulty;
mod alike;
mod odds;
mod voter;
mod report;
#[cfg(test)]
mod tests;

use crate::Outcome;
use anyhow::{Context, bail};
use faulty::Liars;
use kinds::{KINDS, Kind};
use report::Tally;
use shsa_lab::calibration::Chance;
use std::fs;
use std::io::{Write as _, stdout};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use watch::Watched;

/// Arguments of `shsa-bench worlds`.
#[derive(clap::Args)]
#[command(
    after_help = "Example: shsa-bench worlds --seeds 0..1000 --kind product --kind wraps+stamps --write failing"
)]
pub(crate) struct Arguments {
    /// The numbers of the worlds of each kind: from, and to before which.
    #[arg(long, value_name = "A..B", default_value = "0..100", value_parser = seeds)]
    seeds: (u64, u64),
    /// A kind, or several in one world, such as `product+delays`; all kinds, each alone, without it.
    #[arg(long = "kind", value_name = "NAME[+NAME]..")]
    kinds: Vec<String>,
    /// Worlds of so many random kinds together.
    #[arg(long, value_name = "COUNT", conflicts_with = "kinds")]
    mixed: Option<usize>,
    /// What is asked of each world.
    #[arg(long, value_enum, default_value_t = Oracle::Sound)]
    oracle: Oracle,
    /// Print the kinds, and what each adds to a world.
    #[arg(long)]
    list: bool,
    /// Write each failing world there: model, recording and truth.
    #[arg(long, value_name = "FOLDER")]
    write: Option<PathBuf>,
    /// With the oracle `odds`: draw the shares of right verdicts there
    #[arg(long, value_name = "SVG")]
    chart: Option<PathBuf>,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Print what is wrong with each failing world.
    #[arg(long)]
    verbose: bool,
    /// Print a JSON object for each kind.
    #[arg(long)]
    json: bool,
}

/// What is asked of a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Oracle {
    /// Nothing is wrong: nobody is accused, and all values hold the truth.
    Sound,
    /// One sensor lies.
    One,
    /// Two lie, one after the other.
    Apart,
    /// Two lie at once.
    AtOnce,
    /// Two of one variable lie at once by the same amount.
    Colluding,
    /// The system, written down otherwise, is judged in the same way.
    Alike,
    /// Signals are faulty as often as the printed probabilities say.
    Odds,
    /// A need errs no more than the median of its sensors while one of these lies.
    Voter,
}

fn seeds(text: &str) -> Result<(u64, u64), String> {
    let parsed = text.split_once("..").and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
    parsed
        .filter(|(from, to)| from < to)
        .ok_or_else(|| format!("`{text}` is no range of seeds, such as 0..100"))
}

/// Watches all worlds.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if arguments.list {
        let mut out = stdout().lock();
        KINDS.iter().try_for_each(|it| writeln!(out, "{:<14} {}", it.name, it.about))?;
        return Ok(Outcome::Done);
    }
    let mut all = Tally::default();
    for kinds in asked(arguments)? {
        let tally = tally(arguments, &kinds)?;
        let names = kinds.iter().map(|it| it.name).collect::<Vec<_>>().join("+");
        let name = arguments.mixed.map_or(names, |count| format!("{count} of all kinds"));
        writeln!(stdout().lock(), "{}", tally.line(&name, arguments.json))?;
        all.join(tally);
    }
    match arguments.oracle {
        Oracle::Odds => {
            writeln!(stdout().lock(), "{}", all.odds(arguments.json))?;
            if let Some(path) = &arguments.chart {
                let chart = odds::chart(&all.tenths).svg();
                fs::write(path, chart).with_context(|| format!("cannot write {}", path.display()))?;
            }
        }
        Oracle::Voter => writeln!(stdout().lock(), "{}", all.voters.lines(arguments.json))?,
        _ => {}
    }
    Ok(if all.is_right() { Outcome::Done } else { Outcome::No })
}

/// The sets of kinds that are asked for; an empty one stands for random kinds.
fn asked(arguments: &Arguments) -> anyhow::Result<Vec<Vec<&'static Kind>>> {
    if arguments.mixed.is_some() {
        return Ok(vec![Vec::new()]);
    }
    if arguments.kinds.is_empty() {
        return Ok(KINDS.iter().map(|it| vec![it]).collect());
    }
    let named = |name: &str| kinds::kind(name).with_context(|| format!("`{name}` is no kind of worlds"));
    arguments.kinds.iter().map(|names| names.split('+').map(named).collect()).collect()
}

/// The kinds of one world.
fn of_seed(arguments: &Arguments, kinds: &[&'static Kind], seed: u64) -> Vec<&'static Kind> {
    let Some(count) = arguments.mixed else { return kinds.to_vec() };
    let mut chance = Chance::new(seed);
    (0..count).map(|_| &KINDS[chance.below(KINDS.len())]).collect()
}

fn tally(arguments: &Arguments, kinds: &[&'static Kind]) -> anyhow::Result<Tally> {
    let (first, end) = arguments.seeds;
    let next = AtomicU64::new(first);
    let work = || {
        let mut tally = Tally::default();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= end {
                return Ok::<Tally, anyhow::Error>(tally);
            }
            let kinds = of_seed(arguments, kinds, seed);
            let watched = watched(arguments.oracle, &kinds, seed, &mut tally);
            if let Some(watched) = watched.with_context(|| format!("seed {seed} of {}", names(&kinds)))? {
                tally.add(&watched);
                show(arguments, &kinds, seed, &watched)?;
            }
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..arguments.threads.max(1)).map(|_| scope.spawn(work)).collect();
        let mut all = Tally::default();
        for worker in workers {
            match worker.join() {
                Ok(tally) => all.join(tally?),
                Err(_) => bail!("a world broke off; its reason stands above"),
            }
        }
        Ok(all)
    })
}

/// Asks one world; `None` where it has no answer.
fn watched(oracle: Oracle, kinds: &[&Kind], seed: u64, tally: &mut Tally) -> anyhow::Result<Option<Watched>> {
    match oracle {
        Oracle::Sound => sound::watch(kinds, seed).map(Some),
        Oracle::One => faulty::watch(kinds, seed, Liars::One),
        Oracle::Apart => faulty::watch(kinds, seed, Liars::Apart),
        Oracle::AtOnce => faulty::watch(kinds, seed, Liars::AtOnce),
        Oracle::Colluding => faulty::watch(kinds, seed, Liars::Colluding),
        Oracle::Alike => alike::watch(kinds, seed),
        Oracle::Odds => {
            tally.worlds += 1;
            odds::watch(kinds, seed, &mut tally.tenths).map(|()| None)
        }
        Oracle::Voter => voter::watch(kinds, seed, &mut tally.voters),
    }
}

fn names(kinds: &[&Kind]) -> String {
    kinds.iter().map(|it| it.name).collect::<Vec<_>>().join("+")
}

/// Prints and writes a failing world.
fn show(arguments: &Arguments, kinds: &[&Kind], seed: u64, watched: &Watched) -> anyhow::Result<()> {
    let lines = report::lines(watched);
    if lines.is_empty() {
        return Ok(());
    }
    let name = names(kinds);
    if arguments.verbose {
        let mut out = stdout().lock();
        lines.iter().try_for_each(|it| writeln!(out, "    {name} {seed}: {it}"))?;
    }
    match &arguments.write {
        Some(folder) => write::write(&watched.world, &watched.readings, folder, &format!("{name}-{seed}")),
        None => Ok(()),
    }
}
