//! What is asked: about which signal, at which time; and which files it is asked about.

use crate::show;
use anyhow::{anyhow, bail};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Span;
use shsa_core::unit::nearest;
use shsa_format::drive::Era;
use shsa_format::fault::moment;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What is asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// Which decisions there were.
    All,
    /// Why a signal was, or was not, accused; at its first accusation when there is no time.
    Signal { name: String, at: Option<Span> },
    /// Why the decision of this number in the list was taken; counted from 1.
    Decision(usize),
}

/// The files among the arguments, and the text after them that is no file.
pub(super) fn files(arguments: &[PathBuf]) -> (&[PathBuf], Option<&Path>) {
    match arguments.split_last() {
        Some((last, files)) if !last.exists() => (files, Some(last)),
        _ => (arguments, None),
    }
}

/// Reads `SIGNAL` or `SIGNAL@TIME`; a name with an `@` of its own is known by the models.
///
/// # Errors
/// When no model of the run has such a signal, or the time is none.
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

/// Puts the two ways of asking together.
///
/// # Errors
/// When both are used, or the number is 0.
pub(super) fn asked(text: Option<&Path>, decision: Option<usize>, eras: &[Era]) -> anyhow::Result<Question> {
    match (text, decision) {
        (Some(_), Some(_)) => bail!("ask about a signal or about a decision, not about both"),
        (None, Some(number)) => Ok(Question::Decision(number)),
        (Some(text), None) => signal(&text.to_string_lossy(), eras),
        (None, None) => Ok(Question::All),
    }
}
