//! The messages of ROS 2 in recordings: the types known without a definition, and those defined in a recording.

use super::topic::Fields;
use shsa_message::MessageError;
use shsa_message::ros::{Layout, Types, full_name};
use std::path::PathBuf;
use std::sync::Arc;

/// The standard types, and those defined in these folders.
///
/// # Errors
/// When a folder or a file in it cannot be read.
pub(super) fn known(folders: &[PathBuf]) -> Result<Arc<Types>, MessageError> {
    let standard = Types::standard();
    if folders.is_empty() {
        return Ok(standard);
    }
    let mut types = Types::beside(standard);
    folders.iter().try_for_each(|folder| types.add_folder(folder))?;
    Ok(Arc::new(types))
}

/// The fields of a message type, from its own definition or from the known types.
pub(super) fn fields(known: &Arc<Types>, name: &str, definition: &str) -> Fields {
    let kind = full_name(name).into_owned();
    let mut types = known.clone();
    if !definition.trim().is_empty() {
        let mut own = Types::beside(known.clone());
        if let Err(problem) = own.add_recorded(&kind, definition) {
            return Fields::Unknown(problem.to_string());
        }
        types = Arc::new(own);
    }
    if types.has(&kind) {
        return Fields::Ros { types, kind, layout: Layout::Cdr };
    }
    Fields::Unknown(format!(
        "the type {kind} is not defined in the file and is no standard one; say where its .msg file is with --messages DIR"
    ))
}
