//! `shsa model join` and `shsa model part`: models in pieces.

use crate::folder::Folder;

const CHASSIS: &str = "\
shsa: 1
variables: { speed: { unit: m/s }, wheel: { unit: rad/s } }
relations: { rolling: speed = wheel * 0.3 m / 1 rad }
signals: { /wheel: { variable: wheel, rate: 50 Hz } }
";

const ENGINE: &str = "\
shsa: 1
variables: { speed: { unit: m/s }, crank: { unit: rad/s } }
relations: { gears: speed = crank * 0.02 m / 1 rad }
signals: { /crank: { variable: crank, rate: 100 Hz } }
needs: { speed: }
";

fn folder() -> Folder {
    Folder::with(&[("chassis.yaml", CHASSIS.as_bytes()), ("engine.yaml", ENGINE.as_bytes())])
}

#[test]
fn parts_make_a_whole_and_a_whole_parts() {
    let folder = folder();
    folder.ends("model join chassis.yaml engine.yaml -o car.yaml", 0);
    let found = folder.json("plan car.yaml speed --all", 0);
    assert_eq!(found["substitutions"].as_array().unwrap().len(), 2);
    folder.ends("model part car.yaml gears crank -o gears.json", 0);
    let checked = folder.json("check gears.json", 0);
    assert_eq!((&checked["variables"], &checked["relations"]), (&2.into(), &1.into()));
    folder.ends("model join chassis.yaml gears.json -o again.yaml", 0);
    assert_eq!(folder.json("plan again.yaml speed --all", 0)["substitutions"].as_array().unwrap().len(), 2);
}

#[test]
fn contradictions_name_both_places() {
    let folder = folder();
    let other = ENGINE.replace("speed: { unit: m/s }", "speed: { unit: rad }");
    folder.write("engine.yaml", other.as_bytes());
    folder.refuses(
        "model join chassis.yaml engine.yaml -o car.yaml",
        &["chassis.yaml:2", "engine.yaml:2", "speed"],
    );
    assert!(!folder.names().contains(&"car.yaml".to_owned()), "something was written");
    folder.refuses("model join chassis.yaml", &["required"]);
    folder.refuses("model part chassis.yaml weel", &["nothing with the name weel"]);
}

#[test]
fn nothing_is_written_over_a_model_or_as_what_it_is_not() {
    let folder = folder();
    let is_read = "is in use by this run already";
    folder.refuses("model join chassis.yaml engine.yaml -o engine.yaml", &["engine.yaml", is_read]);
    folder.refuses("model join chassis.yaml engine.yaml -o ./chassis.yaml", &["chassis.yaml", is_read]);
    folder.refuses("model part engine.yaml speed -o engine.yaml", &["engine.yaml", is_read]);
    for ending in ["pl", "dot", "svg"] {
        let words = [&format!("as .{ending}"), "YAML or JSON", "shsa model convert"];
        folder.refuses(&format!("model part engine.yaml gears -o x.{ending}"), &words);
        folder.refuses(&format!("model join chassis.yaml engine.yaml -o x.{ending}"), &words);
    }
    let read = |name: &str| std::fs::read_to_string(folder.path(name)).unwrap();
    assert_eq!((read("chassis.yaml"), read("engine.yaml")), (CHASSIS.into(), ENGINE.into()));
    assert_eq!(folder.names().len(), 2, "{:?}", folder.names());
    folder.ends("model part engine.yaml speed -o part.yml", 0);
}

#[test]
fn quantities_under_two_names_are_proposed_and_equated() {
    let folder = Folder::with(&[
        (
            "ours.yaml",
            b"shsa: 1\nvariables: { speed: { unit: m/s }, level: { unit: m } }\n\
              signals: { /ours/speed: { variable: speed, rate: 10 Hz, value_error: 0.5 }, /level: { variable: level } }\n\
              needs: { speed: { max_age: 1 s } }\n" as &[u8],
        ),
        (
            "supplier.yaml",
            b"shsa: 1\nvariables: { velocity: { unit: km/h }, heading: { unit: deg } }\n\
              signals: { /their/velocity: { variable: velocity, rate: 10 Hz, value_error: 2 }, /compass: { variable: heading } }\n",
        ),
    ]);
    let proposed = folder.ends("model join ours.yaml supplier.yaml -o apart.yaml", 0);
    assert!(proposed.stderr.contains("--same speed=velocity"), "{}", proposed.stderr);
    assert!(!proposed.stderr.contains("heading"), "{}", proposed.stderr);
    let joined = folder.ends("model join ours.yaml supplier.yaml --same velocity=speed -o one.yaml", 0);
    assert!(!joined.stderr.contains("--same"), "{}", joined.stderr);
    let survives = |model: &str| {
        let analysed = folder.json(&format!("analyze {model}"), 0);
        analysed["needs"][0]["survives"].clone()
    };
    assert_eq!((survives("apart.yaml"), survives("one.yaml")), (0.into(), 1.into()));
    folder.refuses("model join ours.yaml supplier.yaml --same velocity=heading -o no.yaml", &["velocity"]);
    folder.refuses("model join ours.yaml supplier.yaml --same velocity -o no.yaml", &["velocity=speed"]);
}
