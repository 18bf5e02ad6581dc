//! Knowledge bases of the thesis's public programs, read into drafts of ours.
//!
//! Two forms, one sketch that both become: YAML with `relations` (or `graph`) and `properties`, and Prolog facts. What has no
//! place in our model, or no like in our formula language, is told with its place; the structure always comes over.
//!
//! Form of the files: D. Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien 2019, and its public programs.

mod tokens;
mod term;
mod functions;
mod expression;
mod operand;
mod python;
mod names;
mod notes;
mod formulas;
mod settle;
mod sketch;
mod yaml;
mod clauses;
mod facts;
mod statements;
pub mod prolog;

pub(super) use clauses::is_prolog;
pub(super) use yaml::is_thesis;

use shsa_core::knowledge::{Diagnostic, Draft};
use std::collections::BTreeSet;

use super::tree::Node;
use notes::Notes;

/// A file of the thesis as a draft.
pub(super) struct Taken {
    pub(super) draft: Draft,
    /// Errors, and warnings about what did not come over.
    pub(super) problems: Vec<Diagnostic>,
    /// Starts of texts whose spans do not count in the file, as they were translated.
    pub(super) rewritten: BTreeSet<u32>,
}

/// Reads the thesis's YAML from its tree.
pub(super) fn from_yaml(root: &Node) -> Taken {
    let mut notes = Notes::default();
    let sketch = yaml::sketch(&mut notes, root);
    sketch::taken(sketch, notes)
}

/// Reads the thesis's Prolog facts.
pub(super) fn from_prolog(text: &str) -> Taken {
    let mut notes = Notes::default();
    let sketch = facts::sketch(&mut notes, text);
    sketch::taken(sketch, notes)
}

#[cfg(test)]
mod tests;
