//! MDF files written by these tests, and those of a car.

use super::super::tests::collector::Collector;
use super::super::tests::independent::{
    check_cut, check_flipped, check_values, collected, collected_with, counted, expected, sample, sample_path,
};
use super::*;

/// A file under construction: blocks at multiples of eight.
struct Writer(Vec<u8>);

/// The bits of a channel.
struct Bits {
    data_type: u8,
    byte: u32,
    length: u32,
}

/// Blocks that a channel leads to.
#[derive(Default)]
struct Links {
    parts: u64,
    conversion: u64,
    data: u64,
}

impl Writer {
    fn new(magic: &[u8]) -> Writer {
        let mut bytes = magic.to_vec();
        bytes.resize(64 + 104, 0);
        Writer(bytes)
    }

    /// The place of the next block.
    fn next(&self) -> u64 {
        self.0.len().next_multiple_of(8) as u64
    }

    fn block(&mut self, name: &[u8; 2], links: &[u64], content: &[u8]) -> u64 {
        let at = self.next();
        self.0.resize(at as usize, 0);
        self.0.extend(block(name, links, content));
        at
    }

    fn text(&mut self, text: &str) -> u64 {
        self.block(b"TX", &[], &[text.as_bytes(), &[0]].concat())
    }

    /// A channel of a float of 64 bits, or of an integer of 16.
    fn channel(&mut self, next: u64, name: &str, kind: u8, bits: Bits, conversion: u64) -> u64 {
        self.linked(next, name, kind, bits, Links { conversion, ..Links::default() })
    }

    /// A channel with further blocks.
    fn linked(&mut self, next: u64, name: &str, kind: u8, bits: Bits, links: Links) -> u64 {
        let Bits { data_type, byte, length } = bits;
        let Links { parts, conversion, data } = links;
        let (name, unit) = (self.text(name), self.text("m"));
        let head = [kind, u8::from(kind == 2), data_type, 0];
        let content = [&head[..], &byte.to_le_bytes(), &length.to_le_bytes(), &[0; 56]].concat();
        self.block(b"CN", &[next, parts, name, 0, conversion, data, unit, 0], &content)
    }

    /// A group of channels with records of this length; or of values of variable length.
    fn group(&mut self, next: u64, id: u64, channels: u64, length: Option<u32>) -> u64 {
        let (flags, length) = (u64::from(length.is_none()), length.unwrap_or(0));
        let content =
            [&id.to_le_bytes()[..], &[0; 8], &flags.to_le_bytes(), &length.to_le_bytes(), &[0; 4]].concat();
        self.block(b"CG", &[next, channels, 0, 0, 0, 0], &content)
    }

    /// The head, which links to the first data group.
    fn finish(mut self, group: u64) -> Vec<u8> {
        let content = [&1_600_000_000_000_000_000_u64.to_le_bytes()[..], &[0; 24]].concat();
        let head = block(b"HD", &[group, 0, 0, 0, 0, 0], &content);
        self.0[64..64 + head.len()].copy_from_slice(&head);
        self.0
    }
}

fn block(name: &[u8; 2], links: &[u64], content: &[u8]) -> Vec<u8> {
    let length = (24 + 8 * links.len() + content.len()) as u64;
    let links: Vec<u8> = links.iter().flat_map(|link| link.to_le_bytes()).collect();
    [
        b"##",
        &name[..],
        &[0; 4],
        &length.to_le_bytes(),
        &(links.len() as u64 / 8).to_le_bytes(),
        &links,
        content,
    ]
    .concat()
}

/// Ten records of a time and a number.
fn records() -> Vec<u8> {
    (0..10_i16)
        .flat_map(|step| [&(f64::from(step) / 10.0).to_le_bytes()[..], &(-step).to_le_bytes()].concat())
        .collect()
}

/// A file with these data.
fn file(magic: &[u8], write: impl FnOnce(&mut Writer) -> u64) -> Vec<u8> {
    let mut writer = Writer::new(magic);
    let linear =
        [&[1, 0, 0, 0, 0, 0, 2, 0][..], &[0; 16], &1.0_f64.to_le_bytes(), &0.5_f64.to_le_bytes()].concat();
    let conversion = writer.block(b"CC", &[0, 0, 0, 0], &linear);
    let (integer, float) =
        (Bits { data_type: 2, byte: 8, length: 16 }, Bits { data_type: 4, byte: 0, length: 64 });
    let speed = writer.channel(0, "Speed", 0, integer, conversion);
    let time = writer.channel(speed, "t", 2, float, 0);
    let name = writer.text("engine");
    let content = [&[0; 8][..], &10_u64.to_le_bytes(), &[0; 8], &10_u32.to_le_bytes(), &[0; 4]].concat();
    let group = writer.block(b"CG", &[0, time, name, 0, 0, 0], &content);
    let data = write(&mut writer);
    let group = writer.block(b"DG", &[0, group, data, 0], &[0; 8]);
    writer.finish(group)
}

fn zipped(method: u8, content: &[u8], columns: u32) -> Vec<u8> {
    let rows = content.len() / columns as usize;
    let turned: Vec<u8> = (0..columns as usize)
        .flat_map(|at| (0..rows).map(move |row| row * columns as usize + at))
        .map(|at| content[at])
        .collect();
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(if method == 1 { &turned } else { content }, 6);
    let length = content.len() as u64;
    [
        b"DT",
        &[method, 0][..],
        &columns.to_le_bytes(),
        &length.to_le_bytes(),
        &(packed.len() as u64).to_le_bytes(),
        &packed,
    ]
    .concat()
}

#[track_caller]
fn check(bytes: &[u8]) {
    let all = collected(read, bytes);
    assert_eq!(all.damages, []);
    assert_eq!(all.shown(), ["engine engine: t [m], Speed [m] x10"]);
    let speeds = all.column("engine", "Speed");
    assert_eq!(speeds[3], (1_600_000_000_300_000_000, "-0.5".into()));
}

#[test]
fn data_are_plain_packed_or_in_lists() {
    let magic = b"MDF     4.11    ";
    check(&file(magic, |writer| writer.block(b"DT", &[], &records())));
    check(&file(magic, |writer| writer.block(b"DZ", &[], &zipped(0, &records(), 10))));
    check(&file(magic, |writer| writer.block(b"DZ", &[], &zipped(1, &records(), 10))));
    check(&file(magic, |writer| {
        let all = records();
        let (one, two) = all.split_at(35);
        let one = writer.block(b"DZ", &[], &zipped(0, one, 1));
        let two = writer.block(b"DT", &[], two);
        let second = writer.block(b"DL", &[0, two], &[0; 8]);
        let first = writer.block(b"DL", &[second, one], &[0; 8]);
        writer.block(b"HL", &[first], &[0; 8])
    }));
}

#[test]
fn a_file_that_was_cut_off_is_read_to_its_end() {
    let mut bytes = file(b"UnFinMF 4.11    ", |_| 0);
    // The data are the last block, without their length.
    let at = bytes.len().next_multiple_of(8);
    bytes.resize(at, 0);
    bytes.extend(block(b"DT", &[], &[]));
    bytes.extend(records());
    let group = bytes.windows(4).position(|it| it == b"##DG").unwrap();
    bytes[group + 40..group + 48].copy_from_slice(&(at as u64).to_le_bytes());
    check(&bytes);
}

const MAGIC: &[u8] = b"MDF     4.11    ";

/// The channels of a CAN frame whose bytes are at this link, by their place.
fn frame_channels(writer: &mut Writer, data: u64) -> u64 {
    let bits = |data_type, byte, length| Bits { data_type, byte, length };
    let bytes = Links { data, ..Links::default() };
    let bytes = writer.linked(0, "CAN_DataFrame.DataBytes", 1, bits(10, 12, 64), bytes);
    let id = writer.channel(bytes, "CAN_DataFrame.ID", 0, bits(0, 8, 32), 0);
    writer.channel(id, "t", 2, bits(4, 0, 64), 0)
}

/// The records of three frames, each of which says where its bytes are: with the lengths before them, these are 6, 5 and 7 bytes.
fn frames() -> Vec<Vec<u8>> {
    let frame = |(at, offset): (u32, u64)| {
        [&f64::from(at).to_le_bytes()[..], &0x123_u32.to_le_bytes(), &offset.to_le_bytes()].concat()
    };
    (0..).zip([0, 6, 11]).map(frame).collect()
}

const BYTES: [&[u8]; 3] = [b"\x02\0\0\0\x01\x02", b"\x01\0\0\0\x03", b"\x03\0\0\0\x04\x05\x06"];

#[track_caller]
fn check_frames(bytes: &[u8]) {
    let all = collected(read, bytes);
    assert_eq!(all.damages, []);
    let values: Vec<String> =
        all.column("0x123[channel=group_0]", "data").into_iter().map(|(_, value)| value).collect();
    assert_eq!(values, ["[1.0, 2.0]", "[3.0]", "[4.0, 5.0, 6.0]"]);
}

#[test]
fn bytes_of_variable_length_are_those_of_their_frame() {
    let sorted = |write: &dyn Fn(&mut Writer, &[u8]) -> u64| {
        let mut writer = Writer::new(MAGIC);
        let values = write(&mut writer, &BYTES.concat());
        let channels = frame_channels(&mut writer, values);
        let group = writer.group(0, 0, channels, Some(20));
        let data = writer.block(b"DT", &[], &frames().concat());
        let group = writer.block(b"DG", &[0, group, data, 0], &[0; 8]);
        writer.finish(group)
    };
    check_frames(&sorted(&|writer, bytes| writer.block(b"SD", &[], bytes)));
    check_frames(&sorted(&|writer, bytes| writer.block(b"DZ", &[], &zipped(0, bytes, 1))));
    check_frames(&sorted(&|writer, bytes| {
        let one = writer.block(b"SD", &[], &bytes[..8]);
        let two = writer.block(b"DZ", &[], &zipped(0, &bytes[8..], 1));
        let list = writer.block(b"DL", &[0, one, two], &[0; 8]);
        writer.block(b"HL", &[list], &[0; 8])
    }));
    // Without the values of the last frame.
    let cut = sorted(&|writer, bytes| writer.block(b"SD", &[], &bytes[..13]));
    let all = collected(read, &cut);
    assert_eq!(all.count(), 2);
    assert!(all.damages[0].1.starts_with("1 frames of a bus have no bytes in the file"), "{:?}", all.damages);
}

#[test]
fn bytes_of_variable_length_are_records_of_an_unsorted_file() {
    // Values before their frame, behind it, and all at the end.
    for order in [[3, 0, 4, 1, 5, 2], [0, 3, 1, 4, 2, 5], [0, 1, 2, 3, 4, 5]] {
        let mut writer = Writer::new(MAGIC);
        let values = writer.group(0, 7, 0, None);
        let channels = frame_channels(&mut writer, values);
        let group = writer.group(values, 5, channels, Some(20));
        let records: Vec<Vec<u8>> = frames()
            .iter()
            .map(|frame| [&[5][..], frame].concat())
            .chain(BYTES.iter().map(|value| [&[7], *value].concat()))
            .collect();
        let records: Vec<u8> = order.iter().flat_map(|at| records[*at].clone()).collect();
        let data = writer.block(b"DT", &[], &records);
        let group = writer.block(b"DG", &[0, group, data, 0], &[1, 0, 0, 0, 0, 0, 0, 0]);
        check_frames(&writer.finish(group));
    }
}

#[test]
fn arrays_are_lists_and_what_is_not_read_is_named() {
    let mut writer = Writer::new(MAGIC);
    let bits = |data_type, byte, length| Bits { data_type, byte, length };
    let odd = writer.block(
        b"CC",
        &[0, 0, 0, 0],
        &[12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    );
    let odd = writer.channel(0, "odd", 0, bits(0, 8, 16), odd);
    let text = writer.channel(odd, "text", 0, bits(7, 8, 16), 0);
    let half = writer.channel(text, "half", 0, bits(4, 12, 16), 0);
    let sizes = [&[0, 0, 1, 0, 0, 0, 0, 0][..], &2_u32.to_le_bytes(), &[0; 4], &2_u64.to_le_bytes()].concat();
    let parts = writer.block(b"CA", &[0], &sizes);
    let list = writer.linked(half, "list", 0, bits(2, 8, 16), Links { parts, ..Links::default() });
    let time = writer.channel(list, "t", 2, bits(4, 0, 64), 0);
    let group = writer.group(0, 0, time, Some(14));
    let record =
        [&0.5_f64.to_le_bytes()[..], &(-1_i16).to_le_bytes(), &2_i16.to_le_bytes(), &[0, 0x3e]].concat();
    let late = [&1e10_f64.to_le_bytes()[..], &[0; 6]].concat();
    let data = writer.block(b"DT", &[], &[record, late].concat());
    let group = writer.block(b"DG", &[0, group, data, 0], &[0; 8]);
    let all = collected(read, &writer.finish(group));
    assert_eq!(all.shown(), ["group_0 group_0: t [m], list [m], half [m] x1"]);
    assert_eq!(all.column("group_0", "list")[0].1, "[-1.0, 2.0]");
    assert_eq!(all.column("group_0", "half")[0].1, "1.5");
    let not_read = "group group_0: not read are the channels text (texts), odd (a conversion of kind 12 is not computed here)";
    assert_eq!(all.notes.iter().map(|(_, note)| note.as_str()).collect::<Vec<_>>(), [not_read]);
    assert_eq!(
        all.damages.iter().map(|(_, what)| what.as_str()).collect::<Vec<_>>(),
        ["1 records have times beyond the year 2262, which are not read here; left out"]
    );
}

#[test]
fn what_loggers_write_is_read_as_asammdf_does() {
    let Some(dbc) = sample_path("odd/CSS-Electronics-SAE-J1939-DEMO.dbc") else { return };
    let options = ReadOptions { dbc: vec![dbc], ..ReadOptions::default() };
    for file in ["vlsd_enginespeed_cut.MF4", "vlsd_sorted_sd.mf4"] {
        let Some(bytes) = sample(&format!("odd/{file}")) else { return };
        let speeds = find_column(&collected_with(read, &bytes, &options), "EngineSpeed");
        let numbers: Vec<f64> = speeds.iter().filter_map(|(_, value)| value.parse().ok()).collect();
        let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
        assert_eq!((numbers.len(), numbers[0], numbers[236]), (237, 649.0, 648.5), "{file}");
        assert!((mean - 650.1825).abs() < 1e-3, "{file}: {mean}");
        (1..=20).for_each(|step| drop(counted(read, &bytes[..bytes.len() * step / 21])));
    }
}

#[test]
fn links_in_a_circle_end() {
    let mut bytes = file(b"MDF     4.11    ", |writer| writer.block(b"DT", &[], &records()));
    let group = bytes.windows(4).position(|it| it == b"##DG").unwrap();
    bytes[group + 24..group + 32].copy_from_slice(&(group as u64).to_le_bytes());
    let all = counted(read, &bytes);
    assert!(!all.damages.is_empty() && all.messages > 0);
}

fn find_column(all: &Collector, field: &str) -> Vec<(i64, String)> {
    let found = all.topics.iter().map(|topic| all.column(&topic.full, field));
    found.into_iter().find(|column| column.iter().any(|(_, value)| !value.is_empty())).unwrap_or_default()
}

#[test]
fn the_drive_of_a_car_is_read_as_asammdf_does() {
    let Some(dbc) = sample_path("mdf/gnss.dbc") else { return };
    let options = ReadOptions { dbc: vec![dbc], ..ReadOptions::default() };
    for file in ["63BEF5CD.MF4", "63BEFDF9.MF4", "car_decoded.mf4", "car_decoded_plain.mf4"] {
        let (Some(bytes), Some(expected)) = (sample(&format!("mdf/{file}")), expected("mdf", file)) else {
            return;
        };
        let all = collected_with(read, &bytes, &options);
        assert_eq!(all.damages, []);
        for (name, of_field) in expected["fields"].as_object().unwrap() {
            let field = name.split_once(" [").unwrap().0;
            let (first, last) = check_values(&find_column(&all, field), of_field, &format!("{file} {name}"));
            for (found, at) in [(first, "first"), (last, "last")] {
                let since = found as f64 / 1e9 - 1_673_458_915.0;
                assert!((since - of_field[at]["time_s"].as_f64().unwrap()).abs() < 1e-6, "{name}: {since}");
            }
        }
    }
}

#[test]
fn drives_are_read_though_damaged() {
    let Some(bytes) = sample("mdf/63BEF5CD.MF4") else { return };
    check_flipped(read, &bytes, 0.0);
    check_cut(read, &bytes);
}
