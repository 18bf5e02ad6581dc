//! A tank whose level is known in three ways, and a minute in which the level's sensor is faulty from 30 s on.

use crate::folder::Folder;
use std::fmt::Write;

pub(crate) const MODEL: &str = "\
shsa: 1
variables:
  level:    { unit: m, range: [0, 5], max_rate: 0.5 m/s }
  pressure: { unit: kPa }
  volume:   { unit: l }
relations:
  hydrostatic: pressure = 9.81 kPa/m * level
  cylinder:    { equation: volume = 1000 l/m * level, for: [level] }
signals:
  /level:    { variable: level, rate: 1 Hz, value_error: 5 cm, properties: { accuracy: 0.9 } }
  /pressure: { variable: pressure, rate: 1 Hz, value_error: 0.5 }
  /volume:   { variable: volume, rate: 1 Hz, value_error: 2 % }
needs:
  level: { signal: /healed/level, max_age: 3 s }
";

/// The row from which the level's sensor is faulty.
pub(crate) const LIE: usize = 30;

/// Second, level, pressure and volume of each row.
fn rows() -> impl Iterator<Item = (usize, [f64; 3])> {
    (0..60).map(|second| {
        let level = 2.0 + 0.01 * second as f64;
        let shown = if second < LIE { level } else { level + 0.5 };
        (second, [shown, 9.81 * level, 1000.0 * level])
    })
}

pub(crate) fn csv() -> String {
    let mut text = "t [s],/level,/pressure,/volume\n".to_owned();
    for (second, [level, pressure, volume]) in rows() {
        writeln!(text, "{second},{level:.3},{pressure:.3},{volume:.3}").unwrap();
    }
    text
}

pub(crate) fn json_lines() -> String {
    let mut text = String::new();
    for (second, values) in rows() {
        let time_ns = second * 1_000_000_000;
        for (signal, value) in ["/level", "/pressure", "/volume"].into_iter().zip(values) {
            let line = serde_json::json!({
                "signal": signal, "time_ns": time_ns, "received_ns": time_ns, "value": value
            });
            writeln!(text, "{line}").unwrap();
        }
    }
    text
}

/// The same as a ROS 1 bag with one chunk a row.
pub(crate) fn bag() -> Vec<u8> {
    let connections: Vec<Vec<u8>> =
        ["/level", "/pressure", "/volume"].iter().zip(0..).map(|(topic, id)| connection(id, topic)).collect();
    let mut chunks = Vec::new();
    for (second, values) in rows() {
        let messages = values.iter().zip(0..).map(|(value, id)| message(id, second as u32, *value));
        let records: Vec<u8> =
            connections.concat().into_iter().chain(messages.collect::<Vec<_>>().concat()).collect();
        let size = (records.len() as u32).to_le_bytes();
        chunks.push(record(&[("op", &[5]), ("compression", b"none"), ("size", &size)], &records));
    }
    let magic = b"#ROSBAG V2.0\n".to_vec();
    let head = |index: usize| {
        let fields: [(&str, &[u8]); 4] = [
            ("op", &[3]),
            ("index_pos", &(index as u64).to_le_bytes()),
            ("conn_count", &3_u32.to_le_bytes()),
            ("chunk_count", &(chunks.len() as u32).to_le_bytes()),
        ];
        record(&fields, &[b' '; 64])
    };
    let body = chunks.concat();
    let index = magic.len() + head(0).len() + body.len();
    [magic, head(index), body, connections.concat()].concat()
}

fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    [sized(&fields.iter().flat_map(|(name, value)| field(name, value)).collect::<Vec<_>>()), sized(data)]
        .concat()
}

fn sized(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn field(name: &str, value: &[u8]) -> Vec<u8> {
    sized(&[name.as_bytes(), b"=", value].concat())
}

fn connection(id: u32, topic: &str) -> Vec<u8> {
    let about = [
        field("topic", topic.as_bytes()),
        field("type", b"std_msgs/Float64"),
        field("md5sum", b"*"),
        field("message_definition", b"float64 data"),
    ];
    record(&[("op", &[7]), ("conn", &id.to_le_bytes()), ("topic", topic.as_bytes())], &about.concat())
}

fn message(id: u32, second: u32, value: f64) -> Vec<u8> {
    let time = [second.to_le_bytes(), 0_u32.to_le_bytes()].concat();
    record(&[("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &time)], &value.to_le_bytes())
}

/// A folder with the model and the minute in every format.
pub(crate) fn folder() -> Folder {
    Folder::with(&[
        ("tank.yaml", MODEL.as_bytes()),
        ("run.csv", csv().as_bytes()),
        ("run.jsonl", json_lines().as_bytes()),
        ("run.bag", &bag()),
    ])
}
