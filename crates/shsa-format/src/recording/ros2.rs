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
    let mut types = Types::standard();
    for folder in folders {
        Arc::make_mut(&mut types).add_folder(folder)?;
    }
    Ok(types)
}

/// The fields of a message type, from its own definition or from the known types.
pub(super) fn fields(known: &Arc<Types>, name: &str, definition: &str) -> Fields {
    let kind = full_name(name).into_owned();
    let mut types = known.clone();
    if !definition.trim().is_empty() {
        let mut own = Types::clone(known);
        own.add_recorded(&kind, definition);
        types = Arc::new(own);
    }
    match types.members(&kind) {
        Ok(_) => Fields::Ros { types, kind, layout: Layout::Cdr },
        Err(_) => Fields::Unknown(format!(
            "the type {kind} is not defined in the file and is no standard one; say where its .msg file is with --messages DIR"
        )),
    }
}
