//! Predictions by inputs that two states fit: they are no witnesses, whatever the geometry, and others are.

use proptest::prelude::*;
use shsa_core::engine::{Fuse, FusionInput};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};
use shsa_estimate::node::Nodes;
use shsa_model::load;
use std::collections::BTreeSet;
use std::fmt::Write;

type Point = (f64, f64);

/// A tag in a plane and its ranges to anchors.
fn text(anchors: &[Point], tag: Point, method: &str) -> String {
    let mut text = String::from("shsa: 1\nvariables:\n  x: { unit: m }\n  y: { unit: m }\n");
    let count = anchors.len();
    (0..count).for_each(|at| writeln!(text, "  d{at}: {{ unit: m }}").unwrap());
    text += "signals:\n";
    (0..count).for_each(|at| {
        writeln!(text, "  a{at}: {{ variable: d{at}, rate: 10 Hz, noise: 0.05, value_error: 0.3 }}").unwrap();
    });
    let (x, y) = tag;
    writeln!(
        text,
        "fusion:\n  tag:\n    method: {method}\n    states:\n      x: {{ initial: {x} m, spread: 0.5 m, transition: x + vx * dt }}\n      \
         y: {{ initial: {y} m, spread: 0.5 m, transition: y + vy * dt }}\n      vx: {{ unit: m/s, spread: 1, noise: 0.5 }}\n      \
         vy: {{ unit: m/s, spread: 1, noise: 0.5 }}\n    inputs:"
    )
    .unwrap();
    for (at, (x, y)) in anchors.iter().enumerate() {
        writeln!(text, "      a{at}: hypot(x - ({x} m), y - ({y} m))").unwrap();
    }
    text + "    outputs: { fused/x: x, fused/y: y }\n    particles: 100\nneeds: { x: {}, y: {} }\n"
}

/// The sets of inputs without which something was predicted, in a run at rest.
fn predicted(knowledge: &KnowledgeBase, anchors: &[Point], tag: Point) -> BTreeSet<Vec<usize>> {
    let mut nodes = Nodes::new(knowledge);
    let mut found = BTreeSet::new();
    let predictions = &knowledge.fusions()[0].predictions;
    for step in 0..30 {
        let at = Time(0) + Span::from_millis(100 * step);
        for (place, (x, y)) in anchors.iter().enumerate() {
            let signal = knowledge.signal(&format!("a{place}")).unwrap();
            let value = RawValue::Number((tag.0 - x).hypot(tag.1 - y));
            let observation = Observation { signal, stamp: at, received: at, value };
            let input = FusionInput {
                observation: &observation,
                is_kept: true,
                is_repeated: false,
                is_trusted: true,
            };
            nodes.observe(input, at);
        }
        nodes.settle(at);
        for output in std::iter::from_fn(|| nodes.poll()) {
            let own = predictions.iter().find(|it| it.signal == output.signal);
            found.extend(own.map(|it| it.without.clone()));
        }
    }
    found
}

/// Twice the area of a triangle, by the square of its longest side.
fn fullness([a, b, c]: [Point; 3]) -> f64 {
    let cross = (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
    let side = |p: Point, q: Point| (p.0 - q.0).hypot(p.1 - q.1);
    let longest = side(a, b).max(side(b, c)).max(side(c, a));
    cross.abs() / (longest * longest).max(1e-9)
}

fn triangles(anchors: &[Point]) -> impl Iterator<Item = [Point; 3]> + '_ {
    let count = anchors.len();
    let triples = (0..count).flat_map(move |i| (i + 1..count).map(move |j| (i, j)));
    triples.flat_map(move |(i, j)| (j + 1..count).map(move |k| [anchors[i], anchors[j], anchors[k]]))
}

fn points(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Point>> {
    prop::collection::vec((0.0..20.0_f64, 0.0..20.0_f64), count)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// What two ranges leave open is predicted by none of the methods; what three anchors off a line determine is predicted.
    #[test]
    fn two_ranges_bear_no_witness_and_three_do(
        anchors in points(3..6),
        (x, y) in (4.0..16.0_f64, 4.0..16.0_f64),
        method in prop::sample::select(&["extended_kalman", "unscented_kalman", "student"][..]),
    ) {
        prop_assume!(triangles(&anchors).all(|it| fullness(it) > 0.3));
        prop_assume!(anchors.iter().all(|(a, b)| (a - x).hypot(b - y) > 2.0));
        let loaded = load(&text(&anchors, (x, y), method), "tag.yaml");
        prop_assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        let found = predicted(&loaded.knowledge, &anchors, (x, y));
        for prediction in &loaded.knowledge.fusions()[0].predictions {
            let left = anchors.len() - prediction.without.len();
            let is_witness = found.contains(&prediction.without);
            prop_assert!(left != 2 || !is_witness, "without {:?} of {anchors:?}", prediction.without);
            prop_assert!(left < 3 || is_witness, "nothing without {:?} of {anchors:?}", prediction.without);
        }
    }

    /// Any number of anchors on a line leaves the side open.
    #[test]
    fn anchors_on_a_line_bear_no_witness_about_one_beside_it(
        along in prop::collection::btree_set(0_u8..40, 3..5),
        (x, y) in (4.0..16.0_f64, 2.0..10.0_f64),
        slope in -1.0..1.0_f64,
    ) {
        let mut anchors: Vec<Point> = along.iter().map(|it| (f64::from(*it) / 2.0, slope * f64::from(*it) / 2.0)).collect();
        let (off, line) = ((x, y + slope * x), anchors.len());
        anchors.push((x + 1.0, y + slope * x + 9.0));
        let loaded = load(&text(&anchors, off, "unscented_kalman"), "tag.yaml");
        let found = predicted(&loaded.knowledge, &anchors, off);
        prop_assert!(!found.iter().any(|without| without.contains(&line)), "{found:?}");
    }
}

/// Sums and differences have one solution: each of these inputs is predicted by the others, also where it is predicted without two.
#[test]
fn a_linear_model_loses_no_witness() {
    let text = "
shsa: 1
variables: { a: {}, b: {}, s: {}, d: {} }
signals:
  sa: { variable: a, rate: 10 Hz, noise: 0.1 }
  sb: { variable: b, rate: 10 Hz, noise: 0.1 }
  ss: { variable: s, rate: 10 Hz, noise: 0.1 }
  sd: { variable: d, rate: 10 Hz, noise: 0.1 }
fusion:
  all:
    method: kalman
    states: { a: { spread: 5, noise: 0.1 }, b: { spread: 5, noise: 0.1 } }
    inputs: { sa: a, sb: b, ss: a + b, sd: a - b }
    outputs: { fused/a: a }
needs: { a: {} }
";
    let loaded = load(text, "all.yaml");
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    let mut nodes = Nodes::new(&loaded.knowledge);
    let mut found = BTreeSet::new();
    for step in 0..30 {
        let at = Time(0) + Span::from_millis(100 * step);
        for (name, value) in [("sa", 2.0), ("sb", 1.0), ("ss", 3.0), ("sd", 1.0)] {
            let signal = loaded.knowledge.signal(name).unwrap();
            let observation = Observation { signal, stamp: at, received: at, value: RawValue::Number(value) };
            let input = FusionInput {
                observation: &observation,
                is_kept: true,
                is_repeated: false,
                is_trusted: true,
            };
            nodes.observe(input, at);
        }
        nodes.settle(at);
        found.extend(std::iter::from_fn(|| nodes.poll()).map(|it| it.signal));
    }
    let predictions = &loaded.knowledge.fusions()[0].predictions;
    assert!(predictions.iter().all(|it| found.contains(&it.signal)));
}
