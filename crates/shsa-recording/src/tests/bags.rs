//! ROS bags written by the tests: intact, truncated, damaged.

use super::bag_writer::{Packing, bag, chunk, connection, message, record, small};
use super::*;

const SOURCES: [&str; 3] = ["odom#linear.x", "/dmin", "/odom#ranges"];
const WHOLE: &str = "0@90<100=1\n2@90<100=[1.0, inf]\n1@150=7.5\n0@190<200=2\n2@190<200=[]\n1@250=NaN\n\
                     0@300=3\n2@300=[4.0]";

fn show_bag(bytes: &[u8], sources: &[&str]) -> String {
    shown(&[("a.bag", bytes)], sources, &ReadOptions::default())
}

fn show_bytes(bytes: &[u8]) -> String {
    show(&read_bytes(Path::new("a.bag"), bytes, &wanted(&SOURCES), &ReadOptions::default()).unwrap())
}

#[test]
fn chunks_of_every_packing() {
    for packing in [Packing::None, Packing::Bz2, Packing::Lz4] {
        assert_eq!(show_bag(&small(packing), &SOURCES), WHOLE, "{packing:?}");
    }
}

#[test]
fn filters_and_stamps_of_messages() {
    let bag = small(Packing::Bz2);
    assert_eq!(show_bag(&bag, &["odom#linear.x[header.frame_id=base_link][linear.x=2]"]), "0@190<200=2");
    assert_eq!(
        show_bag(&bag, &["odom#linear.x[header.frame_id=map]"]),
        "! a.bag: signal odom#linear.x[header.frame_id=map]: \
        found in a.bag: /odom#linear.x, but without a sample (0 without a value)"
    );
    assert_eq!(show_bag(&bag, &["odom#linear.y@received"]), "0@100=0.5\n0@200=0.5\n0@300=0.5");
    assert_eq!(show_bag(&bag, &["odom#linear.y@received!changed"]), "0@100=0.5");
    assert_eq!(show_bag(&bag, &["odom#ranges[0]"]), "0@90<100=1\n0@300=4");
    assert_eq!(show_bag(&bag, &["odom#header.seq@linear.x*50ms"]), "0@50<100=1\n0@100<200=1\n0@150<300=1");
}

#[test]
fn what_is_not_in_the_bag_is_said() {
    let said = show_bag(&small(Packing::None), &["odom#linear.z", "odmo#linear.x", "odom#header.frame_id"]);
    assert_eq!(
        said,
        "! a.bag: signal odom#linear.z: topic /odom: no field 'z' in geometry_msgs/Vector3 (there is: x, y)\n\
         ! a.bag: signal odom#header.frame_id: topic /odom: 'header.frame_id' is neither a number nor a list of numbers\n\
         ! a.bag: signal odmo#linear.x: no 'odmo' in the recording; did you mean '/odom'? (there is: /odom, dmin)"
    );
}

#[test]
fn a_bag_lists_its_topics() {
    let folder = Folder::with(&[("a.bag", &small(Packing::Lz4))]);
    let topics = topics(&folder.0.join("a.bag"));
    let shown: Vec<_> =
        topics.iter().map(|t| format!("{} {} {} {:?}", t.name, t.kind, t.count, t.rate_hz)).collect();
    assert_eq!(shown, ["/odom nav/Twist 3 Some(10.0)", "dmin std_msgs/Float64 2 Some(10.0)"]);
}

#[test]
fn a_cut_bag_gives_the_beginning_of_the_whole() {
    for packing in [Packing::None, Packing::Bz2, Packing::Lz4] {
        let whole = small(packing);
        let connections = connection(1, "dmin", "std_msgs/Float64", "float64 data").len();
        for length in 0..whole.len() - connections {
            let said = show_bytes(&whole[..length]);
            let (samples, rest) = said.split_at(said.find("! ").unwrap_or(said.len()));
            assert!(WHOLE.starts_with(samples.trim_end()), "{packing:?} cut at {length}: {said}");
            assert!(rest.ends_with("degraded"), "{packing:?} cut at {length}: {said}");
        }
    }
}

#[test]
fn reading_goes_on_after_damage() {
    let whole = small(Packing::Bz2);
    let chunk_at = |n: usize| {
        let starts = whole.windows(11).enumerate().filter(|(_, bytes)| *bytes == b"compression");
        starts.map(|(at, _)| at).nth(n).unwrap()
    };
    let mut length_wrong = whole.clone();
    // Before the length of this field come the header's length, and the length and text of `op`.
    length_wrong[chunk_at(0) - 4 - 5 - 4 - 1] = 0xff;
    let said = show_bag(&length_wrong, &SOURCES);
    assert!(said.starts_with("0@190<200=2\n2@190<200=[]\n1@250=NaN"), "{said}");
    assert!(said.contains("! a.bag: at byte ") && said.ends_with("degraded"), "{said}");

    let mut data_wrong = whole.clone();
    data_wrong[chunk_at(0) + 100] ^= 0xff;
    let said = show_bag(&data_wrong, &SOURCES);
    assert!(said.starts_with("0@190<200=2"), "a damaged chunk gives nothing wrong: {said}");
    assert!(said.contains("of a chunk") || said.contains("is damaged, left out"), "{said}");
}

#[test]
fn padding_before_the_index_of_a_bag_is_no_damage() {
    let whole = small(Packing::None);
    let index = whole.windows(10).position(|it| it == b"index_pos=").unwrap() + 10;
    let place = usize::try_from(u64::from_le_bytes(whole[index..index + 8].try_into().unwrap())).unwrap();
    for padding in [0, b' '] {
        let (before, behind) = whole.split_at(place);
        let mut padded = [before, &[padding; 100], behind].concat();
        padded[index..index + 8].copy_from_slice(&(place as u64 + 100).to_le_bytes());
        let said = shown(&[("a.bag", &padded)], &["odom#linear.x"], &ReadOptions::default());
        assert_eq!(said, "0@90<100=1\n0@190<200=2\n0@300=3");
    }
}

#[test]
fn lengths_are_not_believed() {
    let connection = connection(0, "/a", "std_msgs/Float64", "float64 data");
    let four_gigabytes = u32::MAX.to_le_bytes();
    let bomb = record(&[("op", &[5]), ("compression", b"bz2"), ("size", &four_gigabytes)], b"BZh9");
    let mut long = message(0, 1, &[0; 8]);
    let at = long.len() - 12;
    long[at..at + 4].copy_from_slice(&four_gigabytes);
    let chunk =
        chunk(Packing::None, &[connection.clone(), message(0, 5, &1_f64.to_le_bytes()), long].concat());
    let said = show_bag(&bag(&[bomb, chunk], &[connection]), &["/a"]);
    assert!(said.starts_with("0@5=1\n! a.bag: at byte "), "{said}");
    assert!(said.contains("no whole record") && said.ends_with("degraded"), "{said}");
}

#[test]
fn few_bytes_do_not_become_many() {
    let connection = connection(0, "/a", "std_msgs/Float64", "float64 data");
    let large = chunk(Packing::Lz4, &vec![0; (64 << 20) + 1]);
    let chunk = chunk(Packing::None, &[connection.clone(), message(0, 5, &1_f64.to_le_bytes())].concat());
    let said = show_bag(&bag(&[large, chunk], &[connection]), &["/a"]);
    assert!(said.starts_with("0@5=1\n! a.bag: "), "{said}");
    assert!(said.contains("a chunk of 67108865 bytes is larger than 64 MiB, left out"), "{said}");
}

#[test]
fn a_bag_that_was_never_closed_is_read() {
    let mut bytes = small(Packing::None);
    let at = bytes.windows(10).position(|bytes| bytes == b"index_pos=").unwrap() + 10;
    bytes[at..at + 8].fill(0);
    let said = show_bag(&bytes, &SOURCES);
    assert!(said.starts_with(WHOLE), "{said}");
    assert!(said.contains("the bag was never closed") && said.ends_with("degraded"), "{said}");
}
