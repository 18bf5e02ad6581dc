//! Instructions for each observation may decrease, but not increase: `ratchet.toml` holds the ceilings.
//!
//! Valgrind counts instructions, so neither other work on the machine nor its clock matters. Counts depend on the compiler: those
//! of another toolchain are not compared.

use crate::command;
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::env;
use std::fmt::Write as _;
use std::fs;

/// The file of the ceilings.
const FILE: &str = "ratchet.toml";
/// The program whose instructions are counted.
const PROGRAM: &str = "target/release/instructions";
/// The largest permitted multiple of a ceiling, because the machine's own functions differ a little.
const MOST: f64 = 1.05;
/// Below this share of its ceiling, a count suggests a lower ceiling.
const WORTH_LOWERING: f64 = 0.95;

/// The content of the file.
#[derive(Debug, Deserialize, PartialEq)]
struct Ratchet {
    /// The compiler of the counts, as in `rustc --version`, and its target.
    toolchain: String,
    /// Instructions for an observation, by system.
    instructions: BTreeMap<String, f64>,
}

/// Searches that are counted without contracts and under contract: a model, and how many substitutions are wanted.
const SEARCHES: [&str; 7] = [
    "drivetrain 1",
    "tree-170 1",
    "tree-170 10",
    "tree-10922 1",
    "tree-10922 32",
    "shared-1000 1",
    "shared-10000 1",
];
/// The largest permitted multiple of a search's instructions where all that it finds is admissible under contract.
const MOST_UNDER_CONTRACT: f64 = 1.2;
/// How many instructions more a search may take, whatever its size: those that find whether there are contracts. Alone, in a model
/// without contracts.
const MOST_AT_ALL: f64 = 64.0;

/// Compares the counts with the ceilings.
///
/// # Errors
/// When a ceiling is exceeded, or cannot be counted.
pub(crate) fn check() -> Result<()> {
    let text = fs::read_to_string(FILE).with_context(|| format!("reading {FILE}"))?;
    let ratchet: Ratchet = toml::from_str(&text).with_context(|| format!("reading {FILE}"))?;
    let toolchain = toolchain()?;
    if toolchain != ratchet.toolchain {
        println!(
            "SKIPPED: the ceilings in {FILE} are of `{}`, this is `{toolchain}`: instructions are not compared; \
             `cargo xtask ratchet write` writes those of this one",
            ratchet.toolchain
        );
        return Ok(());
    }
    let counts = count(ratchet.instructions.keys().map(String::as_str))?;
    let mut exceeded = Vec::new();
    for (system, ceiling) in &ratchet.instructions {
        let count = counts.get(system.as_str()).copied().unwrap_or(f64::INFINITY);
        let (line, is_exceeded) = compared(system, count, *ceiling);
        println!("{line}");
        if is_exceeded {
            exceeded.push(line);
        }
    }
    exceeded.extend(under_contract()?);
    if !exceeded.is_empty() {
        bail!("{}\nif that is what the change is worth: `cargo xtask ratchet write`", exceeded.join("\n"));
    }
    Ok(())
}

/// Compares as [`check`] does, in a process of its own with the lowest priority, whose lines are shown together at its end.
///
/// # Errors
/// When a ceiling is exceeded, or cannot be counted.
pub(crate) fn check_apart() -> Result<()> {
    let own = env::current_exe().context("finding the own program")?;
    print!("{}", command::output(&["nice", "-n", "19", &own.display().to_string(), "ratchet"])?);
    Ok(())
}

/// Compares searches without contracts and under contract; returns the lines about those that cost too much.
fn under_contract() -> Result<Vec<String>> {
    let mut exceeded = Vec::new();
    for search in SEARCHES {
        let count = |mode: &str| count_one(&format!("plan {search} {mode}"));
        let (line, is_exceeded) = of_search(search, count("bare")?, count("without")?, count("under")?);
        println!("{line}");
        if is_exceeded {
            exceeded.push(line);
        }
    }
    Ok(exceeded)
}

/// The line about a search, and whether it costs too much.
fn of_search(search: &str, bare: f64, without: f64, under: f64) -> (String, bool) {
    let (more, share) = (without - bare, under / bare);
    let line = format!(
        "{search}: {bare:.0} instructions for a search, {more:+.0} in a model without contracts, {:+.1} % under contract",
        (share - 1.0) * 100.0
    );
    match more > MOST_AT_ALL || under > bare * MOST_UNDER_CONTRACT + MOST_AT_ALL {
        true => (format!("{line}: MORE THAN ALLOWED"), true),
        false => (line, false),
    }
}

/// Writes the present counts as ceilings.
///
/// # Errors
/// When they cannot be counted or written.
pub(crate) fn write() -> Result<()> {
    let text = fs::read_to_string(FILE).with_context(|| format!("reading {FILE}"))?;
    let ratchet: Ratchet = toml::from_str(&text).with_context(|| format!("reading {FILE}"))?;
    let counts = count(ratchet.instructions.keys().map(String::as_str))?;
    let mut text = format!(
        "# Most instructions for an observation, counted by valgrind; `cargo xtask ratchet` compares, `cargo xtask ratchet write`\n\
         # writes this file anew. The systems are in crates/shsa-core/tests/models.\n\
         toolchain = \"{}\"\n\n[instructions]\n",
        toolchain()?
    );
    for (system, count) in counts {
        writeln!(text, "{system} = {count:.1}")?;
        println!("{system}: {count:.1}");
    }
    fs::write(FILE, text).with_context(|| format!("writing {FILE}"))
}

/// The line about a system, and whether its ceiling is exceeded.
fn compared(system: &str, count: f64, ceiling: f64) -> (String, bool) {
    let share = count / ceiling;
    let percent = (share - 1.0) * 100.0;
    let line = format!(
        "{system}: {count:.1} instructions for an observation, ceiling {ceiling:.1} ({percent:+.1} %)"
    );
    match share {
        _ if share > MOST => (format!("{line}: MORE THAN ALLOWED"), true),
        _ if share < WORTH_LOWERING => {
            (format!("{line}; to lower the ceiling: `cargo xtask ratchet write`"), false)
        }
        _ => (line, false),
    }
}

fn toolchain() -> Result<String> {
    let reported = command::output(&["rustc", "--version", "--verbose"])?;
    let host = reported.lines().find_map(|line| line.strip_prefix("host: ")).unwrap_or("unknown");
    Ok(format!("{}, {host}", reported.lines().next().unwrap_or("unknown")))
}

/// Instructions for an observation of each system.
fn count<'a>(systems: impl Iterator<Item = &'a str>) -> Result<BTreeMap<&'a str, f64>> {
    let build = ["cargo", "build", "--release", "--locked", "--package", "shsa-ratchet"];
    command::run(&build)?;
    systems.map(|system| Ok((system, count_one(system)?))).collect()
}

fn count_one(system: &str) -> Result<f64> {
    // Only instructions within the functions that feed the engine, or search.
    let line = [
        "valgrind",
        "--tool=callgrind",
        "--callgrind-out-file=/dev/null",
        "--toggle-collect=instructions::drive*",
        "--toggle-collect=instructions::planning::drive*",
        "--log-fd=1",
        PROGRAM,
        system,
    ];
    let reported = command::output(&line)?;
    per_observation(&reported).with_context(|| format!("`{}` tells no counts:\n{reported}", line.join(" ")))
}

/// Instructions for an observation, from the program's own line with the number of observations and valgrind's `Collected : N`.
fn per_observation(reported: &str) -> Option<f64> {
    let observations: f64 = reported.lines().find_map(|line| line.trim().parse().ok())?;
    let collected = reported.lines().find_map(|line| line.split_once("Collected :"))?.1;
    let instructions: f64 = collected.split_whitespace().next()?.parse().ok()?;
    (observations > 0.0 && instructions > 0.0).then_some(instructions / observations)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_holds_ceilings() {
        let text = fs::read_to_string(crate::workspace::root().join(FILE)).unwrap();
        let ratchet: Ratchet = toml::from_str(&text).unwrap();
        let systems: Vec<&str> = ratchet.instructions.keys().map(String::as_str).collect();
        assert_eq!(systems, ["car", "climber", "generic", "plant", "rover"]);
        assert!(ratchet.instructions.values().all(|ceiling| *ceiling > 10.0));
    }

    #[test]
    fn contracts_may_cost_a_fifth_of_a_search_and_nothing_where_there_are_none() {
        let is_exceeded = |without, under| of_search("tree 1", 10_000.0, without, under).1;
        assert!(!is_exceeded(10_060.0, 12_060.0));
        assert!(is_exceeded(10_070.0, 11_900.0) && is_exceeded(10_060.0, 12_100.0));
    }

    #[test]
    fn more_is_refused_and_less_is_reported() {
        assert!(compared("car", 106.0, 100.0).1);
        assert!(!compared("car", 104.0, 100.0).1);
        let (line, is_exceeded) = compared("car", 90.0, 100.0);
        assert!(line.contains("cargo xtask ratchet write") && !is_exceeded, "{line}");
    }

    #[test]
    fn counts_are_read_from_valgrind() {
        let reported = "==7== Callgrind\n300\n==7== Events    : Ir\n==7== Collected : 90300\n";
        assert_eq!(per_observation(reported), Some(301.0));
        assert_eq!(per_observation("==7== Collected : 0\n300\n"), None);
    }
}
