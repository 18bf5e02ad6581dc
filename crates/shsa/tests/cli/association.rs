//! `shsa service --associate`: the association of tracks, over standard input and output.

use crate::folder::Folder;
use crate::service::Service;
use serde_json::{Value, json};

/// The file of the reference, as it stands there.
fn reference() -> String {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/association.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, rest) = page.split_once("```yaml\n").unwrap();
    rest.split_once("```").unwrap().0.to_owned()
}

/// The payloads of a topic, in order.
fn of<'a>(lines: &'a [Value], topic: &str) -> Vec<&'a Value> {
    lines.iter().filter(|line| line["topic"] == topic).map(|line| &line["payload"]).collect()
}

#[test]
fn tracks_of_two_radars_and_of_a_vehicle_are_associated() {
    let folder = Folder::new();
    std::fs::write(folder.path("border.yaml"), reference()).unwrap();
    let file = folder.path("border.yaml");
    let mut service = Service::start(&["--associate", file.to_str().unwrap(), "--stats", "1 h"]);
    let objects = json!([
        { "pose": { "x": 114.0, "y": 2.0 }, "v": { "x": 20, "y": 0 } },
        { "pose": { "x": 146.0, "y": 2.0 }, "v": { "x": 20, "y": 0 } },
    ]);
    service.say("/radar/1/tracks", json!({ "stamp": 10.0, "objects": objects }), 10.0);
    service.say("/vehicles", json!({ "t": 10.0, "id": 7, "x": 146.5, "y": 2.0, "speed": 20 }), 10.0);
    // 0.1 s later all is 2 m further. What a vehicle says starts no association.
    let entering = json!({ "t": 10.1, "x": [148.25, 260.0], "y": [2.5, 2.0], "speed": [20, 20] });
    service.say("/radar/2/tracks", entering, 10.1);
    service.say("/radar/2/tracks", json!({ "t": 10.2, "x": [1], "y": [], "speed": [1] }), 10.2);
    service.say("/radar/2/tracks", json!({ "t": 10.2, "x": [], "y": [], "speed": [] }), 10.2);
    let (said, status, errors) = service.end();
    assert_eq!(status, 0, "{errors}");
    assert!(
        errors.contains("unreadable 1, the last one: /radar/2/tracks: y has 0 values and not 1"),
        "{errors}"
    );
    assert_eq!(of(&said, "/radar/2/entering/x"), [&json!(148.25)]);
    assert_eq!(of(&said, "/radar/2/entering/y"), [&json!(2.5)]);
    assert_eq!(of(&said, "/radar/2/entering/count"), [&json!(1), &json!(0.5)]);
    // The blind radar is not silent, and the others go on.
    assert_eq!(of(&said, "/radar/1/leaving/x"), [&json!(146), &json!(148), &json!(150)]);
    assert_eq!(of(&said, "/radar/1/leaving/count"), [&json!(1), &json!(1), &json!(1)]);
    assert_eq!(of(&said, "/vehicles/1/x"), [&json!(148.5), &json!(150.5)]);
    let objects = of(&said, "/border/1/vehicles");
    let tracks: Vec<&Value> = objects.iter().map(|object| &object["tracks"]).collect();
    assert_eq!(tracks[0], &json!({ "entering": [null, null], "leaving": [0, 1], "told": [null, null] }));
    assert_eq!(tracks[1], &json!({ "entering": [0, null], "leaving": [1, 0], "told": [0, null] }));
    assert_eq!(tracks[2], &json!({ "entering": [null, null], "leaving": [0, 1], "told": [null, 0] }));
    let chosen: Vec<&Value> = objects.iter().map(|object| &object["chosen"]).collect();
    assert_eq!(chosen, [&json!(1), &json!(0), &json!(1)]);
}

#[test]
fn a_silent_sensor_is_not_waited_for() {
    let folder = Folder::new();
    std::fs::write(folder.path("border.yaml"), reference()).unwrap();
    let file = folder.path("border.yaml");
    let mut service = Service::start(&["--associate", file.to_str().unwrap()]);
    service.say("/radar/2/tracks", json!({ "t": 10.0, "x": [150], "y": [2], "speed": [20] }), 10.0);
    let object = |x: f64| json!({ "pose": { "x": x, "y": 2.0 }, "v": { "x": 20, "y": 0 } });
    for tenths in 1..=20 {
        let stamp = 10.0 + f64::from(tenths) / 10.0;
        service.say("/radar/1/tracks", json!({ "stamp": stamp, "objects": [object(140.0)] }), stamp);
    }
    let (said, ..) = service.end();
    assert_eq!(of(&said, "/radar/2/entering/count").len(), 1);
    // From the second on in which the first sensor has said nothing.
    assert_eq!(of(&said, "/radar/1/leaving/count").len(), 10);
}

#[test]
fn what_is_wrong_with_the_file_is_reported_with_its_place() {
    let folder = Folder::new();
    std::fs::write(folder.path("border.yaml"), reference().replace("near:", "nearby:")).unwrap();
    let ended = folder.run("service --associate border.yaml --stdio");
    assert_eq!(ended.status, 2, "{}", ended.stderr);
    assert!(ended.stderr.contains("border.yaml:33:5"), "{}", ended.stderr);
    assert!(ended.stderr.contains("did you mean `near`?"), "{}", ended.stderr);
    let ended = folder.run("service --associate absent.yaml --stdio");
    assert_eq!(ended.status, 2, "{}", ended.stderr);
}

#[test]
fn a_message_about_something_else_changes_nothing() {
    let folder = Folder::new();
    let file = "associations: { yard: { sensors: { camera: { tracks: /seen, x: 'x[kind=car]', y: 'y[kind=car]', time: t, \
                error: [1, 1], output: /yard } } } }";
    folder.write("yard.yaml", file);
    let mut service = Service::start(&["--associate", folder.path("yard.yaml").to_str().unwrap()]);
    service.say("/seen", json!({ "t": 1.0, "kind": "car", "x": [5], "y": [2] }), 1.0);
    service.say("/seen", json!({ "t": 1.1, "kind": "dog", "x": [9], "y": [9] }), 1.1);
    let (said, ..) = service.end();
    assert_eq!((of(&said, "/yard/x"), of(&said, "/yard/count")), (vec![&json!(5)], vec![&json!(1)]));
}
