//! Knowledge bases as graphs: everything is there once, marks are seen, names cannot break out.

use crate::bases::{Dice, layered, model, read, substitution};
use crate::keep;
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::drawing::{Marks, dot, svg};
use std::time::Instant;

/// Draws a knowledge base and checks that all of it is there.
#[track_caller]
fn check(name: &str, knowledge: &KnowledgeBase, marks: &Marks) -> crate::xml::Element {
    let text = svg(knowledge, marks).unwrap();
    assert_eq!(text, svg(knowledge, marks).unwrap());
    let root = keep(name, &text);
    let tooltips = root.texts("title");
    let told = |what: &str, name: &str| {
        let first = format!("{what} {name}");
        tooltips.iter().filter(|title| title.lines().next() == Some(&first)).count()
    };
    for variable in knowledge.variables() {
        assert_eq!(told("variable", &variable.name), 1, "{}", variable.name);
    }
    for relation in knowledge.relations() {
        assert_eq!(told("relation", &relation.name), 1, "{}", relation.name);
    }
    root
}

#[test]
fn the_models_of_this_project() {
    for name in ["rover", "car", "husky", "quad", "motes"] {
        let knowledge = model(&format!("{name}.yaml"));
        check(&format!("{name}.svg"), &knowledge, &Marks::default());
        std::fs::write(
            std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("drawings/{name}.dot")),
            dot(&knowledge, &Marks::default()),
        )
        .unwrap();
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

#[test]
fn hostile_names_stay_names() {
    let names = ["</svg><script>alert(1)</script>", "a\\\"];}<b>&amp;", "line\nbreak\u{202e}", "]]>--><!--"];
    let mut text = "{\"shsa\": 1, \"variables\": {\"out\": {}".to_owned();
    for name in names {
        text += &format!(", {}: {{}}", serde_json::to_string(name).unwrap());
    }
    text += "}, \"signals\": {";
    let signals = names.map(|name| {
        let name = serde_json::to_string(name).unwrap();
        format!("{name}: {{\"variable\": {name}}}")
    });
    text += &signals.join(", ");
    text += "}}";
    let loaded = shsa_format::model::load(&text, "hostile");
    // The checks may refuse such names; what they let pass is drawn.
    let knowledge = loaded.knowledge;
    let root = keep("hostile.svg", &svg(&knowledge, &Marks::default()).unwrap());
    assert!(root.all().iter().all(|element| element.name != "script"));
}

#[test]
fn what_is_too_large_is_refused_with_help() {
    let knowledge = layered(1_600, &mut Dice(9));
    let error = svg(&knowledge, &Marks::default()).unwrap_err();
    let expected = format!(
        "a drawing of {} variables and relations is beyond the limit of 2000: write DOT, and let Graphviz draw it (`sfdp -Tsvg`)",
        error.count
    );
    assert_eq!(error.to_string(), expected);
    assert!(dot(&knowledge, &Marks::default()).lines().count() > error.count);
}

#[test]
fn an_empty_knowledge_base_is_an_empty_drawing() {
    keep("nothing.svg", &svg(&KnowledgeBase::default(), &Marks::default()).unwrap());
}
