//! Checks a draft and builds the knowledge base, with every problem reported at once.
//!
//! Later checks skip what earlier ones reported, so that one mistake gives one error.

mod problems;
mod quantity;
mod variables;
mod scope;
mod functions;
mod relations;
mod signals;
mod needs;
mod utility;
#[cfg(test)]
mod tests;

pub(super) use quantity::senseless;

use super::KnowledgeBase;
use super::draft::{Diagnostic, Draft};
use alloc::vec::Vec;
use problems::Problems;
use scope::Names;

/// Checks a model and builds its knowledge base.
///
/// Never fails: gives every error and warning in the order of the file, and a knowledge base, which is complete
/// when there is no error and else holds what was right. Time: linear in the draft, but for looking up names
/// and for solving equations (bounded by their size).
#[must_use]
pub fn build(draft: &Draft) -> (KnowledgeBase, Vec<Diagnostic>) {
    let mut problems = Problems::default();
    let variables = variables::build(&mut problems, draft);
    let functions = functions::build(&mut problems, draft, &variables);
    let names = Names::new(&variables, &functions);
    functions::check(&mut problems, draft, &names);
    let (relations, undecided) = relations::build(&mut problems, draft, &names);
    let signals = signals::build(&mut problems, draft, &variables);
    let needs = needs::build(&mut problems, draft, &variables, &signals);
    let mut mentioned = names.mentioned();
    mentioned.extend(&undecided);
    let knowledge = KnowledgeBase::from_parts(variables.list.clone(), relations, signals, needs);
    needs::check_providable(&mut problems, draft, &variables, &knowledge, &undecided);
    variables::check_used(&mut problems, &variables, &knowledge, &mentioned);
    let utility = utility::build(&mut problems, draft, &knowledge);
    (knowledge.with_utility(utility), problems.sorted())
}
