//! Two vehicles of a platoon, each with an instance and a network of its own: their certificates compose over Zenoh, and degrade with
//! the link between them.

use crate::car::router;
use crate::real::{self, Script, free_port};
use crate::running::Running;
use serde_json::json;
use std::io::copy;
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread;

const LEADER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/leader.yaml");
const FOLLOWER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/follower.yaml");

/// The radio between two vehicles: forwards the bytes of a connection, until it is cut.
struct Link {
    port: u16,
    open: Arc<Mutex<Option<Vec<TcpStream>>>>,
}

impl Link {
    /// Forwards connections to a port.
    fn to(target: u16) -> Link {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let open = Arc::new(Mutex::new(Some(Vec::new())));
        let held = open.clone();
        // Ends with the process: nobody connects any more when the test is over.
        thread::spawn(move || {
            for near in listener.incoming().map_while(Result::ok) {
                let Some(open) = &mut *held.lock().unwrap() else { continue };
                let Ok(far) = TcpStream::connect(("127.0.0.1", target)) else { continue };
                for (from, to) in [(&near, &far), (&far, &near)] {
                    let (mut from, mut to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                    thread::spawn(move || {
                        let _ = copy(&mut from, &mut to);
                        let _ = to.shutdown(Shutdown::Both);
                    });
                }
                open.extend([near, far]);
            }
        });
        Link { port, open }
    }

    fn cut(&self) {
        for stream in self.open.lock().unwrap().take().into_iter().flatten() {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    fn restore(&self) {
        *self.open.lock().unwrap() = Some(Vec::new());
    }
}

/// The router of the vehicle behind, which reaches the vehicle before it by the link.
fn second_router(python: &Path, link: &Link) -> (Script, u16) {
    let port = free_port();
    let config = json!({
        "mode": "router", "scouting/multicast/enabled": false,
        "listen/endpoints": [format!("tcp/127.0.0.1:{port}")],
        "connect/endpoints": [format!("tcp/127.0.0.1:{}", link.port)],
    });
    (Script::start(python, "../../../shsa-bridge/tests/python/zenoh_client.py", &config), port)
}

fn sensor(python: &Path, port: u16, topic: &str, text: &str) -> Script {
    let order =
        json!({ "bus": "zenoh", "port": port, "name": topic, "topic": topic, "text": text, "period": 0.1 });
    Script::start(python, "sensor.py", &order)
}

fn instance(model: &str, name: &str, port: u16) -> Running {
    let address = format!("zenoh://127.0.0.1:{port}");
    Running::start([model, "--bus", &address, "--name", name, "--form", "json"])
}

/// Waits until a need is served by this source, at this level.
#[track_caller]
fn wait_for(run: &Running, model: &str, need: &str, source: &str, level: &str) {
    run.until(&format!("{need} from {source} at {level}"), |state| {
        let need = &state["models"][model]["needs"][need];
        (&need["source"], &need["level"]) == (&json!(source), &json!(level))
    });
}

#[test]
fn certificates_compose_over_the_network_and_degrade_with_the_link() {
    let Some(python) = real::python() else { return };
    let (_first, port) = router(&python);
    let link = Link::to(port);
    let (_second, own_port) = second_router(&python, &link);
    let _wheels = sensor(&python, port, "leader/wheels", r#"{"speed": VALUE}"#);
    let radar = sensor(&python, port, "leader/radar", r#"{"speed": VALUE}"#);
    let _own = sensor(&python, own_port, "follower/speed", r#"{"speed": VALUE}"#);
    let _closing = sensor(&python, own_port, "follower/radar", r#"{"closing": 0}"#);
    let leader = instance(LEADER, "leader", port);
    let follower = instance(FOLLOWER, "follower", own_port);
    let ahead = |source: &str, level: &str| wait_for(&follower, "follower", "ahead", source, level);
    let (theirs, ours) = ("/leader/speed", "/follower/speed, /follower/radar by seen");
    ahead(theirs, "ASIL B");
    link.cut();
    ahead(ours, "ASIL A");
    link.restore();
    ahead(theirs, "ASIL B");
    // The leader loses its radar: its word is worth less, and is heard all the same.
    drop(radar);
    wait_for(&leader, "leader", "speed", "/leader/wheels by rolling", "ASIL A");
    ahead(theirs, "ASIL A");
}
