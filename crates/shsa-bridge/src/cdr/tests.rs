//! CDR as a whole: written messages can be read, in both byte orders, and invalid bytes do no harm.

use super::*;
use crate::payload::{Reading, Unreadable};
use proptest::prelude::*;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::path::Path;
use shsa_message::ros::{Body, Count, Kind, Layout, Plan, Types};
use shsa_message::source::Field;

fn field(path: &str) -> Field {
    Field { path: path.into(), stamp: None }
}

/// All fields of a message, or the reasons why they cannot be read.
fn read(message_type: &str, paths: &[&str], message: &[u8]) -> Vec<Result<Reading, Unreadable>> {
    let fields: Vec<Field> = paths.iter().map(|path| field(path)).collect();
    let reader = Reader::new(&fields, message_type, &Types::standard()).unwrap();
    let mut readings = Vec::new();
    reader.read(message, |_, reading| readings.push(reading));
    readings
}

fn writer(message_type: &str, path: &str) -> Writer {
    Writer::new(message_type, path, Types::standard()).unwrap()
}

/// A joint state of two joints in its encoding.
fn joints(is_big_endian: bool) -> Vec<u8> {
    let word = |n: u32| if is_big_endian { n.to_be_bytes() } else { n.to_le_bytes() };
    let double = |x: f64| if is_big_endian { x.to_be_bytes() } else { x.to_le_bytes() };
    let mut bytes = vec![0, u8::from(!is_big_endian), 0, 0];
    let pad = |bytes: &mut Vec<u8>, to: usize| bytes.resize((bytes.len() - 4).next_multiple_of(to) + 4, 0);
    bytes.extend([word(7), word(500), word(1)].concat());
    bytes.push(0);
    pad(&mut bytes, 4);
    bytes.extend(word(2));
    for name in ["left", "right"] {
        pad(&mut bytes, 4);
        bytes.extend(word(name.len() as u32 + 1));
        bytes.extend(name.bytes().chain([0]));
    }
    pad(&mut bytes, 4);
    bytes.extend(word(2));
    pad(&mut bytes, 8);
    bytes.extend([double(1.5), double(-2.5)].concat());
    bytes.extend([word(0), word(1)].concat());
    pad(&mut bytes, 8);
    bytes.extend(double(9.0));
    bytes
}

#[test]
fn fields_are_read_by_path_in_both_byte_orders() {
    for is_big_endian in [false, true] {
        let paths =
            ["position", "position[1]", "position[name=right]", "velocity", "effort.0", "header.stamp"];
        let readings = read("sensor_msgs/JointState", &paths, &joints(is_big_endian));
        let values: Vec<RawValue> = readings.iter().map(|reading| reading.clone().unwrap().value).collect();
        assert_eq!(
            values,
            [
                RawValue::Vector(vec![1.5, -2.5]),
                RawValue::Number(-2.5),
                RawValue::Number(-2.5),
                RawValue::Vector(vec![]),
                RawValue::Number(9.0),
                RawValue::Number(7.000_000_5),
            ]
        );
        assert_eq!(readings[0].clone().unwrap().stamp, Some(Time(7_000_000_500)));
        assert!(
            read("sensor_msgs/JointState", &["position[name=middle]"], &joints(is_big_endian)).is_empty()
        );
    }
}

#[test]
fn a_field_of_each_element_is_a_list() {
    let of = |index: usize, x: f64| (format!("transforms[{index}].transform.translation.x"), x);
    let fields: Vec<(String, f64)> = vec![of(0, 1.5), of(1, -2.5), of(2, 0.25)];
    let values: Vec<RawValue> = fields.iter().map(|(_, x)| RawValue::Number(*x)).collect();
    let contents: Vec<FieldContent<'_>> = fields
        .iter()
        .zip(&values)
        .map(|((path, _), value)| FieldContent { path, content: Content::Value(value) })
        .collect();
    let message = compose("tf2_msgs/TFMessage", &contents, Time(5), &Types::standard()).unwrap();
    let paths = ["transforms[].transform.translation.x", "transforms[].transform.rotation.w"];
    let readings = read("tf2_msgs/TFMessage", &paths, &message);
    let values: Vec<RawValue> = readings.into_iter().map(|reading| reading.unwrap().value).collect();
    assert_eq!(values, [RawValue::Vector(vec![1.5, -2.5, 0.25]), RawValue::Vector(vec![1.0; 3])]);
    let written = Writer::new("tf2_msgs/TFMessage", paths[0], Types::standard());
    assert!(written.unwrap_err().to_string().contains("is no number that could be written"));
}

#[test]
fn what_cannot_be_read_says_why() {
    let check = |bytes: &[u8], expected: &str| {
        let reading = read("sensor_msgs/JointState", &["effort[0]"], bytes).remove(0);
        assert_eq!(reading.unwrap_err().to_string(), expected);
    };
    let whole = joints(false);
    let length = whole.len() - 5;
    check(
        &whole[..whole.len() - 1],
        &format!("`effort[0]` of sensor_msgs/msg/JointState is not within {length} bytes"),
    );
    check(&[], "0 bytes are no CDR message");
    check(&[0, 7, 0, 0, 1], "an encapsulation 0x0007 (XCDR version 2) is no plain CDR (0x0000 or 0x0001)");
    let unknown = Reader::new(&[field("x")], "bot/Robot", &Types::standard()).unwrap_err();
    assert!(unknown.to_string().starts_with("the message type bot/msg/Robot is not known"), "{unknown}");
    let text = Reader::new(&[field("header.frame_id")], "sensor_msgs/Imu", &Types::standard()).unwrap_err();
    assert_eq!(text.to_string(), "`header.frame_id` is a text in sensor_msgs/msg/Imu, no number");
}

#[test]
fn a_message_cut_anywhere_gives_nothing_past_the_cut() {
    for whole in [joints(false), joints(true)] {
        for length in 0..whole.len() {
            assert!(
                read("sensor_msgs/JointState", &["effort[0]"], &whole[..length])[0].is_err(),
                "cut at {length}"
            );
        }
    }
}

#[test]
fn what_is_written_is_read() {
    let types = ["std_msgs/msg/Float64", "std_msgs/msg/Int8", "std_msgs/msg/Bool"];
    for (message_type, expected) in types.into_iter().zip([1.0, 1.0, 1.0]) {
        let bytes = writer(message_type, "").write(&RawValue::Number(1.0), Time(5)).unwrap();
        let reading = read(message_type, &["data"], &bytes).remove(0).unwrap();
        assert_eq!(reading, Reading { value: RawValue::Number(expected), stamp: None });
    }
    let bytes = writer("geometry_msgs/TwistStamped", "twist.angular.z")
        .write(&RawValue::Interval { lo: 1.0, hi: 2.0 }, Time(3_000_000_004))
        .unwrap();
    let reading = read("geometry_msgs/TwistStamped", &["twist.angular.z"], &bytes).remove(0).unwrap();
    assert_eq!(reading, Reading { value: RawValue::Number(1.5), stamp: Some(Time(3_000_000_004)) });
    let bytes =
        writer("sensor_msgs/JointState", "velocity[2]").write(&RawValue::Number(4.0), Time(1)).unwrap();
    let reading = read("sensor_msgs/JointState", &["velocity"], &bytes).remove(0).unwrap();
    assert_eq!(reading.value, RawValue::Vector(vec![0.0, 0.0, 4.0]));
}

#[test]
fn what_does_not_fit_is_refused() {
    let check = |message_type: &str, path: &str, value: RawValue, expected: &str| {
        let problem = writer(message_type, path).write(&value, Time(0)).unwrap_err();
        assert_eq!(problem.to_string(), expected);
    };
    let list = || RawValue::Vector(vec![1.0]);
    check("std_msgs/Float64", "", list(), "the value is a list, no number");
    check("sensor_msgs/LaserScan", "ranges", RawValue::Number(1.0), "the value is a number, no list");
    let covariance = "orientation_covariance";
    check(
        "sensor_msgs/Imu",
        covariance,
        list(),
        "the value is a list of 1, no list of the length of the field",
    );
    check("std_msgs/Int8", "", RawValue::Number(f64::NAN), "the value is not-a-number, no whole number");
    assert!(Writer::new("sensor_msgs/Imu", "header.frame_id", Types::standard()).is_err());
}

#[test]
fn a_copy_differs_in_the_value_and_the_stamp_alone() {
    for is_big_endian in [false, true] {
        let whole = joints(is_big_endian);
        let patched = writer("sensor_msgs/JointState", "position[1]")
            .patch(&whole, &RawValue::Number(0.25), Time(9_000_000_001))
            .unwrap();
        let readings = read("sensor_msgs/JointState", &["position", "effort"], &patched);
        let reading = |value: Vec<f64>| {
            Ok(Reading { value: RawValue::Vector(value), stamp: Some(Time(9_000_000_001)) })
        };
        assert_eq!(readings, [reading(vec![1.5, 0.25]), reading(vec![9.0])]);
        let lists = writer("sensor_msgs/JointState", "position");
        let longer = lists.patch(&whole, &RawValue::Vector(vec![1.0; 3]), Time(0));
        assert!(longer.is_err());
        assert!(lists.patch(&whole[..20], &RawValue::Vector(vec![1.0; 2]), Time(0)).is_err());
    }
}

#[test]
fn payloads_of_a_type_are_read_and_imitated_without_further_ado() {
    use crate::payload::{Reader as PayloadReader, SIZE_LIMIT, Writer as PayloadWriter};
    use crate::{Message, Payload, Provenance, Quality};
    let message = |message_type: &str, bytes: Vec<u8>| Message {
        message_type: Some(message_type.into()),
        ..Message::new("x".into(), Time(0), Payload::Bytes(bytes.into()))
    };
    let mut reader =
        PayloadReader::new(&[field("position[name=right]"), field("speed")], SIZE_LIMIT).unwrap();
    let mut read = |message: &Message| {
        let mut shown = Vec::new();
        reader.read(message, |index, reading| {
            shown.push(match reading {
                Ok(reading) => format!("{index}: {:?}", reading.value),
                Err(problem) => format!("{index}: {problem}"),
            });
        });
        shown.join(" | ")
    };
    let absent = read(&message("std_msgs/msg/Header", joints(false)));
    assert_eq!(absent.matches("no field 'position' in std_msgs/msg/Header").count(), 2, "{absent}");
    let text = [&[0, 1, 0, 0, 12, 0, 0, 0], b"{\"speed\":2}\0".as_slice()].concat();
    assert!(read(&message("std_msgs/msg/String", text)).ends_with("1: Number(2.0)"));
    assert!(
        read(&message("std_msgs/msg/String", vec![0, 1, 0, 0, 9, 0, 0, 0])).contains("not within 8 bytes")
    );

    let mut writer = PayloadWriter::like(field("position[1]"), SIZE_LIMIT).unwrap();
    writer.learn_message(&message("sensor_msgs/msg/JointState", joints(false)));
    let provenance = Provenance::new(Quality::Good, "");
    let bytes = writer.write(Some(&RawValue::Number(3.0)), Time(1), &provenance).unwrap().unwrap();
    assert_eq!(
        super::tests::read("sensor_msgs/JointState", &["position[1]"], &bytes)[0].clone().unwrap().value,
        RawValue::Number(3.0)
    );
}

/// The bytes of a message with these fields, or why it cannot be written.
fn composed(message_type: &str, fields: &[FieldContent<'_>]) -> Result<bytes::Bytes, String> {
    compose(message_type, fields, Time(3_000_000_007), &Types::standard())
        .map_err(|problem| problem.to_string())
}

#[test]
fn a_message_is_composed_of_several_fields() {
    let numbers = |numbers: &[f64]| RawValue::Vector(numbers.to_vec());
    let (first, step, ranges) = (RawValue::Number(-0.5), RawValue::Number(0.25), numbers(&[1.5, 2.5]));
    let frame = FieldContent { path: "header.frame_id", content: Content::Text("laser") };
    let of = |path, value| FieldContent { path, content: Content::Value(value) };
    // In any order.
    let fields = [of("ranges", &ranges), frame, of("angle_min", &first), of("angle_increment", &step)];
    let bytes = composed("sensor_msgs/msg/LaserScan", &fields).unwrap();
    let paths = ["ranges", "angle_min", "angle_increment", "angle_max", "intensities"];
    let readings = read("sensor_msgs/msg/LaserScan", &paths, &bytes);
    let readings: Vec<Reading> = readings.into_iter().map(Result::unwrap).collect();
    let values: Vec<RawValue> = readings.iter().map(|reading| reading.value.clone()).collect();
    let [nothing, none] = [RawValue::Number(0.0), numbers(&[])];
    assert_eq!(values.iter().collect::<Vec<_>>(), [&ranges, &first, &step, &nothing, &none]);
    assert!(readings.iter().all(|reading| reading.stamp == Some(Time(3_000_000_007))));
    let plan = Path::parse("header.frame_id").unwrap();
    let plan = Plan::of_value(&Types::standard(), Layout::Cdr, "sensor_msgs/msg/LaserScan", &plan.steps);
    assert_eq!(plan.unwrap().text(Body::cdr(&bytes).unwrap()).as_deref(), Some("laser"));

    // Members of one message, and elements of one list.
    let (low, high) = (RawValue::Number(0.6), RawValue::Number(0.8));
    let fields =
        [of("transforms[1].transform.rotation.z", &low), of("transforms[1].transform.rotation.w", &high)];
    let bytes = composed("tf2_msgs/msg/TFMessage", &fields).unwrap();
    let paths = [fields[0].path, fields[1].path, "transforms[0].transform.rotation.w"];
    let readings = read("tf2_msgs/msg/TFMessage", &paths, &bytes).into_iter();
    let values: Vec<RawValue> = readings.map(|reading| reading.unwrap().value).collect();
    assert_eq!(values.iter().collect::<Vec<_>>(), [&low, &high, &RawValue::Number(1.0)]);
}

#[test]
fn what_does_not_fit_into_a_message_is_refused() {
    #[track_caller]
    fn check(message_type: &str, path: &str, content: Content<'_>, expected: &str) {
        let refused = composed(message_type, &[FieldContent { path, content }]).unwrap_err();
        assert!(refused.contains(expected), "{refused}");
    }
    let (one, list) = (RawValue::Number(1.0), RawValue::Vector(vec![1.0]));
    let scan = "sensor_msgs/msg/LaserScan";
    check(scan, "range", Content::Value(&one), "no field 'range'");
    check(scan, "ranges", Content::Value(&one), "sensor_msgs/msg/LaserScan: ");
    check(scan, "angle_min", Content::Value(&list), "sensor_msgs/msg/LaserScan: ");
    check(scan, "angle_min", Content::Text("a"), "is no text that could be written");
    check(scan, "header.frame_id", Content::Value(&one), "is no number that could be written");
    check("sensor_msgs/msg/JointState", "name", Content::Text("left"), "is no text that could be written");
    check("bot/msg/None", "x", Content::Value(&one), "the message type bot/msg/None is not known");
}

/// Paths to every number of a type, to the first element of lists, down to `depth`.
fn paths(message_type: &str, prefix: &str, depth: usize, found: &mut Vec<String>) {
    for member in Types::standard().members(message_type).unwrap() {
        let index = if member.count == Count::One { "" } else { "[0]" };
        let path = format!("{prefix}{}{index}", member.name);
        match &member.kind {
            Kind::Primitive(_) => found.push(path),
            Kind::Message(inner) if depth < 6 => paths(inner, &format!("{path}."), depth + 1, found),
            _ => {}
        }
    }
}

#[test]
fn every_number_of_every_standard_type_is_written_and_read() {
    let types = Types::standard();
    let mut count = 0;
    for message_type in types.names() {
        let mut found = Vec::new();
        paths(message_type, "", 0, &mut found);
        for path in found {
            let bytes = writer(message_type, &path).write(&RawValue::Number(1.0), Time(0)).unwrap();
            let reading = read(message_type, &[&path], &bytes).remove(0);
            assert_eq!(
                reading.map(|reading| reading.value),
                Ok(RawValue::Number(1.0)),
                "{message_type} {path}"
            );
            count += 1;
        }
    }
    assert!(count > 500, "{count}");
}

proptest! {
    #[test]
    fn garbage_never_panics_and_is_never_read_past_its_end(
        bytes in proptest::collection::vec(any::<u8>(), 0..200), kind in 0..2_u8,
        at in any::<proptest::sample::Index>(),
    ) {
        let types = Types::standard();
        let names: Vec<&str> = types.names().collect();
        let message_type = names[at.index(names.len())];
        let mut found = Vec::new();
        paths(message_type, "", 0, &mut found);
        let message = [&[0, kind, 0, 0], bytes.as_slice()].concat();
        for path in found {
            let plan = Path::parse(&path).unwrap();
            let plan = Plan::of_value(&types, Layout::Cdr, message_type, &plan.steps).unwrap();
            if let Some(place) = plan.locate(Body::cdr(&message).unwrap()) {
                prop_assert!(place.at < bytes.len().max(1) && place.count <= bytes.len());
            }
            let _ = read(message_type, &[&path], &message);
            let _ = writer(message_type, &path).patch(&message, &RawValue::Number(1.0), Time(1));
        }
    }
}
