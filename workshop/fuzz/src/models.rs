//! Models: any text becomes a knowledge base or a report in bounded time, and a valid model can be planned.

use shsa_core::plan::{Graph, Limits, Options, best};
use shsa_foreign::thesis::prolog;
use shsa_foreign::{Form, load, read};
use shsa_model::write;

/// Shipped model files.
pub(crate) const CAR: &str = include_str!("../../../models/car.yaml");
pub(crate) const QUAD: &str = include_str!("../../../models/quad.yaml");
pub(crate) const HUSKY: &str = include_str!("../../../models/husky.yaml");
pub(crate) const ROVER: &str = include_str!("../../../models/rover.yaml");

/// A model with one of every kind of element.
const EVERYTHING: &str = "\
shsa: 1
variables:
  v: { unit: m, shape: vector }
  d: { unit: m, range: [0, 30 m], max_rate: 12 }
  s: { unit: m/s, properties: { accuracy: 0.9 } }
constants: { base: 2.67 m, slip: [0.9, 1.1] }
functions: { clamp01(x): 'min(max(x, 0), 1)' }
relations:
  near: d = min(v)
  go: { equation: d = previous(d) - s * dt * slip, for: [d], when: s > 0 m/s, error: 0.1 + 2 %, properties: { cost: 2 } }
  dark: { output: s, inputs: [v, d] }
  both: { outputs: [d, s], inputs: [d, s] }
signals:
  /v: { variable: v, source: 'a#b[0]', unit: cm, rate: 10 Hz, value_error: [-10, 15 cm], time_error: [-1 ms, 0 ms], timeout: 1 s }
  s1: { variable: s, delay: 5 ms, derived_from: [/v], timeout: none }
needs:
  d:
    - { signal: /d, max_age: 250 ms, max_width: 50 cm, integrity: B, hold: 0 s, probation: 1 min, blend: 10 ms, hysteresis: 5 %, isolation: process }
    - { signal: /d2, min_rate: 5 Hz, when_unsure: last }
  s:
utility: norm
";

/// A file of the thesis's programs.
const THESIS: &str = "\
relations:
  r: { y: { in: [a, xs], fct: 'math.sin(a) ** 2 if a > 0 else min(xs[1:3]) % 2', constraint: 'a < y <= 3' }, a: { in: [y, xs] } }
  s: { z: { in: [y], fct: 'lambda u: u // -2' } }
properties:
  provision: { a: [/a, /b], xs: [/xs] }
  constant: { c: 2 }
  need: { y: [/y], z: 1 }
  cost: { s: 2 }
provision_properties: { /a: { pubrate: 10, accuracy: 0.5 } }
";

/// The other form of the thesis's files.
const GRAPH: &str = "graph: { a: [r], r: [b], b: [r] }\nproperties: { type: { a: 0, b: 0, r: 1 }, provided: [a], fct: { r: a + 1 } }\n";

/// Facts of the thesis's programs.
const FACTS: &str = "% facts\n:- use_module(library(lists)).\nfunction(y, r, [a, 'B c']).\nfunction(a, r, [y, 'B c']).\nimplementation(r, \"\nk = a.v\ny.v = 2 * k\ny.t = a.t\\n\").\nitomsOf(a, [\"/a\", a2]).\nitomOf(c, -1.5e3).\nquery(f(X)).\n";

/// The limits of a plan.
const LIMITS: Limits = Limits { expansions: 1_000, states: 1_000 };

/// Reads the bytes as a model in every form, and writes it.
pub fn run(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    for form in [Form::Thesis, Form::Prolog] {
        converted(&text, form);
    }
    let loaded = load(&text, "m.yaml");
    for found in &loaded.report.diagnostics {
        assert!(found.source_line.get(found.span.clone()).is_some(), "no such place: {found:?}");
    }
    let shown = loaded.report.render(false);
    assert!(!shown.contains('\u{1b}'), "a control character for the terminal: {shown:?}");
    let knowledge = &loaded.knowledge;
    let graph = Graph::new(knowledge);
    for need in knowledge.needs().iter() {
        let plan = best(&graph, need.variable, &Options::default(), 4, LIMITS);
        assert!(
            plan.substitutions.is_sorted_by(|(_, one), (_, next)| one >= next),
            "{:?}",
            plan.substitutions
        );
    }
}

/// A converted model is a model of ours, and can be written as facts again.
fn converted(text: &str, form: Form) {
    let Ok(source) = read(text, "m", Some(form)) else { return };
    let written = write::yaml(source.draft());
    let loaded = source.build(text, "m");
    for found in &loaded.report.diagnostics {
        assert!(found.source_line.get(found.span.clone()).is_some(), "no such place: {found:?}");
    }
    if loaded.report.ok() {
        let again = load(&written, "m.yaml");
        assert!(again.report.ok(), "{}\n{written}", again.report.render(false));
        let facts = prolog::write(&loaded.knowledge).text;
        let again = load(&facts, "m.pl");
        let is_empty = loaded.knowledge.variables().is_empty();
        assert!(is_empty || again.report.ok(), "{}\n{facts}", again.report.render(false));
    }
}

/// The short ones of the shipped models, and the model with every kind of element.
#[must_use]
pub fn seeds() -> Vec<Vec<u8>> {
    let short = "shsa: 1\nvariables: { x: { unit: m }, y: }\nrelations: { r: y = x * 2 }\nsignals: { s: { variable: x } }\nneeds: { y: }\n";
    let json = "{\"shsa\": 1, \"variables\": {\"x\": {\"unit\": \"m\"}}, \"signals\": {\"s\": {\"variable\": \"x\"}}, \"needs\": {\"x\": {}}}";
    let yaml = "shsa: 1\nvariables: &all\n  ? x\n  : &one { unit: \"\\u006d\", <<: *one }\n  y: |\n    text\n  z: >-\n    !!str m\n";
    [EVERYTHING, short, json, yaml, CAR, ROVER, THESIS, GRAPH, FACTS]
        .iter()
        .map(|text| text.as_bytes().to_vec())
        .collect()
}
