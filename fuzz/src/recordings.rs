//! Recordings: any bytes as a table, as lines or as a bag; what is read is in order, counted, and was asked for.

use shsa_format::recording::{ReadOptions, Wanted, read_bytes};
use std::path::Path;

#[allow(dead_code, reason = "some of it is for the reader's own tests")]
#[path = "../../crates/shsa-format/src/recording/tests/bag_writer.rs"]
mod bag_writer;

use bag_writer::{Packing, small};

const TABLE: &str = "t [s],\"v [m/s]\",w\n0.1,1.5,2\n0.2,\"1.6\",NaN\n0.3,1e3,\n0.4,-inf,x\n";
const STAMPED: &str = "time_ms;v;header.stamp\n2024-05-01T10:00:00.5Z;1,5;7\n12;2;8\n";
const LINES: &str = "\
{\"signal\": \"/a\", \"time_ns\": 1, \"received_ns\": 2, \"value\": [1, {\"lo\": 1, \"hi\": 2}]}
{\"signal\": \"log\", \"time_ns\": 5, \"value\": {\"lo\": 1, \"hi\": 2}}
{\"signal\": \"/a\", \"time_ns\": 9e18, \"value\": null}
";

/// What is asked for: columns, fields, elements, changes, another clock.
const SOURCES: [&str; 9] = [
    "log#v",
    "log#w!changed",
    "/a",
    "odom#linear.x",
    "/dmin",
    "odom#ranges",
    "odom#ranges[1][header.frame_id=base_link]",
    "b#c.d[0]@e*5s!changed",
    "log#v@w*1ms",
];

/// The first byte says the format that the name pretends; the rest is the file.
pub fn run(bytes: &[u8]) {
    let (kind, bytes) = bytes.split_first().unwrap_or((&0, &[]));
    let name = ["log.csv", "log.jsonl", "log.bag", "log"][usize::from(kind % 4)];
    for sources in [&SOURCES[..], &SOURCES[..1], &SOURCES[2..7]] {
        check(name, bytes, sources, &ReadOptions::default());
    }
}

/// Reads a file, if it can be read at all, and looks at what comes of it.
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
    let texts = [("0", TABLE), ("0", STAMPED), ("1", LINES)];
    let texts = texts.iter().map(|(kind, text)| [kind.as_bytes(), text.as_bytes()].concat());
    let bags =
        [Packing::None, Packing::Bz2, Packing::Lz4].map(|packing| [b"2".to_vec(), small(packing)].concat());
    texts.chain(bags).collect()
}
