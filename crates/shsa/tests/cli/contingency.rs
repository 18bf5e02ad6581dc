//! `shsa plan --contingency`: the substitutes for lost signals.

use crate::folder::{Folder, keys};
use crate::tank;
use serde_json::{Value, json};

/// A pump's speed gives the flow, and so does its power; but the power is itself derived from the speed.
const MODEL: &str = "\
shsa: 1
variables: { flow: {}, speed: {}, power: {}, valve: {} }
relations:
  pump:  { output: flow, inputs: [speed], properties: { cost: 2 } }
  motor: { output: speed, inputs: [power] }
signals:
  meter: { variable: flow }
  speed: { variable: speed }
  power: { variable: power, derived_from: [speed] }
  valve: { variable: valve }
needs:
  flow:  { signal: /flow }
  valve: { signal: /valve }
";

fn folder() -> Folder {
    Folder::with(&[("m.yaml", MODEL.as_bytes()), ("tank.yaml", tank::MODEL.as_bytes())])
}

fn of(answer: &Value, at: usize) -> Vec<(String, Value, Value)> {
    let losses = answer["variables"][at]["losses"].as_array().unwrap();
    let row = |loss: &Value| {
        let lost: Vec<&str> =
            loss["lost"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
        (lost.join("+"), loss["takes_over"]["relations"].clone(), loss["takes_over"]["signals"].clone())
    };
    losses.iter().map(row).collect()
}

#[test]
fn what_takes_over_as_json() {
    let folder = folder();
    let answer = folder.json("plan m.yaml --contingency", 0);
    assert_eq!(keys(&answer), ["pairs", "searches", "variables", "needs"]);
    let flow = &answer["variables"][0];
    let expected = ["variable", "needed_as", "now", "losses", "unhealed", "complete"];
    assert_eq!(keys(flow), expected);
    assert_eq!(keys(&flow["losses"][0]), ["lost", "with_them", "takes_over", "change"]);
    assert_eq!((&flow["variable"], &flow["needed_as"]), (&json!("flow"), &json!(["/flow"])));
    assert_eq!(flow["now"]["signals"], json!(["meter"]));
    assert_eq!((&flow["complete"], &flow["unhealed"]), (&json!(true), &json!([])));
    assert_eq!(
        of(&answer, 0),
        [("meter".into(), json!(["pump"]), json!(["speed"])), ("speed".into(), json!([]), json!(["meter"]))]
    );
    assert_eq!(of(&answer, 1), [("valve".into(), Value::Null, Value::Null)]);
    assert_eq!(answer["variables"][1]["unhealed"], json!([["valve"]]));
}

/// The answer equals that of the search without the signal.
#[test]
fn it_agrees_with_the_search() {
    let folder = folder();
    let answer = folder.json("plan tank.yaml --contingency", 0);
    for loss in answer["variables"][0]["losses"].as_array().unwrap() {
        let lost = loss["lost"][0].as_str().unwrap();
        let searched = folder.json(&format!("plan tank.yaml level --exclude {lost}"), 0);
        assert_eq!(loss["takes_over"], searched["substitutions"][0], "{lost}");
    }
}

#[test]
fn a_pair_that_nothing_heals() {
    let answer = folder().json("plan m.yaml flow --contingency --pairs", 0);
    let found: Vec<String> = of(&answer, 0).into_iter().map(|(lost, ..)| lost).collect();
    assert_eq!(found, ["meter", "speed", "meter+speed"]);
    assert_eq!(answer["variables"][0]["unhealed"], json!([["meter", "speed"]]), "power is lost with speed");
}

#[test]
fn text_is_a_table_a_variable() {
    let output = folder().ends("plan m.yaml --contingency", 0).stdout;
    let expected = "\
flow: now (its own signal) from meter, utility 1.000000
lost   takes over  from   utility   change
meter  pump        speed  0.821429  -18 %
no difference alone: speed

valve: now (its own signal) from valve, utility 1.000000
lost   takes over  from  utility  change
valve  nothing

nothing heals the loss of  needed for
valve                      valve
";
    assert_eq!(output, expected);
    let output = folder().ends("plan tank.yaml --contingency", 0).stdout;
    assert!(output.ends_with("\n\nevery loss of one signal is healed\n"), "{output}");
}

#[test]
fn what_cannot_be_asked() {
    let folder = folder();
    folder.refuses("plan m.yaml", &["<VARIABLE>"]);
    folder.refuses("plan m.yaml flow --pairs", &["--contingency"]);
    folder.refuses("plan m.yaml flow --contingency --all", &["cannot be used with"]);
    folder.refuses("plan m.yaml flw --contingency", &["did you mean 'flow'?"]);
    folder.write("bare.yaml", "shsa: 1\nvariables: { a: {} }\n");
    folder.refuses("plan bare.yaml --contingency", &["no needs", "name a variable"]);
    let output = folder.ends("plan bare.yaml a --contingency", 0).stdout;
    assert!(output.starts_with("a: nothing can provide it now\n"), "{output}");
}

/// What serves the first need when each piece of evidence fails: its source and level, or `-`.
fn after_failures(answer: &Value) -> Vec<String> {
    let served = |it: &Value| match it["source"].as_str() {
        Some(source) => format!("{source}, {} ({})", it["level"], it["admitted"].as_str().unwrap()),
        None => "-".to_owned(),
    };
    let row = |it: &Value| format!("{} of {}: {}", it["evidence"], it["of"], served(&it["then"]));
    let need = &answer["needs"][0];
    let rows = need["evidence"].as_array().unwrap().iter().map(row).map(|row| row.replace('"', ""));
    std::iter::once(format!("now: {}", served(&need["now"]).replace('"', ""))).chain(rows).collect()
}

#[test]
fn what_contracts_do_not_admit_takes_nothing_over() {
    let folder = Folder::with(&[("stop.yaml", include_bytes!("../../../../models/stop.yaml").as_slice())]);
    let answer = folder.json("plan stop.yaml --contingency", 0);
    let lost: Vec<(String, Value)> = of(&answer, 0).into_iter().map(|(lost, by, _)| (lost, by)).collect();
    let expected = [
        ("/lidar/nearest", json!(["together"])),
        ("/sonar/nearest", json!([])),
        ("/camera/nearest", json!([])),
        // It serves nobody, but evidence of the platform is about it.
        ("/computer/idle", Value::Null),
    ];
    assert_eq!(lost, expected.map(|(lost, by)| (lost.to_owned(), by)));
    // Without contracts the sonar alone would take over.
    let bare = include_str!("../../../../models/stop.yaml").split_once("platform:").unwrap().0;
    folder.write("bare.yaml", bare);
    let bare = folder.json("plan bare.yaml --contingency", 0);
    assert_eq!((&of(&bare, 0)[0].1, &bare["needs"]), (&json!(["by_sonar"]), &json!([])));
}

#[test]
fn what_each_piece_of_evidence_would_take_away() {
    let model = include_str!("../../../../models/stop.yaml");
    let folder = Folder::with(&[("stop.yaml", model.as_bytes())]);
    let lidar = "/lidar/nearest, SIL 2 (met)";
    let both = "/sonar/nearest, /camera/nearest by together, SIL 2 (met)";
    let expected = |without_computer: &str| {
        vec![
            format!("now: {lidar}"),
            format!("spare of computer: {without_computer}"),
            format!("fresh of /lidar/nearest: {both}"),
            format!("sound of /lidar/nearest: {both}"),
            format!("fresh of /sonar/nearest: {lidar}"),
            format!("sound of /sonar/nearest: {lidar}"),
            format!("fresh of /camera/nearest: {lidar}"),
            format!("sound of /camera/nearest: {lidar}"),
        ]
    };
    let under = |policy: &str| {
        folder.write("policy.yaml", format!("{model}    policy: {policy}\n"));
        after_failures(&folder.json("plan policy.yaml --contingency", 0))
    };
    assert_eq!(after_failures(&folder.json("plan stop.yaml --contingency", 0)), expected("-"));
    assert_eq!(under("warn"), expected("/lidar/nearest, SIL 2 (warned)"));
    assert_eq!(under("degrade"), expected("/lidar/nearest, SIL 2 (degraded)"));
    let output = folder.ends("plan stop.yaml dmin --contingency", 0).stdout;
    let expected = "
dmin by contract: now /lidar/nearest, SIL 2
evidence that fails      serves then                                  level
spare of computer        nothing
fresh of /lidar/nearest  /sonar/nearest, /camera/nearest by together  SIL 2
";
    assert!(output.contains(expected), "{output}");
}

/// A variable with two stand-ins: the values of one are wide, those of the other old.
const STAND_INS: &str = "\
shsa: 1
variables: { x: { unit: m }, y: { unit: m }, z: { unit: m } }
relations: { near: x = y + 1 m, far: x = z + 2 m }
signals:
  own: { variable: x, rate: 10 Hz, value_error: 0.1 }
  wide: { variable: y, rate: 20 Hz, value_error: 1 }
  old: { variable: z, rate: 10 Hz, value_error: 0.1, delay: 500 ms, properties: { integrity: B } }
needs:
  x: { max_age: 300 ms, max_width: 1 }
  z: { max_age: 2 s }
";

#[test]
fn what_takes_over_meets_the_requirements() {
    let folder = Folder::with(&[("m.yaml", STAND_INS.as_bytes())]);
    let ways = |flags: &str| {
        let answer = folder.json(&format!("plan m.yaml x --contingency {flags}"), 0);
        let losses = of(&answer, 0).into_iter().find(|(lost, ..)| lost == "own");
        (answer["variables"][0]["now"]["signals"].clone(), losses.map(|(_, relations, _)| relations))
    };
    let (own, nothing) = (json!(["own"]), Some(Value::Null));
    assert_eq!(ways(""), (own.clone(), Some(json!(["near"]))));
    assert_eq!(ways("--max-width 1"), (own.clone(), Some(json!(["far"]))));
    assert_eq!(ways("--max-latency 300ms"), (own.clone(), Some(json!(["near"]))));
    assert_eq!(ways("--exclude-relation near"), (own.clone(), Some(json!(["far"]))));
    assert_eq!(ways("--for-need"), (own.clone(), nothing.clone()));
    assert_eq!(ways("--independent-of wide --max-latency 300ms"), (own, nothing));
    assert_eq!(ways("--integrity B"), (json!(["old"]), None), "its own signal falls short already");
    assert_eq!(ways("--min-rate 15"), (json!(["wide"]), None));
    // Each need gets its own answer.
    let answer = folder.json("plan m.yaml --contingency --for-need", 0);
    let unhealed: Vec<&Value> =
        answer["variables"].as_array().unwrap().iter().map(|it| &it["unhealed"]).collect();
    assert_eq!(unhealed, [&json!([["own"]]), &json!([])]);
    folder.refuses("plan m.yaml y --contingency --for-need", &["no need of 'y'"]);
}

#[test]
fn what_it_does_not_look_at_is_refused() {
    for flag in ["--why", "--threads 2", "--engine dfs"] {
        folder().refuses(&format!("plan m.yaml flow --contingency {flag}"), &["cannot be used with"]);
    }
}
