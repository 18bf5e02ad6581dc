//! The record of a run as a file of MCAP.

use super::ROVER;
use crate::replay::{provenance, written};
use crate::show;
use anyhow::{Context, bail};
use shsa_core::engine::Options;
use shsa_format::drive::Given;
use shsa_report::mcap::Follower;
use shsa_runtime::{Model, RunRecorder};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// Begins the record of the only model. Returns it with the model's name.
///
/// # Errors
/// When there are several models, or the file cannot be written.
pub(super) fn recorder(
    path: &Path,
    models: &[Model],
    options: Options,
) -> anyhow::Result<(String, Box<dyn RunRecorder>)> {
    let [model] = models else {
        bail!("a record is of one model, and these are {}; --journal keeps the inputs of each", models.len());
    };
    let (name, bytes) = text(model)?;
    let made = provenance(&name, &bytes);
    let [file] = written::open([Some(path)], &[&name])?;
    let file = file.context("no file to record to")?;
    let follower = Follower::new(file, model.live.knowledge(), options, &made)
        .with_context(|| format!("{} cannot be written", path.display()))?;
    Ok((model.name.clone(), Box::new(Record { follower, path: path.to_owned() })))
}

/// The file of a model with its content.
fn text(model: &Model) -> anyhow::Result<(PathBuf, Vec<u8>)> {
    let path = model.path.clone().unwrap_or_default();
    match ROVER {
        (name, text) if path == Path::new(name) => Ok((path, text.into())),
        _ => {
            let bytes =
                std::fs::read(&path).with_context(|| format!("cannot read {} again", path.display()))?;
            Ok((path, bytes))
        }
    }
}

/// A record that is being written.
struct Record {
    follower: Follower<BufWriter<File>>,
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
