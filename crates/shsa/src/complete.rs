//! `shsa completions`: the completions of our arguments for a shell.

use crate::groups;
use crate::outcome::Outcome;
use clap_complete::Shell;
use std::io::{Write, stdout};

/// Arguments of `shsa completions`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa completions bash > ~/.local/share/bash-completion/completions/shsa")]
pub(crate) struct Arguments {
    /// The shell to print completions for.
    shell: Shell,
}

/// Prints the completions.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut command = groups::command();
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "shsa", &mut script);
    stdout().write_all(&script)?;
    Ok(Outcome::Done)
}
