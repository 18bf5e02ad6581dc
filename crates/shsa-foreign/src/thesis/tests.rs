//! Python to formulas, and files in the form of the thesis to drafts; the files here are our own.

#[cfg(feature = "ontology")]
mod ontology;
mod python;

use super::clauses::is_prolog;
use crate::{Form, load, read};
use proptest::prelude::*;
use python::translated;
use shsa_core::knowledge::Severity;
use shsa_model::write;

/// The draft as YAML, and the problems of the loaded model, one per line.
fn taken(text: &str) -> (String, String) {
    let source = read(text, "m", None).expect("a model");
    assert_ne!(source.form, Form::Yaml, "not seen as a file of the thesis");
    let problems = load(text, "m").report.diagnostics;
    let brief = problems.iter().map(|found| {
        let severity = if found.severity == Severity::Error { "error" } else { "warning" };
        format!("{}:{} {severity}: {}", found.line, found.column, found.message)
    });
    (write::yaml(source.draft()), brief.collect::<Vec<_>>().join("\n"))
}

#[track_caller]
fn check_taken(text: &str, expected: &str, problems: &str) {
    let (found, described) = taken(text);
    assert!(found.trim() == expected.trim(), "found:\n{found}");
    assert!(described == problems.trim(), "told:\n{described}");
}

const PRESS: &str = r#"
utils: ["press.py"]
relations:
  by_area:
    force: { in: [pressure, piston_area], fct: "pressure * piston_area" }
  by_strain:
    force:
      in: [strain, stiffness]
      fct: "strain * stiffness"
      constraint: "abs(strain) < 0.01 and force >= 0"
    strain:
      in: [force, stiffness]
      fct: "force / stiffness"
  smallest:
    gap: { in: [gaps], fct: "min(gaps[1:4])" }
  tilt:
    angle: { in: [left, right, width], fct: "math.atan2(left - right, width) + math.pi / 2" }
  opaque:
    wear: { in: [force, temperature], fct: "lookup(force, temperature)" }
  both:
    wear: { in: [heat, time], fct: "" }
    heat: { in: [wear, time], fct: "" }
  bumper:
    force: { in: [strain], fct: "(strain < 2) * 5" }
properties:
  provision:
    pressure: ["/pressure", "/pressure2"]
    strain: ["/strain"]
    gaps: ["/gaps"]
    left: ["/sides"]
    right: ["/sides"]
    temperature: []
  constant: { piston_area: 0.02, stiffness: 4.0e6, width: 0.8 }
  need: { force: ["/force/safe"], angle: True, wear: 1 }
  accuracy: { pressure: 0.9, strain: 1.4 }
  cost: { by_strain: 2, opaque: 0.5 }
  description: { force: "what presses" }
provision_properties:
  "/pressure": { pubrate: 50, accuracy: 0.95 }
"#;

const PRESS_TAKEN: &str = r#"shsa: 1

variables:
  force: {}
  pressure: { properties: { accuracy: 0.9 } }
  strain: {}
  gap: {}
  gaps: { shape: vector }
  angle: {}
  left: {}
  right: {}
  wear: {}
  temperature: {}
  heat: {}
  time: {}

constants:
  piston_area: 0.02
  stiffness: 4.0e6
  width: 0.8

relations:
  by_area: { equation: force = pressure * piston_area, for: [force] }
  by_strain_force:
    equation: force = strain * stiffness
    for: [force]
    when: abs(strain) < 0.01 and force >= 0
    properties: { cost: 2 }
  by_strain_strain: { equation: strain = force / stiffness, for: [strain], properties: { cost: 2 } }
  smallest:
    equation: gap = min(gaps[1..4])
    for: [gap]
  tilt:
    equation: angle = atan2(left - right, width) / 1 rad + pi / 2
    for: [angle]
  opaque: { output: wear, inputs: [force, temperature] }
  both: { outputs: [wear, heat], inputs: [heat, time, wear] }
  bumper: { output: force, inputs: [strain] }

signals:
  /pressure: { variable: pressure, rate: 50 Hz, properties: { accuracy: 0.95 } }
  /pressure2: { variable: pressure }
  /strain: { variable: strain }
  /gaps: { variable: gaps }
  /sides: { variable: left }
  /sides_2: { variable: right, source: /sides }

needs:
  force: { signal: /force/safe }
  angle: {}
"#;

#[test]
fn the_yaml_of_the_thesis_comes_over() {
    let described = "\
2:1 warning: other files of Python are not read
6:3 warning: the directions of relation `by_strain` have formulas or inputs of their own: it becomes by_strain_force, by_strain_strain
7:5 warning: `for` names `force`, but its own `when` reads it, so the result would prove its own condition
19:45 warning: this cannot be taken over: the function `lookup` is not known here
24:34 warning: this cannot be taken over: `*` takes a number, not true or false
31:14 warning: `/sides_2` has the same source as `/sides`: it bears no witness for it
34:48 warning: this need is left out: nothing can provide `wear`
35:38 warning: this is left out: `accuracy: 1.4` makes no sense
36:33 warning: this is left out: the cost 0.5 of relation `opaque` is below 1
37:3 warning: 1 `description` value is no number and left out";
    check_taken(PRESS, PRESS_TAKEN, described);
}

#[test]
fn a_graph_of_the_thesis_comes_over() {
    let text = "\
graph:
  a: [r1, r2]
  b: [r1]
  r1: [c]
  r2: [c, a]
  c: [r2, a]
  r3: []
properties:
  type: { a: 0, b: 0, c: 0, r1: 1, r2: 1, r3: 1 }
  provided: { a: True, b: yes, c: False }
  fct: { r1: a - b }
";
    let expected = "\
shsa: 1

variables:
  c: {}
  a: {}
  b: {}

relations:
  r1: { equation: c = a - b, for: [c] }
  r2: { outputs: [c, a], inputs: [a, c] }

signals:
  /a: { variable: a }
  /b: { variable: b }
";
    let described = "\
6:11 warning: this edge joins two variables, `c` and `a`: it is left out
7:3 warning: relation `r3` feeds no variable: it is left out";
    check_taken(text, expected, described);
}

#[test]
fn wrong_yaml_of_the_thesis_is_placed() {
    let problems = |text: &str| taken(text).1;
    assert_eq!(
        problems("graph: { a: [r] }\nproperties: { type: { a: 0, b: 7 } }\n"),
        "1:10 warning: nothing uses `a`\n1:14 error: the type of `r` is missing\n2:32 error: this is no type of a node"
    );
    assert_eq!(
        problems("relations: { r: { a: 3 } }\nproperties: {}\n"),
        "1:22 error: expected what `a` is computed from"
    );
    assert_eq!(
        problems("relations: { r: { x: { in: [pi, a-b, a b] } } }\nproperties: { provided: [pi] }\n"),
        "1:29 warning: `pi` cannot be a variable's name in a formula: it becomes `pi_`\n\
         1:33 warning: `a-b` cannot be a variable's name in a formula: it becomes `a_b`\n\
         1:38 warning: `a b` cannot be a variable's name in a formula: it becomes `a_b_2`"
    );
}

const FACTS: &str = r#"% A press as facts.
:- use_module(library(shsa)).
function(force, by_area, [pressure, area]).
function(force, by_strain, [strain, stiffness]).   /* both
   ways */ function(strain, by_strain, [force, stiffness]).
function(wear, 'Wear map', [force, "oil temperature"]).
implementation(by_area, "
k = area.v  # local
force.v = pressure.v * k
force.t = pressure.t
").
implementation(by_strain, "force.v = strain.v * stiffness.v").
implementation('Wear map', "
try:
    q.pop()
except:
    pass
").
itomsOf(pressure, ["/p1", p2]).  itomOf(strain, 'it''s').
itomsOf(area, [0.02]). itomsOf(stiffness, [-3.5e6]). itomsOf(heat, []).
query(substitution(force, X)).
substitution(a, b) :- function(a, _, _).
0.5::match(a, b).
"#;

const FACTS_TAKEN: &str = "\
shsa: 1

variables:
  force: {}
  pressure: {}
  strain: {}
  wear: {}
  oil_temperature: {}
  heat: {}

constants:
  area: 0.02
  stiffness: -3.5e6

relations:
  by_area: { equation: force = pressure * area, for: [force] }
  by_strain: { equation: force = strain * stiffness, for: [force, strain] }
  Wear map: { output: wear, inputs: [force, oil_temperature] }

signals:
  /p1: { variable: pressure }
  p2: { variable: pressure }
  \"it's\": { variable: strain }
";

#[test]
fn facts_of_prolog_come_over() {
    let described = "\
2:1 warning: not taken over: 1 directive, 1 other clause, 1 query clause, 1 rule
6:37 warning: `oil temperature` cannot be a variable's name in a formula: it becomes `oil_temperature`
14:1 warning: this cannot be taken over: `try` is a statement: only formulas can be taken over
20:62 warning: nothing uses `heat`";
    check_taken(FACTS, FACTS_TAKEN, described);
}

#[test]
fn wrong_facts_are_placed() {
    #[track_caller]
    fn check(text: &str, expected: &str) {
        assert_eq!(taken(text).1, expected, "{text}");
    }
    check("function(a, r).", "1:1 error: `function` has 3 arguments, not 2");
    check("function(a, r, b).", "1:10 error: the arguments of `function` are of another kind");
    check("function(a, r, [X]).", "1:17 error: `X` is a variable of Prolog: a fact holds names only");
    check("function(a, r, [b c]).", "1:19 error: a `,` is missing before this");
    check("function(a, r, [b, f(c)]).", "1:21 error: a `,` is missing before this");
    check("function(a, r, [b]) x.", "1:21 error: something follows the fact");
    check("function(a, r, [b.\n", "1:17 error: this fact is not closed");
    check("function(a, r, [b])", "1:1 error: this clause does not end");
    check("itomOf(a, 'b).", "1:11 error: this ' is not closed");
    check("% nothing\n", "1:1 error: there is no fact of a knowledge base in this Prolog text");
    check(
        "function(a, r, [b]).\nfunction(a, r, [c]).",
        "2:13 warning: relation `r` computes `a` in another way already: this one gets a name of its own",
    );
}

#[test]
fn a_cut_or_a_choice_before_the_full_stop_is_no_part_of_it() {
    let described = "2:1 warning: not taken over: 2 rules";
    assert_eq!(taken("function(a, r, [b]).\nf(X) :- g(X), !.\nf(X) :- !;g(X).\n").1, described);
}

#[test]
fn prolog_is_distinguished_from_yaml() {
    for text in [
        "% x",
        "\u{feff} /* a */ f(x).",
        ":- dynamic f/1.",
        "function(a,r,[b]).",
        "/* open",
        "%!/usr/bin/env problog\n",
    ] {
        assert!(is_prolog(text), "{text}");
    }
    for text in
        ["", "%YAML 1.2\n---\na: b", "shsa: 1", "f(x): a", "# c", "{\"a\": 1}", "hello", "Function(a)."]
    {
        assert!(!is_prolog(text), "{text}");
    }
}

#[test]
fn many_equal_names_stay_cheap() {
    let facts: String = (0..10_000)
        .map(|at| format!("function('{}', r{at}, []).\n", "-".repeat(at % 7) + &"+".repeat(at % 11)))
        .collect();
    assert!(load(&facts, "m").report.ok());
    let needs: String = (0..20_000).map(|at| format!("n{at}: 1, ")).collect();
    let text = format!(
        "relations: {{ r: {{ x: {{ in: [a] }} }} }}\nproperties: {{ need: {{ {needs} }}, provided: [a] }}"
    );
    assert!(load(&text, "m").report.diagnostics.len() <= 20_001);
}

proptest! {
    #[test]
    fn any_text_is_read(text in "(function|implementation|itomsOf|\\(|\\)|\\[|\\]|,|\\.|\n| |a|B|'|\"|\\\\|x|:-|%|/\\*|\\*/|-|1|0'){0,60}") {
        let found = load(&format!("function(a, r, [b]).\n{text}"), "m").report;
        for problem in &found.diagnostics {
            prop_assert!(problem.source_line.get(problem.span.clone()).is_some());
        }
    }

    #[test]
    fn any_code_is_translated_or_refused(code in "(a|b|xs|y|\\.v|\\.t| |\\(|\\)|\\[|\\]|:|,|\\*\\*|\\*|-|if|else|and|not|<|=|==|%|//|1|2\\.5|min|math\\.|lambda|def f|return|\n|\"){0,40}") {
        let formula = translated(&code);
        prop_assert!(formula.len() < 25_000);
    }
}
