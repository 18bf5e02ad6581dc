//! Messages that do not fit their definitions give no values, and are counted.

use super::bag_writer::{self, Packing};
use super::mcap_writer::{channel, file, message, schema};
use super::*;

/// A file with these messages of one topic.
fn mcap(about: &[Vec<u8>], messages: &[&[u8]]) -> Vec<u8> {
    let messages = (1..).zip(messages).map(|(at, data)| message(1, at * 1_000_000, 0, data));
    file(&about.iter().cloned().chain(messages).collect::<Vec<_>>())
}

#[track_caller]
fn check(about: &[Vec<u8>], messages: &[&[u8]], source: &str, expected: &str) {
    let said = shown(&[("a.mcap", &mcap(about, messages))], &[source], &ReadOptions::default());
    assert_eq!(said, expected);
}

#[test]
fn messages_of_ros_2() {
    let about = [schema(1, "a/msg/A", "ros2msg", b"uint8 x\nint16 y"), channel(1, 1, "/a", "cdr")];
    let whole = b"\0\x01\0\0\x01\0\x02\0";
    let padded = [&whole[..], &[0; 3]].concat();
    let long = [&whole[..], &[0; 4]].concat();
    let second = [&b"\0\x07\0\0"[..], &whole[4..]].concat();
    let sized = b"\0\x09\0\0\x04\0\0\0\x05\0\x06\0";
    let unsized_one = [&b"\0\x09\0\0"[..], &whole[4..]].concat();
    let other = [&b"\0\x03\0\0"[..], &whole[4..]].concat();
    check(
        &about,
        &[whole, &padded, &long, &whole[..7], &second, sized, &unsized_one, &other],
        "a#y",
        "0@1=2\n0@2=2\n0@5=2\n0@6=6\n! a.mcap: topic /a: 3 messages do not fit their definition a/msg/A; left out\n\
         ! a.mcap: topic /a: 1 messages are not read here; the first: an encapsulation 0x0003 (a parameter list) \
         is no plain CDR (0x0000 or 0x0001)\ndegraded",
    );
}

#[test]
fn messages_of_json() {
    let about = [channel(1, 0, "/a", "json")];
    let messages: [&[u8]; 4] = [b"{\"x\": 1}", b"{\"x\": 2} 3", b"{\"x\": 4", b"{\"x\": \"\xff\"}"];
    let said = "0@1=1\n! a.mcap: topic /a: 3 messages do not fit their definition; left out\ndegraded";
    check(&about, &messages, "a#x", said);
}

#[test]
fn messages_of_ros_1() {
    let connection = bag_writer::connection(0, "/a", "a/A", "int16 x");
    let messages = [vec![1, 0], vec![2, 0, 0], vec![3]];
    let messages = (1..).zip(&messages).map(|(at, data)| bag_writer::message(0, at, data));
    let records: Vec<u8> = [connection.clone()].into_iter().chain(messages).flatten().collect();
    let bag = bag_writer::bag(&[bag_writer::chunk(Packing::None, &records)], &[connection]);
    let said = shown(&[("a.bag", &bag)], &["a#x"], &ReadOptions::default());
    assert_eq!(
        said,
        "0@1=1\n! a.bag: topic /a: 2 messages do not fit their definition a/A; left out\ndegraded"
    );
}

#[test]
fn events_of_a_service() {
    let about = [
        schema(1, "a/srv/Add_Event", "ros2msg", b"int64 a\nint64 b\n---\nint64 sum"),
        channel(1, 1, "/add/_service_event", "cdr"),
    ];
    let body = [
        &[1, 0, 0, 0][..],
        &[0; 8],
        &[7; 16],
        &[0; 4],
        &5_i64.to_le_bytes(),
        &[1, 0, 0, 0, 0, 0, 0, 0],
        &1_i64.to_le_bytes(),
        &3_i64.to_le_bytes(),
        &[0; 4],
    ];
    let event = [&b"\0\x01\0\0"[..], &body.concat()].concat();
    check(&about, &[&event], "/add/_service_event#request[0].b", "0@1=3");
    check(&about, &[&event], "/add/_service_event#info.sequence_number", "0@1=5");
}
