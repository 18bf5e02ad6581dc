//! Payloads as other implementations write them, and arbitrary bytes.

use super::*;
use proptest::prelude::*;

/// The bytes of a text of hexadecimal digits.
fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    digits
        .as_chunks::<2>()
        .0
        .iter()
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect()
}

fn shown(payload: &[u8]) -> String {
    let Some(payload) = Payload::read(payload) else { return "no payload".to_owned() };
    let mut text = format!("{:?} {:?}", payload.timestamp, payload.seq);
    for metric in payload.metrics() {
        let name = metric.name.map_or_else(|| format!("#{}", metric.alias.unwrap()), str::to_owned);
        let value = match (metric.number(), metric.numbers()) {
            (Some(number), _) => number.to_string(),
            (None, Some(numbers)) => format!("{numbers:?}"),
            _ => format!("{:?}", metric.value),
        };
        let flags = [(metric.is_null, " null"), (metric.is_historical, " historical")];
        let flags: String = flags.into_iter().filter(|(is, _)| *is).map(|(_, flag)| flag).collect();
        text += &format!(" | {name}={value} at {:?} {}{flags}", metric.timestamp, metric.quality());
    }
    text
}

/// A birth and the data after it, serialised from the definition in the specification by Google's implementation of Protocol
/// Buffers.
const BIRTH: &str = "08e80712160a0b496e707574732f41206f6e100118d00f200b700112380a0454656d70100218d00f20034a230a07656e67556e69740a07\
    5175616c6974791208080c4204646567431205080318f40350fbffffff0f12130a05537065656418cf0f20092801650000c03f120d0a04476f6e6518cf0f\
    200a380112170a05417272617918cf0f2018820108ffffffff02000000120f0a0353657418cf0f20108a010208011800";
const DATA: &str = "08e907120b100218d10f50faffffff0f1207100918d10f5007120b0a044c6f6e6718d10f58071801";

#[test]
fn payloads_of_another_implementation_are_read() {
    assert_eq!(
        shown(&bytes(BIRTH)),
        "Some(1000) Some(0) | Inputs/A on=1 at Some(2000) 192 | Temp=-5 at Some(2000) 500 \
         | Speed=1.5 at Some(1999) 192 historical | Gone=Absent at Some(1999) 192 null \
         | Array=[-1.0, 2.0] at Some(1999) 192 | Set=Structure at Some(1999) 192"
    );
    let unit = Payload::read(&bytes(BIRTH))
        .and_then(|birth| birth.metrics().nth(1)?.text_property("engUnit").map(str::to_owned));
    assert_eq!(unit.as_deref(), Some("degC"));
    assert_eq!(
        shown(&bytes(DATA)),
        "Some(1001) Some(1) | #2=4294967290 at Some(2001) 192 | #9=7 at Some(2001) 192 | Long=7 at Some(2001) 192"
    );
}

#[test]
fn names_and_types_of_a_birth_are_added() {
    let known = |metric: &Metric<'_>| match (metric.name, metric.alias) {
        (None, Some(2)) => Some(Known { name: "Temp", data_type: DataType::INT32 }),
        (Some("Long"), None) => Some(Known { name: "Long", data_type: DataType::INT64 }),
        _ => None,
    };
    let expected = "Some(1001) Some(1) | Temp=-6 at Some(2001) 192 | Long=7 at Some(2001) 192";
    assert_eq!(shown(&resolved(&bytes(DATA), known)), expected);
}

#[test]
fn what_is_written_is_read() {
    let mut writer = Writer::new(7, Some(255));
    let metric = NewMetric { name: "a/b", timestamp: 5, data_type: None, value: None, properties: &[] };
    let properties = [
        (QUALITY, Property::Whole(quality::BAD)),
        ("lo", Property::Number(-1.0)),
        ("source", Property::Text("wheel")),
    ];
    for value in [
        NewValue::Number(-2.5),
        NewValue::Whole(u64::MAX),
        NewValue::Truth(true),
        NewValue::Text("x"),
        NewValue::Numbers(&[1.0, f64::NAN]),
    ] {
        let data_type = Some(value.data_type());
        writer.push(&NewMetric { data_type, value: Some(value), ..metric });
    }
    writer.push(&NewMetric { properties: &properties, ..metric });
    let written = writer.finish();
    assert_eq!(
        shown(&written),
        "Some(7) Some(255) | a/b=-2.5 at Some(5) 192 | a/b=18446744073709552000 at Some(5) 192 \
         | a/b=1 at Some(5) 192 | a/b=Text(\"x\") at Some(5) 192 | a/b=[1.0, NaN] at Some(5) 192 \
         | a/b=Absent at Some(5) 0 null"
    );
    let last = Payload::read(&written).unwrap().metrics().last().unwrap();
    assert_eq!((last.text_property("source"), last.text_property("lo")), (Some("wheel"), None));
    assert_eq!(last.text_property("other"), None);
}

#[test]
fn whole_numbers_have_the_sign_of_their_type() {
    #[track_caller]
    fn check(data_type: u32, bits: u64, expected: f64) {
        assert_eq!(DataType(data_type).whole(bits), expected);
    }
    // Implementations extend the sign to 32 bits or leave it at the width of the type.
    check(1, 0xfb, -5.0);
    check(1, 0xffff_fffb, -5.0);
    check(2, 0xfffb, -5.0);
    check(3, 0xffff_fffb, -5.0);
    check(4, (-5_i64) as u64, -5.0);
    check(7, 0xffff_fffb, 4_294_967_291.0);
    check(13, 1_700_000_000_000, 1.7e12);
}

#[test]
fn arrays_are_packed() {
    #[track_caller]
    fn check(data_type: u32, hex: &str, expected: &str) {
        let shown = DataType(data_type).elements(&bytes(hex)).map(|all| format!("{all:?}"));
        assert_eq!(shown.as_deref().unwrap_or("none"), expected);
    }
    check(22, "ffe97b", "[-1.0, -23.0, 123.0]");
    check(23, "30 8a 7b 30", "[-30160.0, 12411.0]");
    check(24, "ffffffff", "[-1.0]");
    check(25, "feffffffffffffff", "[-2.0]");
    check(26, "17fa", "[23.0, 250.0]");
    check(27, "1e00", "[30.0]");
    check(28, "34000000", "[52.0]");
    check(29, "0100000001000000", "[4294967297.0]");
    check(30, "0000203f", "[0.625]");
    check(31, "000000000000f03f", "[1.0]");
    check(32, "0c000000 34d0", "[0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0]");
    check(34, "0100000000000000", "[1.0]");
    check(31, "0000", "none");
    check(32, "ff000000 34", "none");
    check(33, "4100", "none");
}

proptest! {
    /// Strangers' bytes: read or not, to an end, and never more than what was given.
    #[test]
    fn any_bytes_are_a_payload_or_none(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        if let Some(payload) = Payload::read(&bytes) {
            prop_assert!(payload.metrics().count() <= bytes.len());
            for metric in payload.metrics() {
                let _any = (metric.number(), metric.quality(), metric.text_property("source"));
                prop_assert!(metric.numbers().is_none_or(|all| all.len() <= 8 * bytes.len()));
            }
            let known = |metric: &Metric<'_>| metric.alias.map(|_| Known { name: "n", data_type: DataType::INT8 });
            prop_assert!(Payload::read(&resolved(&bytes, known)).is_some());
        }
    }

    /// As above, with bytes that are nearly a payload.
    #[test]
    fn a_damaged_payload_is_read_or_not(at in 0_usize..200, byte: u8, cut in 0_usize..200) {
        let mut writer = Writer::new(7, Some(1));
        let properties = [(QUALITY, Property::Whole(500)), ("source", Property::Text("wheel"))];
        let value = Some(NewValue::Numbers(&[1.0, 2.0]));
        let data_type = Some(DataType::DOUBLE_ARRAY);
        writer.push(&NewMetric { name: "a/b", timestamp: 5, data_type, value, properties: &properties });
        let mut bytes = writer.finish();
        let length = bytes.len();
        bytes[at % length] = byte;
        bytes.truncate(length - cut % length);
        let _shown = shown(&bytes);
    }
}
