//! No bytes make a reader panic, or deliver a signal that was not wanted.

use proptest::prelude::*;

use super::bag_writer::{Packing, small};
use super::*;

/// Whether the result of reading these bytes, if any, is in order, counted, and wanted.
fn is_sound(name: &str, bytes: &[u8], sources: &[&str]) -> bool {
    let Ok(recording) = read_bytes(Path::new(name), bytes, &wanted(sources), &ReadOptions::default()) else {
        return true;
    };
    recording.by_session().all(|(_, samples)| samples.is_sorted_by_key(|sample| sample.received))
        && recording.by_session().map(|(_, samples)| samples.len()).sum::<usize>() == recording.samples.len()
        && recording.samples.iter().all(|sample| sample.wanted < sources.len())
        && recording.found.iter().map(|found| found.samples).sum::<usize>() == recording.samples.len()
}

/// The bytes with some of them overwritten, a piece cut out, or a piece repeated.
fn mutated(mut bytes: Vec<u8>, changes: &[(usize, u8)], cut: (usize, usize), again: bool) -> Vec<u8> {
    let length = bytes.len();
    for (at, value) in changes {
        bytes[at % length] = *value;
    }
    let (from, to) = (cut.0 % length, (cut.0 % length + cut.1).min(length));
    let piece = bytes[from..to].to_vec();
    bytes.splice(if again { from..from } else { from..to }, if again { piece } else { Vec::new() });
    bytes
}

const TABLE: &str = "t [s],\"v [m/s]\",w\n0.1,1.5,2\n0.2,\"1.6\",NaN\n0.3,1e3,\n0.4,-inf,x\n";
const LINES: &str = "{\"signal\": \"/a\", \"time_ns\": 1, \"received_ns\": 2, \"value\": [1, {\"lo\": 1, \"hi\": 2}]}\n\
                     {\"signal\": \"/a\", \"time_ns\": 5, \"value\": {\"lo\": 1, \"hi\": 2}}\n";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn bags(
        packing in prop_oneof![Just(Packing::None), Just(Packing::Bz2), Just(Packing::Lz4)],
        changes in prop::collection::vec(any::<(usize, u8)>(), 0..6),
        cut in (any::<usize>(), 0_usize..200),
        again in any::<bool>(),
    ) {
        let bytes = mutated(small(packing), &changes, cut, again);
        let sources = ["odom#linear.x", "/dmin", "odom#ranges", "odom#ranges[1][header.frame_id=base_link]"];
        prop_assert!(is_sound("a.bag", &bytes, &sources));
    }

    #[test]
    fn texts(
        changes in prop::collection::vec(any::<(usize, u8)>(), 0..6),
        cut in (any::<usize>(), 0_usize..50),
        again in any::<bool>(),
    ) {
        let sources = ["log#v", "w!changed", "/a"];
        let table = mutated(TABLE.into(), &changes, cut, again);
        prop_assert!(is_sound("log.csv", &table, &sources));
        let lines = mutated(LINES.into(), &changes, cut, again);
        prop_assert!(is_sound("log.jsonl", &lines, &sources));
    }

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let bag = [rosbag::MAGIC, &bytes].concat();
        for (name, bytes) in [("log.csv", &bytes), ("log.jsonl", &bytes), ("log.bag", &bag)] {
            prop_assert!(is_sound(name, bytes, &["log#v", "b#c.d[0]@e*5s!changed"]));
        }
    }

    #[test]
    fn any_source(text in ".{0,40}") {
        if let Ok(source) = text.parse::<shsa_message::source::Source>() {
            prop_assert!(!source.field.is_empty());
        }
    }
}
