//! Builds, lints and documents the workspace, and runs the examples in its documentation.

use super::GIVING_WAY;
use crate::workspace::TESTED;
use crate::{command, compiler};
use anyhow::Result;
use serde_json::Value;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// What cargo says that it has built.
#[derive(Debug, PartialEq)]
pub(super) enum Built {
    Test(Program),
    /// A program that other tests run, by its name.
    Command(String),
}

/// A built test program.
#[derive(Debug, PartialEq)]
pub(super) struct Program {
    /// The name of its target: `live`, `shsa_core`.
    pub(super) name: String,
    pub(super) executable: PathBuf,
    /// The folder of its crate, in which cargo runs it.
    pub(super) folder: PathBuf,
}

/// Builds, lints and documents all but the benches, and passes on each program once it is built. Ends after
/// the first unit at which `is_cancelled`.
///
/// # Errors
/// When something does not build, or clippy or the documentation has a warning; when it was ended.
pub(super) fn all(is_cancelled: impl Fn() -> bool, mut pass: impl FnMut(Built)) -> Result<()> {
    let arguments = ["--no-run", "--message-format", "json-render-diagnostics"];
    let mut hear = |message: &str| {
        if let Some(built) = built(message) {
            pass(built);
        }
        if is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    cargo_test(&arguments, |line| command::listen(line, &mut hear))
}

/// The program in a message of cargo; `None` for other messages.
fn built(message: &str) -> Option<Built> {
    let message: Value = serde_json::from_str(message).ok()?;
    let is_test = message["profile"]["test"].as_bool()?;
    let name = message["target"]["name"].as_str()?;
    let executable = message["executable"].as_str()?;
    if !is_test {
        return (message["target"]["kind"][0] == "bin").then(|| Built::Command(name.to_owned()));
    }
    Some(Built::Test(Program {
        name: name.to_owned(),
        executable: executable.into(),
        folder: Path::new(message["manifest_path"].as_str()?).parent()?.to_owned(),
    }))
}

/// Builds and lints the benches, which nothing runs.
///
/// # Errors
/// When one does not build, or clippy has a warning.
pub(super) fn benches() -> Result<()> {
    cargo_test(&["--benches", "--no-run"], command::run)
}

/// Runs the examples in the documentation of all crates; passes on each line that they print.
///
/// # Errors
/// When an example fails.
pub(super) fn examples(show: impl FnMut(&str)) -> Result<()> {
    cargo_test(&["--no-fail-fast", "--doc"], |line| command::relay(line, show))
}

/// Runs `cargo test` for the workspace, with more arguments.
fn cargo_test(arguments: &[&str], run: impl FnOnce(&[&str]) -> Result<()>) -> Result<()> {
    let compiler = compiler::setting()?;
    // Nobody steps through these programs with a debugger. It takes a tenth of the time to compile them.
    let settings = ["--config", &compiler, "--config", "profile.test.debug=false"];
    let line = ["cargo", "test", "--workspace", "--locked", "--features", TESTED];
    run(&[&GIVING_WAY[..], &line, arguments, &settings].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn test_programs_are_among_the_messages_of_cargo() {
        let message = |name: &str, kind: &str, test: bool| {
            let target = format!(r#"{{"name": "{name}", "kind": ["{kind}"]}}"#);
            format!(
                r#"{{"reason": "compiler-artifact", "manifest_path": "/w/crates/a/Cargo.toml", "target": {target},
                    "profile": {{"test": {test}}}, "executable": "/w/target/live-1"}}"#
            )
        };
        let live = Program {
            name: "live".into(),
            executable: "/w/target/live-1".into(),
            folder: "/w/crates/a".into(),
        };
        assert_eq!(built(&message("live", "test", true)), Some(Built::Test(live)));
        assert_eq!(built(&message("shsa", "bin", false)), Some(Built::Command("shsa".into())));
        assert_eq!(built(&message("own_bus", "example", false)), None);
        assert_eq!(built(r#"{"reason": "build-finished", "success": true}"#), None);
        assert_eq!(built("a line of something else"), None);
    }
}
