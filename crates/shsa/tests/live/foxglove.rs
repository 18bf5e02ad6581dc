//! `shsa run --foxglove`: viewers that follow a run over WebSocket.

use crate::real::{free_port, python};
use crate::running::{Folder, Running};
use serde_json::{Value, json};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/models/rover.yaml");

/// What a viewer that is not ours sees.
#[track_caller]
fn seen(python: &Path, argument: &Value) -> Value {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/foxglove.py");
    let output = Command::new(python).arg(script).arg(argument.to_string()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_viewer_that_is_not_ours_sees_what_a_record_has() {
    let Some(python) = python() else { return };
    let folder = Folder::new();
    let (address, layout) = (format!("127.0.0.1:{}", free_port()), folder.path("layout.json"));
    let run = Running::start([&format!("--foxglove={address}"), "--layout", layout.to_str().unwrap()]);
    for protocol in ["foxglove.sdk.v1", "foxglove.websocket.v1"] {
        let told = seen(&python, &json!({ "address": address, "protocol": protocol }));
        assert_eq!(told["name"], "shsa (rover)");
        let schemas = json!([
            "foxglove.Log",
            "foxglove.SceneUpdate",
            "shsa.Decision",
            "shsa.Interval",
            "shsa.Journal",
            "shsa.Need",
            "shsa.Verdict",
        ]);
        assert_eq!(told["schemas"], schemas, "{told}");
        let seen = &told["seen"];
        assert!(seen["/shsa/needs"]["lo"].as_f64() <= seen["/shsa/needs"]["hi"].as_f64(), "{seen}");
        assert!(seen["/shsa/log"]["message"].is_string(), "{seen}");
        let entities = seen["/shsa/graph"]["entities"].as_array().unwrap();
        let words: Vec<&str> =
            entities.iter().filter_map(|entity| entity["texts"][0]["text"].as_str()).collect();
        assert!(words.iter().any(|words| words.ends_with("/lidar/scan")), "{words:?}");
        assert!(words.contains(&"= nearest"), "{words:?}");
    }
    for (protocol, origin, status) in
        [("foxglove.sdk.v9", Value::Null, 400), ("foxglove.sdk.v1", json!("https://example.org"), 403)]
    {
        let argument = json!({ "address": address, "protocol": protocol, "origin": origin });
        assert_eq!(seen(&python, &argument), json!({ "refused": status }));
    }
    let layout: Value = serde_json::from_str(&std::fs::read_to_string(layout).unwrap()).unwrap();
    assert_eq!(layout["configById"]["3D!graph"]["topics"]["/shsa/graph"]["visible"], true, "{layout}");
    assert!(run.stop().success());
}

#[test]
fn nobody_looks_without_a_token_where_looking_needs_one() {
    let folder = Folder::new();
    let token = folder.path("token");
    std::fs::write(&token, "a token that is long enough\n").unwrap();
    std::fs::set_permissions(&token, std::fs::Permissions::from_mode(0o600)).unwrap();
    let ended =
        Running::ended([MODEL, "--foxglove=127.0.0.1:0", "--view-token-file", token.to_str().unwrap()]);
    let words = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.code() == Some(2) && words.contains("looking needs a token"), "{words}");
}
