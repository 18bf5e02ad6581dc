//! Searches for substitutions, without contracts and under contract.

use crate::generated::{drivetrain, large, tree, under_contract};
use shsa_core::assurance::{Assurance, Reading, Search};
use shsa_core::interval::Truth;
use shsa_core::knowledge::{ContractId, KnowledgeBase, NeedId, VariableId, Watched};
use shsa_core::plan::{Admission, BestFirst, Graph, Limits, Options};
use shsa_core::substitution::Way;
use std::hint::black_box;

/// How often each search is made.
const TIMES: usize = 20;

/// The model of a name, and the variable that is needed.
fn model(name: &str) -> Option<(KnowledgeBase, VariableId)> {
    let model = match name {
        "drivetrain" => drivetrain(),
        "tree-170" => tree(2, 8, Some(0.2), 0),
        "tree-10922" => tree(2, 14, Some(0.2), 0),
        "shared-1000" => large(1_000, 0),
        "shared-10000" => large(10_000, 0),
        _ => return None,
    };
    let root =
        if name == "drivetrain" { "steering_angle" } else { model.variables().iter().next()?.name.as_str() };
    let root = model.variable(root)?;
    Some((model, root))
}

/// Searches for the best substitutions; returns how many searches were made. `case` has the name of a model, how many
/// substitutions are wanted, and `bare` for a search that knows nothing of contracts, `without` for the search of a caller that
/// asks contracts where there are any, in a model without, or `under` for the same in a model under contract.
pub(crate) fn run(case: &str) -> Option<usize> {
    let mut words = case.split(' ');
    let ((plain, root), count, mode) = (model(words.next()?)?, words.next()?.parse().ok()?, words.next()?);
    let knowledge = match mode {
        "under" => under_contract(&plain, root),
        _ => plain,
    };
    let graph = Graph::new(&knowledge);
    let assurance = Assurance::new(&knowledge);
    let need = knowledge.needs().ids().next();
    for _ in 0..TIMES {
        let found = match mode {
            "bare" => drive_bare(&graph, root, count),
            _ => drive_asked(&knowledge, assurance.as_ref(), need, &graph, root, count),
        };
        assert_eq!(found, count, "all is admissible");
    }
    Some(TIMES)
}

#[inline(never)]
fn drive_bare(graph: &Graph, root: VariableId, count: usize) -> usize {
    found(graph, root, count, None)
}

#[inline(never)]
fn drive_asked(
    knowledge: &KnowledgeBase,
    assurance: Option<&Assurance>,
    need: Option<NeedId>,
    graph: &Graph,
    root: VariableId,
    count: usize,
) -> usize {
    let all = |_: ContractId, _: &Watched, _: &Way| Reading::lasting(Truth::True);
    let search =
        assurance.zip(need).map(|(assurance, need)| Search::new(knowledge, assurance, need, &all, &[]));
    found(graph, root, count, search.as_ref().map(|search| search as &dyn Admission))
}

#[inline(never)]
fn found(graph: &Graph, root: VariableId, count: usize, admission: Option<&dyn Admission>) -> usize {
    let search = BestFirst::new(graph, black_box(root), &Options::default(), Limits::NONE);
    match admission {
        Some(admission) => search.admitted_by(admission).take(count).map(black_box).count(),
        None => search.take(count).map(black_box).count(),
    }
}
