//! The project's tasks: `cargo xtask test` is all of CI, and each step can be run alone.

mod command;
mod compiler;
mod needs;
mod workspace;
mod licences;
mod tidy;
mod testing;
mod results;
mod sbom;
mod package;
mod screenshots;
mod book;
mod wasm;

use anyhow::{Context, Result, bail};
use std::env;
use std::process::ExitCode;
use std::time::Instant;

/// Leaves out the packages for JavaScript.
const WITHOUT_PACKAGES: &str = "--without-packages";

const USAGE: &str = "\
usage: cargo xtask COMMAND

  test       installs what the tests need, then runs every check and all tests: all of CI; `--without-packages` leaves out what is built
             for JavaScript, which takes four minutes of two cores
  ci         the same
  tidy       only the rules of the house: layers, file heads, lengths, words, crates, budgets
  licences   only the licences of what is shipped, against deny.toml
  results    replays the recordings with faults injected, and writes workshop/measured/results.md
  chaos      breaks the world around a live run, and writes that section of workshop/measured/results.md (as root: all of it; random
             sequences of faults for a handful of seeds, or those that SHSA_SEEDS=1..100 names)
  screenshots  takes pictures of the live page at three widths, light and dark, in target/screenshots
  book       makes a site of the documents, with search, in target/book/site, and checks its links (installs mdBook in target/book-tools)
  wasm       builds the npm package @shsa/engine and the studio in target/wasm; `--test` builds them quickly, and tests
             them; `--servers` installs Signal K's and Node-RED, and tests the plugins in them, too (not in CI: 390 MB)
  package    builds target/package/shsa.deb, and image.tar for deploy/Containerfile; `--program FILE` packs one that is built already, `--out
             FOLDER` writes there, `--twice` builds in two folders and compares (not in CI: two builds of 10 minutes),
             `--static` builds the program alone, without libraries: target/package/shsa (not in CI, either)";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let ended = match compiler::is_called(&arguments) {
        true => compiler::run(&arguments),
        false => run(arguments.first().map(String::as_str)).map(|()| true),
    };
    match ended {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: Option<&str>) -> Result<()> {
    env::set_current_dir(workspace::root()).context("entering the workspace's folder")?;
    match command {
        Some("test" | "ci") => test(),
        Some("tidy") => tidy::check(),
        Some("licences") => licences::check(),
        Some("results") => results::write(),
        Some("chaos") => results::chaos::write(),
        Some("screenshots") => screenshots::take(),
        Some("book") => book::write(),
        Some("wasm") if env::args().nth(2).as_deref() == Some("--test") => {
            wasm::test(|line| println!("{line}"))
        }
        Some("wasm") if env::args().nth(2).as_deref() == Some("--servers") => {
            wasm::test_with_servers(|line| println!("{line}"))
        }
        Some("wasm") => wasm::build(),
        Some("package") => package::write(env::args().skip(2)),
        Some(other) => bail!("no command `{other}`\n{USAGE}"),
        None => bail!("no command\n{USAGE}"),
    }
}

/// Runs all of CI: the quick checks first, the tests last, so that the output ends with their result.
fn test() -> Result<()> {
    let start = Instant::now();
    step("toolchain", needs::provide_toolchain)?;
    step("format", || command::run(&["cargo", "fmt", "--all", "--check"]))?;
    step("tidy", tidy::check)?;
    step("licences", licences::check)?;
    println!("quick checks passed in {} s", start.elapsed().as_secs());
    let with_packages = !env::args().any(|it| it == WITHOUT_PACKAGES);
    step("tests", || testing::run(with_packages))
}

fn step(name: &'static str, check: impl FnOnce() -> Result<()>) -> Result<()> {
    println!("== {name}");
    check().context(name)
}
