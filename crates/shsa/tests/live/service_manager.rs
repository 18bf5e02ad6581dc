//! The messages of a run to a service manager.

use crate::running::{Folder, Running};
use std::os::unix::net::UnixDatagram;
use std::process::Command;
use std::time::Duration;

/// The next message.
#[track_caller]
fn next(socket: &UnixDatagram) -> String {
    let mut state = [0; 256];
    let length = socket.recv(&mut state).expect("a state within a minute");
    String::from_utf8_lossy(&state[..length]).into_owned()
}

#[track_caller]
fn until(socket: &UnixDatagram, wanted: &str) {
    while !next(socket).contains(wanted) {}
}

#[test]
fn it_is_ready_alive_reloads_and_stops() {
    let folder = Folder::new();
    let path = folder.path("notify");
    let socket = UnixDatagram::bind(&path).unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let model = folder.path("tank.yaml");
    let text = "shsa: 1\nvariables: { level: { unit: m } }\nsignals: { /level: { variable: level, timeout: 1 s } }\nneeds: { level: { max_age: 1 s } }\n";
    std::fs::write(&model, text).unwrap();
    let variable = format!("NOTIFY_SOCKET={}", path.display());
    let run = Running::start_under(&["env", &variable, "WATCHDOG_USEC=200000"], [model.to_str().unwrap()]);
    assert!(next(&socket).starts_with("READY=1"));
    for _ in 0..3 {
        assert_eq!(next(&socket), "WATCHDOG=1");
    }
    run.signal("-HUP");
    assert!(run.decision("ordered")["because"].as_str().unwrap().contains("read again"));
    until(&socket, "RELOADING=1");
    until(&socket, "READY=1");
    std::fs::write(&model, "shsa: 1\nvariables: 7\n").unwrap();
    run.signal("-HUP");
    until(&socket, "RELOADING=1");
    until(&socket, "READY=1");
    run.until("it goes on", |state| state["models"]["tank"]["signals"]["/level"].is_object());
    // The need is not served, but a requested end is a success.
    assert_eq!(run.stop().code(), Some(0));
    until(&socket, "STOPPING=1");
}

#[test]
fn the_unit_is_one() {
    let unit = concat!(env!("CARGO_MANIFEST_DIR"), "/../../deploy/shsa.service");
    let Ok(verified) = Command::new("systemd-analyze").args(["verify", "--man=no", unit]).output() else {
        eprintln!("SKIPPED: there is no systemd-analyze");
        return;
    };
    let stated = String::from_utf8_lossy(&verified.stderr);
    let wrong =
        stated.lines().filter(|line| line.contains("shsa.service") && !line.contains("is not executable"));
    assert_eq!(wrong.collect::<Vec<_>>(), [""; 0]);
}
