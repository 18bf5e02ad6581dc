//! The headings of options in the help. Options of one command come first; those that many commands share follow, reading last.

/// What is changed in recordings before they are used.
pub(crate) const FAULTS: &str = "Faults";
/// How the ways of knowing one variable are compared.
pub(crate) const COMPARISON: &str = "Comparison";
/// Which part of recordings is used.
pub(crate) const PARTS: &str = "Part of the recording";
/// How much is watched.
pub(crate) const WATCHING: &str = "Watching";
/// Files that are written.
pub(crate) const OUTPUT: &str = "Output files";
/// What recordings do not say of themselves.
pub(crate) const READING: &str = "Reading recordings";
