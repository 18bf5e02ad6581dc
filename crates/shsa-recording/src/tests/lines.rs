//! JSON lines, intact and damaged, read and written.

use super::*;

#[track_caller]
fn check(text: &str, signals: &[&str], expected: &str) {
    let said = shown(&[("log.jsonl", text.as_bytes())], signals, &ReadOptions::default());
    assert_eq!(said, expected);
}

#[test]
fn values_of_all_shapes() {
    check(
        r#"{"signal": "/a", "time_ns": 500000000, "received_ns": 600000000, "value": 1.775}
{"signal": "/b", "time_ns": 500000000, "value": [1, null, "inf"]}

{"signal": "/a", "time_ns": 5.5e8, "value": {"lo": -1, "hi": "inf"}, "more": 1}
{"signal": "/a", "time_ns": 700000000, "received_ns": null, "value": null}
{"signal": "/other", "time_ns": 0, "value": 1}
"#,
        &["/a", "b"],
        "1@500=[1.0, NaN, inf]\n0@550=-1..inf\n0@500<600=1.775\n0@700=NaN",
    );
}

#[test]
fn a_signal_is_found_by_its_source_too() {
    let folder =
        Folder::with(&[("a.jsonl", b"{\"signal\": \"odom#x\", \"time_ns\": 1000000, \"value\": 1}")]);
    let wanted = [Wanted::new("/odom/speed", "odom#x"), Wanted::new("odom#x", "")];
    let recording = read(&[folder.0.join("a.jsonl")], &wanted, &ReadOptions::default()).unwrap();
    assert_eq!(show(&recording), "0@1=1\n1@1=1");
    assert_eq!(recording.found[0].places, ["a.jsonl: odom#x"]);
    assert_eq!(recording.first(), Some(Time(1_000_000)));
}

#[test]
fn damaged_lines_are_left_out() {
    check(
        "{\"signal\": \"/a\", \"time_ns\": 1000000, \"value\": 1}\n{\"signal\" /a}\n[1]\n\
         {\"signal\": 5}\n{\"signal\": \"/a\", \"time_ns\": 1e30, \"value\": 1}\n\
         {\"signal\": \"/a\", \"time_ns\": 2000000, \"value\": true}\n\
         {\"signal\": \"/a\", \"time_ns\": 3000000, \"value\": 3}\n{\"signal\": \"/a\", \"ti",
        &["/a"],
        "0@1=1\n0@3=3\n\
         ! log.jsonl:2: no JSON at column 11: expected `:` at line 1 column 11; line left out\n\
         ! log.jsonl:3: the line is no JSON object; line left out\n\
         ! log.jsonl:4: \"signal\" is missing or no text; line left out\n\
         ! log.jsonl:8: the file ends within this line; line left out\n\
         ! log.jsonl: 6 places in all are damaged\ndegraded",
    );
}

#[test]
fn extreme_times_are_kept_in_order_of_reception() {
    check(
        "{\"signal\": \"/a\", \"time_ns\": 9223372036854775807, \"received_ns\": 2000000, \"value\": 1}\n\
         {\"signal\": \"/a\", \"time_ns\": -9223372036854775808, \"received_ns\": 1000000, \"value\": 2}\n",
        &["/a"],
        "0@-9223372036854.775<1=2\n0@9223372036854.775<2=1\n\
         ! log.jsonl: signal /a: 1 time stamps are before the one ahead of them in the file",
    );
}

#[test]
fn what_is_written_is_read_again() {
    let sample =
        |wanted, time, received, value| Sample { wanted, time: Time(time), received: Time(received), value };
    let samples = [
        sample(0, i64::MIN, i64::MIN, RawValue::Number(0.1)),
        sample(1, 7, -5, RawValue::Vector(vec![1e308, f64::NEG_INFINITY, 5e-324])),
        sample(0, 3, 4, RawValue::Interval { lo: f64::NEG_INFINITY, hi: -0.0 }),
        sample(0, 1_432_235_498_025_043_042, i64::MAX, RawValue::Number(f64::INFINITY)),
    ];
    let names = ["/a", "/b"];
    let mut text = Vec::new();
    write_jsonl(&mut text, &samples, |wanted| names[wanted]).unwrap();
    let folder = Folder::with(&[("w.jsonl", &text)]);
    let recording = read(std::slice::from_ref(&folder.0), &wanted(&names), &ReadOptions::default()).unwrap();
    assert_eq!(recording.samples, samples);
    let topics = topics(&folder.0.join("w.jsonl"));
    let shown: Vec<_> =
        topics.iter().map(|topic| format!("{} {} {}", topic.name, topic.kind, topic.count)).collect();
    assert_eq!(shown, ["/a number 3", "/b list 1"]);
}

#[test]
fn not_a_number_is_written_as_null() {
    let value = RawValue::Number(f64::NAN);
    let sample = Sample { wanted: 0, time: Time(1), received: Time(2), value };
    let mut text = Vec::new();
    write_jsonl(&mut text, [&sample], |_| "/a").unwrap();
    let text = String::from_utf8(text).unwrap();
    assert_eq!(text, "{\"signal\":\"/a\",\"time_ns\":1,\"received_ns\":2,\"value\":null}\n");
}

#[test]
fn fields_of_the_whole_file_are_known() {
    let text = "a v=1 1600000000000000000\na v=2 1600000001000000000\na w=3 1600000002000000000\n";
    assert_eq!(shown(&[("log.lp", text.as_bytes())], &["a#w"], &ReadOptions::default()), "0@1600000002000=3");
    let folder = Folder::with(&[("log.lp", text.as_bytes())]);
    let topics = topics(&folder.0.join("log.lp"));
    let fields: Vec<_> = topics[0].fields.iter().map(|field| (&*field.path, field.kind)).collect();
    assert_eq!(fields, [("v", "number"), ("w", "number")]);
}
