//! `shsa bench live`: what healing costs on the wire, measured with real parts.

mod model;
mod times;
mod middleware;
mod plain;
mod subject;
mod traffic;
mod gate;
mod reaction;

use crate::outcome::Outcome;
use crate::show;
use middleware::{Kind, Middleware};
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa bench live`.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    plain: Option<plain::Arguments>,
    /// On which middleware.
    #[arg(long, value_name = "BUS", value_delimiter = ',', value_enum, default_values = ["memory", "mqtt", "zenoh"])]
    bus: Vec<Kind>,
    /// Write live.md, its plots and the raw results there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each measurement instead of tables.
    #[arg(long)]
    json: bool,
}

/// Measures.
///
/// # Errors
/// When a middleware is not installed, or something does not work.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if let Some(plain) = &arguments.plain {
        return plain::run(plain);
    }
    for kind in &arguments.bus {
        show::tell(&format!("{} ...", kind.name()));
        let middleware = Middleware::start(*kind)?;
        let found = gate::measure(&middleware, 15.0)?;
        writeln!(stdout().lock(), "{}", found.to_json())?;
        for found in reaction::measure(&middleware, 40)? {
            writeln!(stdout().lock(), "{}", found.to_json())?;
        }
    }
    Ok(Outcome::Done)
}
