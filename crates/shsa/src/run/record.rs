//! The record of a run: as a file of MCAP, and for viewers that follow it.

use super::Arguments;
#[cfg(feature = "foxglove")]
use super::foxglove::Viewers;
use crate::replay::provenance;
use crate::show;
use crate::written;
use anyhow::{Context, bail};
use shsa_core::engine::Options;
use shsa_demo::rover;
use shsa_format::drive::Given;
use shsa_report::mcap::{Follower, McapFile, Sink};
#[cfg(feature = "foxglove")]
use shsa_runtime::Token;
use shsa_runtime::{Model, RunRecorder};
use std::io::{self, Write};
use std::path::PathBuf;

/// All that is told of a run.
type Sinks = Vec<Box<dyn Sink + Send>>;

/// Begins the record of the only model, where one is asked for. Returns it with the model's name.
///
/// # Errors
/// When there are several models, a file cannot be written, or an address cannot be used.
pub(super) fn recorder(
    arguments: &Arguments,
    models: &[Model],
    options: Options,
) -> anyhow::Result<Option<(String, Box<dyn RunRecorder>)>> {
    let Arguments { record, viewers, .. } = arguments;
    if !is_asked_for(arguments) {
        anyhow::ensure!(viewers.layout.is_none(), "--layout is for the viewers of --record and --foxglove");
        return Ok(None);
    }
    let [model] = models else {
        bail!("a record is of one model, and these are {}; --journal keeps the inputs of each", models.len());
    };
    let (name, bytes) = text(arguments, model)?;
    let files = written::open([record, &viewers.layout].map(Option::as_deref), &[&name])?;
    let [file, layout] = files;
    let made = provenance(&name, &bytes);
    let mut sinks = Sinks::new();
    if let Some(file) = file {
        let file = McapFile::new(file, &made).context("the record cannot be written")?;
        sinks.push(Box::new(file));
    }
    sinks.extend(viewers_of(arguments, model)?);
    let follower =
        Follower::new(sinks, model.live.knowledge(), options).context("the record cannot begin")?;
    if let Some(mut layout) = layout {
        layout.write_all(follower.layout().to_string().as_bytes()).and_then(|()| layout.flush())?;
    }
    let path = record.clone().unwrap_or_default();
    Ok(Some((model.name.clone(), Box::new(Record { follower, path }))))
}

#[cfg(feature = "foxglove")]
fn is_asked_for(arguments: &Arguments) -> bool {
    arguments.record.is_some() || arguments.viewers.foxglove.is_some()
}

#[cfg(not(feature = "foxglove"))]
fn is_asked_for(arguments: &Arguments) -> bool {
    arguments.record.is_some()
}

/// The viewers that follow the run over WebSocket.
#[cfg(feature = "foxglove")]
fn viewers_of(arguments: &Arguments, model: &Model) -> anyhow::Result<Option<Box<dyn Sink + Send>>> {
    let Some(address) = arguments.viewers.foxglove else { return Ok(None) };
    let view_token = Token::find(arguments.view_token_file.as_deref(), "SHSA_VIEW_TOKEN")?;
    anyhow::ensure!(
        view_token.is_none(),
        "looking needs a token, and --foxglove has none: everyone who can reach it may look"
    );
    let name = format!("{} ({})", arguments.name, model.name);
    let (viewers, address) = Viewers::serve(address, &name)?;
    show::notice(&format!("for Foxglove: ws://{address}/"));
    Ok(Some(Box::new(viewers)))
}

#[cfg(not(feature = "foxglove"))]
fn viewers_of(_: &Arguments, _: &Model) -> anyhow::Result<Option<Box<dyn Sink + Send>>> {
    Ok(None)
}

/// The file of a model with its content.
fn text(arguments: &Arguments, model: &Model) -> anyhow::Result<(PathBuf, Vec<u8>)> {
    let path = model.path.clone().unwrap_or_default();
    if arguments.models.is_empty() {
        return Ok((path, rover::MODEL.into()));
    }
    let bytes = std::fs::read(&path).with_context(|| format!("cannot read {} again", path.display()))?;
    Ok((path, bytes))
}

/// A record that is being written.
struct Record {
    follower: Follower<Sinks>,
    path: PathBuf,
}

impl RunRecorder for Record {
    fn record(&mut self, given: Given<'_>) -> io::Result<()> {
        self.follower.follow(given)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.follower.flush()
    }

    /// An error is shown, as the run may be over and report nothing more.
    fn finish(&mut self) -> io::Result<()> {
        self.follower.finish().map(drop).inspect_err(|error| {
            show::warn(format!("the end of {} could not be written: {error}", self.path.display()));
        })
    }
}
