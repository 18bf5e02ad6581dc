//! substitution.
