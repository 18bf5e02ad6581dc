//! Recordings: any bytes as a table, as lines, as a bag of ROS 1 or 2, as MCAP; results are in order, counted, and among the
//! wanted ones.

use shsa_recording::{ReadOptions, Wanted, read_bytes};
use std::path::Path;

#[allow(dead_code, reason = "some of it is for the reader's own tests")]
#[path = "../../../crates/shsa-recording/src/tests/bag_writer.rs"]
mod bag_writer;

#[path = "../../../crates/shsa-recording/src/tests/mcap_writer.rs"]
mod mcap_writer;

#[path = "../../../crates/shsa-recording/src/tests/parquet_writer.rs"]
pub(crate) mod parquet_writer;

#[path = "../../../crates/shsa-recording/src/tests/sqlite_writer.rs"]
mod sqlite_writer;

use bag_writer::{Packing, small};
use mcap_writer::Chunks;

const TABLE: &str = "t [s],\"v [m/s]\",w\n0.1,1.5,2\n0.2,\"1.6\",NaN\n0.3,1e3,\n0.4,-inf,x\n";
const STAMPED: &str = "time_ms;v;header.stamp\n2024-05-01T10:00:00.5Z;1,5;7\n12;2;8\n";
const DATED: &str = "#YY MM DD hh mm v\n#yr mo dy hr mn m/s\n2019 08 01 00 10 1,5\n2019 08 01 00 20 2,5\n";
const APART: &str = "Date;Time;v;;\r\n10/03/2004;18.00.00;2,6;;\r\n11/03/2004;19.00.00;3,6;;\r\n";
const LINES: &str = "\
{\"signal\": \"/a\", \"time_ns\": 1, \"received_ns\": 2, \"value\": [1, {\"lo\": 1, \"hi\": 2}]}
{\"signal\": \"log\", \"time_ns\": 5, \"value\": {\"lo\": 1, \"hi\": 2}}
{\"signal\": \"/a\", \"time_ns\": 9e18, \"value\": null}
";

/// The wanted sources: columns, fields, elements, changes, another clock.
const SOURCES: [&str; 13] = [
    "log#v",
    "log#w!changed",
    "/a",
    "odom#linear.x",
    "/dmin",
    "odom#ranges",
    "odom#ranges[1][header.frame_id=base_link]",
    "b#c.d[0]@e*5s!changed",
    "log#v@w*1ms",
    "speed#data",
    "gnss#fix[0][name=a]",
    "gnss#fix@published",
    "/old",
];

/// The first byte chooses the format of the file name; the rest is the file.
pub fn run(bytes: &[u8]) {
    let (kind, bytes) = bytes.split_first().unwrap_or((&0, &[]));
    let name = ["log.csv", "log.jsonl", "log.bag", "log", "log.mcap", "log.db3"][usize::from(kind % 6)];
    for sources in [&SOURCES[..], &SOURCES[..1], &SOURCES[2..7]] {
        check(name, bytes, sources, &ReadOptions::default());
    }
}

/// Reads a file, if possible, and checks the results.
pub(crate) fn check(name: &str, bytes: &[u8], sources: &[&str], options: &ReadOptions) {
    let wanted: Vec<Wanted> = sources.iter().map(|source| Wanted::new(*source, *source)).collect();
    let Ok(recording) = read_bytes(Path::new(name), bytes, &wanted, options) else { return };
    for (session, samples) in recording.by_session() {
        assert!(samples.is_sorted_by_key(|sample| sample.received), "out of order");
        assert_eq!(samples.len(), session.samples.len(), "of no session");
    }
    assert!(recording.samples.iter().all(|sample| sample.wanted < sources.len()), "not asked for");
    let counted: usize = recording.found.iter().map(|found| found.samples).sum();
    assert_eq!(counted, recording.samples.len(), "counted wrong");
}

/// A small file of every kind.
#[must_use]
pub fn seeds() -> Vec<Vec<u8>> {
    let texts = [("0", TABLE), ("0", STAMPED), ("0", DATED), ("0", APART), ("1", LINES)];
    let texts = texts.iter().map(|(kind, text)| [kind.as_bytes(), text.as_bytes()].concat());
    let bags =
        [Packing::None, Packing::Bz2, Packing::Lz4].map(|packing| [b"2".to_vec(), small(packing)].concat());
    let files = [Chunks::None, Chunks::Plain, Chunks::Lz4]
        .map(|chunks| [b"4".to_vec(), mcap_writer::small(chunks)].concat());
    let messages: Vec<(i64, f64)> = (1..=8).map(|number| (number * 1_000_000, number as f64)).collect();
    let databases = [[b"5".to_vec(), sqlite_writer::bag(&messages)].concat()];
    texts.chain(bags).chain(files).chain(databases).collect()
}
