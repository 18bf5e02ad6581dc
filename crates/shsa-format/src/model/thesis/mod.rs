//! Knowledge bases of the thesis's public programs as drafts of models.
//!
//! Both forms become one sketch: YAML with `relations` (or `graph`) and `properties`, and Prolog facts. Elements without a
//! counterpart in our model or formula language are reported with their place; the structure is always converted.
//!
//! Format of the files: D. Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien 2019, and its public programs.

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

/// The draft of a file of the thesis.
pub(super) struct Taken {
    pub(super) draft: Draft,
    /// Errors, and warnings about parts that were not converted.
    pub(super) problems: Vec<Diagnostic>,
    /// The starts of translated texts, whose spans do not count in the file.
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
