//! Searches for substitutions.
