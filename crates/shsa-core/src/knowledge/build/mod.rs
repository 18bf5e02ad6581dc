//! Checks a draft and builds the knowledge base, with every problem reported at once.
//!
//! A check skips elements with an earlier error, so that one mistake gives one error.

mod problems;
mod quantity;
mod variables;
mod scope;
mod functions;
mod turns;
mod learning;
mod parsed;
mod vague;
mod specifications;
mod directions;
mod relations;
mod signals;
mod fusions;
mod causes;
mod needs;
mod utility;
mod contracts;
#[cfg(test)]
mod tests;

pub(super) use quantity::senseless;

use super::KnowledgeBase;
use super::draft::{Diagnostic, Draft, Source};
use alloc::vec::Vec;
use problems::Problems;
use scope::Names;

/// Checks a model and builds its knowledge base.
///
/// Never fails: returns every error and warning in the order of the file, and a knowledge base. The knowledge base is complete
/// when there is no error; otherwise it holds the valid part. Time: linear in the draft, but for sorting names and for solving
/// equations (bounded by their size).
#[must_use]
pub fn build(mut draft: &Draft) -> (KnowledgeBase, Vec<Diagnostic>) {
    build_from(&mut draft)
}

/// As [`build`], for a model that is read a piece at a time, which keeps memory low.
#[must_use]
pub fn build_from(source: &mut dyn Source) -> (KnowledgeBase, Vec<Diagnostic>) {
    let mut problems = Problems::default();
    let variables = variables::build(&mut problems, source);
    let functions = functions::build(&mut problems, source, &variables);
    let names = Names::new(&variables, &functions);
    functions::check(&mut problems, source, &names);
    let relations::Built { mut relations, undecided, learning, specifications, places } =
        relations::build(&mut problems, source, &names);
    let (mut signals, shares) = signals::build(&mut problems, source, &variables);
    let fusions = fusions::build(&mut problems, source, &names, &mut signals);
    let causes = causes::build(&mut problems, &shares);
    let (needs, needed) = needs::build(&mut problems, source, &variables, &signals);
    let mut mentioned = names.mentioned();
    mentioned.extend(&undecided);
    let (mut list, declared) = variables.into_parts();
    let learned = learning::build(&mut problems, &learning, &mut list, &mut relations, &signals);
    let knowledge = KnowledgeBase::from_parts(list, relations, signals, needs)
        .with_causes(causes)
        .with_fusions(fusions)
        .with_learned(learned)
        .with_specifications(specifications);
    needs::check_providable(&mut problems, &needed, &knowledge, &undecided);
    needs::check_fitted(&mut problems, &learning, &knowledge, &undecided);
    variables::check_used(&mut problems, &declared, &knowledge, &mentioned);
    vague::check(&mut problems, &places, &knowledge);
    let utility = utility::build(&mut problems, source, &knowledge);
    let contracts = contracts::build(&mut problems, source, &knowledge);
    (knowledge.with_utility(utility).with_contracts(contracts), problems.sorted())
}
