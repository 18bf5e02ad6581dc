//! Which signals are wanted of a recording.

use super::files::without_packing;
use super::gathered::Gathered;
use super::{Place, RecordingError};
use shsa_message::source::Source;
use std::path::Path;

/// A signal that a model asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The signal's name on the bus.
    pub signal: String,
    /// The place in a recording, in the grammar of [`Source`]; empty: the signal's own name.
    pub source: String,
}

impl Wanted {
    /// A signal and its source.
    #[must_use]
    pub fn new(signal: impl Into<String>, source: impl Into<String>) -> Wanted {
        Wanted { signal: signal.into(), source: source.into() }
    }
}

/// One wanted signal with its parsed source.
pub(super) struct Want<'a> {
    pub(super) index: usize,
    pub(super) signal: &'a str,
    pub(super) text: &'a str,
    pub(super) source: Source,
}

/// The wanted signals with their parsed sources.
///
/// # Errors
/// When a source is malformed.
pub(super) fn understand(wanted: &[Wanted]) -> Result<Vec<Want<'_>>, RecordingError> {
    let understood = wanted.iter().enumerate().map(|(index, Wanted { signal, source: text })| {
        let written = if text.trim().is_empty() { signal } else { text };
        let source = written.parse().map_err(|problem| RecordingError::Source {
            signal: signal.clone(),
            text: text.clone(),
            problem,
        })?;
        Ok(Want { index, signal, text, source })
    });
    understood.collect()
}

/// Where a single table has a name that no source knows, the sources mean that table: it may be a copy, a part, a download.
pub(super) fn lone_table(file: &Path, wants: &mut [Want<'_>], gathered: &mut Gathered) {
    let named = |want: &Want<'_>| want.source.file.is_some();
    if !wants.iter().any(named)
        || wants.iter().any(|want| named(want) && want.source.is_of_file(&without_packing(file)))
    {
        return;
    }
    gathered.about(file);
    gathered
        .warn(Place::Whole, "no source names this file; as it is the only one, it is read for all of them");
    for want in wants {
        want.source.file = None;
    }
}
