//! Small MCAP files, as the tests and the fuzz target write them.

/// The chunks of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Chunks {
    /// There are no chunks.
    None,
    /// Uncompressed chunks.
    Plain,
    /// Chunks compressed by lz4.
    Lz4,
}

pub(super) fn record(kind: u8, content: &[u8]) -> Vec<u8> {
    [&[kind][..], &(content.len() as u64).to_le_bytes(), content].concat()
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

pub(super) fn schema(id: u16, name: &str, encoding: &str, data: &[u8]) -> Vec<u8> {
    let data = [&(data.len() as u32).to_le_bytes()[..], data].concat();
    record(3, &[&id.to_le_bytes()[..], &text(name), &text(encoding), &data].concat())
}

pub(super) fn channel(id: u16, schema: u16, topic: &str, encoding: &str) -> Vec<u8> {
    let ids = [id.to_le_bytes(), schema.to_le_bytes()].concat();
    record(4, &[ids, text(topic), text(encoding), vec![0; 4]].concat())
}

pub(super) fn message(channel: u16, logged_ns: u64, published_ns: u64, data: &[u8]) -> Vec<u8> {
    let times = [logged_ns.to_le_bytes(), published_ns.to_le_bytes()].concat();
    record(5, &[&channel.to_le_bytes()[..], &[0; 4], &times, data].concat())
}

pub(super) fn chunk(chunks: Chunks, records: &[u8]) -> Vec<u8> {
    let (method, packed) = match chunks {
        Chunks::None => return records.to_vec(),
        Chunks::Plain => ("", records.to_vec()),
        Chunks::Lz4 => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            std::io::Write::write_all(&mut encoder, records).unwrap();
            ("lz4", encoder.finish().unwrap())
        }
    };
    let times = [0_u64.to_le_bytes(), u64::MAX.to_le_bytes()].concat();
    let sizes = [&(records.len() as u64).to_le_bytes()[..], &[0; 4]].concat();
    let packed = [&(packed.len() as u64).to_le_bytes()[..], &packed].concat();
    record(6, &[times, sizes, text(method), packed].concat())
}

/// A whole file: magic, header, these parts, end of data, a footer without a summary.
pub(super) fn file(parts: &[Vec<u8>]) -> Vec<u8> {
    let magic = b"\x89MCAP0\r\n".to_vec();
    let header = record(1, &[text(""), text("tests")].concat());
    [magic.clone(), header, parts.concat(), record(15, &[0; 4]), record(2, &[0; 20]), magic].concat()
}

/// Three topics: of ROS 2 without header, of JSON without a schema, of ROS 1.
pub(super) fn small(chunks: Chunks) -> Vec<u8> {
    let double = |value: f64| value.to_le_bytes();
    let cdr = |value: f64| [&[0, 1, 0, 0][..], &double(value)].concat();
    let about = [
        schema(1, "std_msgs/msg/Float64", "ros2msg", b"float64 data"),
        schema(2, "std_msgs/Float64", "ros1msg", b"float64 data"),
        channel(1, 1, "/speed", "cdr"),
        channel(2, 0, "/gnss", "json"),
        channel(3, 2, "/old", "ros1"),
    ];
    let json = br#"{"header": {"stamp": {"sec": 0, "nanosec": 90000000}}, "fix": [1, null], "name": "a"}"#;
    let first = [
        about.concat(),
        message(1, 100_000_000, 99_000_000, &cdr(1.5)),
        message(2, 110_000_000, 0, json),
        message(3, 120_000_000, 0, &double(7.0)),
    ];
    let second = [message(1, 200_000_000, 199_000_000, &cdr(2.5)), message(1, 300_000_000, 0, &cdr(3.5))];
    file(&[chunk(chunks, &first.concat()), chunk(chunks, &second.concat())])
}
