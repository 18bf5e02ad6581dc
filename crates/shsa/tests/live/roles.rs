//! Access rights: viewing, orders, and the names of the host.

use crate::running::{Folder, Running, TOKEN};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;

const VIEW: &str = "a-token-for-looking-only";

fn get(run: &Running, path: &str, headers: &str) -> (u16, String) {
    run.text(TcpStream::connect(run.address()).unwrap(), &format!("GET {path}"), headers, "")
}

#[test]
fn looking_needs_a_token_where_one_is_given() {
    let folder = Folder::new();
    let file = folder.path("view");
    std::fs::write(&file, VIEW).unwrap();
    std::fs::set_permissions(&file, PermissionsExt::from_mode(0o640)).unwrap();
    let run = Running::start(["--view-token-file", file.to_str().unwrap()]);
    let shown = |token: &str| format!("Authorization: BEARER {token}\r\n");
    for path in ["/state", "/events", "/metrics"] {
        let status = |headers: &str| get(&run, path, headers).0;
        assert_eq!([status(""), status(&shown(VIEW)), status(&shown(TOKEN))], [401, 200, 200], "{path}");
    }
    for path in [
        "/changes",
        "/past?model=rover",
        "/bands?model=rover&variable=speed",
        "/model?model=rover",
        "/what-if?model=rover",
    ] {
        assert_eq!(get(&run, path, "").0, 401, "{path}");
    }
    assert_eq!(get(&run, "/", "").0, 200);
    assert_ne!(get(&run, "/health", "").0, 401);
    assert_eq!(run.order(Some(VIEW), r#"{"order": "reload"}"#).0, 401);
    assert_eq!(run.order(Some(TOKEN), r#"{"order": "reload"}"#).0, 200);
}

#[test]
fn a_token_that_everyone_can_read_is_refused() {
    let folder = Folder::new();
    let file = folder.path("token");
    std::fs::write(&file, TOKEN).unwrap();
    std::fs::set_permissions(&file, PermissionsExt::from_mode(0o644)).unwrap();
    let ended = Running::ended(["--token-file", file.to_str().unwrap()]);
    assert_eq!(ended.status.code(), Some(2));
    let output = String::from_utf8_lossy(&ended.stderr);
    assert!(output.contains("everyone on this machine can read") && output.contains("chmod o-r"), "{output}");
}

#[test]
fn other_names_of_the_host_are_allowed_one_by_one() {
    let run = Running::start(["--http-host", "robot.local"]);
    let status = |host: &str| {
        let mut stream = TcpStream::connect(run.address()).unwrap();
        Running::answer(
            &mut stream,
            &format!("GET /metrics HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"),
        )
        .0
    };
    assert_eq!(
        ["robot.local:7410", "ROBOT.local", "localhost", "evil.example"].map(status),
        [200, 200, 200, 403]
    );
}
