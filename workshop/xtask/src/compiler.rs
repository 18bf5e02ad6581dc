//! Called by cargo in the place of rustc: each unit of the workspace is compiled, then linted and, if it is a library, documented with
//! what it was compiled with.
//!
//! `cargo clippy` and `cargo doc` would have every dependency checked again, the second with features of its own for some: a tenth of
//! the processor time of all of CI.

use anyhow::{Context, Result};
use std::env;
use std::path::Path;
use std::process::Command;

/// Options of rustc whose value is the next argument.
const WITH_VALUE: [&str; 9] = [
    "-C",
    "-L",
    "--cap-lints",
    "--cfg",
    "--check-cfg",
    "--crate-name",
    "--crate-type",
    "--extern",
    "--out-dir",
];
/// Those of them that rustdoc needs, besides the kind of the unit.
const OF_DOCUMENTATION: [&str; 6] = ["-L", "--cap-lints", "--cfg", "--check-cfg", "--crate-name", "--extern"];
/// Crates whose tests are optimised more than a level less than their library: those of the largest crate compile three times as quickly
/// without any, and take 30 s more to run; those of the laboratory run for 3 s.
const LEVELS_LESS: [(&str, u8); 2] = [("shsa-core", 2), ("shsa-lab", 2)];
/// The crate whose program has its instructions counted.
const COUNTED: &str = "shsa-ratchet";
/// How rustc is to optimise.
const LEVEL: &str = "opt-level=";
/// Cargo takes an announced artifact for the one that it waits for: only the compiler announces its own.
const MESSAGES: &str = "--json=diagnostic-rendered-ansi";

/// An argument of rustc, with the one after it where this is its value.
type Argument<'a> = &'a [String];

/// The setting of cargo for which this program is called in the place of rustc.
///
/// # Errors
/// When the own program cannot be found.
pub(crate) fn setting() -> Result<String> {
    let own = env::current_exe().context("finding the own program")?;
    Ok(format!("build.rustc-workspace-wrapper={:?}", own.display().to_string()))
}

/// Whether these arguments are the path of rustc and its arguments.
pub(crate) fn is_called(arguments: &[String]) -> bool {
    arguments.first().is_some_and(|first| Path::new(first).file_stem().is_some_and(|name| name == "rustc"))
}

/// Compiles a unit, lints it and documents it; returns whether all succeeded. A unit with a warning fails, so that cargo builds it
/// again the next time.
///
/// # Errors
/// When a program cannot be started.
pub(crate) fn run(arguments: &[String]) -> Result<bool> {
    let (rustc, arguments) = arguments.split_first().context("the path of rustc is missing")?;
    let parsed = parsed(arguments);
    let lines = match is_last(&parsed) {
        // Nothing waits for a test or a program, so clippy compiles it, too.
        true => vec![("clippy-driver", compiled(arguments, levels_less(&parsed)))],
        // Compiled first, as units that use this one wait for its metadata only.
        false => [
            ("rustc", Some(arguments.to_vec())),
            ("clippy-driver", linted(&parsed)),
            ("rustdoc", documented(&parsed)),
        ]
        .into_iter()
        .filter_map(|(program, line)| Some((program, line?)))
        .collect(),
    };
    for (program, line) in lines {
        let program = Path::new(rustc).with_file_name(program);
        let status = Command::new(&program).args(line).status();
        if !status.with_context(|| format!("starting {}", program.display()))?.success() {
            return Ok(false);
        }
    }
    Ok(true)
}

fn parsed(mut arguments: &[String]) -> Vec<Argument<'_>> {
    let mut parsed = Vec::new();
    while let Some(first) = arguments.first() {
        let count = if WITH_VALUE.contains(&first.as_str()) { 2 } else { 1 };
        let (argument, rest) = arguments.split_at(count.min(arguments.len()));
        parsed.push(argument);
        arguments = rest;
    }
    parsed
}

/// The values of an option.
fn values<'a>(parsed: &[Argument<'a>], option: &str) -> impl Iterator<Item = &'a str> {
    parsed.iter().filter(move |it| it[0] == option).filter_map(|it| it.get(1)).map(String::as_str)
}

/// The first value of an option; `None` where it is absent.
fn value<'a>(parsed: &[Argument<'a>], option: &str) -> Option<&'a str> {
    values(parsed, option).next()
}

/// Whether this is a unit of tests or benches; those with a main function of their own only have the configuration of tests.
fn is_test(parsed: &[Argument<'_>]) -> bool {
    parsed.iter().any(|it| it[0] == "--test") || values(parsed, "--cfg").any(|it| it == "test")
}

/// Whether this is a unit that no other one uses. A program whose instructions are counted is compiled by rustc: clippy optimises
/// otherwise.
fn is_last(parsed: &[Argument<'_>]) -> bool {
    let is_program = value(parsed, "--crate-type") == Some("bin") && value(parsed, "--out-dir").is_some();
    is_test(parsed) || (is_program && !is_of(COUNTED))
}

/// Whether cargo names this crate to the compiler.
fn is_of(krate: &str) -> bool {
    env::var("CARGO_PKG_NAME").is_ok_and(|name| name == krate)
}

/// How many levels less than its crate a unit is optimised. Most tests run for less time than a further level takes to compile, and
/// nothing runs the benches.
fn levels_less(parsed: &[Argument<'_>]) -> u8 {
    if parsed.iter().any(|it| it[0].starts_with("benches/") || it[0].contains("/benches/")) {
        return u8::MAX;
    }
    match is_test(parsed) {
        true => LEVELS_LESS.into_iter().find(|it| is_of(it.0)).map_or(1, |it| it.1),
        false => 0,
    }
}

/// The arguments with which clippy compiles a unit, optimised less than it would be.
fn compiled(arguments: &[String], levels_less: u8) -> Vec<String> {
    let less = |it: &String| match it.strip_prefix(LEVEL).and_then(|level| level.parse::<u8>().ok()) {
        Some(level) => format!("{LEVEL}{}", level.saturating_sub(levels_less)),
        _ => it.clone(),
    };
    arguments.iter().map(less).chain(["-D", "warnings"].map(str::to_owned)).collect()
}

/// Whether a unit is a library that is compiled once more with its tests, as all are that other crates use.
fn is_linted_with_its_tests(parsed: &[Argument<'_>]) -> bool {
    value(parsed, "--crate-type") == Some("lib")
}

/// The arguments with which clippy checks a unit that is no test; `None` for what is linted with its tests, and where cargo only asks what the compiler can do.
fn linted(parsed: &[Argument<'_>]) -> Option<Vec<String>> {
    if is_linted_with_its_tests(parsed) {
        return None;
    }
    let kept = parsed.iter().filter(|it| {
        let is_incremental = it.get(1).is_some_and(|value| value.starts_with("incremental="));
        !(it[0] == "--out-dir"
            || it[0].starts_with("--emit=")
            || it[0].starts_with("--json=")
            || is_incremental)
    });
    finished(parsed, kept, &["--emit=metadata"])
}

/// The arguments with which rustdoc documents a library; `None` for tests, for programs, whose documentation nobody but their authors
/// reads, and where cargo only asks what the compiler can do.
fn documented(parsed: &[Argument<'_>]) -> Option<Vec<String>> {
    if is_test(parsed) || matches!(value(parsed, "--crate-type"), None | Some("bin")) {
        return None;
    }
    let kept = parsed.iter().filter(|it| {
        let is_of_source = it[0].ends_with(".rs") || it[0].starts_with("--edition=");
        is_of_source || it[0].starts_with("--error-format=") || OF_DOCUMENTATION.contains(&it[0].as_str())
    });
    // A library of any kind has the same documentation.
    finished(parsed, kept, &["--crate-type", "lib"])
}

/// The kept arguments and some more, with warnings as errors and what comes out apart from the results of the compiler.
fn finished<'a>(
    parsed: &[Argument<'_>],
    kept: impl Iterator<Item = &'a Argument<'a>>,
    more: &[&str],
) -> Option<Vec<String>> {
    let suffix = parsed.iter().find_map(|it| it.get(1)?.strip_prefix("extra-filename="))?;
    let unit = format!("{}{suffix}", value(parsed, "--crate-name")?);
    let folder = Path::new(value(parsed, "--out-dir")?).with_file_name("checked").join(unit);
    let folder = folder.display().to_string();
    let last = [MESSAGES, "-D", "warnings", "--out-dir", &folder];
    Some(
        kept.copied().flatten().cloned().chain(more.iter().chain(&last).map(|it| (*it).to_owned())).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(line: &str) -> Vec<String> {
        line.split(' ').map(str::to_owned).collect()
    }

    const LIBRARY: &str = "--crate-name a --edition=2024 src/lib.rs --error-format=json --json=diagnostic-rendered-ansi,artifacts \
                           --crate-type cdylib --crate-type rlib --emit=dep-info,metadata,link -C opt-level=1 --warn=clippy::all \
                           --check-cfg cfg(test) -C extra-filename=-12 --out-dir /t/debug/deps -C incremental=/t/i \
                           -L dependency=/t/debug/deps --extern b=/t/debug/deps/libb-3.rmeta";

    #[test]
    fn a_library_is_linted_and_documented() {
        let line = arguments(LIBRARY);
        let parsed = parsed(&line);
        assert_eq!(
            linted(&parsed).unwrap().join(" "),
            "--crate-name a --edition=2024 src/lib.rs --error-format=json --crate-type cdylib --crate-type rlib -C opt-level=1 \
             --warn=clippy::all --check-cfg cfg(test) -C extra-filename=-12 -L dependency=/t/debug/deps \
             --extern b=/t/debug/deps/libb-3.rmeta --emit=metadata --json=diagnostic-rendered-ansi -D warnings \
             --out-dir /t/debug/checked/a-12"
        );
        assert_eq!(
            documented(&parsed).unwrap().join(" "),
            "--crate-name a --edition=2024 src/lib.rs --error-format=json --check-cfg cfg(test) -L dependency=/t/debug/deps \
             --extern b=/t/debug/deps/libb-3.rmeta --crate-type lib --json=diagnostic-rendered-ansi -D warnings \
             --out-dir /t/debug/checked/a-12"
        );
    }

    #[test]
    fn a_program_and_a_test_are_linted_and_not_documented() {
        let program =
            arguments(&LIBRARY.replace("--crate-type cdylib --crate-type rlib", "--crate-type bin"));
        assert!(linted(&parsed(&program)).is_some());
        assert_eq!(documented(&parsed(&program)), None);
        let test = arguments(&LIBRARY.replace("--crate-type cdylib --crate-type rlib", "--test"));
        assert_eq!(documented(&parsed(&test)), None);
        assert!(linted(&parsed(&test)).unwrap().contains(&"--test".to_owned()));
    }

    #[test]
    fn benches_are_not_optimised_and_programs_as_they_are_to_be() {
        let of = |line: &str| levels_less(&parsed(&arguments(line)));
        assert_eq!((of("benches/a.rs --crate-type bin"), of("src/main.rs --crate-type bin")), (u8::MAX, 0));
        assert!(is_last(&parsed(&arguments("src/main.rs --crate-type bin --out-dir /t"))));
        assert!(is_last(&parsed(&arguments(
            "benches/a.rs --emit=dep-info,link --cfg feature=\"a\" --cfg test"
        ))));
        assert!(!is_last(&parsed(&arguments("src/lib.rs --crate-type lib"))));
    }

    #[test]
    fn tests_are_optimised_less() {
        let line = compiled(&arguments("--test -C opt-level=2 -C lto=off"), 1);
        assert_eq!(line.join(" "), "--test -C opt-level=1 -C lto=off -D warnings");
        for unchanged in ["--test -C opt-level=s", "--test -C opt-level=0"] {
            let line = compiled(&arguments(unchanged), 2);
            assert_eq!(line.join(" "), format!("{unchanged} -D warnings"));
        }
    }

    #[test]
    fn questions_to_the_compiler_are_passed_on_only() {
        for question in ["-vV", "- --crate-name ___ --print=file-names --crate-type bin"] {
            let line = arguments(question);
            assert_eq!((linted(&parsed(&line)), documented(&parsed(&line))), (None, None));
            assert!(!is_last(&parsed(&line)));
        }
        assert!(is_called(&arguments("/opt/bin/rustc -vV")));
        assert!(!is_called(&arguments("test")) && !is_called(&[]));
    }
}
