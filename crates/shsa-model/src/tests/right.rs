//! Valid models and their knowledge bases.

use super::super::tree::{self, Node, Value};
use super::{EVERYTHING, brief, check, loaded, serious};
use crate::load;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, ReadingLimits, ValueError, WhenUnsure};
use shsa_core::time::Span;

fn everything() -> KnowledgeBase {
    let loaded = load(EVERYTHING, "everything.yaml");
    assert_eq!(serious(&loaded), "");
    loaded.knowledge
}

/// `name: outputs <- inputs` of each relation.
fn structure(knowledge: &KnowledgeBase) -> Vec<String> {
    let name = |id: &_| knowledge.variables()[*id].name.as_str();
    let relation = |relation: &shsa_core::knowledge::Relation| {
        let outputs: Vec<_> = relation.outputs.iter().map(name).collect();
        let inputs: Vec<_> = relation.inputs.iter().map(name).collect();
        format!("{}: {} <- {}", relation.name, outputs.join(" "), inputs.join(" "))
    };
    knowledge.relations().iter().map(relation).collect()
}

#[test]
fn every_key_is_read() {
    let knowledge = everything();
    let expected = [
        "nearest: dmin <- distances dmin",
        "shifted: dmin speed <- dmin speed wheel_base",
        "turn: speed curve_radius <- speed curve_radius lateral_acceleration",
        "travelled: dmin speed <- dmin speed slip",
        "opaque: heavy <- distances speed",
        "either: dmin heavy <- dmin speed heavy",
    ];
    assert_eq!(structure(&knowledge), expected);
    let turn = &knowledge.relations().iter().find(|relation| relation.name == "turn").unwrap();
    assert!(turn.condition.is_some() && turn.formulas.len() == 2 && turn.properties["cost"] == 2.0);
    assert_eq!(turn.text, "curve_radius = speed^2 / lateral_acceleration");
}

#[test]
fn variables_are_si() {
    let knowledge = everything();
    let variable = |name| &knowledge.variables()[knowledge.variable(name).unwrap()];
    assert_eq!(variable("speed").range, Some(Interval::new(-3.0, 3.0)));
    assert_eq!(variable("speed").max_rate, Some(12.0));
    assert_eq!(variable("curve_radius").range, Some(Interval::ENTIRE));
    assert_eq!(variable("wheel_base").constant, Some(Interval::point(2.67)));
    assert_eq!(variable("slip").constant, Some(Interval::new(0.9, 1.1)));
    assert_eq!(variable("heavy").properties["accuracy"], 0.9);
}

#[test]
fn signals_are_si_and_silent_after_five_periods() {
    let knowledge = everything();
    let signal = |name| &knowledge.signals()[knowledge.signal(name).unwrap()];
    let scan = signal("/scan");
    assert_eq!(scan.source, "scan#ranges");
    assert_eq!(scan.value_error, ValueError { lo: -0.1, hi: 0.15, relative: 0.0 });
    assert_eq!(scan.time_error, (Span::from_millis(-100), Span::ZERO));
    assert_eq!((scan.rate_hz, scan.timeout), (Some(10.0), Some(Span::from_millis(1000))));
    let odometry = signal("/odom/speed");
    assert_eq!(odometry.value_error, ValueError { lo: 0.0, hi: 0.0, relative: 0.02 });
    assert_eq!(odometry.timeout, Some(Span::from_millis(250)));
    assert_eq!(odometry.derived_from, [knowledge.signal("/scan").unwrap()]);
    assert_eq!((signal("s1").timeout, signal("s1").source.as_str()), (None, "s1"));
    assert_eq!((signal("s2").timeout, signal("s2").time_error.1), (None, Span::from_millis(5)));
}

#[test]
fn limits_of_readings_are_si_and_those_of_the_variable_where_there_are_no_own() {
    let knowledge = everything();
    let limits = |name| knowledge.signals()[knowledge.signal(name).unwrap()].limits;
    let milliseconds = |count| Some(Span::from_millis(count));
    assert_eq!(limits("/scan"), ReadingLimits { max_delay: milliseconds(50), ..ReadingLimits::default() });
    let own = limits("/odom/speed");
    assert_eq!((own.range, own.max_rate), (Some(Interval::new(-3.0, 2.0)), Some(20.0)));
    assert_eq!(own.max_delay, milliseconds(260), "the delay and the timeout");
    let of_variable = ReadingLimits { max_rate: Some(30.0), ..ReadingLimits::default() };
    assert_eq!(limits("accelerometer"), of_variable, "it has a delay, but no timeout");
    assert_eq!(limits("gyroscope"), ReadingLimits::default());
}

#[test]
fn needs_have_sound_defaults() {
    let knowledge = everything();
    let needs: Vec<_> = knowledge.needs().iter().collect();
    assert_eq!((needs[0].signal.as_str(), needs[0].integrity), ("/emergency_stop/dmin", Some('B')));
    assert_eq!((needs[0].max_age, needs[0].max_width), (Span::from_millis(250), Some(0.5)));
    let switching = needs[0].switching;
    assert_eq!((switching.hold, switching.probation), (Span::ZERO, Span::from_millis(60_000)));
    assert_eq!((switching.blend, switching.hysteresis), (Span::from_millis(10), 0.05));
    assert_eq!((needs[0].is_isolated, needs[1].is_isolated), (true, false));
    assert_eq!((needs[1].signal.as_str(), needs[1].max_age), ("/healed/speed", Span::from_millis(300)));
    assert_eq!(needs[2].max_age, Span::from_millis(1000));
}

#[test]
fn a_variable_may_have_several_needs() {
    let text = "\
shsa: 1
variables: { v: { unit: m }, w: {} }
signals:
  a: { variable: v }
  b: { variable: w }
needs:
  v:
    - { signal: /fast, min_rate: 5 Hz, max_width: 1 }
    - { signal: /last, when_unsure: last, max_width: 2 }
    - { signal: /plain }
  w: { when_unsure: hull }
";
    let knowledge = load(text, "m.yaml").knowledge;
    let needs: Vec<_> = knowledge.needs().iter().collect();
    let choices: Vec<WhenUnsure> = needs.iter().map(|need| need.when_unsure).collect();
    let usual = [WhenUnsure::Hull, WhenUnsure::Last, WhenUnsure::Unstated, WhenUnsure::Hull];
    assert_eq!(choices, usual, "the hull where a width is stated");
    assert_eq!((needs[0].min_rate_hz, needs[1].min_rate_hz), (Some(5.0), None));
    let names: Vec<&str> = knowledge.needs().ids().map(|id| knowledge.need_name(id)).collect();
    assert_eq!(names, ["/fast", "/last", "/plain", "w"]);
    assert_eq!(knowledge.needs_named("v").len(), 3);
    assert_eq!(knowledge.needs_named("/last"), [knowledge.needs().ids().nth(1).unwrap()]);
}

/// The same tree as JSON; numbers stay numbers.
fn json(node: &Node) -> String {
    let quoted = |text: &str| serde_json::to_string(text).unwrap();
    match &node.value {
        Value::Null | Value::Unread => "null".to_owned(),
        Value::Scalar(text) if serde_json::from_str::<f64>(&text.text).is_ok() => text.text.clone(),
        Value::Scalar(text) => quoted(&text.text),
        Value::List(items) => format!("[{}]", items.iter().map(json).collect::<Vec<_>>().join(",")),
        Value::Map(entries) => {
            let entry = |(key, value): &(_, Node)| format!("{}:{}", quoted(text_of(key)), json(value));
            format!("{{{}}}", entries.iter().map(entry).collect::<Vec<_>>().join(","))
        }
    }
}

fn text_of(text: &shsa_core::knowledge::Text) -> &str {
    &text.text
}

#[test]
fn json_is_the_same_tree() {
    let text = json(&tree::read(EVERYTHING).root.unwrap());
    assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok());
    let loaded = load(&text, "everything.json");
    assert_eq!(serious(&loaded), "");
    assert_eq!(format!("{:?}", loaded.knowledge), format!("{:?}", everything()));
    let pretty = serde_json::from_str::<serde_json::Value>(&text).map(|value| format!("{value:#}")).unwrap();
    assert_eq!(serious(&load(&pretty.replace("  ", "\t"), "tabs.json")), "");
}

#[test]
fn aliases_and_line_ends_of_all_kinds_are_read() {
    let text = "variables:\r\n  a: &metre { unit: m }\r\n  b: *metre\r\nrelations:\r\n  r: a = b\r\n";
    let knowledge = loaded(text).knowledge;
    assert_eq!(knowledge.variables().iter().filter(|variable| variable.unit.is_some()).count(), 2);
    check(text, "");
    check("variables: { a: }\nrelations:\n  r: >\n    a =\n    2\n", "");
}

#[test]
fn a_relation_may_be_wrong_by_its_error() {
    let with = |error: &str| {
        let text = format!(
            "variables: {{ x: {{ unit: km }}, y: {{ unit: m }} }}
relations: {{ r: {{ equation: x = y, for: x{error} }} }}"
        );
        let loaded = loaded(&text);
        assert_eq!(brief(&loaded), "");
        let relation = loaded.knowledge.relations().iter().next().cloned().unwrap();
        format!("{:?}", relation.formulas)
    };
    assert_eq!(with(", error: 0.1"), with(", error: 100 m"));
    assert_eq!(with(", error: 0.1"), with(", error: [-0.1, 100 m]"));
    assert_ne!(with(", error: 0.1"), with(""));
    assert_ne!(with(", error: 1 %"), with(""));
}

#[test]
fn what_a_broken_relation_names_may_be_providable() {
    let text = "variables: { x: , y: , z: }\nrelations: { r: x = y * q, s: z = x }\nneeds: { z: }\n";
    check(text, "3:25 error: `q` is not defined");
}

#[test]
fn readings_are_scaled_and_values_wrap() {
    let loaded = loaded(
        "variables: { x: { unit: km/h }, t: { unit: degC }, h: { unit: deg, wraps: 360, range: [-180, 180] } }
signals:
  a: { variable: x, unit: -1 m/s }
  b: { variable: x, scale: 10 %, offset: 1 m/s }
  c: { variable: t, unit: 0.1 degC, offset: -40 degC }
  d: { variable: t, scale: 0.1, offset: 5 K }
  e: { variable: x, scale: 1 }
  f: { variable: h, unit: rad }
",
    );
    let scaling = |name: &str| {
        let signal = loaded.knowledge.signals().iter().find(|signal| signal.name == name).unwrap();
        signal.scaling.map(|scaling| (scaling.scale, scaling.offset))
    };
    assert_eq!(scaling("a"), Some((-1.0, 0.0)));
    let (scale, offset) = scaling("b").unwrap();
    assert!(scale == 0.1 && (offset - 3.6).abs() < 1e-9, "{offset}");
    let (scale, offset) = scaling("c").unwrap();
    assert!(scale == 0.1 && (offset + 40.0).abs() < 1e-9, "{offset}");
    assert_eq!(scaling("d"), Some((0.1, 5.0)));
    assert_eq!(scaling("e"), None);
    let heading = loaded.knowledge.variables().iter().find(|variable| variable.name == "h").unwrap();
    let turn = heading.wraps.unwrap();
    assert!(
        (turn - core::f64::consts::TAU).abs() < 1e-12 && (heading.turn_begins() + turn / 2.0).abs() < 1e-12
    );
    // Readings of both conventions are possible.
    let range =
        loaded.knowledge.signals().iter().find(|signal| signal.name == "f").unwrap().limits.range.unwrap();
    assert!(range.contains(6.2) && range.contains(-6.2) && !range.contains(100.0));
}
