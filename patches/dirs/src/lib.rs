//! Where the user's files are. Stands in for the crate of the same name (`[patch.crates-io]`), of which Zenoh's
//! configuration needs this alone, and which brings a licence that is not shipped.

use std::path::PathBuf;

/// The user's home; `None` where there is none.
#[must_use]
pub fn home_dir() -> Option<PathBuf> {
    std::env::home_dir()
}
