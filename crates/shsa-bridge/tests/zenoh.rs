//! The Zenoh bridge against independent Python clients and routers, and against itself.

#[macro_use]
mod contract;
mod real;

use bytes::Bytes;
use real::{Script, eventually, free_port, python};
use serde_json::{Value, json};
use shsa_bridge::zenoh::{Mode, Options, Presence, Secret, ZenohBridge};
use shsa_bridge::{Bridge, BridgeError, Clock, Inbox, Link, Message, Outgoing, Payload, Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

fn open(options: &Options) -> ZenohBridge {
    ZenohBridge::open(options, Inbox::new(4096, Clock::running())).unwrap()
}

fn client(port: u16) -> Options {
    Options { mode: Some(Mode::Client), ..Options::to(&tcp(port)) }
}

fn listening(port: u16) -> Options {
    Options { listen: vec![tcp(port)], ..Options::default() }
}

fn tcp(port: u16) -> String {
    format!("tcp/127.0.0.1:{port}")
}

/// A Python client in a mode, listening or connecting.
fn script(python: &Path, mode: &str, side: &str, endpoint: &str) -> Script {
    let endpoints = format!("{side}/endpoints");
    let mut config = json!({
        "mode": mode, "scouting/multicast/enabled": false, "listen/endpoints": [],
    });
    config[endpoints] = json!([endpoint]);
    Script::start(python, "zenoh_client.py", &config)
}

fn router(python: &Path, port: u16) -> Script {
    script(python, "router", "listen", &tcp(port))
}

/// A router that keeps messages for long: on a busy machine, consumers stop for longer than a router waits by default.
fn patient_router(python: &Path, port: u16) -> Script {
    let queue = "transport/link/tx/queue";
    let config = json!({
        "mode": "router", "scouting/multicast/enabled": false, "listen/endpoints": [tcp(port)],
        format!("{queue}/size/real_time"): 16,
        format!("{queue}/congestion_control/drop/wait_before_drop"): 2_000_000,
        format!("{queue}/congestion_control/drop/max_wait_before_drop_fragments"): 10_000_000,
    });
    Script::start(python, "zenoh_client.py", &config)
}

/// Listening peers, each connected to the earlier ones, because peers do not forward messages.
#[derive(Default)]
struct Peers {
    ports: Vec<u16>,
}

impl contract::Middleware for Peers {
    fn bridge(&mut self, _name: &str, inbox: Inbox) -> Box<dyn Bridge> {
        let port = free_port();
        let connect = self.ports.iter().map(|port| tcp(*port)).collect();
        self.ports.push(port);
        Box::new(ZenohBridge::open(&Options { connect, ..listening(port) }, inbox).unwrap())
    }

    fn break_it(&mut self) -> bool {
        false
    }

    fn mend_it(&mut self) {}

    fn asking(&self) -> contract::Asking {
        contract::Asking::Queries
    }
}

/// Clients of an independent router.
struct Routed {
    python: PathBuf,
    port: u16,
    router: Option<Script>,
}

impl Routed {
    fn start() -> Option<Routed> {
        let (python, port) = (python()?, free_port());
        let router = Some(patient_router(&python, port));
        Some(Routed { python, port, router })
    }
}

impl contract::Middleware for Routed {
    fn bridge(&mut self, _name: &str, inbox: Inbox) -> Box<dyn Bridge> {
        Box::new(ZenohBridge::open(&client(self.port), inbox).unwrap())
    }

    fn break_it(&mut self) -> bool {
        self.router = None;
        true
    }

    fn mend_it(&mut self) {
        self.router = Some(patient_router(&self.python, self.port));
    }

    fn asking(&self) -> contract::Asking {
        contract::Asking::Queries
    }
}

contract!(peers, Peers::default());
contract!(
    routed,
    match Routed::start() {
        Some(routed) => routed,
        None => return,
    }
);

#[track_caller]
fn next(bridge: &mut ZenohBridge) -> Message {
    eventually("a message", || bridge.receive())
}

fn text(message: &Message) -> String {
    match &message.payload {
        Payload::Bytes(bytes) => String::from_utf8(bytes.to_vec()).unwrap(),
        Payload::Value(value) => panic!("{value:?} is no payload of Zenoh"),
    }
}

fn number(value: f64) -> Payload {
    Payload::Value(RawValue::Number(value))
}

/// Publishes until a message arrives: a new subscription takes a moment to be known everywhere.
#[track_caller]
fn warm_up(from: &mut ZenohBridge, to: &mut ZenohBridge, topic: &str) {
    eventually("the first message", || {
        from.publish(Outgoing::new(topic, Time(0), number(-1.0))).ok()?;
        to.inbox().wait(Duration::from_millis(20));
        to.receive()
    });
    std::thread::sleep(Duration::from_millis(50));
    while to.receive().is_some() {}
}

#[track_caller]
fn is_up(bridge: &ZenohBridge) {
    eventually("the link", || (bridge.link() == Link::Up).then_some(()));
}

#[test]
fn an_independent_client_is_heard_and_hears() {
    let Some(python) = python() else { return };
    let port = free_port();
    let mut peer = script(&python, "peer", "listen", &tcp(port));
    let mut bridge = open(&Options::to(&tcp(port)));
    bridge.subscribe("/odom/speed", None).unwrap();
    peer.order(&json!({"subscribe": "dmin"}));
    let received = eventually("the client's message", || {
        peer.order(&json!({"put": "odom/speed", "text": "1.5", "encoding": "text/plain;std/number"}));
        bridge.receive()
    });
    assert_eq!((&*received.topic, text(&received)), ("/odom/speed", "1.5".into()));
    assert_eq!((received.stamp, received.quality), (None, None));
    assert_eq!(received.message_type.as_deref(), Some("std/number"));

    let ground = shsa_core::assurance::Ground::Warned;
    let admission = Some(shsa_bridge::Admission { ground, level: None, rank: 0 });
    let provenance = Provenance { admission, ..Provenance::new(Quality::Substitute, "odom") };
    let message = Outgoing { provenance: Some(&provenance), ..Outgoing::new("dmin", Time(7), number(0.25)) };
    bridge.publish(message).unwrap();
    let arrived = peer.next_with("key");
    assert_eq!(["key", "encoding", "hex"].map(|it| &arrived[it]), ["dmin", "application/json", "302e3235"]);
    let beside: Value = serde_json::from_slice(&unhex(arrived["attachment"].as_str().unwrap())).unwrap();
    let provenance =
        ["stamp_ns", "quality", "publisher", "source", "admitted", "level", "rank"].map(|it| &beside[it]);
    let own = bridge.publisher().to_string();
    assert_eq!(json!(provenance), json!([7, "UncertainSubstituteValue", own, "odom", "warned", null, 0]));
}

fn unhex(digits: &str) -> Vec<u8> {
    (0..digits.len()).step_by(2).map(|at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap()).collect()
}

#[test]
fn own_messages_do_not_come_back_and_others_know_whose_they_are() {
    let port = free_port();
    let (mut a, mut b) = (open(&listening(port)), open(&Options::to(&tcp(port))));
    for bridge in [&mut a, &mut b] {
        bridge.subscribe("/x", None).unwrap();
        bridge.subscribe("/x", None).unwrap();
    }
    warm_up(&mut a, &mut b, "/x");
    warm_up(&mut b, &mut a, "/x");
    let provenance = Provenance::new(Quality::LastUsable, "");
    let message = Outgoing { provenance: Some(&provenance), ..Outgoing::new("/x", Time(9), number(3.0)) };
    a.publish(message).unwrap();
    let message = next(&mut b);
    assert_eq!((message.publisher, message.stamp), (Some(a.publisher()), Some(Time(9))));
    assert_eq!((message.quality, text(&message)), (Some(Quality::LastUsable), "3".into()));
    b.publish(Outgoing::new("/x", Time(0), number(4.0))).unwrap();
    assert_eq!(text(&next(&mut a)), "4");
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!((a.receive(), b.receive()), (None, None));
}

#[test]
fn names_that_were_asked_for_come_back_and_all_others_bear_their_keys() {
    let port = free_port();
    let (mut a, mut b) = (open(&listening(port)), open(&Options::to(&tcp(port))));
    b.subscribe("/named", None).unwrap();
    b.subscribe_all().unwrap();
    b.subscribe_all().unwrap();
    warm_up(&mut a, &mut b, "/named");
    for topic in ["/named", "/a/b", "c"] {
        a.publish(Outgoing::new(topic, Time(0), number(1.0))).unwrap();
    }
    let mut names: Vec<String> = (0..3).map(|_| next(&mut b).topic.to_string()).collect();
    names.sort();
    assert_eq!(names, ["/named", "a/b", "c"]);
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(b.receive(), None);
    assert!(matches!(b.subscribe("/a/*", None), Err(BridgeError::Configuration(_))));
}

#[test]
fn a_burst_arrives_in_order_and_a_huge_payload_whole() {
    let port = free_port();
    let (mut a, mut b) = (open(&listening(port)), open(&Options::to(&tcp(port))));
    burst(&mut a, &mut b);
}

#[test]
fn so_they_do_through_a_router() {
    let Some(python) = python() else { return };
    let port = free_port();
    let _router = patient_router(&python, port);
    burst(&mut open(&client(port)), &mut open(&client(port)));
}

#[track_caller]
fn burst(a: &mut ZenohBridge, b: &mut ZenohBridge) {
    b.subscribe("burst", None).unwrap();
    b.subscribe("huge", None).unwrap();
    warm_up(a, b, "burst");
    for n in 0..2000 {
        a.publish(Outgoing::new("burst", Time(n), number(n as f64))).unwrap();
    }
    let stamps: Vec<i64> = (0..2000).map(|_| next(b).stamp.unwrap().0).collect();
    assert_eq!(stamps, (0..2000).collect::<Vec<_>>());
    let huge: Bytes = (0..20_000_000_u32).map(|n| (n % 251) as u8).collect::<Vec<_>>().into();
    a.publish(Outgoing::new("huge", Time(1), Payload::Bytes(huge.clone()))).unwrap();
    assert!(next(b).payload == Payload::Bytes(huge));
}

#[test]
fn what_is_too_large_is_not_received_and_the_rest_is() {
    let port = free_port();
    let mut a = open(&listening(port));
    let mut b = open(&Options { message_max: 1 << 20, ..Options::to(&tcp(port)) });
    b.subscribe("x", None).unwrap();
    warm_up(&mut a, &mut b, "x");
    a.publish(Outgoing::new("x", Time(0), Payload::Bytes(vec![7; 2 << 20].into()))).unwrap();
    a.publish(Outgoing::new("x", Time(0), number(5.0))).unwrap();
    assert_eq!(text(&next(&mut b)), "5");
}

#[test]
fn garbage_arrives_as_it_is() {
    let Some(python) = python() else { return };
    let port = free_port();
    let mut peer = script(&python, "peer", "listen", &tcp(port));
    let mut bridge = open(&Options::to(&tcp(port)));
    bridge.subscribe_all().unwrap();
    eventually("the link's first message", || {
        peer.order(&json!({"put": "first", "text": ""}));
        bridge.receive()
    });
    for beside in ["", "7b", "7b227374616d705f6e73223a2278227d", "ff00", &"00".repeat(33)] {
        peer.order(&json!({"put": "x", "hex": "ff00fe", "attachment": beside, "encoding": ";;\u{1F600}"}));
    }
    for _ in 0..5 {
        let message = eventually("garbage", || bridge.receive().filter(|message| &*message.topic == "x"));
        assert_eq!(message.payload, Payload::Bytes(Bytes::from_static(&[0xff, 0, 0xfe])));
        assert_eq!((message.stamp, message.publisher, message.quality), (None, None, None));
    }
}

#[test]
fn a_router_that_comes_late_goes_and_comes_back_is_no_error() {
    let Some(python) = python() else { return };
    let port = free_port();
    let start = Instant::now();
    let (mut a, mut b) = (open(&client(port)), open(&client(port)));
    assert!(start.elapsed() < Duration::from_secs(12));
    assert!(matches!(a.link(), Link::Down(reason) if reason.contains(&port.to_string())), "{:?}", a.link());
    assert!(matches!(a.publish(Outgoing::new("x", Time(0), number(0.0))), Err(BridgeError::Lost(_))));
    b.subscribe("x", None).unwrap();
    let first = router(&python, port);
    is_up(&a);
    is_up(&b);
    warm_up(&mut a, &mut b, "x");
    drop(first);
    eventually("the loss of the router", || matches!(b.link(), Link::Down(_)).then_some(()));
    // Without a session, publishing keeps nothing and breaks nothing.
    let _ = a.publish(Outgoing::new("x", Time(0), number(0.0)));
    let _second = router(&python, port);
    is_up(&a);
    is_up(&b);
    warm_up(&mut a, &mut b, "x");
    a.publish(Outgoing::new("x", Time(0), number(8.0))).unwrap();
    assert_eq!(text(&next(&mut b)), "8");
}

#[test]
fn a_peer_that_comes_late_goes_and_comes_back_is_no_error() {
    let port = free_port();
    let mut b = open(&Options { patience: Duration::from_millis(100), ..Options::to(&tcp(port)) });
    b.subscribe("x", None).unwrap();
    assert!(matches!(b.link(), Link::Down(_)));
    for _ in 0..2 {
        let mut a = open(&listening(port));
        is_up(&b);
        warm_up(&mut a, &mut b, "x");
        drop(a);
        eventually("the loss of the peer", || matches!(b.link(), Link::Down(_)).then_some(()));
    }
}

#[test]
fn closing_does_not_wait_for_a_router_that_hangs() {
    let Some(python) = python() else { return };
    let port = free_port();
    let router = router(&python, port);
    let mut bridge = open(&client(port));
    bridge.subscribe("x", None).unwrap();
    is_up(&bridge);
    router.signal("STOP");
    let start = Instant::now();
    for n in 0..200 {
        bridge.publish(Outgoing::new("x", Time(n), Payload::Bytes(vec![0; 60_000].into()))).unwrap();
    }
    assert!(start.elapsed() < Duration::from_secs(5), "sending waited {:?}", start.elapsed());
    let start = Instant::now();
    drop(bridge);
    assert!(start.elapsed() < Duration::from_secs(5), "closing took {:?}", start.elapsed());
    // Closing without a session does no harm, either.
    let bridge = open(&Options { patience: Duration::ZERO, ..client(free_port()) });
    let start = Instant::now();
    drop(bridge);
    assert!(start.elapsed() < Duration::from_secs(5));
}

#[test]
fn an_address_that_is_taken_is_said() {
    let port = free_port();
    let _first = open(&listening(port));
    let second = ZenohBridge::open(&listening(port), Inbox::new(1, Clock::running()));
    assert!(
        matches!(&second, Err(BridgeError::Configuration(why)) if why.contains(&port.to_string())),
        "{second:?}"
    );
}

/// Files of one certificate: authority, certificate, key.
struct Certificates {
    ca: PathBuf,
    certificate: PathBuf,
    key: PathBuf,
}

/// An authority and a certificate for a name.
fn certificates(authority: &str, name: &str) -> Certificates {
    use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair};
    let mut params = CertificateParams::default();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    params.distinguished_name.push(DnType::CommonName, authority);
    let ca_key = KeyPair::generate().unwrap();
    let ca = params.self_signed(&ca_key).unwrap();
    let key = KeyPair::generate().unwrap();
    let own = CertificateParams::new(vec![name.to_owned()]).unwrap();
    let certificate = own.signed_by(&key, &Issuer::new(params, ca_key)).unwrap();
    let file = |kind: &str, text: String| {
        let path =
            std::env::temp_dir().join(format!("shsa-{}-{authority}-{name}-{kind}.pem", std::process::id()));
        std::fs::write(&path, text).unwrap();
        path
    };
    Certificates {
        ca: file("ca", ca.pem()),
        certificate: file("certificate", certificate.pem()),
        key: file("key", key.serialize_pem()),
    }
}

fn tls_router(python: &Path, port: u16, certificates: &Certificates) -> Script {
    let config = json!({
        "mode": "router", "scouting/multicast/enabled": false, "listen/endpoints": [format!("tls/127.0.0.1:{port}")],
        "transport/link/tls/listen_certificate": certificates.certificate,
        "transport/link/tls/listen_private_key": certificates.key,
    });
    Script::start(python, "zenoh_client.py", &config)
}

#[test]
fn a_certificate_is_checked_both_by_authority_and_by_name() {
    let Some(python) = python() else { return };
    let (right, other) = (certificates("right", "localhost"), certificates("other", "localhost"));
    let port = free_port();
    let _router = tls_router(&python, port, &right);
    let to = |host: &str, ca: &Path, mode| Options {
        patience: real::PATIENCE,
        mode: Some(mode),
        ca: Some(ca.to_owned()),
        ..Options::to(&format!("tls/{host}:{port}"))
    };
    for mode in [Mode::Client, Mode::Peer] {
        is_up(&open(&to("localhost", &right.ca, mode)));
        for options in [to("localhost", &other.ca, mode), to("127.0.0.1", &right.ca, mode)] {
            let refused = ZenohBridge::open(&options, Inbox::new(1, Clock::running()));
            assert!(
                matches!(&refused, Err(BridgeError::Refused(why)) if why.contains("tls/")),
                "{refused:?}"
            );
        }
    }
}

#[test]
fn a_router_may_ask_for_user_and_password() {
    let Some(python) = python() else { return };
    let dictionary = std::env::temp_dir().join(format!("shsa-{}-users", std::process::id()));
    std::fs::write(&dictionary, "me:right\n").unwrap();
    let port = free_port();
    let config = json!({
        "mode": "router", "scouting/multicast/enabled": false, "listen/endpoints": [tcp(port)],
        "transport/auth/usrpwd/user": "router", "transport/auth/usrpwd/password": "its",
        "transport/auth/usrpwd/dictionary_file": dictionary,
    });
    let _router = Script::start(&python, "zenoh_client.py", &config);
    let patient = || Options { patience: real::PATIENCE, ..client(port) };
    let with = |password: &str| Options { user: Some(("me".into(), Secret(password.into()))), ..patient() };
    is_up(&open(&with("right")));
    for options in [with("wrong"), patient()] {
        let refused = ZenohBridge::open(&options, Inbox::new(1, Clock::running()));
        let why = format!("{refused:?}");
        assert!(matches!(&refused, Err(BridgeError::Refused(_))), "{why}");
        assert!(!why.contains("wrong"), "{why}");
    }
}

#[test]
fn tokens_tell_who_is_there_who_went_and_who_was_killed() {
    let Some(python) = python() else { return };
    let port = free_port();
    let mut a = open(&listening(port));
    let own = a.liveliness().declare("shsa/healer/a").unwrap();
    let watch = a.liveliness().watch("shsa/healer/*").unwrap();
    let next = || eventually("a change", || watch.next());
    assert_eq!(next(), Presence::Alive("shsa/healer/a".into()));
    let b = open(&Options::to(&tcp(port)));
    let token = b.liveliness().declare("/shsa/healer/b").unwrap();
    assert_eq!(next(), Presence::Alive("shsa/healer/b".into()));
    drop(token);
    assert_eq!(next(), Presence::Gone("shsa/healer/b".into()));
    drop(b);
    let mut stranger = script(&python, "peer", "connect", &tcp(port));
    stranger.order(&json!({"watch": "shsa/**"}));
    assert_eq!(stranger.next_with("token"), json!({"token": "shsa/healer/a", "alive": true}));
    stranger.order(&json!({"token": "shsa/healer/c"}));
    assert_eq!(next(), Presence::Alive("shsa/healer/c".into()));
    drop(own);
    assert_eq!(next(), Presence::Gone("shsa/healer/a".into()));
    let gone =
        eventually("the loss of a", || Some(stranger.next_with("token")).filter(|it| it["alive"] == false));
    assert_eq!(gone["token"], "shsa/healer/a");
    // A killed process is detected at once, because its socket is closed.
    while a.receive().is_some() {}
    drop(stranger);
    a.inbox().wait(real::PATIENCE);
    assert_eq!(next(), Presence::Gone("shsa/healer/c".into()));
}

#[test]
fn a_holder_that_hangs_is_gone_after_its_lease() {
    let Some(python) = python() else { return };
    let port = free_port();
    let a = open(&listening(port));
    let watch = a.liveliness().watch("shsa/healer/*").unwrap();
    let next = || eventually("a change", || watch.next());
    let mut stranger = Script::start(
        &python,
        "zenoh_client.py",
        &json!({
            "scouting/multicast/enabled": false, "listen/endpoints": [], "connect/endpoints": [tcp(port)],
            "transport/link/tx/lease": 1000,
        }),
    );
    stranger.order(&json!({"token": "shsa/healer/c"}));
    assert_eq!(next(), Presence::Alive("shsa/healer/c".into()));
    stranger.signal("STOP");
    assert_eq!(next(), Presence::Gone("shsa/healer/c".into()));
    stranger.signal("CONT");
    assert_eq!(next(), Presence::Alive("shsa/healer/c".into()));
}

#[test]
fn tokens_are_there_again_after_the_router_is() {
    let Some(python) = python() else { return };
    let port = free_port();
    let (a, b) = (open(&client(port)), open(&client(port)));
    let watch = a.liveliness().watch("shsa/healer/*").unwrap();
    let _token = b.liveliness().declare("shsa/healer/b").unwrap();
    let next = || eventually("a change", || watch.next());
    for _ in 0..2 {
        let router = router(&python, port);
        assert_eq!(next(), Presence::Alive("shsa/healer/b".into()));
        drop(router);
        assert_eq!(next(), Presence::Gone("shsa/healer/b".into()));
    }
}
