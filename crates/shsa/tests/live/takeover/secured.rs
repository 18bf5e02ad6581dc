//! A broker that disconnects the client of a failed source, and admits it again.

use super::{SUBSTITUTE, Scene, check_taken, takeover, wait_for};
use crate::broker::Broker;
use crate::real::{self};
use crate::running::TOKEN;
use serde_json::json;
use std::fs;
use std::process::Command;

/// The password of every client that has one.
pub(super) const PASSWORD: &str = "not a secret in a test";

/// A broker whose clients can be disabled.
fn secured() -> Option<Broker> {
    let found = fs::read_dir("/usr/lib").unwrap().flatten();
    let found = found.map(|folder| folder.path().join("mosquitto_dynamic_security.so"));
    let Some(plugin) = found.into_iter().find(|path| path.exists()) else {
        use std::io::Write;
        let _ = writeln!(std::io::stderr(), "SKIPPED: mosquitto_dynamic_security.so is absent");
        return None;
    };
    let plugin = format!("plugin {}", plugin.display());
    let options = "plugin_opt_config_file FOLDER/dynamic-security.json";
    let broker = Broker::start_with(&[&plugin, options, "allow_anonymous false"], |folder| {
        let file = folder.join("dynamic-security.json").display().to_string();
        let made = Command::new("mosquitto_ctrl").args(["dynsec", "init", &file, "admin", PASSWORD]).output();
        assert!(made.unwrap().status.success());
    });
    let port = broker.port().to_string();
    let control = |words: &[&str]| {
        let address = ["-h", "127.0.0.1", "-p", &port, "-u", "admin", "-P", PASSWORD, "dynsec"];
        let done = Command::new("mosquitto_ctrl").args(address).args(words).output().unwrap();
        assert!(done.status.success(), "{words:?}: {done:?}");
    };
    let security = "$CONTROL/dynamic-security/v1";
    let answers = format!("{security}/response");
    for (role, access, topic) in [
        ("member", "publishClientSend", "#"),
        ("member", "subscribePattern", "#"),
        ("silencer", "publishClientSend", security),
        ("silencer", "publishClientReceive", &answers),
        ("silencer", "subscribeLiteral", &answers),
    ] {
        if access.ends_with("Send") {
            control(&["createRole", role]);
        }
        control(&["addRoleACL", role, access, topic, "allow"]);
    }
    for client in ["wheel-driver", "others", "healer"] {
        control(&["createClient", client, "-p", PASSWORD]);
        control(&["addClientRole", client, "member"]);
    }
    control(&["addClientRole", "healer", "silencer"]);
    Some(broker)
}

#[test]
fn a_client_that_the_broker_throws_out_is_replaced_and_let_in_again_by_order() {
    let Some(python) = real::python() else { return };
    let Some(broker) = secured() else { return };
    let wheel = json!({ "user": "wheel-driver", "password": PASSWORD });
    let mut scene = Scene::new(&python, "mqtt", broker.port(), &wheel);
    let password = scene.folder.path("password");
    fs::write(&password, PASSWORD).unwrap();
    let bus = format!("mqtt://127.0.0.1:{}?user=healer&password-file={}", broker.port(), password.display());
    let run = scene.run("silence: { dynamic_security: { client: wheel-driver } }", &["--bus", &bus]);
    let mut consumer = scene.consumer(Some("others"));

    scene.lie();
    let silenced = run.decision("silenced");
    assert!(silenced["because"].as_str().unwrap().contains("dynamic security (client wheel-driver)"));
    check_taken(&mut consumer);
    assert!(!run.get("/state").1.to_string().contains(PASSWORD));

    // The wheel was repaired, and the operator clears it.
    scene.wheel.order(&json!({ "value": 10.1 }));
    let (status, answer) = run.order(Some(TOKEN), r#"{"order": "clear", "signal": "wheel"}"#);
    assert_eq!(status, 200, "{answer}");
    assert!(run.decision("returning")["because"].as_str().unwrap().contains("by order of the operator"));
    run.decision("returned");
    let own = wait_for(
        &mut consumer,
        "the wheel",
        |quality, _| quality.is_empty(),
        |quality, _| {
            assert_eq!(quality, SUBSTITUTE);
        },
    );
    assert!(own.1.contains("10.1"), "{own:?}");
    let state = run.until("it is trusted again", |state| takeover(state)["stage"] == "watching");
    assert_eq!(takeover(&state)["quality"], "Good");
}
