//! `shsa learn`: planted relations are found, fit a model as a change of it, and false friends are not proposed.

use crate::folder::Folder;
use serde_json::{Value, json};
use std::fmt::Write;

/// A power and its factors, and two temperatures that only drift alike.
pub(crate) fn power(rows: usize) -> String {
    let mut text = "t [s],volts [V],amps [A],power [W],case [degC],room [degC],sensor [V]\n".to_owned();
    let mut state = 7_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5
    };
    for row in 0..rows {
        let time = row as f64 * 0.1;
        let volts = 24.0 + 3.0 * (0.31 * time).sin() + (0.83 * time).cos();
        let amps = 15.0 + 4.0 * (0.47 * time).cos() + 2.0 * (0.19 * time).sin();
        let share = time / 200.0;
        let (case, room) =
            (20.0 + 9.0 * share + 0.3 * (0.5 * time).sin(), 5.0 + 8.0 * share + 0.3 * (0.4 * time).cos());
        let sensor = 0.4 + 0.02 * amps + 0.001 * amps * amps;
        let power = volts * amps + noise();
        writeln!(
            text,
            "{time:.1},{:.3},{:.3},{power:.2},{case:.3},{room:.3},{sensor:.4}",
            volts + 0.02 * noise(),
            amps + 0.02 * noise()
        )
        .unwrap();
    }
    text
}

fn folder() -> Folder {
    Folder::with(&[("power.csv", power(2_000).as_bytes())])
}

#[test]
fn what_follows_from_others_is_found_and_what_drifts_alike_is_not() {
    let found = folder().json("learn power.csv", 0);
    let relations = found["relations"].as_array().unwrap();
    let equations: Vec<&str> = relations.iter().map(|it| it["equation"].as_str().unwrap()).collect();
    assert!(equations.contains(&"power = volts * amps"), "{equations:?}");
    assert!(equations.iter().all(|it| !it.contains("case") && !it.contains("room")), "{equations:?}");
    let statistical: Vec<&str> = relations
        .iter()
        .filter(|it| it["statistical"] == true)
        .map(|it| it["equation"].as_str().unwrap())
        .collect();
    assert!(statistical.len() == 1 && statistical[0].starts_with("sensor = "), "{equations:?}");
    let (before, after) = (&found["before"], &found["after"]);
    assert!(
        before["detectable"].as_u64().unwrap() == 0 && after["detectable"].as_u64().unwrap() == 3,
        "{found}"
    );
}

#[test]
fn the_change_is_put_into_the_model_which_knows_it_then() {
    let folder = folder();
    folder.ends("draft power.csv -o m.yaml", 0);
    folder.ends("learn power.csv --model m.yaml --patch found.yaml -o learned.yaml", 0);
    let change = folder.read("found.yaml");
    assert!(
        change.contains("\n  power_from_volts_amps: { equation: \"power = volts * amps\", error: "),
        "{change}"
    );
    assert!(change.contains("\n  # statistical only; "), "{change}");
    folder.ends("model patch m.yaml found.yaml -o m.yaml", 0);
    assert_eq!(folder.read("learned.yaml"), folder.read("m.yaml"));
    // Without a model, the draft of the recordings gets the relations.
    folder.ends("learn power.csv -o drafted.yaml", 0);
    assert!(folder.read("drafted.yaml").contains("power_from_volts_amps"), "{}", folder.read("drafted.yaml"));
    folder.ends("check drafted.yaml", 0);
    let again = folder.json("learn power.csv --model m.yaml", 0);
    let is_known = |it: &serde_json::Value| it["equation"] == "power = volts * amps";
    assert!(!again["relations"].as_array().unwrap().iter().any(is_known), "{again}");
    let report = folder.json("replay m.yaml power.csv --inject bias=40:power@100s..", 0);
    let first = report["events"]
        .as_array()
        .unwrap()
        .iter()
        .find(|it| it["kind"] == "suspected" || it["kind"] == "failed");
    assert!(first.is_some(), "{report}");
}

#[test]
fn the_order_in_which_sessions_are_named_changes_nothing() {
    let session = |from: usize, to: usize| {
        let text = power(2_000);
        let rows: Vec<&str> = text.lines().skip(1).collect();
        let shifted = rows[from..to].iter().enumerate().map(|(at, row)| {
            let (_, values) = row.split_once(',').unwrap();
            format!("{:.1},{values}\n", at as f64 * 0.1)
        });
        format!("{}\n{}", text.lines().next().unwrap(), shifted.collect::<String>())
    };
    let (one, two) = (session(0, 800), session(800, 2_000));
    let folder = Folder::new();
    for (day, text) in [("one", one), ("two", two)] {
        std::fs::create_dir(folder.path(day)).unwrap();
        folder.write(&format!("{day}/power.csv"), text);
    }
    folder.ends("draft one two -o m.yaml", 0);
    for model in ["", " --model m.yaml"] {
        let found = ["one two", "two one"].map(|order| folder.json(&format!("learn {order}{model}"), 0));
        assert_eq!(found[0]["relations"], found[1]["relations"]);
        let is_product = |it: &Value| it["equation"] == "power = volts * amps";
        assert!(found[0]["relations"].as_array().unwrap().iter().any(is_product), "{}", found[0]);
    }
}

/// The draft of a recording, with its power as a need.
pub(crate) fn with_need(folder: &Folder, recording: &str) -> String {
    let draft = folder.ends(&format!("draft {recording}"), 0).stdout;
    let (before, _) = draft.split_once("# needs:").unwrap();
    format!(
        "{before}needs:\n  power: {{ signal: /served/power, max_age: 1 s }}\n  case: {{ max_age: 1 s }}\n"
    )
}

#[test]
fn what_serves_a_need_is_kept_and_nothing_else() {
    let folder = folder();
    folder.write("m.yaml", with_need(&folder, "power.csv"));
    let found = folder.json("learn power.csv --model m.yaml --for power --patch found.yaml", 0);
    let (need, relations) = (&found["for"], found["relations"].as_array().unwrap());
    assert_eq!(need["single_points"], serde_json::json!(["power"]), "{need}");
    assert_eq!(need["left"], serde_json::json!([]), "{need}");
    assert_eq!(relations.len(), 1, "{found}");
    assert_eq!(relations[0]["equation"], "power = volts * amps");
    folder.ends("model patch m.yaml found.yaml -o m.yaml", 0);
    let after = folder.json("analyze m.yaml", 0);
    let survives = after["needs"].as_array().unwrap().iter().find(|it| it["variable"] == "power").unwrap();
    assert_eq!(survives["single_points"], serde_json::json!([]), "{survives}");
    // Named by its publication; and a need that nothing serves.
    let text = folder.ends("learn power.csv --model m.yaml --for /served/power", 1).stdout;
    assert!(text.starts_with("/served/power (power): no single loss fails it.\n"), "{text}");
    let text = folder.ends("learn power.csv --model m.yaml --for case", 1).stdout;
    assert!(
        text.contains("(case): nothing stands in for case; no relation that was found changes this"),
        "{text}"
    );
    folder.refuses("learn power.csv --model m.yaml --for speed", &["no need `speed`", "power, case"]);
}

#[test]
fn the_answer_is_no_where_nothing_is_found() {
    let mut text = "t [s],a [m],b [V]\n".to_owned();
    for row in 0..600 {
        let time = f64::from(row);
        writeln!(text, "{time},{:.3},{:.3}", (time * 0.11).sin(), (time * 0.23).cos() + (time * 0.031).sin())
            .unwrap();
    }
    let folder = Folder::with(&[("two.csv", text.as_bytes())]);
    assert_eq!(folder.ends("learn two.csv", 1).stdout, "no relation found between 2 variables\n");
    folder.ends("learn two.csv --patch nothing.yaml", 1);
    folder.ends("draft two.csv -o model.yaml", 0);
    folder.ends("model patch model.yaml nothing.yaml -o same.yaml", 0);
    folder.ends("check same.yaml", 0);
    folder.refuses("learn absent.csv", &["absent.csv"]);
}

/// A model without relations, and three of which one says nothing new.
#[test]
fn learned_relations_are_ranked_beside_sensors() {
    let tank = "shsa: 1
variables: { level: { unit: m }, pressure: { unit: kPa }, volume: { unit: l } }
relations: { cylinder: { equation: volume = 1000 l/m * level, for: [level] } }
signals:
  /level: { variable: level, rate: 1 Hz, value_error: 5 cm }
  /pressure: { variable: pressure, rate: 1 Hz, value_error: 0.5 }
  /volume: { variable: volume, rate: 1 Hz, value_error: 2 % }
";
    let learned = "relations:
  again: { equation: level = 0.001 m/l * volume, for: [level] }
  both_ways: pressure = 9.81 kPa/m * level
  one_way: { equation: pressure = 9.81 kPa/m * level, for: [pressure] }
";
    let files = [("tank.yaml", tank.as_bytes()), ("learned.yaml", learned.as_bytes())];
    let folder = Folder::with(&files);
    let answer = folder.json("analyze tank.yaml --relations learned.yaml", 0);
    let additions = answer["additions"].as_array().unwrap();
    let given: Vec<&Value> =
        additions.iter().filter(|it| it["kind"] == "given").map(|it| &it["relation"]).collect();
    assert_eq!(given, ["both_ways", "one_way"]);
    assert_eq!(additions[0]["variables"], json!(["level", "pressure"]));
    let text = folder.ends("analyze tank.yaml --relations learned.yaml", 0).stdout;
    assert!(text.contains("both_ways: pressure = 9.81 kPa/m * level"), "{text}");
    let alone = folder.json("analyze tank.yaml", 0);
    assert_eq!((&answer["signals"], &answer["gaps"]), (&alone["signals"], &alone["gaps"]));
}
