//! The `shsa` command under measurement.

use anyhow::{Context, bail};
use std::path::PathBuf;

/// The path of `shsa`: from the environment variable `SHSA`, else beside this program.
///
/// # Errors
/// When the file does not exist.
pub(crate) fn shsa() -> anyhow::Result<PathBuf> {
    let named = std::env::var_os("SHSA").map(PathBuf::from);
    let beside = || Ok(std::env::current_exe().context("cannot find this program")?.with_file_name("shsa"));
    let program: PathBuf = named.map_or_else(beside, anyhow::Ok)?;
    if !program.exists() {
        bail!(
            "{} is absent: build it (cargo build --release -p shsa), or name it in SHSA",
            program.display()
        );
    }
    Ok(program)
}
