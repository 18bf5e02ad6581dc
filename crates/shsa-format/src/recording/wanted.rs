//! Which signals are wanted of a recording.

use super::RecordingError;
use shsa_message::source::Source;

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
