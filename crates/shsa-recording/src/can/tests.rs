//! CAN recordings written by these tests, and those of a car and a boat.

use super::super::tests::collector::Collector;
use super::super::tests::independent::{
    Reader, check_cut, check_flipped, check_values, collected_with, counted, expected, sample_path,
};
use super::super::tests::independent::{collected, sample};
use super::super::*;
use super::{asc, blf, candump};

const DBC: &str = "\
BO_ 23 speed: 5 X\n SG_ Valid : 0|1@1+ (1,0) [0|1] \"\" X\n SG_ Speed : 8|16@1+ (0.001,0) [0|1] \"m/s\" X\n\
BO_ 2147483671 wide: 8 X\n SG_ Mode M : 0|8@1+ (1,0) [0|1] \"\" X\n SG_ A m1 : 8|8@1- (1,0) [0|1] \"\" X\n SG_ B m2 : 8|8@1- (1,0) [0|1] \"\" X\n";

/// The messages of a recording with this DBC.
fn with_dbc(reader: Reader, bytes: &[u8]) -> Collector {
    let folder = tests::Folder::with(&[("a.dbc", DBC.as_bytes())]);
    collected_with(
        reader,
        bytes,
        &ReadOptions { dbc: vec![folder.0.join("a.dbc")], ..ReadOptions::default() },
    )
}

#[track_caller]
fn check(reader: Reader, bytes: &[u8], topics: &[&str], damages: &[&str]) {
    let all = with_dbc(reader, bytes);
    assert_eq!(all.shown(), topics);
    let shown: Vec<String> = all.damages.iter().map(|(place, what)| format!("{place:?} {what}")).collect();
    assert_eq!(shown, damages);
}

const CANDUMP: &str = "# a boat\n(1700000000.000001) can0 017#01E803 R\n(1700000000.5) can0 00000017#02FF\n\
(1700000001.0) can0 00000017#01.FE\n(1700000001.1) can1 123#R\n(1700000001.2) can1 20000080#00\n\
(1700000001.3)  can1  123   [3]  01 02 03   '...'\n(1700000001.4) can0 017##1000000 T\n(1700000002.0) can0 017#0\n(1700000002.0) can0 17#00\nnoise\n(17000";

#[test]
fn lines_of_candump_are_frames() {
    let file_ends = "Line(12) the file ends within this line; line left out";
    check(
        candump::read,
        CANDUMP.as_bytes(),
        &[
            "speed 0x17:speed[channel=can0]: Valid, Speed [m/s] x2",
            "wide 0x17:wide[channel=can0]: Mode, A, B x2",
            "0x123 0x123[channel=can1]: data x1",
        ],
        &[
            "Line(9) the data have an odd number of digits; line left out",
            "Line(10) '17' is no identifier of three or eight digits; line left out",
            "Line(11) no time in parentheses; line left out",
            file_ends,
        ],
    );
    let all = with_dbc(candump::read, CANDUMP.as_bytes());
    assert_eq!(
        all.column("0x17:speed[channel=can0]", "Speed"),
        [(1_700_000_000_000_001_000, "1".into()), (1_700_000_001_400_000_000, "0".into())]
    );
    let wide = "0x17:wide[channel=can0]";
    let values = |field| all.column(wide, field).into_iter().map(|(_, value)| value).collect::<Vec<_>>();
    assert_eq!(
        (values("A"), values("B")),
        (vec!["-".into(), "-2".into()], vec!["-1".into(), "-".to_string()])
    );
    assert_eq!(all.notes[0].1, "2 frames without data were passed over: errors of the bus, requests");
    assert!(candump::is_log(CANDUMP.as_bytes()) && !candump::is_log(b"t,v\n1,2\n"));
}

#[test]
fn a_frame_without_bytes_is_no_request() {
    let text = "(1700000000.1) can0 123# R\n(1700000000.2)  can0  123   [0]\n(1700000000.3)  can0  123   [4]  remote request\n";
    check(candump::read, text.as_bytes(), &["0x123 0x123[channel=can0]: data x2"], &[]);
}

#[test]
fn without_a_dbc_frames_are_bytes() {
    let all = collected(candump::read, CANDUMP.as_bytes());
    assert_eq!(all.column("0x17[channel=can0]", "data[0]").len(), 4);
    assert!(all.notes[0].1.contains("--dbc FILE"));
}

const ASC: &str = "date Wed Jan 11 05:42:09.103 pm 2023\nbase hex  timestamps absolute\ninternal events logged\n\
Begin Triggerblock Wed Jan 11 05:42:09.103 pm 2023\n 0.000000 Start of measurement\n\
 0.000400 1  17              Rx   d 3 01 E8 03\n 0.001 1 17x Tx d 2 01 FE Length = 0\n 0.002 1 ErrorFrame\n\
 0.003 CANFD 1 Rx 17 speed 1 0 3 3 01 D0 07 0 0 0\n 0.004 1 17 Rx d 3 01\n 0.005 1 17 Rx r\n 0.006 CANFD 1 17 Rx 1 0 2 2 01 00\n\
End TriggerBlock\n";

#[test]
fn lines_of_asc_are_frames() {
    check(
        asc::read,
        ASC.as_bytes(),
        &["speed 0x17:speed[channel=1]: Valid, Speed [m/s] x3", "wide 0x17:wide[channel=1]: Mode, A, B x1"],
        &["Line(10) the frame has 1 of its 3 bytes; line left out"],
    );
    let speeds = with_dbc(asc::read, ASC.as_bytes()).column("0x17:speed[channel=1]", "Speed");
    assert_eq!(speeds[0], (1_673_458_929_103_400_000, "1".into()));
    assert_eq!(speeds[1], (1_673_458_929_106_000_000, "2".into()));
    assert_eq!(speeds[2].1, "-", "the frame is too short for it");
    assert!(asc::is_log(ASC.as_bytes()));
}

#[test]
fn dates_of_asc_are_told_in_words() {
    #[track_caller]
    fn check(head: &str, expected: Option<i64>) {
        let text = format!(
            "{head}\nbase dec  timestamps relative\n0.5 1 23 Rx d 3 1 232 3\n0.5 1 23 Rx d 3 1 232 3\n"
        );
        let found = with_dbc(asc::read, text.as_bytes()).column("0x17:speed[channel=1]", "Speed");
        assert_eq!(found[1], (expected.unwrap_or(0) * 1_000_000_000 + 1_000_000_000, "1".into()));
    }
    check("date Sam Mär 30 15:06:13 2019", Some(1_553_958_373));
    check("date Mon Dec 1 12:00:00.000 am 2025", Some(1_764_547_200));
    check("date unknown", None);
}

/// An object of a BLF.
fn object(kind: u32, content: &[u8]) -> Vec<u8> {
    let length = u32::try_from(16 + content.len()).unwrap();
    let mut bytes =
        [b"LOBJ", &[32, 0, 1, 0][..], &length.to_le_bytes(), &kind.to_le_bytes(), content].concat();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// A frame, so many steps of 10 us after the start.
fn frame(steps: u64, id: u32, data: &[u8]) -> Vec<u8> {
    let mut padded = data.to_vec();
    padded.resize(8, 0);
    let length = u8::try_from(data.len()).unwrap();
    let header = [&1_u32.to_le_bytes()[..], &[0; 4], &steps.to_le_bytes()].concat();
    object(1, &[&header, &[1, 0, 0, length][..], &id.to_le_bytes(), &padded].concat())
}

fn container(content: &[u8]) -> Vec<u8> {
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(content, 6);
    let size = u32::try_from(content.len()).unwrap();
    object(10, &[&[2, 0, 0, 0, 0, 0, 0, 0][..], &size.to_le_bytes(), &[0; 4], &packed].concat())
}

fn blf_file(objects: &[Vec<u8>]) -> Vec<u8> {
    let date = [2023_u16, 1, 3, 11, 17, 42, 9, 103].map(u16::to_le_bytes).concat();
    let mut header = [b"LOGG", &144_u32.to_le_bytes()[..], &[0; 32], &date].concat();
    header.resize(144, 0);
    [header, objects.concat()].concat()
}

#[test]
fn objects_of_blf_are_frames() {
    let frames: Vec<u8> = (0..10).flat_map(|step| frame(step, 23, &[1, 0xe8, 3])).collect();
    // The fifth frame is split between the two containers.
    let (one, two) = frames.split_at(4 * 48 + 20);
    let bytes = blf_file(&[container(one), container(two), frame(10, 23 | 1 << 31, &[1, 2])]);
    let all = with_dbc(blf::read, &bytes);
    let shown =
        ["speed 0x17:speed[channel=1]: Valid, Speed [m/s] x10", "wide 0x17:wide[channel=1]: Mode, A, B x1"];
    assert_eq!(all.shown(), shown);
    assert_eq!(all.column("0x17:speed[channel=1]", "Speed")[9], (1_673_458_929_103_090_000, "1".into()));
    assert_eq!(all.damages, []);
}

/// A CAN FD frame of so many valid bytes, of which these are in the object.
fn frame_fd(valid: u8, there: &[u8]) -> Vec<u8> {
    let header = [&2_u32.to_le_bytes()[..], &[0; 4], &[0; 8]].concat();
    object(101, &[&header, &[1, 15, valid, 0][..], &23_u32.to_le_bytes(), &[0; 32], there].concat())
}

#[test]
fn bytes_of_a_frame_beyond_its_object_are_zero() {
    let all = collected(blf::read, &blf_file(&[frame_fd(6, &[1, 2, 3, 4]), frame_fd(3, &[1, 2, 3, 4])]));
    let values: Vec<String> =
        all.column("0x17[channel=1]", "data").into_iter().map(|(_, value)| value).collect();
    assert_eq!(values, ["[1.0, 2.0, 3.0, 4.0, 0.0, 0.0]", "[1.0, 2.0, 3.0]"]);
    // The file ends within the object: nothing is known of the rest.
    let mut cut = blf_file(&[frame_fd(6, &[1, 2, 3, 4, 5, 6])]);
    cut.truncate(cut.len() - 5);
    let all = collected(blf::read, &cut);
    assert_eq!((all.count(), all.damages.len()), (0, 1));
}

#[test]
fn lengths_of_asc_are_those_of_can_fd_too() {
    let lines = [
        "0.1 1 17 Rx d 10 00 01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E 0F",
        "0.2 1 17 Rx d 9 00 01 02 03 04 05 06 07",
        "0.3 1 17 Rx d c 00 01 02 03 04 05 06 07 08 09 0A 0B",
        "0.4 1 17 Rx d 11 00",
    ];
    let all = collected(
        asc::read,
        format!("date unknown\nbase hex timestamps absolute\n{}\n", lines.join("\n")).as_bytes(),
    );
    let count = |(_, value): (i64, String)| value.matches(".0").count();
    let counts: Vec<usize> = all.column("0x17[channel=1]", "data").into_iter().map(count).collect();
    assert_eq!(counts, [16, 8, 12]);
    assert_eq!(all.damages[0].1, "the identifier or the length is no number; line left out");
}

#[test]
fn a_damaged_container_costs_itself() {
    let full = |from: u64| {
        container(&(from..from + 10).flat_map(|step| frame(step, 23, &[1, 2, 3])).collect::<Vec<_>>())
    };
    let (one, mut two, three) = (full(0), full(10), full(20));
    let middle = two.len() / 2;
    two[middle..middle + 8].fill(0xff);
    let bytes = blf_file(&[one, vec![7; 100], two, three]);
    let all = counted(blf::read, &bytes);
    assert!(all.messages >= 20, "{}", all.messages);
    assert!(all.damages[0].contains("no object begins here"), "{:?}", all.damages);
    assert!(all.damages[1].contains("a container unpacks to"), "{:?}", all.damages);
}

fn options() -> Option<ReadOptions> {
    Some(ReadOptions { dbc: vec![sample_path("can/gnss.dbc")?], ..ReadOptions::default() })
}

fn check_sample(reader: Reader, file: &str, channel: &str) {
    let (Some(bytes), Some(expected), Some(options)) =
        (sample(&format!("can/{file}")), expected("can", file), options())
    else {
        return;
    };
    let all = collected_with(reader, &bytes, &options);
    assert_eq!(all.damages, []);
    let full_of = |name: &str| {
        let topic = all.topics.iter().find(|topic| topic.name == name);
        topic.unwrap_or_else(|| panic!("{name}: {:?}", all.shown())).full.clone()
    };
    for (name, count) in expected["messages"].as_object().unwrap() {
        let found: usize = all.topics.iter().filter(|it| it.name == *name).map(|it| it.messages.len()).sum();
        assert_eq!(found as u64, count.as_u64().unwrap(), "{name}");
        assert!(full_of(name).ends_with(&format!("[channel={channel}]")));
    }
    let unknown: usize =
        all.topics.iter().filter(|it| it.name.starts_with("0x")).map(|it| it.messages.len()).sum();
    assert_eq!(unknown as u64, expected["frames_unknown"].as_u64().unwrap());
    for (name, of_field) in expected["fields"].as_object().unwrap() {
        let (topic, field) = name.split_once('#').unwrap();
        let (first, last) = check_values(&all.column(&full_of(topic), field), of_field, name);
        for (found, at) in [(first, "first"), (last, "last")] {
            let expected = of_field[at]["time_s"].as_f64().unwrap();
            assert!((found as f64 / 1e9 - expected).abs() < 1e-6, "{name}: {found} and {expected}");
        }
    }
}

#[test]
fn the_drive_of_a_car_is_read_as_python_can_and_cantools_do() {
    check_sample(candump::read, "car.log", "can0");
    check_sample(asc::read, "car.asc", "1");
    check_sample(blf::read, "car.blf", "1");
}

#[test]
fn the_bus_of_a_boat_is_read() {
    let Some(bytes) = sample("can/n2k_candump.log") else { return };
    let all = counted(candump::read, &bytes);
    assert_eq!((all.messages, all.damages), (10_495, vec![]));
}

#[test]
fn drives_are_read_though_damaged() {
    for (reader, file, least) in
        [(candump::read as Reader, "car.log", 0.9), (asc::read, "car.asc", 0.9), (blf::read, "car.blf", 0.0)]
    {
        let Some(bytes) = sample(&format!("can/{file}")) else { return };
        check_cut(reader, &bytes);
        check_flipped(reader, &bytes, least);
    }
}
