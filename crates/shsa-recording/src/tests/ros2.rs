//! MCAP files and bags of ROS 2 written by the tests: intact, truncated, damaged.

use super::mcap_writer::{Chunks, channel, chunk, file, message, record, schema, small};
use super::sqlite_writer::bag;
use super::*;

const SOURCES: [&str; 3] = ["speed#data", "gnss#fix", "/old"];
const WHOLE: &str = "0@100=1.5\n1@90<110=[1.0, NaN]\n2@120=7\n0@200=2.5\n0@300=3.5";

fn show_file(name: &str, bytes: &[u8], sources: &[&str]) -> String {
    shown(&[(name, bytes)], sources, &ReadOptions::default())
}

#[test]
fn mcap_of_every_packing() {
    for chunks in [Chunks::None, Chunks::Plain, Chunks::Lz4] {
        assert_eq!(show_file("a.mcap", &small(chunks), &SOURCES), WHOLE, "{chunks:?}");
    }
    let said =
        show_file("a.mcap", &small(Chunks::Lz4), &["speed#data@published", "gnss#fix[0]@received[name=a]"]);
    assert!(said.contains("0@99<100=1.5"), "{said}");
    let said =
        show_file("a.mcap", &small(Chunks::Lz4), &["gnss#fix[0][name=a]@received", "gnss#fix[0][name=b]"]);
    assert!(said.starts_with("0@110=1\n! "), "{said}");
}

#[test]
fn a_cut_mcap_gives_the_beginning_of_the_whole() {
    for chunks in [Chunks::None, Chunks::Plain, Chunks::Lz4] {
        let whole = small(chunks);
        for length in (0..whole.len()).step_by(7) {
            let said = show_file("a.mcap", &whole[..length], &SOURCES);
            let (samples, rest) = said.split_at(said.find("! ").unwrap_or(said.len()));
            assert!(WHOLE.starts_with(samples.trim_end()), "{chunks:?} cut at {length}: {said}");
            assert!(rest.ends_with("degraded"), "{chunks:?} cut at {length}: {said}");
        }
    }
}

#[test]
fn mcap_goes_on_after_damage() {
    let chunk_at = |bytes: &[u8], nth: usize| {
        let starts = bytes.windows(3).enumerate().filter(|(_, bytes)| *bytes == b"lz4");
        starts.map(|(at, _)| at - 4 - 28 - 9).nth(nth).unwrap()
    };
    let whole = small(Chunks::Lz4);
    let mut length_wrong = whole.clone();
    length_wrong[chunk_at(&whole, 0) + 4] = 1;
    let said = show_file("a.mcap", &length_wrong, &["speed#data"]);
    assert!(said.contains("! a.mcap: at byte ") && said.ends_with("degraded"), "{said}");
    // Without a summary the channels of the damaged chunk are unknown; with a channel record before it they are known.
    let double = [&[0, 1, 0, 0][..], &2.5_f64.to_le_bytes()].concat();
    let about =
        [schema(1, "std_msgs/msg/Float64", "ros2msg", b"float64 data"), channel(1, 1, "/speed", "cdr")];
    let lost = record(6, &[7; 60]);
    let found = chunk(Chunks::Lz4, &message(1, 5_000_000, 0, &double));
    let said = show_file("a.mcap", &file(&[about.concat(), lost, found]), &["speed#data"]);
    assert!(said.starts_with("0@5=2.5\n! a.mcap: at byte ") && said.ends_with("degraded"), "{said}");
}

#[test]
fn what_mcap_cannot_say_is_said() {
    let parts = [
        channel(1, 0, "/a", "cbor"),
        schema(2, "bot_msgs/msg/Odd", "ros2msg", b"Missing part\nfloat64 data"),
        channel(2, 2, "/b", "cdr"),
        message(1, 1, 1, b"x"),
        message(2, 2, 2, b"x"),
    ];
    let said = show_file("a.mcap", &file(&parts), &["a#x", "b#data"]);
    assert!(said.contains("signal a#x: topic /a: messages encoded as 'cbor'"), "{said}");
    assert!(said.contains("the type bot_msgs/msg/Missing is not defined in the file"), "{said}");
    assert!(!said.contains("degraded"), "{said}");
}

#[test]
fn bags_of_ros_2_are_read_row_by_row() {
    let messages: Vec<(i64, f64)> = (1..=8).map(|number| (number * 1_000_000, number as f64)).collect();
    let whole = bag(&messages);
    assert_eq!(
        show_file("a.db3", &whole, &["speed#data"]),
        "0@1=1\n0@2=2\n0@3=3\n0@4=4\n0@5=5\n0@6=6\n0@7=7\n0@8=8"
    );
    // Without its last page.
    let said = show_file("a.db3", &whole[..whole.len() - 512], &["/speed"]);
    assert!(said.starts_with("0@1=1\n0@2=2\n0@3=3\n0@4=4\n0@5=5\n0@6=6\n! a.db3: at byte "), "{said}");
    assert!(said.ends_with("degraded"), "{said}");
    // The page that leads to the others, and the head of the file.
    for at in [2 * 512, 0, 100] {
        let mut damaged = whole.clone();
        damaged[at..at + 16].fill(0xee);
        let said = show_file("a.db3", &damaged, &["/speed"]);
        assert!(said.ends_with("degraded"), "{said}");
        if at > 0 {
            assert!(
                said.starts_with("0@1=1\n0@2=2\n0@3=3\n0@4=4\n0@5=5\n0@6=6\n0@7=7\n0@8=8"),
                "{at}: {said}"
            );
        }
    }
}
