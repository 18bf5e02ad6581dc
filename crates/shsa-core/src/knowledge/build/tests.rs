//! Tests of drafts that only programs can make, of the fixpoint, and of errors as written. Drafts from files are tested where
//! files are read.

use super::*;
use crate::knowledge::draft::{
    BodyDraft, Bounds, NeedDraft, RelationDraft, SignalDraft, Text, VariableDraft,
};
use crate::knowledge::{IdVec, Properties, Relation, Shape, ValueError, Variable, VariableId};
use crate::unit::Unit;
use alloc::collections::BTreeSet;
use alloc::string::{String, ToString};
use proptest::prelude::*;

fn text(text: &str) -> Text {
    Text { text: text.to_string(), ..Text::default() }
}

fn structure(name: &str, output: &str, inputs: &[&str]) -> RelationDraft {
    let inputs = inputs.iter().map(|input| text(input)).collect();
    let body = BodyDraft::Structure { outputs: [text(output)].into(), inputs };
    let properties = Vec::new();
    RelationDraft {
        name: text(name),
        body,
        directions: None,
        condition: None,
        error: None,
        learn: Vec::new(),
        properties,
    }
}

fn messages(draft: &Draft) -> Vec<String> {
    build(draft).1.into_iter().map(|found| found.message).collect()
}

#[test]
fn nothing_is_a_knowledge_base_too() {
    let (knowledge, problems) = build(&Draft::default());
    assert!(knowledge.variables().is_empty() && problems.is_empty());
}

#[test]
fn what_a_function_uses_is_read_by_who_calls_it_only() {
    let equation = |text: &str| BodyDraft::Equation(self::text(text));
    let relation =
        |name: &str, body: &str| RelationDraft { body: equation(body), ..structure(name, "a", &[]) };
    let variable = |name: &str| VariableDraft { name: text(name), ..VariableDraft::default() };
    let draft = Draft {
        variables: ["a", "b", "c"].map(variable).into(),
        functions: [(text("f(p)"), text("p + c"))].into(),
        relations: [relation("plain", "a = b"), relation("calls", "a = f(b)")].into(),
        ..Draft::default()
    };
    let (knowledge, _) = build(&draft);
    let inputs: Vec<usize> = knowledge.relations().iter().map(|relation| relation.inputs.len()).collect();
    assert_eq!(inputs, [2, 3], "of two and three variables, as each is solved for all of them");
}

#[test]
fn drafts_of_programs_may_repeat_names() {
    let variable = |name: &str| VariableDraft { name: text(name), ..VariableDraft::default() };
    let signal = SignalDraft { name: text("/a"), variable: Some(text("a")), ..SignalDraft::default() };
    let need = NeedDraft { variable: text("a"), ..NeedDraft::default() };
    let draft = Draft {
        variables: [variable("a"), variable("b"), variable("a")].into(),
        constants: [(text("c"), Bounds::One(text("1"))), (text("c"), Bounds::One(text("2")))].into(),
        relations: [structure("r", "a", &["b", "c"]), structure("r", "b", &["a"])].into(),
        signals: [signal.clone(), signal].into(),
        needs: [need.clone(), need].into(),
        ..Draft::default()
    };
    let expected = [
        "variable `a` is given twice",
        "constant `c` has two values",
        "relation `r` is given twice",
        "signal `/a` is given twice",
        "two needs are published as `/healed/a`",
    ];
    assert_eq!(messages(&draft), expected);
}

#[test]
fn a_broken_model_holds_what_was_right() {
    let draft = Draft {
        variables: ["a", "b"]
            .map(|name| VariableDraft { name: text(name), ..VariableDraft::default() })
            .into(),
        relations: [structure("broken", "x", &["a"]), structure("right", "b", &["a"])].into(),
        ..Draft::default()
    };
    let (knowledge, problems) = build(&draft);
    assert_eq!(problems.len(), 1);
    assert_eq!(
        knowledge.relations().iter().map(|relation| relation.name.as_str()).collect::<Vec<_>>(),
        ["right"]
    );
}

#[track_caller]
fn check_error(written: &str, unit: &str, expected: Option<(f64, f64, f64)>) {
    let unit = Unit::parse(unit).unwrap();
    let read = quantity::value_error(&mut Problems::default(), &Bounds::One(text(written)), Some(&unit));
    assert_eq!(read, expected.map(|(lo, hi, relative)| ValueError { lo, hi, relative }), "{written}");
}

#[test]
fn value_errors_are_absolute_or_shares_or_both() {
    check_error("0.15", "m", Some((-0.15, 0.15, 0.0)));
    check_error("50 cm", "km", Some((-0.5, 0.5, 0.0)));
    check_error("2", "km", Some((-2000.0, 2000.0, 0.0)));
    check_error("2 %", "m", Some((0.0, 0.0, 0.02)));
    check_error("25 % + 5 m", "m", Some((-5.0, 5.0, 0.25)));
    check_error("1e+1+50%", "m", Some((-10.0, 10.0, 0.5)));
    check_error("5 degC", "degC", Some((-5.0, 5.0, 0.0)));
    for wrong in ["-1", "100 %", "1 s", "1 +", "", "nan", "inf", "1e999", "1 + 2 + 3", "- 5 %"] {
        check_error(wrong, "m", None);
    }
}

/// A knowledge base of `count` variables with structure-only relations.
fn knowledge(count: usize, relations: &[(Vec<usize>, Vec<usize>)]) -> KnowledgeBase {
    use crate::knowledge::Id;
    let ids = |indices: &[usize]| {
        let ids: BTreeSet<VariableId> =
            indices.iter().map(|index| VariableId::from_index(index % count)).collect();
        ids.into_iter().collect::<Vec<_>>()
    };
    let variables = IdVec::filled(count, |_| Variable {
        name: String::new(),
        unit: None,
        shape: Shape::Scalar,
        range: None,
        max_rate: None,
        wraps: None,
        constant: None,
        properties: Properties::new(),
    });
    let mut list = IdVec::new();
    for (inputs, outputs) in relations {
        list.push(Relation {
            name: String::new(),
            inputs: ids(inputs),
            outputs: ids(outputs),
            formulas: Vec::new(),
            condition: None,
            text: String::new(),
            properties: Properties::new(),
        });
    }
    KnowledgeBase::from_parts(variables, list, IdVec::new(), IdVec::new())
}

/// Adds the outputs of relations with known inputs until nothing changes.
fn naive(knowledge: &KnowledgeBase, given: &BTreeSet<VariableId>) -> BTreeSet<VariableId> {
    let mut known = given.clone();
    loop {
        let before = known.len();
        for relation in knowledge.relations() {
            for &output in &relation.outputs {
                if relation.needs(output).all(|input| known.contains(&input)) {
                    known.insert(output);
                }
            }
        }
        if known.len() == before {
            return known;
        }
    }
}

proptest! {
    #[test]
    fn providable_is_the_least_fixpoint(
        relations in prop::collection::vec(
            (prop::collection::vec(0..12_usize, 0..4), prop::collection::vec(0..12_usize, 1..3)), 0..14),
        given in prop::collection::btree_set(0..12_usize, 0..4),
    ) {
        let knowledge = knowledge(12, &relations);
        let given = knowledge.variables().ids().zip(0..).filter(|(_, at)| given.contains(at)).map(|(id, _)| id);
        let given: BTreeSet<VariableId> = given.collect();
        let known = needs::providable(&knowledge, &given, None);
        let known: BTreeSet<VariableId> = known.enumerate().filter(|(_, known)| **known).map(|(id, _)| id).collect();
        prop_assert_eq!(known, naive(&knowledge, &given));
    }
}
