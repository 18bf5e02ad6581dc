//! Payloads: any bytes as a message's content; what is read is bounded, and what is written of it can be read again.

use shsa_bridge::payload::{Reader, Writer};
use shsa_bridge::{Provenance, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::source::{Field, StampField};

const PATHS: [&str; 6] = ["", "a.b", "/a/b/0", "list[1]", "position[name=left]", "value[id=3]"];
const SIZE_LIMIT: usize = 1 << 16;

fn field(path: &str) -> Field {
    Field { path: path.into(), stamp: None }
}

/// Every path at once, then a takeover in the shape of these bytes by each.
///
/// # Panics
/// When a reason is long, or a number that was put into a payload is not found there again.
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
    texts.iter().map(|text| text.as_bytes().to_vec()).collect()
}
