//! Tests with descriptors and messages as bytes, and the results as text.

use super::*;
use crate::path::Path;
use proptest::prelude::*;

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

fn sized(number: u64, content: &[u8]) -> Vec<u8> {
    [varint(number << 3 | 2), varint(content.len() as u64), content.to_vec()].concat()
}

fn whole(number: u64, value: u64) -> Vec<u8> {
    [varint(number << 3), varint(value)].concat()
}

fn field(name: &str, number: u64, kind: u64, label: u64, of: &str) -> Vec<u8> {
    let mut own = [sized(1, name.as_bytes()), whole(3, number), whole(4, label), whole(5, kind)].concat();
    if !of.is_empty() {
        own.extend(sized(6, of.as_bytes()));
    }
    sized(2, &own)
}

fn types() -> Types {
    let part = [
        sized(1, b"Part"),
        field("wear", 1, 2, 1, ""),
        field("name", 2, 9, 1, ""),
        field("turns", 3, 17, 1, ""),
    ];
    let robot = [
        sized(1, b"Robot"),
        field("speed", 1, 1, 1, ""),
        field("ranges", 2, 1, 3, ""),
        field("parts", 3, 11, 3, ".bot.Robot.Part"),
        field("stamp", 4, 11, 1, ".google.protobuf.Timestamp"),
        field("names", 5, 9, 3, ""),
        sized(3, &part.concat()),
    ];
    let file =
        [sized(1, b"bot.proto"), sized(2, b"bot"), sized(4, &robot.concat()), sized(12, b"proto3")].concat();
    Types::of_descriptors(&sized(1, &file))
}

fn message() -> Vec<u8> {
    let double = |value: f64| value.to_le_bytes().to_vec();
    let part = |wear: f32, turns: u64| {
        let wear = [varint(1 << 3 | 5), wear.to_le_bytes().to_vec()].concat();
        sized(3, &[wear, sized(2, b"left"), whole(3, turns)].concat())
    };
    [
        [varint(1 << 3 | 1), double(1.5)].concat(),
        sized(2, &[double(4.0), double(5.0)].concat()),
        part(0.25, 3),
        part(0.5, 4),
        sized(4, &[whole(1, 12), whole(2, 500)].concat()),
        sized(5, b"left"),
        sized(5, b"right"),
    ]
    .concat()
}

#[track_caller]
fn check(path: &str, expected: &str) {
    let plan = Plan::new(&types(), "bot.Robot", &Path::parse(path).unwrap().steps);
    let shown = match plan {
        Ok(plan) => format!("{:?}", plan.find(&message())),
        Err(problem) => problem.to_string(),
    };
    assert_eq!(shown, expected);
}

#[test]
fn fields_are_found() {
    check("speed", "Some(Number(1.5))");
    check("ranges", "Some(Numbers([4.0, 5.0]))");
    check("ranges[1]", "Some(Number(5.0))");
    check("ranges[2]", "None");
    check("parts[1].wear", "Some(Number(0.5))");
    check("parts[0].turns", "Some(Number(-2.0))");
    check("parts.1.turns", "Some(Number(2.0))");
    check("parts[].wear", "Some(Numbers([0.25, 0.5]))");
    check("parts[].name", "Some(Texts([\"left\", \"left\"]))");
    check("parts[].bulk", "no field 'bulk' in bot.Robot.Part (there is: wear, name, turns)");
    check("speed[].x", "'speed' is no list");
    check("parts[0][].x", "'parts' is no list");
    check("parts[0].name", "Some(Text(\"left\"))");
    check("stamp", "Some(Time(12, 500))");
    check("names", "Some(Texts([\"left\", \"right\"]))");
    check("sped", "no field 'sped' in bot.Robot; is it speed?");
    check("parts.wear", "'parts' is a list; say which element, parts[0], or take all of them, parts[]");
    check("speed.x", "'speed' has no parts");
    assert_eq!(Found::Texts(vec!["left".into(), "right".into()]).says("right"), Some(Some(1)));
    let mut paths = Vec::new();
    types().paths("bot.Robot", "", 9, &mut paths);
    assert_eq!(paths, ["speed", "ranges", "parts[0].wear", "parts[0].name", "parts[0].turns", "names"]);
}

#[test]
fn a_message_fits_its_type() {
    #[track_caller]
    fn check(bytes: &[u8], expected: bool) {
        assert_eq!(types().fits("bot.Robot", bytes), expected, "{bytes:?}");
    }
    let message = message();
    check(&message, true);
    check(&message[..message.len() - 1], false);
    check(&[&message[..], &[7]].concat(), false);
    // A field that the type does not have, a number of another wire type, half a packed number.
    check(&whole(99, 5), true);
    check(&whole(1, 5), false);
    check(&sized(2, &[0; 12]), false);
    check(&sized(3, b"\x0a"), false);
    check(b"", true);
}

#[test]
fn a_field_that_is_not_there_is_what_its_definition_says() {
    let given = |name: &str, number: u64, kind: u64, default: &str, oneof: Option<u64>| {
        let mut own = [sized(1, name.as_bytes()), whole(3, number), whole(4, 1), whole(5, kind)].concat();
        own.extend(if kind == 14 { sized(6, b".E") } else { Vec::new() });
        own.extend(if default.is_empty() { Vec::new() } else { sized(7, default.as_bytes()) });
        own.extend(oneof.map(|at| whole(9, at)).unwrap_or_default());
        sized(2, &own)
    };
    let message = [
        sized(1, b"M"),
        given("plain", 1, 1, "", None),
        given("chosen", 2, 1, "", Some(0)),
        given("warm", 3, 1, "20.5", None),
        given("on", 4, 8, "true", None),
        given("mode", 5, 14, "FAST", None),
        given("name", 6, 9, "left", None),
    ];
    let value = sized(2, &[sized(1, b"FAST"), whole(2, 7)].concat());
    let enumeration = sized(5, &[sized(1, b"E"), value].concat());
    let check = |syntax: &[u8], path: &str, expected: &str| {
        let file = [sized(4, &message.concat()), enumeration.clone(), sized(12, syntax)].concat();
        let types = Types::of_descriptors(&sized(1, &file));
        let plan = Plan::new(&types, "M", &Path::parse(path).unwrap().steps).unwrap();
        assert_eq!(format!("{:?}", plan.find(b"")), expected, "{path}");
    };
    check(b"proto3", "plain", "Some(Number(0.0))");
    check(b"proto3", "chosen", "None");
    check(b"proto2", "plain", "None");
    check(b"proto2", "chosen", "None");
    check(b"proto2", "warm", "Some(Number(20.5))");
    check(b"proto2", "on", "Some(Number(1.0))");
    check(b"proto2", "mode", "Some(Number(7.0))");
    check(b"proto2", "name", "Some(Text(\"left\"))");
}

proptest! {
    #[test]
    fn any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let types = Types::of_descriptors(&bytes);
        let _plan = Plan::new(&types, "a", &[Step::Key("a".into())]);
        for path in ["speed", "ranges", "parts[1].wear", "parts[].turns", "stamp", "names"] {
            let plan = Plan::new(&self::types(), "bot.Robot", &Path::parse(path).unwrap().steps).unwrap();
            let _found = plan.find(&bytes);
            let _fits = self::types().fits("bot.Robot", &bytes);
        }
    }
}
