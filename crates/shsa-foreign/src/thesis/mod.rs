//! Knowledge bases of the thesis's public programs as drafts of models.
//!
//! The first two forms become one sketch: YAML with `relations` (or `graph`) and `properties`, and Prolog facts. Elements without a
//! counterpart in our model or formula language are reported with their place; the structure is always converted. Ontologies are the
//! third form.
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
mod losses;
pub mod prolog;
#[cfg(feature = "ontology")]
pub mod ontology;

pub(super) use clauses::is_prolog;
pub(super) use yaml::is_thesis;

use shsa_core::knowledge::{Diagnostic, Draft};
use std::collections::BTreeSet;

use notes::Notes;
use shsa_model::tree::Node;

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

/// Reads an ontology in Turtle.
#[cfg(feature = "ontology")]
pub(super) fn from_ontology(text: &str) -> Taken {
    let mut notes = Notes::default();
    let draft = ontology::draft(&mut notes, text);
    Taken { draft, problems: notes.found, rewritten: notes.rewritten }
}

/// Whether a text looks like Turtle.
pub(super) fn is_turtle(text: &str) -> bool {
    let mut lines = text.trim_start_matches('\u{feff}').lines().map(str::trim_start);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#')).unwrap_or_default();
    let word = first.split(char::is_whitespace).next().unwrap_or_default();
    let is_keyword = |keyword: &str| word.eq_ignore_ascii_case(keyword);
    word.starts_with("<http")
        || word.starts_with("<urn:")
        || ["@prefix", "@base", "prefix", "base"].into_iter().any(is_keyword)
}

#[cfg(test)]
mod tests;
