//! `shsa man`: a manual page for each command.

use crate::groups;
use crate::outcome::Outcome;
use anyhow::Context;
use clap::Command;
use std::fs;
use std::path::{Path, PathBuf};

/// Arguments of `shsa man`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa man ~/.local/share/man/man1")]
pub(crate) struct Arguments {
    /// The folder that shsa.1, shsa-check.1 and the others are written to; it is made where it is absent.
    folder: PathBuf,
}

/// Writes the pages.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let folder = &arguments.folder;
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let mut all = groups::command();
    all.build();
    write(&all, folder)?;
    Ok(Outcome::Done)
}

/// Writes the page of a command, and those of the commands below it.
fn write(command: &Command, folder: &Path) -> anyhow::Result<()> {
    let (name, page) = page(command)?;
    let path = folder.join(name);
    fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))?;
    command.get_subcommands().filter(|it| !it.is_hide_set()).try_for_each(|it| write(it, folder))
}

/// The file name and the text of a command's page.
fn page(command: &Command) -> anyhow::Result<(String, Vec<u8>)> {
    let name = match command.get_bin_name().unwrap_or_default() {
        "" | "shsa" => "shsa".to_owned(),
        words => words.replace(' ', "-"),
    };
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).title(name.clone()).render(&mut page)?;
    Ok((format!("{name}.1"), page))
}
