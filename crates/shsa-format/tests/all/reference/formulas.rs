//! `docs/formulas.md` against the tables of the language, and every example of it.

use super::document::{Document, code};
use shsa_core::expression::{
    Assignment, CheckedEquation, Formula, Function, Infix, Kind, MAX_DEPTH, MAX_NESTING, MAX_TEXT, Prefix,
    Program, Scope, Symbol, WORDS, check_equation, functions, parse_equation,
};
use shsa_core::time::{Time, Validity};
use shsa_core::unit;
use shsa_model::load;
use std::collections::BTreeSet;

const FUNCTIONS: [&str; 5] = [
    "Functions of numbers",
    "Functions of several numbers or of a vector",
    "Uncertainty",
    "Time",
    "Conditions over time",
];

fn page() -> Document {
    Document::read("formulas.md")
}

#[test]
fn every_function_is_described_as_it_is_written() {
    let documented: Vec<String> =
        FUNCTIONS.iter().flat_map(|section| page().section(section).named("function")).collect();
    let known: BTreeSet<&str> = functions().map(|(_, usage)| usage).collect();
    assert_eq!(documented.iter().map(String::as_str).collect::<BTreeSet<_>>(), known);
    assert_eq!(documented.len(), known.len());
}

#[test]
fn every_word_is_described() {
    page().section("Words").names_exactly("word", WORDS);
}

#[test]
fn every_operator_is_described() {
    let known: BTreeSet<&str> =
        Infix::ALL.map(Infix::symbol).into_iter().chain(Prefix::ALL.map(Prefix::symbol)).collect();
    page().section("Operators").names_exactly("operator", known);
}

#[test]
fn every_unit_and_prefix_is_described() {
    let section = page().section("Units");
    section.names_exactly("unit", unit::known().flat_map(|(names, _)| names.iter().copied()));
    for row in section.rows("unit") {
        let names = code(&row[0]);
        let (known, prefixed) = unit::known().find(|(known, _)| known.contains(&names[0].as_str())).unwrap();
        assert_eq!((names.len(), &*row[2]), (known.len(), if prefixed { "yes" } else { "no" }), "{names:?}");
    }
    section.names_exactly("prefix", unit::prefixes().map(|(name, ..)| name));
    for row in section.rows("prefix") {
        let factor: f64 = row[1].split(',').next().unwrap().parse().unwrap();
        for name in code(&row[0]) {
            let (_, over, under) = unit::prefixes().into_iter().find(|(known, ..)| *known == name).unwrap();
            assert!((factor / (over / under) - 1.0).abs() < 1e-12, "{name}");
        }
    }
}

#[test]
fn limits_are_those_of_the_code() {
    let text =
        format!("at most {MAX_TEXT} bytes, {MAX_NESTING} levels of brackets, {MAX_DEPTH} operators in a row");
    let page =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/formulas.md")).unwrap();
    assert!(page.contains(&text), "{text}");
}

/// Formulas without variables.
struct Alone;

impl Scope for Alone {
    fn symbol(&self, _: &str) -> Option<Symbol> {
        None
    }
    fn kind(&self, _: Symbol) -> Kind {
        unreachable!("there is no symbol")
    }
    fn function(&self, _: &str) -> Option<&Function> {
        None
    }
    fn names(&self) -> Vec<&str> {
        Vec::new()
    }
    fn function_names(&self) -> Vec<&str> {
        Vec::new()
    }
}

fn value(formula: &Formula) -> f64 {
    let program = Program::compile(&[Assignment { symbol: Symbol(0), formula, condition: None }]).unwrap();
    let now = Validity { from: Time::default(), to: Time::default() };
    program.evaluate::<f64>(&mut program.new_state(0, 0.0), &[], now, None).value.scalar()
}

/// Both sides of an equation of numbers are the same.
#[track_caller]
fn check_equal(example: &str, checked: &CheckedEquation) {
    let (lhs, rhs) = checked.sides.as_ref().unwrap();
    let (left, right) = (value(lhs), value(rhs));
    assert!((left - right).abs() < 1e-9, "{example}: {left} is not {right}");
}

/// The model of the page with one more relation.
#[track_caller]
fn check_relation(example: &str) {
    let model = page().blocks("yaml")[0].clone();
    let text = format!("{model}relations:\n  example: \"{example}\"\n");
    let report = load(&text, example).report.without_notes();
    let problems: Vec<_> =
        report.diagnostics.iter().filter(|problem| !problem.message.starts_with("nothing uses")).collect();
    assert!(problems.is_empty(), "{example}: {problems:?}");
}

fn examples() -> Vec<String> {
    let mut found = Vec::new();
    for (section, head) in [
        ("Operators", "operator"),
        ("Operators", "of a vector"),
        ("Words", "word"),
        ("What wraps", "what wraps"),
        ("Temperatures", "of temperatures"),
    ]
    .into_iter()
    .chain(FUNCTIONS.map(|section| (section, "function")))
    {
        for row in page().section(section).rows(head) {
            let [example] = code(row.last().unwrap()).try_into().expect("each row has an example");
            found.push(example);
        }
    }
    found.push(code("`smooth = limited(speed)`").remove(0));
    found
}

#[test]
fn every_example_is_true() {
    let mut of_numbers = 0;
    for example in examples() {
        let equation = parse_equation(&example).unwrap_or_else(|problem| panic!("{example}: {problem:?}"));
        let checked = check_equation(&equation, &Alone);
        if checked.sides.is_some() {
            assert!(checked.problems.is_empty(), "{example}: {:?}", checked.problems);
            check_equal(&example, &checked);
            of_numbers += 1;
        } else {
            check_relation(&example);
        }
    }
    assert!(of_numbers > 30, "{of_numbers}");
}

/// Each example uses what its row is about.
#[test]
fn an_example_shows_what_it_stands_beside() {
    for (section, head) in
        FUNCTIONS.map(|section| (section, "function")).into_iter().chain([("Words", "word")])
    {
        for row in page().section(section).rows(head) {
            let (name, example) = (code(&row[0]).remove(0), code(row.last().unwrap()).remove(0));
            let name = name.split('(').next().unwrap().to_owned();
            assert!(example.contains(&name), "{name}: {example}");
        }
    }
    for row in page().section("Operators").rows("operator") {
        let (name, example) = (code(&row[0]).remove(0), code(row.last().unwrap()).remove(0));
        assert!(example.contains(&name), "{name}: {example}");
    }
}

#[test]
fn models_of_the_page_load() {
    let blocks = page().blocks("yaml");
    assert_eq!(blocks.len(), 4);
    for block in &blocks[1..] {
        let report = load(block, "docs/formulas.md").report.without_notes();
        assert!(report.diagnostics.is_empty(), "{}", report.render(false));
    }
}
