//! `shsa check`: loads a knowledge base and tells every problem with its place.

use crate::outcome::Outcome;
use crate::show;
use serde_json::json;
use shsa_format::model;
use std::io::{IsTerminal, Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa check`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa check models/car.yaml")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Checks a model; bad input when it has errors.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let loaded = model::load_file(&arguments.model);
    let knowledge = &loaded.knowledge;
    let mut output = stdout().lock();
    if arguments.json {
        let answer = json!({
            "ok": loaded.report.ok(),
            "variables": knowledge.variables().len(),
            "relations": knowledge.relations().len(),
            "signals": knowledge.signals().len(),
            "needs": knowledge.needs().len(),
            "diagnostics": loaded.report.diagnostics,
        });
        writeln!(output, "{answer}")?;
    } else {
        let report = loaded.report.render(show::colour(stdout().is_terminal()));
        if !report.is_empty() {
            writeln!(output, "{report}\n")?;
        }
        writeln!(
            output,
            "{}: {} ({} variables, {} relations, {} signals, {} needs)",
            arguments.model.display(),
            if loaded.report.ok() { "ok" } else { "not usable" },
            knowledge.variables().len(),
            knowledge.relations().len(),
            knowledge.signals().len(),
            knowledge.needs().len()
        )?;
    }
    Ok(if loaded.report.ok() { Outcome::Done } else { Outcome::Bad })
}
