//! Checks the levels that contracts claim for two redundant demands against the standards.

use super::super::problems::Problems;
use crate::expression::{Binary, Formula, Operation, Reduction};
use crate::knowledge::contract::{Asked, Contracts, Given, Party, Subject};
use crate::knowledge::decomposition::{Claim, Common, Objection, Redundancy, dependence};
use crate::knowledge::draft::{ContractDraft, Text};
use crate::knowledge::{KnowledgeBase, RelationId, SignalSet, VariableId};
use crate::statement::Statement;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Reports every invalid claim of a decomposition.
pub(super) fn check(
    problems: &mut Problems,
    knowledge: &KnowledgeBase,
    contracts: &Contracts,
    drafts: &[&ContractDraft],
) {
    for (contract, draft) in contracts.rows().iter().zip(drafts) {
        for given in &contract.gives {
            let Some(pair) = given.redundant else { continue };
            let written = draft.gives.iter().find(|it| it.name.text == given.name);
            let at = written.and_then(|it| it.redundant.as_ref()?.first()).unwrap_or(&draft.name);
            let asked: Vec<&Asked> = pair.iter().filter_map(|&place| contract.asks.get(place)).collect();
            of_given(problems, knowledge, contracts, contract.subject, given, &asked, at);
        }
    }
}

fn of_given(
    problems: &mut Problems,
    knowledge: &KnowledgeBase,
    contracts: &Contracts,
    subject: Subject,
    given: &Given,
    asked: &[&Asked],
    at: &Text,
) {
    let ([one, other], Subject::Relation(relation)) = (asked, subject) else {
        let message = "only a relation that compares two sources can claim a decomposition";
        return problems.error(at, message, "leave `redundant` away");
    };
    let (Party::Provider(first), Party::Provider(second)) = (one.of, other.of) else {
        return problems.error(at, "a decomposition is of two inputs", "ask two inputs of the relation");
    };
    let levels = (given.statement.level, one.statement.level, other.statement.level);
    let (Some(original), Some(part), Some(rest)) = levels else {
        let help = "give the guarantee and both demands a level";
        return problems.error(at, "a decomposition without levels says nothing", help);
    };
    let redundancy = Redundancy {
        each_suffices: [one, other].iter().all(|asked| suffices(&asked.statement, &given.statement))
            && selects(knowledge, relation, first, second),
        are_compared: are_compared(knowledge, relation, first, second),
        in_common: shared_by_all(knowledge, contracts, first, second),
    };
    let claim = Claim { original, parts: [part, rest] };
    for objection in claim.objections(contracts.scales(), &redundancy) {
        let (message, help) = described(knowledge, contracts, &claim, &objection);
        problems.error(at, format!("this decomposition does not stand: {message}"), help);
    }
}

/// Whether a demand has all properties of a guarantee, whatever the level and the name of the variable.
fn suffices(asked: &Statement, given: &Statement) -> bool {
    given.properties.iter().all(|wanted| asked.properties.iter().any(|part| part.meets(wanted)))
}

/// Whether the relation always gives the value of one of the two, so that each is enough.
fn selects(knowledge: &KnowledgeBase, relation: RelationId, one: VariableId, other: VariableId) -> bool {
    let row = &knowledge.relations()[relation];
    let outputs = row.outputs.iter().filter(|output| **output != one && **output != other);
    let formulas: Vec<&Formula> = outputs.filter_map(|&output| row.formula(output)).collect();
    !formulas.is_empty() && formulas.iter().all(|formula| is_selection(formula))
}

/// Whether a formula is a variable, or `min` and `max` of variables.
fn is_selection(formula: &Formula) -> bool {
    match formula.operation() {
        Operation::Symbol(_) => true,
        Operation::Binary(Binary::Min | Binary::Max)
        | Operation::Reduce(Reduction::Min | Reduction::Max)
        | Operation::List => formula.arguments().iter().all(is_selection),
        _ => false,
    }
}

/// Whether the relation's condition reads both variables.
fn are_compared(knowledge: &KnowledgeBase, relation: RelationId, one: VariableId, other: VariableId) -> bool {
    let condition = knowledge.relations()[relation].condition.as_ref();
    condition.is_some_and(|formula| {
        let symbols = formula.symbols();
        symbols.contains(&one.symbol()) && symbols.contains(&other.symbol())
    })
}

/// The common faults of every choice of a signal for each of the two variables; empty where some choice is independent. Where one
/// of them is always computed, the flow of information decides instead.
fn shared_by_all(
    knowledge: &KnowledgeBase,
    contracts: &Contracts,
    one: VariableId,
    other: VariableId,
) -> Vec<Common> {
    let mut shared: Option<Vec<Common>> = None;
    for &first in knowledge.carriers(one) {
        for &second in knowledge.carriers(other) {
            let sets = [first, second].map(|signal| SignalSet::from_iter([signal]));
            let common = dependence(knowledge, contracts, &sets);
            if shared.as_ref().is_none_or(|known| common.len() < known.len()) {
                shared = Some(common);
            }
        }
    }
    shared.unwrap_or_default()
}

/// An objection in words, and the help.
fn described(
    knowledge: &KnowledgeBase,
    contracts: &Contracts,
    claim: &Claim,
    objection: &Objection,
) -> (String, String) {
    let scales = contracts.scales();
    let level = |level| scales.written(level);
    let [one, other] = claim.parts.map(level);
    match objection {
        Objection::OtherScale => (
            format!("{one}, {other} and {} are not of one scale", level(claim.original)),
            "nothing converts one scale into another".to_string(),
        ),
        Objection::NoRule => {
            ("this scale has no rule for pairs".to_string(), "ASIL and SIL have one".to_string())
        }
        Objection::TooLow(reached) => (
            format!("{one} and {other} together reach {}", level(*reached)),
            format!("ask more of the two, or give {} at most", level(*reached)),
        ),
        Objection::Insufficient => (
            "one of the two is not enough on its own".to_string(),
            "ask of each what is given, and compute `min` or `max` of the two: a mean is no decomposition"
                .to_string(),
        ),
        Objection::NotCompared => (
            "the two are not compared".to_string(),
            "give the relation a `when` such as `abs(one - other) < 0.3 m`".to_string(),
        ),
        Objection::Dependent(common) => {
            let name = |common: &Common| match common {
                Common::Signal(id) => knowledge.signals()[*id].name.clone(),
                Common::Cause(id) => knowledge.causes()[*id].name.clone(),
                Common::Platform(id) => contracts.rows()[*id].name.clone(),
            };
            let names: Vec<String> = common.iter().map(name).collect();
            (format!("both rest on {}", names.join(", ")), "take sources that share nothing".to_string())
        }
    }
}
