//! Nothing listens and nothing scouts unless set. A process of its own, so that it has no sockets of other tests.

use shsa_bridge::zenoh::{Options, ZenohBridge};
use shsa_bridge::{Bridge, Clock, Inbox};
use std::collections::BTreeSet;
use std::net::TcpListener;

/// The local addresses of this process's sockets in a table of the kernel, with their states: `0100007F:1F90 0A`.
#[cfg(target_os = "linux")]
fn sockets(table: &str) -> Vec<String> {
    let descriptors = std::fs::read_dir("/proc/self/fd").unwrap().filter_map(Result::ok);
    let targets = descriptors.filter_map(|entry| std::fs::read_link(entry.path()).ok());
    let own: BTreeSet<String> = targets
        .filter_map(|target| Some(target.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned()))
        .collect();
    let rows = std::fs::read_to_string(format!("/proc/self/net/{table}")).unwrap_or_default();
    let fields = rows.lines().skip(1).map(|row| row.split_whitespace().collect::<Vec<_>>());
    fields
        .filter(|row| row.get(9).is_some_and(|inode| own.contains(*inode)))
        .map(|row| format!("{} {}", row[1], row[3]))
        .collect()
}

#[test]
#[cfg(target_os = "linux")]
fn a_bridge_that_connects_opens_nothing_else() {
    const LISTENING: &str = " 0A";
    let hub = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = hub.local_addr().unwrap().port();
    drop(hub);
    let listening =
        || [sockets("tcp"), sockets("tcp6")].concat().iter().filter(|s| s.ends_with(LISTENING)).count();
    let inbox = || Inbox::new(1, Clock::running());
    let mut bridge = ZenohBridge::open(&Options::to(&format!("tcp/127.0.0.1:{port}")), inbox()).unwrap();
    bridge.subscribe_all().unwrap();
    assert_eq!((listening(), sockets("udp").len() + sockets("udp6").len()), (0, 0));
    let listening_too = Options { listen: vec![format!("tcp/127.0.0.1:{port}")], ..Options::default() };
    let hub = ZenohBridge::open(&listening_too, inbox()).unwrap();
    assert_eq!((listening(), sockets("udp").len() + sockets("udp6").len()), (1, 0));
    drop(hub);
}
