//! Silent HTTP connections and wrong tokens: neither keeps others from being served.

use crate::running::{Folder, Running, TOKEN};
use serde_json::Value;
use socket2::{Domain, Socket, Type};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// The limit of the program's open files; a fourth of them may be connections.
const LIMITED: [&str; 4] = ["sh", "-c", "ulimit -n 256; exec \"$@\"", "sh"];

#[test]
fn thousands_of_half_open_connections_stop_nothing() {
    let folder = Folder::new();
    let state = folder.path("state");
    let run = Running::start_under(&LIMITED, ["--state", state.to_str().unwrap()]);
    run.until("the need is served", |state| {
        state["models"]["rover"]["needs"]["v_dmin"]["published"].as_u64() > Some(3)
    });
    let files = || std::fs::read_dir(run.files()).unwrap().count();
    let mut held = Vec::new();
    for round in 0..5 {
        for kind in 0..400 {
            let Ok(mut stream) = TcpStream::connect(run.address()) else { continue };
            // Nothing, the beginning of a request, or a request without its body.
            let words: &[u8] = match kind % 3 {
                0 => b"",
                1 => b"GET /state HTTP/1.1\r\nHost: lo",
                _ => b"POST /orders HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4000000\r\n\r\n{",
            };
            let _ = stream.write_all(words);
            held.push(stream);
        }
        let asked = Instant::now();
        assert_eq!(run.get("/health").0, 200, "round {round}");
        assert!(asked.elapsed() < Duration::from_secs(10), "round {round}: {:?}", asked.elapsed());
        assert!(files() < 128, "{} files are open", files());
        // Stays within the test's own limit of open files.
        held.drain(..held.len().saturating_sub(200));
    }
    let before = std::fs::metadata(state.join("rover.json")).unwrap().modified().unwrap();
    let order = r#"{"order": "change", "text": "available: { /lidar/scan: false }"}"#;
    assert_eq!(run.order(Some(TOKEN), order).0, 200);
    run.decision("substituted");
    run.until("the state is written", |_| {
        std::fs::metadata(state.join("rover.json")).is_ok_and(|file| file.modified().unwrap() > before)
    });
    drop(held);
    assert_eq!(run.stop().code(), Some(0));
}

#[test]
fn a_slow_request_is_ended() {
    let run = Running::start([]);
    let mut slow = TcpStream::connect(run.address()).unwrap();
    slow.write_all(b"GET /health HTTP/1.1\r\nHost: loc").unwrap();
    slow.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let mut answer = Vec::new();
    slow.read_to_end(&mut answer).unwrap();
    assert!(!String::from_utf8_lossy(&answer).contains("200 OK"));
}

#[test]
fn only_so_many_streams_are_open() {
    let run = Running::start([]);
    let streams: Vec<u16> = (0..20)
        .map(|_| {
            let mut stream = TcpStream::connect(run.address()).unwrap();
            stream.write_all(b"GET /events/stream HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
            let mut head = [0; 12];
            stream.read_exact(&mut head).unwrap();
            std::mem::forget(stream);
            std::str::from_utf8(&head[9..]).unwrap().parse().unwrap()
        })
        .collect();
    assert_eq!(streams.iter().filter(|status| **status == 200).count(), 16);
    assert_eq!(streams.iter().filter(|status| **status == 503).count(), 4);
}

#[test]
fn wrong_tokens_and_callers_are_reported() {
    let run = Running::start([]);
    for _ in 0..5 {
        assert_eq!(run.order(Some("a-guess-of-a-token"), r#"{"order": "reload"}"#).0, 401);
    }
    assert_eq!(run.decision("denied")["because"], "a wrong token from 127.0.0.1");
    let decision = run.decision("denied");
    assert!(
        decision["because"].as_str().unwrap().starts_with("5 wrong tokens from 127.0.0.1 within 10 s"),
        "{decision}"
    );
    let (_, metrics) = run.get("/metrics");
    let metrics = metrics.as_str().unwrap();
    assert!(metrics.contains("shsa_wrong_tokens_total 5"), "{metrics}");
    // Another address of the same host is another source.
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
    socket.bind(&SocketAddr::from(([127, 0, 0, 2], 0)).into()).unwrap();
    socket.connect(&run.address().parse::<SocketAddr>().unwrap().into()).unwrap();
    let (status, answer) = run.order_over(socket.into(), Some(TOKEN), r#"{"order": "reload"}"#);
    assert_eq!(status, 200, "{answer}");
    let ordered = run.decision("ordered");
    assert!(ordered["because"].as_str().unwrap().ends_with("(from 127.0.0.2)"), "{ordered}");
    let is_denied = |event: &&Value| event["kind"] == "denied";
    assert_eq!(run.get("/events").1.as_array().unwrap().iter().filter(is_denied).count(), 2);
}
