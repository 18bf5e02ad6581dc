//! Models that are changed while they are in use: edits, parts, and an engine that goes on.

mod drafts;
mod edits;
mod parts;
mod reload;
