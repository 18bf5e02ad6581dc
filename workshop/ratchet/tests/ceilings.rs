//! Instructions for each observation may decrease, but not increase: `workshop/ratchet.toml` holds the ceilings.
//!
//! Valgrind counts instructions, so neither other work on the machine nor its clock matters. Counts depend on the compiler: those
//! of another toolchain are not compared. `cargo test` compares what tests are built with, which is built anyway, and
//! `cargo test --release` what is released. With `SHSA_RATCHET=write`, the ceilings of that profile are written anew.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::env;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;

/// The file of the ceilings.
const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../ratchet.toml");
/// The program whose instructions are counted.
const PROGRAM: &str = env!("CARGO_BIN_EXE_instructions");
/// What the program is built with.
const PROFILE: &str = if cfg!(debug_assertions) { "test" } else { "release" };
/// The variable of the environment with which the ceilings are written.
const WRITE: &str = "SHSA_RATCHET";
/// The largest permitted multiple of a ceiling, because the machine's own functions differ a little.
const MOST: f64 = 1.05;
/// Below this share of its ceiling, a count suggests a lower ceiling.
const WORTH_LOWERING: f64 = 0.95;

/// Systems whose observations are counted.
const SYSTEMS: [&str; 5] = ["car", "climber", "generic", "plant", "rover"];
/// Searches that are counted without contracts and under contract: a model, and how many substitutions are wanted.
const SEARCHES: [&str; 6] =
    ["drivetrain 1", "tree-170 1", "tree-170 10", "tree-10922 32", "shared-1000 1", "shared-10000 1"];
/// The largest permitted multiple of a search's instructions where all that it finds is admissible under contract.
const MOST_UNDER_CONTRACT: f64 = 1.2;
/// How many instructions more a search may take, whatever its size: those that find whether there are contracts. Alone, in a model
/// without contracts.
const MOST_AT_ALL: f64 = 64.0;
/// The same as a share of the search: where the allocator finds its memory differs between machines by some hundred instructions.
const SHARE_AT_ALL: f64 = 0.001;
/// The same under contract, beside the share: how the compiler lays out the rest of the core moves small searches by some ten.
const MOST_BESIDE: f64 = 80.0;

/// The content of the file.
#[derive(Debug, Deserialize)]
struct Ratchet {
    /// The compiler of the counts, as in `rustc --version`, and its target.
    toolchain: String,
    /// Instructions for an observation, by profile and system.
    instructions: BTreeMap<String, BTreeMap<String, f64>>,
}

impl Ratchet {
    fn read() -> Self {
        toml::from_str(&fs::read_to_string(FILE).unwrap()).unwrap()
    }

    fn write(&self) {
        let mut text = format!(
            "# Most instructions for an observation, by what the engine is built with, counted by valgrind. Compared by\n\
             # `cargo test -p shsa-ratchet`, and with `--release`; SHSA_RATCHET=write before it writes this file anew. The systems are in\n\
             # crates/shsa-core/tests/models.\n\
             toolchain = \"{}\"\n",
            self.toolchain
        );
        for (profile, ceilings) in &self.instructions {
            writeln!(text, "\n[instructions.{profile}]").unwrap();
            for (system, ceiling) in ceilings {
                writeln!(text, "{system} = {ceiling:.1}").unwrap();
            }
        }
        fs::write(FILE, text).unwrap();
    }
}

#[test]
fn an_observation_takes_no_more_instructions_than_its_ceiling() {
    let mut ratchet = Ratchet::read();
    let counts: BTreeMap<String, f64> =
        SYSTEMS.into_iter().map(|system| (system.to_owned(), count(system))).collect();
    let toolchain = toolchain();
    if env::var(WRITE).is_ok_and(|value| value == "write") {
        // Counts of one compiler are no ceilings for another.
        if ratchet.toolchain != toolchain {
            ratchet.instructions.values_mut().for_each(BTreeMap::clear);
        }
        ratchet.instructions.insert(PROFILE.to_owned(), counts);
        return Ratchet { toolchain, ..ratchet }.write();
    }
    if toolchain != ratchet.toolchain {
        println!(
            "SKIPPED: the ceilings are of `{}`, this is `{toolchain}`: instructions are not compared",
            ratchet.toolchain
        );
        return;
    }
    let compared: Vec<(String, bool)> = ratchet.instructions[PROFILE]
        .iter()
        .map(|(system, ceiling)| compared(system, counts[system], *ceiling))
        .collect();
    none_exceeded(&compared);
}

#[test]
fn contracts_cost_no_more_of_a_search_than_they_may() {
    let compared: Vec<(String, bool)> = SEARCHES
        .into_iter()
        .map(|search| {
            let count = |mode: &str| count(&format!("plan {search} {mode}"));
            of_search(search, count("bare"), count("without"), count("under"))
        })
        .collect();
    none_exceeded(&compared);
}

/// Shows the lines, none of which may be of a count that is exceeded.
#[track_caller]
fn none_exceeded(compared: &[(String, bool)]) {
    compared.iter().for_each(|(line, _)| println!("{line}"));
    let exceeded: Vec<&str> = compared.iter().filter(|it| it.1).map(|it| it.0.as_str()).collect();
    assert!(
        exceeded.is_empty(),
        "{}\nif that is what the change is worth: `{WRITE}=write cargo test -p shsa-ratchet`",
        exceeded.join("\n")
    );
}

/// The line about a search, and whether it costs too much.
fn of_search(search: &str, bare: f64, without: f64, under: f64) -> (String, bool) {
    let (more, share) = (without - bare, under / bare);
    let line = format!(
        "{search}: {bare:.0} instructions for a search, {more:+.0} in a model without contracts, {:+.1} % under contract",
        (share - 1.0) * 100.0
    );
    match more > MOST_AT_ALL + bare * SHARE_AT_ALL || under > bare * MOST_UNDER_CONTRACT + MOST_BESIDE {
        true => (format!("{line}: MORE THAN ALLOWED"), true),
        false => (line, false),
    }
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
            (format!("{line}; to lower the ceiling: `{WRITE}=write cargo test -p shsa-ratchet`"), false)
        }
        _ => (line, false),
    }
}

fn toolchain() -> String {
    let reported = output(Command::new("rustc").args(["--version", "--verbose"]));
    let host = reported.lines().find_map(|line| line.strip_prefix("host: ")).unwrap_or("unknown");
    format!("{}, {host}", reported.lines().next().unwrap_or("unknown"))
}

/// Instructions for an observation of a system, or for a search.
fn count(case: &str) -> f64 {
    // Only instructions within the functions that feed the engine, or search.
    let mut valgrind = Command::new("valgrind");
    valgrind.args([
        "--tool=callgrind",
        "--callgrind-out-file=/dev/null",
        "--toggle-collect=instructions::drive*",
        "--toggle-collect=instructions::planning::drive*",
        "--log-fd=1",
        PROGRAM,
        case,
    ]);
    let reported = output(&mut valgrind);
    each(&reported).unwrap_or_else(|| panic!("{valgrind:?} tells no counts:\n{reported}"))
}

/// What a command prints, which must succeed.
#[track_caller]
fn output(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Instructions for each, from the program's own line with their number and valgrind's `Collected : N`.
fn each(reported: &str) -> Option<f64> {
    let observations: f64 = reported.lines().find_map(|line| line.trim().parse().ok())?;
    let collected = reported.lines().find_map(|line| line.split_once("Collected :"))?.1;
    let instructions: f64 = collected.split_whitespace().next()?.parse().ok()?;
    (observations > 0.0 && instructions > 0.0).then_some(instructions / observations)
}

#[test]
fn the_file_holds_ceilings() {
    let ratchet = Ratchet::read();
    assert_eq!(ratchet.instructions.keys().collect::<Vec<_>>(), ["release", "test"]);
    for ceilings in ratchet.instructions.values() {
        assert_eq!(ceilings.keys().collect::<Vec<_>>(), SYSTEMS);
        assert!(ceilings.values().all(|ceiling| *ceiling > 10.0));
    }
}

#[test]
fn contracts_may_cost_a_fifth_of_a_search_and_nothing_where_there_are_none() {
    let is_exceeded = |without, under| of_search("tree 1", 10_000.0, without, under).1;
    assert!(!is_exceeded(10_070.0, 12_060.0));
    assert!(is_exceeded(10_080.0, 11_900.0) && is_exceeded(10_060.0, 12_100.0));
}

#[test]
fn more_is_refused_and_less_is_reported() {
    assert!(compared("car", 106.0, 100.0).1);
    assert!(!compared("car", 104.0, 100.0).1);
    let (line, is_exceeded) = compared("car", 90.0, 100.0);
    assert!(line.contains("to lower the ceiling") && !is_exceeded, "{line}");
}

#[test]
fn counts_are_read_from_valgrind() {
    let reported = "==7== Callgrind\n300\n==7== Events    : Ir\n==7== Collected : 90300\n";
    assert_eq!(each(reported), Some(301.0));
    assert_eq!(each("==7== Collected : 0\n300\n"), None);
}
