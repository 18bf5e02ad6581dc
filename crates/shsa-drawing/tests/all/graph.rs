//! Knowledge bases as graphs: every element is drawn once, marks are visible, names cannot break out.

use super::bases::{Dice, layered, model, read, substitution};
use super::keep;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{
    Id, IdVec, KnowledgeBase, Need, Properties, Relation, RelationId, Shape, Signal, Switching, Variable,
    VariableId, WhenUnsure,
};
use shsa_core::substitution::Substitution;
use shsa_core::time::Span;
use shsa_drawing::{Marks, dot, svg};
use std::time::Instant;

/// Draws a knowledge base and checks that all of it is there.
#[track_caller]
fn check(name: &str, knowledge: &KnowledgeBase, marks: &Marks) -> super::xml::Element {
    let text = svg(knowledge, marks).unwrap();
    assert_eq!(text, svg(knowledge, marks).unwrap());
    let root = keep(name, &text);
    let tooltips = root.texts("title");
    let reported = |what: &str, name: &str| {
        let first = format!("{what} {name}");
        tooltips.iter().filter(|title| title.lines().next() == Some(&first)).count()
    };
    for variable in knowledge.variables() {
        assert_eq!(reported("variable", &variable.name), 1, "{}", variable.name);
    }
    for relation in knowledge.relations() {
        assert_eq!(reported("relation", &relation.name), 1, "{}", relation.name);
    }
    root
}

#[test]
fn the_models_of_this_project() {
    for name in ["rover", "car", "husky", "quad", "motes", "turtlebot", "cell"] {
        let knowledge = model(&format!("{name}.yaml"));
        check(&format!("{name}.svg"), &knowledge, &Marks::default());
    }
}

#[test]
fn what_is_chosen_and_lost_stands_out() {
    let rover = model("rover.yaml");
    let chosen = substitution(&rover, "v_dmin", &[("v_dmin", "nearest"), ("v_2D", "row")]);
    let lost = ["/lidar/scan", "/sonar/ranges"].map(|name| rover.signal(name).unwrap());
    let marks = Marks { chosen: Some(chosen), lost: lost.into_iter().collect() };
    let root = check("rover-chosen.svg", &rover, &marks);
    let description = root.texts("desc");
    assert_eq!(
        description,
        ["Knowledge base with 4 variables, 3 relations, 4 signals, 1 need. Chosen: v_dmin by row, nearest. \
          Lost: /lidar/scan, /sonar/ranges."]
    );
    // Two signals and the sign of the legend.
    assert_eq!(root.count("shsa-lost"), 3);
    // Three variables, two relations, four links, the signal at the source, and the sign of the legend.
    assert_eq!(root.count("shsa-chosen"), 3 + 2 + 4 + 1 + 1);
    assert_eq!(root.count("shsa-chosen-text"), 2 + 1);
}

#[test]
fn generated_bases_of_many_sizes() {
    for (variables, seed) in [(12, 1), (30, 2), (60, 3), (120, 4), (570, 5)] {
        let knowledge = layered(variables, &mut Dice(seed));
        let begun = Instant::now();
        check(&format!("layered-{variables}.svg"), &knowledge, &Marks::default());
        assert!(begun.elapsed().as_secs() < 20, "{variables}: {:?}", begun.elapsed());
    }
}

#[test]
fn several_directions_constants_and_structure() {
    let knowledge = read(
        "shsa: 1
variables:
  speed: { unit: km/h, range: [0, 250] }
  yaw_rate: { unit: deg/s }
  curve_radius: { unit: m }
  lateral_acceleration: { unit: m/s^2 }
  steering_angle: { unit: deg }
  weather: {}
  a_variable_with_a_very_long_name_that_nobody_would_want_to_read_in_full: { unit: m }
constants:
  wheel_base: 2.67 m
relations:
  turn: lateral_acceleration = speed^2 / curve_radius
  yaw: yaw_rate = speed / curve_radius
  ackermann: steering_angle = atan(wheel_base / curve_radius)
  guess: { output: weather, inputs: [speed, lateral_acceleration] }
signals:
  /imu/yaw: { variable: yaw_rate }
  /imu/acc: { variable: lateral_acceleration, value_error: 0.2, rate: 100 Hz }
  /wheel/1: { variable: speed }
  /wheel/2: { variable: speed }
  /wheel/3: { variable: speed }
  /wheel/4: { variable: speed }
  /gps: { variable: speed }
  /radar: { variable: speed }
  /camera: { variable: speed }
  /lidar: { variable: speed }
needs:
  steering_angle: { signal: /steer }
",
    );
    let chosen = substitution(
        &knowledge,
        "steering_angle",
        &[("steering_angle", "ackermann"), ("curve_radius", "turn")],
    );
    let lost = [knowledge.signal("/radar").unwrap()].into_iter().collect();
    let root = check("car-turn.svg", &knowledge, &Marks { chosen: Some(chosen), lost });
    let texts = root.texts("text");
    for text in ["= 2.67 m", "and 2 more", "/radar", "usable in both directions", "/steer"] {
        assert!(texts.contains(&text), "{text} is not in {texts:?}");
    }
    assert!(root.texts("title").contains(&"variable speed\nunit: km/h\nrange: [0, 250] km/h\nsignals: /wheel/1, /wheel/2, /wheel/3, /wheel/4, /gps, /radar, /camera, /lidar"));
}

/// Names that would break out of an attribute, an element, a quoted text, a line or a statement.
const HOSTILE: [&str; 6] = [
    "</svg><script>alert(1)</script>",
    "\"/><x onload=\"",
    "a\\\"];}<b>&amp;",
    "line\nbreak\u{202e}\u{0}",
    "]]>--><!--",
    "v0\\",
];

/// A knowledge base whose every name is hostile, as only a program could make it.
fn hostile() -> KnowledgeBase {
    let (mut variables, mut relations, mut signals) = (IdVec::new(), IdVec::new(), IdVec::new());
    for name in HOSTILE {
        let name = name.to_owned();
        let (shape, properties) = (Shape::Scalar, [(name.clone(), f64::NAN)].into());
        let variable = Variable {
            name: name.clone(),
            unit: None,
            shape,
            range: Some(Interval::ENTIRE),
            max_rate: None,
            wraps: None,
            constant: None,
            properties,
        };
        let variable = variables.push(variable);
        signals.push(Signal {
            source: name.clone(),
            rate_hz: Some(f64::INFINITY),
            ..Signal::new(name.clone(), variable)
        });
        relations.push(Relation {
            name: name.clone(),
            inputs: vec![VariableId::from_index(0), variable],
            outputs: vec![VariableId::from_index(0), variable],
            formulas: Vec::new(),
            condition: None,
            text: name,
            properties: Properties::new(),
        });
    }
    let need = Need {
        variable: VariableId::from_index(0),
        signal: HOSTILE[0].to_owned(),
        max_age: Span::ZERO,
        max_width: None,
        integrity: None,
        min_rate_hz: None,
        when_unsure: WhenUnsure::Withhold,
        switching: Switching::default(),
        is_isolated: false,
    };
    let mut needs = IdVec::new();
    needs.push(need);
    KnowledgeBase::from_parts(variables, relations, signals, needs)
}

#[test]
fn hostile_names_stay_names() {
    let knowledge = hostile();
    let marks = Marks { chosen: None, lost: knowledge.signals().ids().collect() };
    let root = keep("hostile.svg", &svg(&knowledge, &marks).unwrap());
    assert!(root.all().iter().all(|element| element.name != "script" && element.name != "x"));
    let titles = root.texts("title");
    assert!(titles.iter().any(|title| title.starts_with("variable </svg><script>alert(1)</script>")));
    check_dot(&dot(&knowledge, &marks), &knowledge);
}

/// Checks a text in DOT: one statement a line, quotes closed, every end of an edge declared.
#[track_caller]
fn check_dot(text: &str, knowledge: &KnowledgeBase) {
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("digraph knowledge {"));
    assert_eq!(lines.next_back(), Some("}"));
    let (mut nodes, mut edges) = (Vec::new(), 0);
    for line in lines {
        let bare = without_quoted(line.trim());
        let statement = bare.strip_suffix("];").unwrap_or_else(|| panic!("{line}"));
        let (subject, attributes) = statement.split_once(" [").unwrap_or_else(|| panic!("{line}"));
        assert!(attributes.split(", ").all(|attribute| attribute.split_once('=').is_some()), "{line}");
        match subject.split_once(" -> ") {
            Some((from, to)) => {
                assert!(nodes.contains(&from.to_owned()) && nodes.contains(&to.to_owned()), "{line}");
                edges += 1;
            }
            None => nodes.push(subject.to_owned()),
        }
    }
    let links: usize = knowledge.relations().iter().map(links_of).sum();
    let (variables, relations) = (knowledge.variables().len(), knowledge.relations().len());
    let attached = knowledge.signals().len() + knowledge.needs().len();
    // `graph`, `node` and `edge` say what holds for all.
    assert_eq!(nodes.len(), 3 + variables + relations + attached);
    assert_eq!(edges, links + attached);
}

fn links_of(relation: &Relation) -> usize {
    relation.inputs.iter().chain(&relation.outputs).collect::<std::collections::BTreeSet<_>>().len()
}

/// A line with each quoted text replaced by `""`.
#[track_caller]
fn without_quoted(line: &str) -> String {
    let (mut bare, mut quoted, mut chars) = (String::new(), false, line.chars());
    while let Some(char) = chars.next() {
        match char {
            '"' => {
                quoted = !quoted;
                bare.push('"');
            }
            '\\' if quoted => drop(chars.next()),
            char if !quoted => bare.push(char),
            _ => {}
        }
    }
    assert!(!quoted, "a quote is open: {line}");
    bare
}

#[test]
fn graphs_for_graphviz_are_whole() {
    for name in ["rover", "car", "husky", "quad", "motes", "turtlebot", "cell"] {
        let knowledge = model(&format!("{name}.yaml"));
        check_dot(&dot(&knowledge, &Marks::default()), &knowledge);
    }
    let knowledge = layered(200, &mut Dice(3));
    let text = dot(&knowledge, &Marks::default());
    check_dot(&text, &knowledge);
    assert!(text.contains("dir=both"));
}

#[test]
fn a_very_large_base_is_soon_a_graph_for_graphviz() {
    let relations = 100_000;
    let knowledge = structure(relations, (1..relations).map(|at| (at, vec![at / 2, at - 1])));
    let need = |at: usize| Need {
        variable: VariableId::from_index(at * 7),
        signal: format!("/need/{at}"),
        max_age: Span::ZERO,
        max_width: None,
        integrity: None,
        min_rate_hz: None,
        when_unsure: WhenUnsure::Withhold,
        switching: Switching::default(),
        is_isolated: false,
    };
    let mut needs = IdVec::new();
    for at in 0..10_000 {
        needs.push(need(at));
    }
    let (variables, relations) = (knowledge.variables().clone(), knowledge.relations().clone());
    let knowledge = KnowledgeBase::from_parts(variables, relations, IdVec::new(), needs);
    let chosen = (1..50_000).map(|at| (VariableId::from_index(at), RelationId::from_index(at - 1))).collect();
    let chosen = Substitution::from_choice(&knowledge, VariableId::from_index(49_999), &chosen);
    let begun = Instant::now();
    let text = dot(&knowledge, &Marks { chosen, ..Marks::default() });
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
    assert_eq!(text.matches("shape=cds").count(), 10_000);
    assert!(text.contains("label=\"49999: r49998\""));
}

#[test]
fn what_is_chosen_is_bold_for_graphviz_too() {
    let rover = model("rover.yaml");
    let chosen = substitution(&rover, "v_dmin", &[("v_dmin", "nearest"), ("v_2D", "row")]);
    let lost = [rover.signal("/lidar/scan").unwrap()].into_iter().collect();
    let text = dot(&rover, &Marks { chosen: Some(chosen), lost });
    check_dot(&text, &rover);
    // Three variables, two relations, four links.
    assert_eq!(text.matches("penwidth=3").count(), 9);
    assert!(text.contains("label=\"2: nearest\"") && text.contains("label=\"lost: /lidar/scan\""));
}

/// Structure only: each relation gives one variable from some.
fn structure(variables: usize, relations: impl Iterator<Item = (usize, Vec<usize>)>) -> KnowledgeBase {
    let id = |at: &usize| VariableId::from_index(*at);
    let variable = |id: VariableId| Variable {
        name: format!("v{}", id.index()),
        unit: None,
        shape: Shape::Scalar,
        range: None,
        max_rate: None,
        wraps: None,
        constant: None,
        properties: Properties::new(),
    };
    let mut all = IdVec::new();
    for (output, inputs) in relations {
        all.push(Relation {
            name: format!("r{}", all.len()),
            inputs: inputs.iter().map(id).collect(),
            outputs: vec![id(&output)],
            formulas: Vec::new(),
            condition: None,
            text: String::new(),
            properties: Properties::new(),
        });
    }
    KnowledgeBase::from_parts(IdVec::filled(variables, variable), all, IdVec::new(), IdVec::new())
}

#[test]
fn extreme_graphs_are_drawn_or_refused_soon() {
    let begun = Instant::now();
    let complete = structure(
        140,
        (0..70).map(|relation| (relation + 70, (0..100).filter(|v| *v != relation + 70).collect())),
    );
    let chain = structure(1_000, (1..1_000).map(|at| (at, vec![at - 1])));
    let ladder = structure(900, (1..900).map(|at| (at, vec![at - 1, at / 2])));
    let ring = structure(900, (0..900).map(|at| (at, vec![(at + 1) % 900, (at + 451) % 900])));
    let star = structure(1_900, std::iter::once((0, (1..1_900).collect())));
    for (name, knowledge) in [("complete", complete), ("chain", chain), ("ring", ring), ("star", star)] {
        check(&format!("{name}.svg"), &knowledge, &Marks::default());
    }
    let error = svg(&ladder, &Marks::default()).unwrap_err();
    assert_eq!((error.what, error.most), ("bends in its links", 20_000));
    assert!(begun.elapsed().as_secs() < 60, "{:?}", begun.elapsed());
}

#[test]
fn what_is_too_large_is_refused_with_help() {
    let knowledge = layered(1_600, &mut Dice(9));
    let error = svg(&knowledge, &Marks::default()).unwrap_err();
    let expected = format!(
        "a drawing with {} variables and relations is beyond the limit of 2000: write DOT, and let Graphviz draw it (`sfdp -Tsvg`)",
        error.count
    );
    assert_eq!(error.to_string(), expected);
    assert!(dot(&knowledge, &Marks::default()).lines().count() > error.count);
}

#[test]
fn an_empty_knowledge_base_is_an_empty_drawing() {
    keep("nothing.svg", &svg(&KnowledgeBase::default(), &Marks::default()).unwrap());
}
