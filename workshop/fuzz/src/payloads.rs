//! Payloads: any bytes as a message's content; results are bounded, and written payloads can be read again.

use shsa_bridge::payload::{METRICS, Reader, STALE, Writer, explore};
use shsa_bridge::{Message, Payload, Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::source::{Field, StampField};

const PATHS: [&str; 6] = ["", "a.b", "/a/b/0", "list[1]", "position[name=left]", "value[id=3]"];
const SIZE_LIMIT: usize = 1 << 16;

fn field(path: &str) -> Field {
    Field { path: path.into(), stamp: None }
}

/// Reads all paths at once, then writes a substitute in the form of these bytes by each path.
///
/// # Panics
/// When a reason is long, or a written number is not read back.
pub fn run(bytes: &[u8]) {
    let stamp = StampField { path: "stamp".into(), step: None };
    let mut fields = PATHS.map(field).to_vec();
    fields.push(Field { path: "a".into(), stamp: Some(stamp) });
    let mut reader = Reader::new(&fields, SIZE_LIMIT).expect("they follow the grammar");
    reader.read_bytes(bytes, |index, reading| match reading {
        Ok(_) => assert!(index < fields.len(), "not asked for"),
        Err(unreadable) => assert!(unreadable.to_string().len() < 300, "a long reason: {unreadable}"),
    });
    PATHS.iter().for_each(|path| take_over(path, bytes));
    metrics(&mut reader, bytes);
}

/// Reads the bytes as a payload of Sparkplug.
fn metrics(reader: &mut Reader, bytes: &[u8]) {
    for message_type in [METRICS, STALE] {
        let message = Message::new("G/N".into(), Time(0), Payload::Bytes(bytes.to_vec().into()));
        let message = Message { message_type: Some(message_type.into()), ..message };
        reader.read(&message, |_, reading| {
            let why = reading.err().map_or(String::new(), |unreadable| unreadable.to_string());
            assert!(why.len() < 1000, "a long reason: {why}");
        });
        let leaves = explore(&message).map_or(0, |leaves| leaves.len());
        assert!(leaves <= bytes.len(), "more fields than bytes");
    }
}

fn take_over(path: &str, bytes: &[u8]) {
    let mut writer = Writer::like(field(path), SIZE_LIMIT).expect("they follow the grammar");
    writer.learn(&bytes.to_vec().into());
    let provenance = Provenance::new(Quality::Substitute, "");
    let one = RawValue::Number(1.0);
    let Ok(Some(written)) = writer.write(Some(&one), Time(0), &provenance) else { return };
    let mut reader = Reader::new(&[field(path)], SIZE_LIMIT * 2).expect("they follow the grammar");
    reader.read_bytes(&written, |_, reading| {
        let value = reading.expect("it could be written").value;
        assert!(value == one || value == RawValue::Interval { lo: 1.0, hi: 1.0 }, "{value:?}");
    });
}

/// A payload of every kind.
#[must_use]
pub fn seeds() -> Vec<Vec<u8>> {
    let texts = [
        " 21.5\n",
        "ON",
        "[1, 2.5, null, NaN]",
        r#"{"a": {"b": [1, {"lo": 1, "hi": 2}]}, "list": [true, "3"], "stamp": {"sec": 1, "nanosec": 2}}"#,
        r#"{"position": [1, -2e3], "name": ["left", "r\u00e9\"\ud83d\ude00"], "id": "3", "value": -Infinity}"#,
        r#"{"value": 1.5, "lo": 1, "hi": 2, "stamp_ns": 1700000000000000000, "quality": "Good"}"#,
        r#"{"a": 1, "stamp": "2024-05-01T10:00:00.5+02:00"}"#,
    ];
    // Metrics of Sparkplug: a number by its name, and an array with a quality.
    let metrics: [&[u8]; 2] = [
        b"\x08\x07\x12\x0f\x0a\x01a\x10\x01\x18\x01\x20\x03\x50\xff\xff\xff\xff\x0f\x18\x01",
        b"\x12\x28\x0a\x07list[1]\x20\x18\x4a\x10\x0a\x07Quality\x12\x05\x08\x03\x18\xc0\x01\x82\x01\x08\x01\0\0\0\x02\0\0\0",
    ];
    texts.iter().map(|text| text.as_bytes().to_vec()).chain(metrics.map(<[u8]>::to_vec)).collect()
}
