//! Reading and writing of payloads, one case a line; and arbitrary bytes, compared with the JSON of `serde_json`.

mod lists;

use super::*;
use crate::{Message, Payload, Provenance, Quality};
use proptest::prelude::*;
use serde_json::Value;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::source::{Field, StampField};

fn field(path: &str, stamp: &str) -> Field {
    let (stamp, step) = stamp.split_once('*').map_or((stamp, None), |(path, step)| (path, step.parse().ok()));
    let stamp = StampField { path: stamp.into(), step: step.map(Span) };
    Field { path: path.into(), stamp: Some(stamp).filter(|stamp| !stamp.path.is_empty()) }
}

/// The readings of a payload, one field after the other.
fn read(reader: &mut Reader, payload: &[u8]) -> String {
    let mut readings = Vec::new();
    reader.read_bytes(payload, |_, reading| {
        readings.push(match reading {
            Err(unreadable) => format!("? {unreadable}"),
            Ok(Reading { value, stamp }) => {
                let stamp = stamp.map_or(String::new(), |stamp| format!(" at {}", stamp.0));
                match value {
                    RawValue::Number(value) => format!("{value}{stamp}"),
                    RawValue::Interval { lo, hi } => format!("{lo}..{hi}{stamp}"),
                    RawValue::Vector(values) => format!("{values:?}{stamp}"),
                }
            }
        });
    });
    readings.join(" | ")
}

#[track_caller]
fn check(path: &str, payload: &str, expected: &str) {
    check_stamped(path, "", payload, expected);
}

#[track_caller]
fn check_stamped(path: &str, stamp: &str, payload: &str, expected: &str) {
    let mut reader = Reader::new(&[field(path, stamp)], SIZE_LIMIT).unwrap();
    assert_eq!(read(&mut reader, payload.as_bytes()), expected);
}

#[test]
fn plain_payloads_are_numbers_or_words() {
    check("", "21.5", "21.5");
    check("data", " -3e2\n", "-300");
    check("", "+.5", "0.5");
    check("", "ON", "1");
    check("", "false", "0");
    check("", "NaN", "NaN");
    check("", "-inf", "-inf");
    check("", "\"21.5\"", "21.5");
    check("", "[1, 2.5, \"3\", null, NaN]", "[1.0, 2.5, 3.0, NaN, NaN]");
    check("", "[]", "[]");
    check("", "", "? an empty payload");
    check("", "null", "? the payload is null, no number");
    check("", "unavailable", "? the payload is the text 'unavailable', no number");
    check("", "21.5 °C", "? the payload is the text '21.5 °C', no number");
    check("a.b", "7", "? the payload is the text '7', no object");
}

#[test]
fn fields_of_json_are_found_by_path() {
    let payload = r#"{"pose": {"x": -1.5, "y": "2"}, "on": true, "list": [1, [2, 3]], "a.b": 4, "s/m": 5}"#;
    check("pose.x", payload, "-1.5");
    check("pose.y", payload, "2");
    check("/pose/x", payload, "-1.5");
    check("on", payload, "1");
    check("list[0]", payload, "1");
    check("/list/1/0", payload, "2");
    check("list[1]", payload, "[2.0, 3.0]");
    check("/a.b", payload, "4");
    check("/s~1m", payload, "5");
    check("pose", payload, "? `pose` is an object, no number; name one of its members");
    check("list", payload, "? element 1 of `list` is a list, no number");
    check("pose.z", payload, "? `pose.z` is absent");
    check("list[2]", payload, "? `list[2]` is absent");
    check("x", r#"{"x": null}"#, "? `x` is null, no number");
    check("x", r#"{"x": Infinity, "y": -Infinity}"#, "inf");
    check("x", r#"{"x": 1, "x": 2}"#, "2");
    check("x.y", r#"{"x": {"y": 1}, "x": {"z": 2}}"#, "? `x.y` is absent");
    check("caf\u{e9}", r#"{"caf\u00e9": 1}"#, "1");
    check("", r#"{"data": 7}"#, "7");
    check("data", r#"{"data": [1, 2]}"#, "[1.0, 2.0]");
    check(
        "temp",
        r#"{"temp": "line\nbreak, and much more than is shown"}"#,
        "? `temp` is the text 'line\u{fffd}break, and much mor..', no number",
    );
}

#[test]
fn intervals_and_envelopes_are_understood() {
    check("", r#"{"lo": 1, "hi": 2}"#, "1..2");
    check("a", r#"{"a": {"hi": 2, "lo": 1, "value": 1.5}}"#, "1..2");
    check("", r#"{"value": 5, "lo": null, "hi": null, "stamp_ns": 7}"#, "5 at 7");
    check("", r#"{"value": 5, "lo": 4, "hi": 6, "stamp_ns": 7}"#, "4..6 at 7");
    check("", r#"{"data": {"lo": 4, "hi": 6, "stamp_ns": 8}}"#, "4..6 at 8");
    check(
        "",
        r#"{"value": null, "lo": null, "hi": null, "stamp_ns": 7}"#,
        "? the payload is null, no number",
    );
    check("", r#"{"lo": 1}"#, "? the payload is an object, no number; name one of its members");
    check("", r#"{"lo": 1, "hi": "x"}"#, "? the payload is the text 'x', no number");
}

#[test]
fn conditions_choose_elements_and_messages() {
    let joints = r#"{"position": [0.5, 0.7], "name": ["left", "right"]}"#;
    check("position[name=right]", joints, "0.7");
    check("position[name=middle]", joints, "");
    check(
        "position[name=right]",
        r#"{"position": [0.5], "name": ["left", "right"]}"#,
        "? `position[name=right]` is absent",
    );
    check(
        "position[name=right]",
        r#"{"position": 3, "name": ["left", "right"]}"#,
        "? `position[name=right]` is a number, no list",
    );
    check("value[id=3]", r#"{"id": 3.0, "value": 8}"#, "8");
    check("value[id=3]", r#"{"id": "3", "value": 8}"#, "8");
    check("value[id=3]", r#"{"id": 4, "value": 8}"#, "");
    check("value[id=3]", r#"{"value": 8}"#, "");
    check("[id=3]", r#"{"id": 3, "value": 8}"#, "8");
}

#[test]
fn stamps_are_read_in_their_forms() {
    let pair = r#"{"v": 1, "header": {"stamp": {"sec": 3, "nanosec": 5}}}"#;
    check_stamped("v", "header.stamp", pair, "1 at 3000000005");
    check_stamped("v", "t", r#"{"v": 1, "t": {"secs": 3, "nsecs": 5}}"#, "1 at 3000000005");
    check_stamped("v", "t", r#"{"v": 1, "t": 1.5}"#, "1 at 1500000000");
    check_stamped("v", "t", r#"{"v": 1, "t": "2024-05-01T10:00:00Z"}"#, "1 at 1714557600000000000");
    check_stamped("v", "t*1000000", r#"{"v": 1, "t": 20}"#, "1 at 20000000");
    check_stamped("v", "t", r#"{"v": 1}"#, "? the stamp `t` is absent");
    check_stamped(
        "v",
        "t",
        r#"{"v": 1, "t": "noon"}"#,
        "? the stamp `t` is the text 'noon', no time in a known form",
    );
    check_stamped(
        "v",
        "t",
        r#"{"v": 1, "t": {"sec": 99999999999999, "nanosec": 0}}"#,
        "? the stamp `t` is an object, no time in a known form",
    );
}

#[test]
fn garbage_says_where() {
    check("x", "{\"x\": 1", "? no JSON: byte 7 should be a comma or a closing brace");
    check("x", "{\"x\": 1} 2", "? no JSON: byte 9 should be the end");
    check("x", "{\"x\": }", "? no JSON: byte 6 should be a value");
    check("x", "{'x': 1}", "? no JSON: byte 1 should be a name in quotes");
    check("x", &"[".repeat(100_000), "? no JSON: byte 64 should be no deeper nesting");
    let mut reader = Reader::new(&[field("x", ""), field("y", "")], 8).unwrap();
    assert_eq!(read(&mut reader, b"ab\xff"), "? byte 2 is no text (UTF-8) | ? byte 2 is no text (UTF-8)");
    assert_eq!(read(&mut reader, b"123456789"), "? 9 bytes, more than 8 | ? 9 bytes, more than 8");
    assert_eq!(read(&mut reader, b"{\"y\":1}"), "? `x` is absent | 1");
}

#[test]
fn values_that_were_never_encoded_are_passed_on() {
    let mut reader = Reader::new(&[field("", ""), field("data", ""), field("x", "")], SIZE_LIMIT).unwrap();
    let message = Message::new("a".into(), Time(0), Payload::Value(RawValue::Number(4.0)));
    let mut readable = Vec::new();
    reader.read(&message, |index, reading| readable.push((index, reading.is_ok())));
    assert_eq!(readable, [(0, true), (1, true), (2, false)]);
}

fn written(mut writer: Writer, pattern: &str, value: Option<&RawValue>) -> String {
    if !pattern.is_empty() {
        writer.learn(&pattern.to_owned().into());
    }
    let provenance = Provenance::new(Quality::Substitute, "a \"b\"");
    match writer.write(value, Time(1_500_000_000), &provenance) {
        Ok(None) => "nothing".into(),
        Ok(Some(bytes)) => String::from_utf8(bytes.to_vec()).unwrap(),
        Err(unreadable) => format!("? {unreadable}"),
    }
}

#[test]
fn plain_values_and_envelopes_are_written() {
    #[track_caller]
    fn check(value: Option<RawValue>, plain: &str, json: &str) {
        assert_eq!(written(Writer::plain(), "", value.as_ref()), plain);
        let rest = r#""stamp_ns":1500000000,"quality":"UncertainSubstituteValue","status":1083244544,"source":"a \"b\""}"#;
        assert_eq!(written(Writer::envelope(), "", value.as_ref()), format!("{{{json},{rest}"));
    }
    check(Some(RawValue::Number(2.0)), "2", r#""value":2,"lo":null,"hi":null"#);
    check(Some(RawValue::Interval { lo: 1.0, hi: 2.0 }), "1.5", r#""value":1.5,"lo":1,"hi":2"#);
    check(
        Some(RawValue::Vector(vec![1.0, f64::INFINITY])),
        "[1,null]",
        r#""value":[1,null],"lo":null,"hi":null"#,
    );
    check(Some(RawValue::Number(f64::NAN)), "NaN", r#""value":null,"lo":null,"hi":null"#);
    check(Some(RawValue::Number(-1e300)), "-1e300", r#""value":-1e300,"lo":null,"hi":null"#);
    check(None, "nothing", r#""value":null,"lo":null,"hi":null"#);
}

#[test]
fn a_takeover_keeps_the_shape_of_the_source() {
    #[track_caller]
    fn check(path: &str, stamp: &str, pattern: &str, value: RawValue, expected: &str) {
        assert_eq!(
            written(Writer::like(field(path, stamp), SIZE_LIMIT).unwrap(), pattern, Some(&value)),
            expected
        );
    }
    let half = || RawValue::Interval { lo: 0.25, hi: 0.75 };
    check("", "", " 21.5\n", half(), " 0.5\n");
    check("", "", "OFF", RawValue::Number(1.0), "ON");
    check("", "", "true", RawValue::Number(0.0), "false");
    check(
        "a.b",
        "",
        r#"{ "id":"é", "a": {"b" :"7", "c":1} }"#,
        half(),
        r#"{ "id":"é", "a": {"b" :"0.5", "c":1} }"#,
    );
    check("v", "t", r#"{"t": 1.25, "v": 3}"#, half(), r#"{"t": 1.500000000, "v": 0.5}"#);
    check(
        "v",
        "t",
        r#"{"t":"2024-05-01T10:00:00+02:00","v":3}"#,
        half(),
        r#"{"t":"1970-01-01T00:00:01.500000000Z","v":0.5}"#,
    );
    check(
        "v",
        "t",
        r#"{"v": 3, "t": {"nanosec": 7, "sec": 8}}"#,
        half(),
        r#"{"v": 0.5, "t": {"nanosec": 500000000, "sec": 1}}"#,
    );
    check(
        "",
        "",
        r#"{"value":1,"lo":0,"hi":2,"stamp_ns":9,"quality":"Good"}"#,
        half(),
        r#"{"value":0.5,"lo":0.25,"hi":0.75,"stamp_ns":1500000000,"quality":"Good"}"#,
    );
    check(
        "position[name=b]",
        "",
        r#"{"name":["a","b"],"position":[1,2]}"#,
        half(),
        r#"{"name":["a","b"],"position":[1,0.5]}"#,
    );
    check("list", "", r#"{"list":[1,2,3]}"#, RawValue::Vector(vec![4.0, 5.0]), r#"{"list":[4,5]}"#);
    check("v", "", r#"{"v": 3}"#, RawValue::Number(f64::NAN), r#"{"v": null}"#);
    check(
        "v",
        "",
        r#"{"v": [3]}"#,
        half(),
        "? the field of the signal to be replaced is no number, no number",
    );
    check("v", "", r#"{"w": 3}"#, half(), "? `v` is absent");
    check("v", "", "", half(), "? a payload of the signal to be replaced is absent");
}

/// Any JSON value of some depth.
fn any_json() -> impl Strategy<Value = Value> {
    let number = prop_oneof![any::<f64>().prop_map(Value::from), any::<i64>().prop_map(Value::from)];
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        number,
        "[\\PC\n\"\\\\]{0,6}".prop_map(Value::from)
    ];
    leaf.prop_recursive(4, 40, 5, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..5).prop_map(Value::from),
            prop::collection::btree_map("[ab/~\"\u{e9}]{0,2}", inner, 0..5)
                .prop_map(|members| Value::Object(members.into_iter().collect())),
        ]
    })
}

/// Every pointer into a value.
fn pointers(value: &Value, at: &str, all: &mut Vec<String>) {
    all.push(at.to_owned());
    match value {
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(index, value)| pointers(value, &format!("{at}/{index}"), all));
        }
        Value::Object(members) => members.iter().for_each(|(name, value)| {
            let name = name.replace('~', "~0").replace('/', "~1");
            pointers(value, &format!("{at}/{name}"), all);
        }),
        _ => {}
    }
}

fn expected(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        Value::Bool(on) => Some(f64::from(u8::from(*on))),
        Value::String(text) => {
            // Blanks are the only white space that may stand unescaped in a text.
            let text = text.trim_matches(' ');
            let on = ["on", "true"].iter().any(|word| word.eq_ignore_ascii_case(text));
            let off = ["off", "false"].iter().any(|word| word.eq_ignore_ascii_case(text));
            text.parse().ok().or(on.then_some(1.0)).or(off.then_some(0.0))
        }
        _ => None,
    }
}

fn is_json(text: &str) -> bool {
    serde_json::from_str::<serde::de::IgnoredAny>(text).is_ok()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn every_scalar_of_any_json_is_read_as_serde_json_reads_it(value in any_json(), pretty: bool) {
        let text = if pretty { serde_json::to_string_pretty(&value) } else { serde_json::to_string(&value) }.unwrap();
        let mut all = Vec::new();
        pointers(&value, "", &mut all);
        let scalars: Vec<_> = all.iter().filter(|at| {
            let value = value.pointer(at).unwrap();
            !at.is_empty() && !value.is_array() && !value.is_object()
        }).collect();
        let fields: Vec<_> = scalars.iter().map(|at| field(at, "")).collect();
        let mut reader = Reader::new(&fields, SIZE_LIMIT).unwrap();
        let mut count = 0;
        reader.read_bytes(text.as_bytes(), |index, reading| {
            let wanted = expected(value.pointer(scalars[index]).unwrap());
            let read = reading.ok().map(|reading| reading.value);
            assert_eq!(format!("{:?}", wanted.map(RawValue::Number)), format!("{read:?}"), "{}", scalars[index]);
            count += 1;
        });
        prop_assert_eq!(count, scalars.len());
    }

    #[test]
    fn what_is_json_and_what_not_is_as_serde_json_says(
        value in any_json(), cut in 0..40_usize, from in any::<prop::sample::Index>(), with in "[\\[\\]{}\",:.eE0-9a-z\\\\ \n-]{0,3}",
    ) {
        let mut text: Vec<char> = value.to_string().chars().collect();
        let from = from.index(text.len());
        text.splice(from..(from + cut % 3).min(text.len()), with.chars());
        let text: String = text.into_iter().collect();
        if text.trim_ascii().starts_with(['{', '[', '"']) {
            let mut reader = Reader::new(&[field("", "")], SIZE_LIMIT).unwrap();
            let output = read(&mut reader, text.as_bytes());
            prop_assert_eq!(!output.starts_with("? no JSON"), is_json(&text), "{}: {}", text, output);
        }
    }

    #[test]
    fn any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let fields = [field("", ""), field("a.b[0]", "t"), field("a[b=c]", "")];
        let output = read(&mut Reader::new(&fields, 100).unwrap(), &bytes);
        prop_assert!(output.len() < 600, "{}", output);
        let mut writer = Writer::like(fields[1].clone(), 100).unwrap();
        writer.learn(&bytes.into());
        let _written = writer.write(Some(&RawValue::Number(1.0)), Time(0), &Provenance::new(Quality::Good, ""));
    }

    #[test]
    fn what_a_takeover_writes_is_read_as_it_was_meant(
        value in any_json(), lo in -1e6..1e6_f64, width in 0.0..10.0_f64, at in any::<prop::sample::Index>(),
    ) {
        let text = value.to_string();
        // `serde_json` reads numbers to an ulp only.
        let value: Value = serde_json::from_str(&text).unwrap();
        let mut all = Vec::new();
        pointers(&value, "", &mut all);
        all.retain(|path| !path.is_empty() && value.pointer(path).unwrap().is_number());
        prop_assume!(!all.is_empty());
        let path = at.get(&all);
        let mut writer = Writer::like(field(path, ""), SIZE_LIMIT).unwrap();
        writer.learn(&text.clone().into());
        let new = RawValue::Interval { lo, hi: lo + width };
        let bytes = writer.write(Some(&new), Time(0), &Provenance::new(Quality::Good, "")).unwrap().unwrap();
        let after: Value = serde_json::from_slice(&bytes).unwrap();
        let number = after.pointer(path).and_then(Value::as_f64).unwrap();
        prop_assert!(lo <= number && number <= lo + width);
        let mut expected = value.clone();
        *expected.pointer_mut(path).unwrap() = after.pointer(path).unwrap().clone();
        prop_assert_eq!(expected, after);
    }
}
