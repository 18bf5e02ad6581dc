//! The question: which signal, at which time; and the files that it is about.

use crate::show;
use anyhow::{anyhow, bail};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::unit::nearest;
use shsa_format::drive::Era;
use shsa_recording::moment;
use shsa_report::explanation::Question;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The files among the arguments, and the text behind them that is no file.
pub(super) fn files(arguments: &[PathBuf]) -> (&[PathBuf], Option<&Path>) {
    match arguments.split_last() {
        Some((last, files)) if !last.exists() => (files, Some(last)),
        _ => (arguments, None),
    }
}

/// Reads `SIGNAL` or `SIGNAL@TIME`; the models tell which names contain an `@`.
///
/// # Errors
/// When no model of the run has the signal, or the time is invalid.
pub(super) fn signal(text: &str, eras: &[Era]) -> anyhow::Result<Question> {
    let known = |name: &str| eras.iter().any(|era| era.knowledge.signal(name).is_some());
    if known(text) {
        return Ok(Question::Signal { name: text.to_owned(), at: None });
    }
    let (name, at) = text.rsplit_once('@').map_or((text, None), |(name, at)| (name, Some(at)));
    if !known(name) {
        return Err(unknown(name, eras));
    }
    let at = at.map(moment).transpose().map_err(|problem| anyhow!("{text}: {problem}"))?;
    Ok(Question::Signal { name: name.to_owned(), at })
}

fn unknown(name: &str, eras: &[Era]) -> anyhow::Error {
    let names = |era: &Era| names(&era.knowledge);
    let all: BTreeSet<String> = eras.iter().flat_map(names).collect();
    let error = show::unknown("signal", name, all.iter().map(String::as_str));
    let is_path = name.contains(['/', '.', '\\']) && nearest(name, all.iter().map(String::as_str)).is_none();
    if is_path { anyhow!("{error}; nor is there a file of this name") } else { error }
}

fn names(knowledge: &KnowledgeBase) -> Vec<String> {
    knowledge.signals().iter().map(|signal| signal.name.clone()).collect()
}

/// The question of either argument.
///
/// # Errors
/// When both arguments are given, or the number is 0.
pub(super) fn asked(text: Option<&Path>, decision: Option<usize>, eras: &[Era]) -> anyhow::Result<Question> {
    match (text, decision) {
        (Some(_), Some(_)) => bail!("ask about a signal or about a decision, not about both"),
        (None, Some(number)) => Ok(Question::Decision(number)),
        (Some(text), None) => signal(&text.to_string_lossy(), eras),
        (None, None) => Ok(Question::All),
    }
}
