//! The documentation of the crates, and its examples.

use super::GIVING_WAY;
use crate::command;
use anyhow::Result;

/// Builds the documentation of all crates and checks its links, with results of clippy, which has run before.
pub(super) fn build() -> Result<()> {
    let strict = "build.rustdocflags=['-D', 'warnings']";
    let cargo = ["cargo", "doc", "--workspace", "--no-deps", "--locked", "--config", strict];
    command::run(&[&GIVING_WAY[..], &cargo].concat())
}

/// Runs the examples in the documentation of all crates; passes on each line that they print.
pub(super) fn test(show: impl FnMut(&str)) -> Result<()> {
    let cargo = ["cargo", "test", "--workspace", "--locked", "--no-fail-fast", "--doc"];
    command::relay(&[&GIVING_WAY[..], &cargo].concat(), show)
}
