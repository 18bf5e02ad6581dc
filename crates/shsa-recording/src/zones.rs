//! Zones of single recordings: loggers of one session may stand in different places, or have clocks of different zones.

use super::files::{File, without_packing};
use super::names::hint;
use super::{ReadOptions, RecordingError};
use shsa_message::source::is_named;
use std::path::Path;

impl ReadOptions {
    /// The options for one file, whose zone is the last one that is given for it or for a folder that it is in.
    pub(super) fn of_file(&self, file: &Path) -> ReadOptions {
        let given = self.zones.iter().rev().find(|(name, _)| names(name, file));
        let zone = given.map_or(&self.zone, |(_, zone)| zone).clone();
        ReadOptions { zone, ..self.clone() }
    }
}

/// Whether a name is that of a file or of a folder that it is in.
fn names(name: &str, file: &Path) -> bool {
    is_named(&without_packing(file), name) || file.ancestors().any(|path| is_named(path, name))
}

/// Checks that each zone is of one of the files.
///
/// # Errors
/// A zone of a file that is not read.
pub(super) fn checked(options: &ReadOptions, files: &[File]) -> Result<(), RecordingError> {
    let is_read = |name: &str| files.iter().any(|file| names(name, &file.path));
    let Some((name, _)) = options.zones.iter().find(|(name, _)| !is_read(name)) else { return Ok(()) };
    let known: Vec<String> = files.iter().map(|file| file.path.display().to_string()).collect();
    let hint = hint(name, known.iter().map(String::as_str));
    Err(RecordingError::ZoneOfNothing { name: name.clone(), hint })
}
