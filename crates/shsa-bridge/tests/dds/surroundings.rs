//! What is around the bridge: the interfaces of its machine, and the clock.

use crate::contract::inbox;
use crate::real::network::{Multicast, alone_with};
use crate::real::{Script, eventually, python};
use crate::{DOMAIN, bridge, number, observe, with_multicast};
use serde_json::json;
use shsa_bridge::dds::{DdsBridge, Interfaces, Options};
use shsa_bridge::{Bridge, Outgoing, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Changes this network.
fn ip(step: &str) {
    let command = format!("PATH=$PATH:/usr/sbin:/sbin; ip {step}");
    let output = std::process::Command::new("sh").args(["-c", &command]).output().unwrap();
    assert!(output.status.success(), "{step}: {output:?}");
}

/// The interfaces on which DDS is listened for, and the datagrams that a second interface has sent.
fn reach() -> (Vec<&'static str>, u64) {
    let groups = std::fs::read_to_string("/proc/net/igmp").unwrap();
    // The lines of an interface's groups follow its own; 239.255.0.1 as a number.
    let mut within = "";
    let mut joined = Vec::new();
    for line in groups.lines() {
        within = ["lo", "field0"].into_iter().find(|name| line.contains(name)).unwrap_or(within);
        if line.contains("0100FFEF") {
            joined.push(within);
        }
    }
    let counts = std::fs::read_to_string("/proc/net/dev").unwrap();
    let second = counts.lines().find_map(|line| line.trim().strip_prefix("field0:")).unwrap();
    (joined, second.split_whitespace().nth(9).unwrap().parse().unwrap())
}

#[test]
fn nothing_is_announced_but_on_the_interfaces_that_were_named() {
    with_multicast("surroundings::nothing_is_announced_but_on_the_interfaces_that_were_named", || {
        // Its other end is there to carry what is sent; without addresses of IPv6, the machine itself sends nothing.
        for step in [
            "link add field0 type veth peer name field1",
            "link set field0 addrgenmode none",
            "link set field1 addrgenmode none",
            "link set field0 up",
            "link set field1 up",
            "address add 10.213.78.1/24 dev field0",
        ] {
            ip(step);
        }
        let open = |interfaces: Interfaces| {
            let options = Options { interfaces, domain: DOMAIN, ..Options::default() };
            let mut bridge = DdsBridge::open(&options, inbox(8)).unwrap();
            for _ in 0..10 {
                bridge
                    .publish(Outgoing::new("/dmin", Time(1), Payload::Value(RawValue::Number(1.0))))
                    .unwrap();
                std::thread::sleep(Duration::from_millis(50));
            }
            bridge
        };
        let (_, before) = reach();
        let bridge = open(Interfaces::Loopback);
        assert_eq!(reach(), (vec!["lo"], before));
        drop(bridge);
        let named = |name: &str| Interfaces::Named(vec![name.into()]);
        for interfaces in [named("field0"), named("10.213.78.1")] {
            let (_, before) = reach();
            let bridge = open(interfaces);
            let (joined, after) = reach();
            assert_eq!(joined, ["field0"]);
            assert!(after > before, "{after}");
            drop(bridge);
        }
        let bridge = open(Interfaces::All);
        assert_eq!(reach().0, ["lo", "field0"]);
        // This is the limit that the documents state: the ports are open on all interfaces.
        let sockets = std::fs::read_to_string("/proc/net/udp").unwrap();
        let open_ports = sockets.lines().filter(|line| line.contains(" 00000000:")).count();
        assert!(open_ports >= 4, "{sockets}");
        drop(bridge);
    });
}

/// Sets the clock of this test and its node, which libfaketime reads from a file.
fn set_clock(file: &Path, step: &str) {
    let new = file.with_extension("new");
    std::fs::write(&new, step).unwrap();
    std::fs::rename(new, file).unwrap();
}

#[test]
fn nodes_are_heard_after_the_clock_was_set_back() {
    let test = "surroundings::nodes_are_heard_after_the_clock_was_set_back";
    let (Some(python), Some(library)) = (python(), libfaketime()) else { return };
    // Its place is known in the inner process, too, which has another number.
    let file = std::env::var_os("FAKETIME_TIMESTAMP_FILE").map(PathBuf::from);
    let file = file.unwrap_or_else(|| std::env::temp_dir().join(format!("shsa-dds-{}", std::process::id())));
    set_clock(&file, "+0");
    let variables = [
        ("LD_PRELOAD", library.as_str()),
        ("FAKETIME_TIMESTAMP_FILE", file.to_str().unwrap()),
        ("FAKETIME_DONT_FAKE_MONOTONIC", "1"),
        ("FAKETIME_NO_CACHE", "1"),
    ];
    alone_with(test, Multicast::On, &variables, || {
        let mut node = Script::start(&python, "dds_node.py", &json!({"multicast": true, "domain": DOMAIN}));
        let (mut bridge, before) = (bridge(), SystemTime::now());
        bridge.subscribe("/speed", None).unwrap();
        let order = json!({"publish": "/speed", "type": "std_msgs/msg/Float64", "set": {"data": 1.0}});
        observe(&mut node, &mut bridge, &order);
        node.order(&json!({"subscribe": "/dmin", "type": "std_msgs/msg/Float64", "get": "data"}));
        let publish = |bridge: &mut DdsBridge, number: f64| {
            bridge
                .publish(Outgoing::new("/dmin", Time(1), Payload::Value(RawValue::Number(number))))
                .unwrap();
        };
        publish(&mut bridge, 1.0);
        let identity = bridge.publisher();
        set_clock(&file, "-3600");
        assert!(SystemTime::now() < before, "libfaketime sets the clock");
        let again = json!({"publish": "/speed", "type": "std_msgs/msg/Float64", "set": {"data": 2.0}});
        eventually("a message of after the step", || {
            node.order(&again);
            bridge.inbox().wait(Duration::from_millis(50));
            std::iter::from_fn(|| bridge.receive()).find(|it| number(it, "").0 == RawValue::Number(2.0))
        });
        assert_ne!(bridge.publisher(), identity);
        eventually("our message of after the step", || {
            publish(&mut bridge, 2.0);
            node.poll("heard", Duration::from_millis(100)).filter(|heard| heard["value"] == json!(2.0))
        });
    });
    let _absent = std::fs::remove_file(file);
}

/// The library that fakes the time of a process; prints SKIPPED if there is none.
fn libfaketime() -> Option<String> {
    let folders = std::fs::read_dir("/usr/lib").into_iter().flatten().flatten();
    let mut places = folders.map(|folder| folder.path().join("faketime/libfaketime.so.1"));
    let found = places.find(|place| place.exists());
    if found.is_none() {
        eprintln!("SKIPPED: libfaketime is absent; `cargo xtask test` installs it");
    }
    found.map(|place| place.display().to_string())
}
