//! Radars along a road as separate programs over a broker: their tracks, the service that associates them, and `shsa run`.

use crate::broker::Broker;
use crate::program;
use crate::running::Running;
use serde_json::Value;
use std::ffi::OsStr;
use std::process::{Child, Command, Stdio};

/// A program that is ended when this is dropped.
struct Program(Child);

impl Program {
    fn start(program: impl AsRef<OsStr>, arguments: &[&str]) -> Program {
        let mut command = Command::new(program);
        command.args(arguments).current_dir(ROOT).stdout(Stdio::null());
        Program(command.spawn().unwrap())
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

#[test]
fn tracks_of_radars_are_associated_and_compared_over_mqtt() {
    let broker = Broker::start(&["persistence false"]);
    let bus = format!("mqtt://127.0.0.1:{}", broker.port());
    let model = format!("{ROOT}/models/radars.yaml");
    let run = Running::start([model.as_str(), "--bus", &bus]);
    let _association =
        Program::start(program(), &["service", "--associate", "models/tracks/radars.yaml", "--bus", &bus]);
    let _road = Program::start(env!("CARGO_BIN_EXE_shsa-demos"), &["road", "--bus", &bus]);
    // Between two vehicles a need is served by whoever has spoken last.
    let is_served = |need: &Value, qualities: &[&str]| {
        let is_good = need["quality"].as_str().is_some_and(|quality| qualities.contains(&quality));
        is_good && need["published"].as_u64() > Some(3)
    };
    for border in 1..=3 {
        run.until("positions and counts at the border come", |state| {
            let need = |what: &str| &state["models"]["radars"]["needs"][format!("{what}_{border}")];
            is_served(need("x"), &["Good", "UncertainSubstituteValue"]) && is_served(need("count"), &["Good"])
        });
    }
}
