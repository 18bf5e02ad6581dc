//! `shsa model schema`: the JSON Schema of models, for editors.

use crate::outcome::Outcome;
use shsa_model::schema;
use std::io::{Write, stdout};

/// Arguments of `shsa model schema`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa model schema > model.schema.json

Editors with the YAML language server take it by a line at the top of a model:
  # yaml-language-server: $schema=model.schema.json")]
pub(crate) struct Arguments {}

/// Prints the schema.
pub(crate) fn run(_: &Arguments) -> anyhow::Result<Outcome> {
    stdout().write_all(schema::text().as_bytes())?;
    Ok(Outcome::Done)
}
