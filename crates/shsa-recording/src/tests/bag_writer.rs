//! Small ROS 1 bags, written record by record so that tests can damage each part.

use std::io::Write;

/// The compression of chunks.
#[derive(Clone, Copy, Debug)]
pub(super) enum Packing {
    None,
    Bz2,
    Lz4,
}

pub(super) const TWIST: &str = "\
Header header
geometry_msgs/Vector3 linear
float32[] ranges
====
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
====
MSG: geometry_msgs/Vector3
float64 x
float64 y
";

fn sized(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn field(name: &str, value: &[u8]) -> Vec<u8> {
    sized(&[name.as_bytes(), b"=", value].concat())
}

/// A record from its header's fields and its data.
pub(super) fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header: Vec<u8> = fields.iter().flat_map(|(name, value)| field(name, value)).collect();
    [sized(&header), sized(data)].concat()
}

pub(super) fn connection(id: u32, topic: &str, kind: &str, definition: &str) -> Vec<u8> {
    let about = [
        field("topic", topic.as_bytes()),
        field("type", kind.as_bytes()),
        field("md5sum", b"*"),
        field("message_definition", definition.as_bytes()),
    ];
    record(&[("op", &[7]), ("conn", &id.to_le_bytes()), ("topic", topic.as_bytes())], &about.concat())
}

fn time(ms: u32) -> Vec<u8> {
    [(ms / 1000).to_le_bytes(), (ms % 1000 * 1_000_000).to_le_bytes()].concat()
}

pub(super) fn message(id: u32, ms: u32, data: &[u8]) -> Vec<u8> {
    record(&[("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &time(ms))], data)
}

/// A message of the type [`TWIST`].
pub(super) fn twist(stamp_ms: u32, x: f64, ranges: &[f32]) -> Vec<u8> {
    let ranges_on_wire: Vec<u8> = ranges.iter().flat_map(|range| range.to_le_bytes()).collect();
    [
        1_u32.to_le_bytes().to_vec(),
        time(stamp_ms),
        sized(b"base_link"),
        x.to_le_bytes().to_vec(),
        0.5_f64.to_le_bytes().to_vec(),
        (ranges.len() as u32).to_le_bytes().to_vec(),
        ranges_on_wire,
    ]
    .concat()
}

pub(super) fn chunk(packing: Packing, records: &[u8]) -> Vec<u8> {
    let (name, packed): (&[u8], Vec<u8>) = match packing {
        Packing::None => (b"none", records.to_vec()),
        Packing::Bz2 => {
            let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            encoder.write_all(records).unwrap();
            (b"bz2", encoder.finish().unwrap())
        }
        Packing::Lz4 => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(records).unwrap();
            (b"lz4", encoder.finish().unwrap())
        }
    };
    let size = (records.len() as u32).to_le_bytes();
    record(&[("op", &[5]), ("compression", name), ("size", &size)], &packed)
}

/// A whole bag: magic, header, chunks, and an index that repeats the connections.
pub(super) fn bag(chunks: &[Vec<u8>], connections: &[Vec<u8>]) -> Vec<u8> {
    let magic = b"#ROSBAG V2.0\n";
    let head = |index: u64| {
        let fields: [(&str, &[u8]); 4] = [
            ("op", &[3]),
            ("index_pos", &index.to_le_bytes()),
            ("conn_count", &(connections.len() as u32).to_le_bytes()),
            ("chunk_count", &(chunks.len() as u32).to_le_bytes()),
        ];
        record(&fields, &[b' '; 64])
    };
    let body = chunks.concat();
    let index = magic.len() + head(0).len() + body.len();
    [magic.to_vec(), head(index as u64), body, connections.concat()].concat()
}

/// Two topics, two chunks: `/odom` with a header at 100, 200, 300 ms (stamped 10 ms earlier, the last not at all), and `/dmin`,
/// a plain number, at 150 and 250 ms.
pub(super) fn small(packing: Packing) -> Vec<u8> {
    let odom = connection(0, "/odom", "nav/Twist", TWIST);
    let dmin = connection(1, "dmin", "std_msgs/Float64", "float64 data");
    let first = [
        odom.clone(),
        message(0, 100, &twist(90, 1.0, &[1.0, f32::INFINITY])),
        dmin.clone(),
        message(1, 150, &7.5_f64.to_le_bytes()),
    ];
    let second = [
        message(0, 200, &twist(190, 2.0, &[])),
        message(1, 250, &f64::NAN.to_le_bytes()),
        message(0, 300, &twist(0, 3.0, &[4.0])),
    ];
    bag(&[chunk(packing, &first.concat()), chunk(packing, &second.concat())], &[odom, dmin])
}
