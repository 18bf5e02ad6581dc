//! Changes of the model during a replay: `--reload FILE@TIME`.

use crate::show;
use anyhow::Context;
use shsa_core::time::Span;
use shsa_model::live::{Live, Written};
use shsa_recording::moment;
use shsa_report::recorded::Stage;
use std::path::PathBuf;
use std::str::FromStr;

/// A file that changes the model at a time from the beginning of the recording.
#[derive(Clone, Debug)]
pub(super) struct Reload {
    pub(super) path: PathBuf,
    at: Span,
}

impl FromStr for Reload {
    type Err = String;

    fn from_str(text: &str) -> Result<Reload, String> {
        let (path, at) = text.rsplit_once('@').ok_or("write it like new.yaml@20s")?;
        if path.is_empty() {
            return Err("the file's name is missing; write it like new.yaml@20s".to_owned());
        }
        Ok(Reload { path: path.into(), at: moment(at)? })
    }
}

/// The knowledge bases of a run in the order of time, and whether a file was refused. The problems of a refused file were
/// reported, and the previous model stays.
///
/// # Errors
/// When a file cannot be read.
pub(super) fn stages(mut live: Live, reloads: &[Reload]) -> anyhow::Result<(Vec<Stage>, bool)> {
    let mut stages = vec![Stage::first(live.knowledge().clone())];
    let mut is_refused = false;
    let mut reloads: Vec<&Reload> = reloads.iter().collect();
    reloads.sort_by_key(|reload| reload.at);
    for reload in reloads {
        let name = reload.path.display().to_string();
        let text = std::fs::read_to_string(&reload.path).with_context(|| format!("{name} cannot be read"))?;
        match live.change(Written { name: &name, text: &text }) {
            Ok(report) => {
                show::print_report(&report);
                let knowledge = live.knowledge().clone();
                stages.push(Stage { at: reload.at, knowledge, change: Some((name, text)) });
            }
            Err(report) => {
                show::print_report(&report);
                show::warn(format_args!("{name} has errors: the model before it goes on"));
                is_refused = true;
            }
        }
    }
    Ok((stages, is_refused))
}

/// The stages that begin before the end of the recording.
pub(super) fn until(mut stages: Vec<Stage>, length: Span) -> Vec<Stage> {
    for (name, _) in stages.iter().filter(|stage| stage.at > length).filter_map(|stage| stage.change.as_ref())
    {
        show::warn(format_args!("{name} changes nothing: the recording ends before that"));
    }
    stages.retain(|stage| stage.at <= length);
    stages
}
