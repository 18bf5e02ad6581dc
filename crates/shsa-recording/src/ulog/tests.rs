//! ULogs written by these tests, and those of vehicles.

use super::super::tests::independent::{
    Reader, check_counts, check_cut, check_flipped, check_values, collected, expected, sample,
};
use super::*;

/// The reader, which has no options.
const READ: Reader = |input, _options, listener| read(input, listener);

/// A log under construction.
struct Writer(Vec<u8>);

impl Writer {
    fn new() -> Writer {
        Writer([MAGIC, &[1], &7_u64.to_le_bytes()].concat())
    }

    fn message(mut self, kind: u8, content: &[u8]) -> Writer {
        let size = u16::try_from(content.len()).unwrap();
        self.0.extend([&size.to_le_bytes()[..], &[kind], content].concat());
        self
    }

    fn format(self, text: &str) -> Writer {
        self.message(b'F', text.as_bytes())
    }

    fn topic(self, id: u16, instance: u8, name: &str) -> Writer {
        self.message(b'A', &[&[instance][..], &id.to_le_bytes(), name.as_bytes()].concat())
    }

    fn data(self, id: u16, time_us: u64, rest: &[u8]) -> Writer {
        self.message(b'D', &[&id.to_le_bytes()[..], &time_us.to_le_bytes(), rest].concat())
    }

    fn raw(mut self, bytes: &[u8]) -> Writer {
        self.0.extend_from_slice(bytes);
        self
    }
}

/// A topic `a` with a number and one list, of which messages come every millisecond.
fn begun() -> Writer {
    Writer::new()
        .format("a:uint64_t timestamp;float x;int16_t[2] list;uint8_t[4] _padding0;")
        .topic(3, 0, "a")
        .topic(4, 1, "a")
}

fn value(writer: Writer, step: u16) -> Writer {
    let number = f32::from(step) / 2.0;
    writer.data(3, 1_000 * u64::from(step), &[&number.to_le_bytes()[..], &[1, 0, 0xff, 0xff]].concat())
}

#[track_caller]
fn check(writer: Writer, topics: &[&str], damages: &[&str]) {
    let all = collected(READ, &writer.0);
    assert_eq!(all.shown(), topics);
    let shown: Vec<String> = all.damages.iter().map(|(place, what)| format!("{place:?} {what}")).collect();
    assert_eq!(shown, damages);
}

#[test]
fn topics_have_instances_and_fields() {
    let log = value(value(begun(), 1), 2).data(4, 2_500, &[0; 8]);
    let all = collected(READ, &log.0);
    assert_eq!(all.shown(), ["a a[0]: timestamp, x, list x2", "a a[1]: timestamp, x, list x1"]);
    assert_eq!(all.column("a[0]", "x"), [(1_000_000, "0.5".into()), (2_000_000, "1".into())]);
    assert_eq!(all.column("a[0]", "list[1]"), [(1_000_000, "-1.0".into()), (2_000_000, "-1.0".into())]);
}

#[test]
fn formats_stand_within_formats() {
    let log = Writer::new()
        .format("inner:int16_t a;int16_t b;")
        .format("outer:uint64_t timestamp;inner[2] esc;char[4] name;")
        .topic(0, 0, "outer")
        .data(0, 5, b"\x01\0\x02\0\x03\0\x04\0ab\0\0");
    let all = collected(READ, &log.0);
    assert_eq!(all.shown(), ["outer outer[0]: timestamp, esc[0].a, esc[0].b, esc[1].a, esc[1].b, name x1"]);
    assert_eq!(all.column("outer[0]", "esc[1].b"), [(5_000, "4".into())]);
    assert_eq!(all.column("outer[0]", "name"), [(5_000, "'ab'".into())]);
}

#[test]
fn the_boot_is_tied_to_the_epoch_by_the_first_fix() {
    let fix = |us: u64, kind: u8| [&us.to_le_bytes()[..], &[kind]].concat();
    let log = value(begun(), 1)
        .format("sensor_gps:uint64_t timestamp;uint64_t time_utc_usec;uint8_t fix_type;")
        .topic(9, 0, "sensor_gps")
        .data(9, 2_000, &fix(1_700_000_000_000_000, 0))
        .data(9, 3_000, &fix(1_600_000_000_000_000, 3));
    let all = collected(READ, &value(log, 4).0);
    let times: Vec<i64> = all.column("a[0]", "x").iter().map(|(time, _)| *time).collect();
    assert_eq!(times, [1_599_999_999_998_000_000, 1_600_000_000_001_000_000]);
}

#[test]
fn reading_goes_on_after_damage() {
    let mut log = begun();
    for step in 0..100 {
        log = value(log, step);
    }
    let length = HEADER + 2 + 16;
    let begin = begun().0.len();
    // The length of one message, the kind of another, the content of a third.
    log.0[begin + 20 * length + 1] = 0x40;
    log.0[begin + 40 * length + 2] = b'?';
    log.0[begin + 60 * length + 14] ^= 0x55;
    let lost = [20, 40]
        .map(|at| format!("Offset({}) no message begins here: 21 bytes are lost", begin + at * length));
    check(log, &["a a[0]: timestamp, x, list x98"], &lost.each_ref().map(String::as_str));
}

#[test]
fn a_hole_in_the_log_is_told_and_passed_over() {
    let (log, begin) = (value(begun(), 1), value(begun(), 1).0.len());
    let log = value(value(log.raw(&[b'x'; 70_000]), 2), 3);
    let hole = format!("Offset({begin}) no message begins here: 70000 bytes are lost");
    check(log, &["a a[0]: timestamp, x, list x3"], &[&hole]);
}

#[test]
fn a_log_that_is_cut_gives_what_is_whole() {
    let mut log = value(value(begun(), 1), 2);
    let end = log.0.len();
    log.0.truncate(end - 5);
    let cut = format!("Offset({}) the log ends within a message: 16 of 21 bytes are there", end - 21);
    check(log, &["a a[0]: timestamp, x, list x1"], &[&cut]);
    check(
        Writer(b"ULog\x01\x12\x35".to_vec()),
        &[],
        &["Offset(7) the log ends within its header of 16 bytes"],
    );
}

#[test]
fn messages_without_a_definition_are_counted() {
    let log = value(begun(), 1).data(77, 5, &[1]).data(77, 5, &[2]);
    let begin = value(begun(), 1).0.len();
    let said = "2 messages of number 77 from here on have no topic: its definition is lost";
    check(value(log, 2), &["a a[0]: timestamp, x, list x2"], &[&format!("Offset({begin}) {said}")]);
}

#[test]
fn what_was_appended_is_read() {
    let flags = |at: u64| [&[0; 8][..], &[1], &[0; 7], &at.to_le_bytes(), &[0; 16]].concat();
    let content = "a:uint64_t timestamp;float x;int16_t[2] list;".as_bytes();
    let start = Writer::new().message(b'B', &flags(0)).message(b'F', content).topic(3, 0, "a");
    // The message before is incomplete where the appended part begins.
    let before = value(start, 1).raw(&[18, 0, b'D', 3, 0, 1]);
    let at = before.0.len() as u64;
    let log = Writer::new().message(b'B', &flags(at)).message(b'F', content).topic(3, 0, "a");
    let log = value(value(log, 1).raw(&[18, 0, b'D', 3, 0, 1]), 2);
    check(log, &["a a[0]: timestamp, x, list x2"], &[]);
}

#[test]
fn dropouts_are_told() {
    let log = value(begun(), 1).message(b'O', &[50, 0]).message(b'O', &[0, 1]);
    let notes = collected(READ, &log.0).notes;
    assert!(notes[0].1.starts_with("the logger left messages out here: 2 times in all, 306 ms together"));
}

/// Fields are named `topic[0]#field`, or `topic#field` where that means the first instance.
fn check_sample(file: &str) {
    let (Some(bytes), Some(expected)) = (sample(&format!("ulog/{file}")), expected("ulog", file)) else {
        return;
    };
    let all = collected(READ, &bytes);
    assert_eq!(all.damages, []);
    check_counts(&all, &expected["datasets"]);
    for (name, of_field) in expected["fields"].as_object().unwrap() {
        let (topic, field) = name.split_once('#').unwrap();
        check_values(&all.column(&format!("{topic}[0]"), field), of_field, name);
    }
}

#[test]
fn logs_of_vehicles_are_read_as_pyulog_does() {
    for file in ["test_ulog.ulg", "sample_appended_multiple.ulg", "../../px4/sample_log_small.ulg"] {
        check_sample(file);
    }
}

#[test]
fn logs_of_vehicles_are_read_though_damaged() {
    let Some(bytes) = sample("ulog/test_ulog.ulg") else { return };
    check_cut(READ, &bytes);
    check_flipped(READ, &bytes, 0.9);
}
