//! Stories as texts: what they find, and what is told about mistakes in them.
