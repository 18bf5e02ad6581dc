//! `shsa help`: the help of a command, or a page of the reference.

use crate::outcome::Outcome;
use crate::{groups, show};
use clap::error::ErrorKind;
use std::io::{Write, stdout};

/// The pages of `docs/` that are the reference.
const PAGES: [(&str, &str); 8] = [
    ("model", include_str!("../reference/model.md")),
    ("formulas", include_str!("../reference/formulas.md")),
    ("recordings", include_str!("../reference/recordings.md")),
    ("events", include_str!("../reference/events.md")),
    ("json", include_str!("../reference/json.md")),
    ("cookbook", include_str!("../reference/cookbook.md")),
    ("learning", include_str!("../reference/learning.md")),
    ("needs", include_str!("../reference/needs.md")),
];

/// Arguments of `shsa help`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa help model")]
pub(crate) struct Arguments {
    /// A command; or a page of the reference: model, formulas, recordings, events, json, cookbook, learning, needs.
    topic: Vec<String>,
}

/// Prints a page of the reference, or the help of a command or of all commands.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if let [topic] = arguments.topic.as_slice()
        && let Some((_, page)) = PAGES.iter().find(|(name, _)| name == topic)
    {
        stdout().write_all(page.as_bytes())?;
        return Ok(Outcome::Done);
    }
    let words = ["shsa"].into_iter().chain(arguments.topic.iter().map(String::as_str)).chain(["--help"]);
    let Err(described) = groups::command().try_get_matches_from(words) else {
        return Ok(Outcome::Done);
    };
    described.print()?;
    if described.kind() == ErrorKind::DisplayHelp {
        return Ok(Outcome::Done);
    }
    let pages = PAGES.map(|(name, _)| name).join(", ");
    show::fail(format_args!("no page of the reference has this name either; there are {pages}"));
    Ok(Outcome::Bad)
}
