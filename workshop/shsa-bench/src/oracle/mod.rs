//! `shsa-bench oracle`: compares our answers with recorded ones, one by one.
//!
//! A file is JSON with its `format`; what the formats hold stands at the readers ([`search`], [`monitor`], [`assurance`],
//! [`fusion`], [`planted`]). Of recordings a folder is given ([`formats`]).

mod search;
mod monitor;
mod certificates;
mod assurance;
mod fusion;
mod planted;
mod formats;

pub(crate) use formats::{Recorded, recorded};

use crate::Outcome;
use anyhow::Context;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::fs;
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};

/// The number of differences that are shown; the rest is only counted.
const SHOWN: usize = 20;

/// The largest difference of two numbers.
const TOLERANCE: f64 = 1e-9;

/// Arguments of `shsa-bench oracle`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench oracle search search.json

Prints how many answers are equal, and the first differences. Exit status 1: there is one.")]
pub(crate) struct Arguments {
    /// What is compared.
    kind: Kind,
    /// Files of recorded answers; of recordings their folder.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Show all differences.
    #[arg(long)]
    all: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    /// All substitutions of a variable with their utilities (shsa-search-golden-1), one answer a root.
    Search,
    /// The published monitor (shsa-monitor-golden-1, shsa-monitor-unit-1), one answer a step.
    Monitor,
    /// State estimation and sensor fusion (shsa-fusion-oracle-1, shsa-fusion-sfpkg-1), one answer a step.
    Fusion,
    /// What certificates give under evidence, and why not more (shsa-assurance-golden-1), one answer a case and a step.
    Assurance,
    /// Relations that are learned from systems with planted ones (shsa-planted-1), one answer a relation, planted or wrong.
    Planted,
    /// Recordings of every format (`expected.json` in the folder and those below it), one answer a count and a field.
    Formats,
}

/// The result of a comparison.
#[derive(Debug, Default)]
struct Compared {
    total: usize,
    equal: usize,
    differences: Vec<String>,
}

impl Compared {
    /// Counts one answer; it is equal when there are no differences.
    fn answer(&mut self, differences: Vec<String>) {
        self.total += 1;
        self.equal += usize::from(differences.is_empty());
        self.differences.extend(differences);
    }
}

/// The head of every file.
#[derive(Deserialize)]
struct Head {
    format: String,
}

/// Compares; the answer is no when anything differs.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut compared = Compared::default();
    for path in &arguments.files {
        if arguments.kind == Kind::Formats {
            formats::compare(path, &mut compared)?;
            continue;
        }
        let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
        let format = read::<Head>(path, &text)?.format;
        match (arguments.kind, format.as_str()) {
            (Kind::Search, "shsa-search-golden-1") => search::compare(&read(path, &text)?, &mut compared)?,
            (Kind::Monitor, "shsa-monitor-golden-1") => {
                monitor::compare_experiments(&read(path, &text)?, &mut compared)?;
            }
            (Kind::Monitor, "shsa-monitor-unit-1") => {
                monitor::compare_units(&read(path, &text)?, &mut compared)?;
            }
            (Kind::Fusion, "shsa-fusion-oracle-1") => fusion::compare(&read(path, &text)?, &mut compared)?,
            (Kind::Fusion, "shsa-fusion-sfpkg-1") => {
                fusion::compare_package(&read(path, &text)?, &mut compared)?;
            }
            (Kind::Assurance, "shsa-assurance-golden-1") => {
                assurance::compare(&read(path, &text)?, &mut compared)?;
            }
            (Kind::Planted, "shsa-planted-1") => planted::compare(&read(path, &text)?, &mut compared)?,
            (kind, format) => {
                let kind = format!("{kind:?}").to_lowercase();
                anyhow::bail!("{}: `{format}` is no format of {kind}", path.display());
            }
        }
    }
    let mut output = stdout().lock();
    writeln!(output, "{} of {} equal", compared.equal, compared.total)?;
    let shown = if arguments.all { usize::MAX } else { SHOWN };
    for difference in compared.differences.iter().take(shown) {
        writeln!(output, "{difference}")?;
    }
    if compared.differences.len() > shown {
        writeln!(output, "and {} more", compared.differences.len() - shown)?;
    }
    Ok(if compared.equal == compared.total { Outcome::Done } else { Outcome::No })
}

fn read<T: DeserializeOwned>(path: &Path, text: &str) -> anyhow::Result<T> {
    serde_json::from_str(text).with_context(|| format!("{} holds something else", path.display()))
}
