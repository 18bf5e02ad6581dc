//! The memory for reading files that are made to take much memory.

use shsa_recording::{ReadOptions, Wanted, read, stream, survey};

/// The most bytes that a file of a few megabytes may take to read beyond its own size.
const BEYOND: u64 = 64 << 20;

/// What reading a file takes at its peak, bytes; and what was reported.
fn reading(name: &str, bytes: &[u8]) -> (u64, String) {
    let folder =
        std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bombs-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(name);
    std::fs::write(&file, bytes).unwrap();
    let wanted = [Wanted::new("a", ""), Wanted::new("b", "t#v")];
    let mut reported = String::new();
    let counted = allocation_counter::measure(|| {
        let recording = read(std::slice::from_ref(&file), &wanted, &ReadOptions::default());
        reported = match recording {
            Ok(recording) => recording.warnings.iter().map(|warning| format!("{warning}\n")).collect(),
            Err(error) => error.to_string(),
        };
    });
    std::fs::remove_file(&file).unwrap();
    (counted.bytes_max, reported)
}

/// What is read of a bomb is bounded, and the bound is reported.
#[track_caller]
fn defused(name: &str, bytes: &[u8], expected: &str) {
    let (peak, reported) = reading(name, bytes);
    assert!(reported.contains(expected), "{reported}");
    assert!(peak <= BEYOND, "{name}: {peak} bytes at the peak of {} bytes", bytes.len());
}

const SOUND: &str = "{\"signal\": \"a\", \"time_ns\": 5, \"value\": 1}\n";

#[test]
fn a_line_without_an_end_is_bounded() {
    let line = "x".repeat(40 << 20);
    defused(
        "endless.jsonl",
        format!("{SOUND}{line}\n{SOUND}").as_bytes(),
        "jsonl:2: the line is longer than 16 MiB",
    );
}

#[test]
fn a_list_without_an_end_is_bounded() {
    let line = format!("{{\"signal\": \"a\", \"time_ns\": 5, \"value\": [1{}]}}\n", ",1".repeat(7 << 20));
    defused("list.jsonl", line.as_bytes(), "a list of more than 1048576 numbers");
    // What is not wanted takes nothing.
    let more = format!(
        "{{\"signal\": \"a\", \"time_ns\": 5, \"more\": [1{}], \"value\": 1}}\n",
        ",1".repeat(7 << 20)
    );
    defused("more.jsonl", more.as_bytes(), "");
}

#[test]
fn deep_nesting_is_bounded() {
    for opening in ["[", "{\"a\":"] {
        let deep = opening.repeat((15 << 20) / opening.len());
        let line = format!("{SOUND}{{\"signal\": \"a\", \"time_ns\": 5, \"value\": {deep}\n{SOUND}");
        defused("deep.jsonl", line.as_bytes(), "jsonl:2: ");
    }
}

#[test]
fn a_quote_that_is_never_closed_is_bounded() {
    // Sixteen lines that together are much.
    let line = format!("1,\"{}\n", "x".repeat(4 << 20));
    let text = format!("time_s,a\n{}2,3\n", line.repeat(12));
    defused("quote.csv", text.as_bytes(), "the row has not 2 cells as the header; row left out");
}

#[test]
fn a_row_of_millions_of_cells_is_bounded() {
    let text = format!("time_s,a\n1,2{}\n2,3\n", ",".repeat(12 << 20));
    // Cells beyond the header are of no column, and take nothing.
    defused("row.csv", text.as_bytes(), "");
    let header = format!("time_s,a{}\n1,2\n", ",c".repeat(6 << 20));
    defused("header.csv", header.as_bytes(), "a table of more than 16384 columns cannot be read");
}

/// A sound message of MCAP, and zeros in chunks that each state to unpack to so many bytes.
fn chunks(packed: &[u8], count: usize, stated: u64) -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let record = |kind: u8, content: &[u8]| {
        [&[kind], (content.len() as u64).to_le_bytes().as_slice(), content].concat()
    };
    let channel = [&[1, 0, 0, 0], text("t").as_slice(), &text("json"), &[0; 4]].concat();
    let message = [&[1, 0], [0; 20].as_slice(), br#"{"v": 1}"#].concat();
    let (stated, length) = (stated.to_le_bytes(), (packed.len() as u64).to_le_bytes());
    let chunk = [&[0; 16], stated.as_slice(), &[0; 4], &text("zstd"), &length, packed].concat();
    let sound = [b"\x89MCAP0\r\n".as_slice(), &record(4, &channel), &record(5, &message)].concat();
    [sound, record(6, &chunk).repeat(count)].concat()
}

#[test]
fn a_chunk_that_would_fill_the_memory_is_left_out() {
    let file = chunks(&[0; 1_000], 1, 200 << 20);
    defused("large.mcap", &file, "a chunk of 209715200 bytes is larger than 64 MiB, left out");
}

#[test]
#[cfg(feature = "zstd")]
fn what_many_small_pieces_unpack_to_is_bounded() {
    let packed = zstd::bulk::compress(&vec![0; 16 << 20], 1).unwrap();
    let file = chunks(&packed, 8, 16 << 20);
    defused("many.mcap", &file, "a chunk of 16777216 bytes is left out: the file unpacks to more than");
}

#[test]
#[cfg(feature = "zstd")]
fn a_file_that_would_fill_the_disk_is_refused() {
    let packed = zstd::bulk::compress(&vec![b' '; 100 << 20], 1).unwrap();
    defused("large.jsonl.zst", &packed, "unpack it first (zstd -d, gunzip)");
}

#[test]
#[cfg(feature = "zstd")]
fn the_values_of_a_small_file_are_bounded() {
    let line = "{\"signal\": \"a\", \"time_ns\": 5, \"value\": 1}\n";
    let packed = zstd::bulk::compress(line.repeat(1_400_000).as_bytes(), 1).unwrap();
    assert!(packed.len() < 10_000);
    defused("values.jsonl.zst", &packed, " values are left out: of a file of ");
}

/// Surveyed and streamed; what its threads take is bounded by the batches that wait.
#[test]
fn a_recording_whose_clock_was_set_takes_no_more_memory_the_longer_it_is() {
    let peak = |rows: usize| {
        let set = |row: usize| if 2 * row < rows { row } else { row + 5_000_000 };
        let text: String = (0..rows).map(|row| format!("{},{row}\n", set(row))).collect();
        let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"))
            .join(format!("set-{rows}-{}.csv", std::process::id()));
        std::fs::write(&file, format!("t [s],a\n{text}")).unwrap();
        let (paths, wanted, options) = ([file], [Wanted::new("a", "")], ReadOptions::default());
        let mut count = 0;
        let counted = allocation_counter::measure(|| {
            let survey = survey(&paths, &wanted, &options).unwrap();
            assert_eq!((survey.recording.sessions.len(), survey.can_stream), (2, true));
            for session in 0..2 {
                count += stream(&paths, &wanted, &options, &survey, session).unwrap().count();
            }
        });
        std::fs::remove_file(&paths[0]).unwrap();
        assert_eq!(count, rows);
        counted.bytes_max
    };
    let (short, long) = (peak(20_000), peak(200_000));
    assert!(long <= short + (1 << 20), "{short} bytes at the peak of a short file, {long} of a long one");
}

/// A battery at rest: rows that hardly differ are packed to few bytes, and are values all the same.
#[test]
#[cfg(feature = "zstd")]
fn a_packed_table_that_hardly_changes_is_taken_whole() {
    const ROWS: usize = 20_000;
    const CELLS: usize = 20;
    let head: String = (0..CELLS).map(|cell| format!(",cell_{cell}")).collect();
    let voltage = |row: usize, cell: usize| 330 + cell + usize::from(row / 400 % CELLS == cell);
    let row = |row: usize| {
        let cells: String = (0..CELLS).map(|cell| format!(",3.{}", voltage(row, cell) - 300)).collect();
        format!("{}.{}{cells}\n", row / 10, row % 10)
    };
    let text = format!("t [s]{head}\n{}", (0..ROWS).map(row).collect::<String>());
    let packed = zstd::bulk::compress(text.as_bytes(), 3).unwrap();
    assert!(packed.len() * 10 < ROWS * CELLS, "{} bytes", packed.len());
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join(format!("rest-{}.csv.zst", std::process::id()));
    std::fs::write(&file, packed).unwrap();
    let wanted: Vec<Wanted> =
        (0..CELLS).map(|cell| Wanted::new(format!("cell {cell}"), format!("rest#cell_{cell}"))).collect();
    let recording = read(std::slice::from_ref(&file), &wanted, &ReadOptions::default()).unwrap();
    std::fs::remove_file(&file).unwrap();
    assert_eq!(recording.samples.len(), ROWS * CELLS, "{:?}", recording.warnings);
}

/// An object of BLF: its kind and its content.
fn object(kind: u32, content: &[u8]) -> Vec<u8> {
    let length = u32::try_from(16 + content.len()).unwrap();
    let head = [b"LOBJ", &[16, 0, 1, 0][..], &length.to_le_bytes(), &kind.to_le_bytes(), content].concat();
    [head, vec![0; content.len().wrapping_neg() % 4]].concat()
}

/// A file of BLF with so many containers of these bytes.
fn containers(content: &[u8], count: usize) -> Vec<u8> {
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(content, 6);
    let container = object(10, &[&[2, 0, 0, 0, 0, 0, 0, 0][..], &[0; 8], &packed].concat());
    let header = [b"LOGG", &144_u32.to_le_bytes()[..], &[0; 136]].concat();
    [header, container.repeat(count)].concat()
}

#[test]
fn the_containers_of_a_file_are_bounded_together() {
    let zeros = vec![0; 12 << 20];
    defused("zeros.blf", &containers(&zeros, 12), "a container is left out: the file unpacks to more than");
    let large = vec![0; 20 << 20];
    defused("large.blf", &containers(&large, 1), "a container unpacks to 16777216 bytes and no further");
    // An object that is never whole.
    let endless = [b"LOBJ", &[16, 0, 1, 0][..], &(60_u32 << 20).to_le_bytes(), &[1, 0, 0, 0]].concat();
    let endless = [endless, vec![0; 12 << 20]].concat();
    defused("endless.blf", &containers(&endless, 8), "an object of more than 8 MiB in containers, left out");
}

/// A block of MDF, with a length that is a multiple of eight.
fn block(name: &[u8; 4], links: &[u64], content: &[u8]) -> Vec<u8> {
    let mut content = content.to_vec();
    content.resize(content.len().next_multiple_of(8), 0);
    let length = (24 + 8 * links.len() + content.len()) as u64;
    let links: Vec<u8> = links.iter().flat_map(|link| link.to_le_bytes()).collect();
    let count = links.len() as u64 / 8;
    [name, &[0; 4][..], &length.to_le_bytes(), &count.to_le_bytes(), &links, &content].concat()
}

/// A file of MDF: data groups that share one channel group and one packed block of data, whose records have `record` bytes. With
/// `is_endless` the channel after `v` is followed by itself.
fn groups(count: usize, record: u32, unpacked: &[u8], is_endless: bool) -> Vec<u8> {
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(unpacked, 6);
    let (length, packed_length) =
        ((unpacked.len() as u64).to_le_bytes(), (packed.len() as u64).to_le_bytes());
    let data = [b"DT", &[0, 0, 0, 0, 0, 0][..], &length, &packed_length, &packed].concat();
    let mut file = b"MDF     4.11    ".to_vec();
    file.resize(64, 0);
    // Several groups of the wanted name would be an error.
    let topic = if count == 1 { b"t" } else { b"s" };
    let texts = [topic, b"v", b"w"].map(|text| block(b"##TX", &[], text)).concat();
    let head = 24 + 6 * 8 + 32;
    let name = 64 + head;
    let channel = name + texts.len() as u64;
    let content = [&[0, 0, 0, 0, 0, 0, 0, 0, 8, 0, 0, 0][..], &[0; 60]].concat();
    let one = |next, name| block(b"##CN", &[next, 0, name, 0, 0, 0, 0, 0], &content);
    let next = channel + one(0, 0).len() as u64;
    let after = if is_endless { next } else { 0 };
    let channels = [one(next, name + 32), one(after, name + 64)].concat();
    let group = channel + channels.len() as u64;
    let content = [&[0; 24][..], &record.to_le_bytes(), &[0; 4]].concat();
    let group_block = block(b"##CG", &[0, channel, name, 0, 0, 0], &content);
    let data_at = group + group_block.len() as u64;
    let data_block = block(b"##DZ", &[], &data);
    let first = data_at + data_block.len() as u64;
    file.extend(block(b"##HD", &[first, 0, 0, 0, 0, 0], &[0; 32]));
    file.extend([texts, channels, group_block, data_block].concat());
    for number in 1..=count as u64 {
        let next = if number == count as u64 { 0 } else { first + number * 64 };
        file.extend(block(b"##DG", &[next, group, data_at, 0], &[0; 8]));
    }
    file
}

#[test]
fn the_links_of_a_file_are_bounded_together() {
    let zeros = vec![0; 12 << 20];
    defused("shared.mf4", &groups(12, 1 << 20, &zeros, false), "is left out: the file unpacks to more than");
    // 16384 channels that share one byte.
    defused(
        "channels.mf4",
        &groups(1, 1, &zeros, true),
        "the other records are left out: the file unpacks to more",
    );
    defused("record.mf4", &groups(1, 1 << 25, &zeros, false), "a record of more than 8 MiB, left out");
    defused("block.mf4", &groups(1, 8, &vec![0; 20 << 20], false), "of which 16777216 are allowed");
}

/// A structure of Thrift from its fields: number, kind, bytes.
fn structure(fields: &[(u8, u8, Vec<u8>)]) -> Vec<u8> {
    let each = fields.iter().flat_map(|(number, kind, bytes)| [&[*kind, 2 * number][..], bytes].concat());
    each.chain([0]).collect()
}

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    [bytes, vec![number as u8]].concat()
}

fn whole(number: u8, value: usize) -> (u8, u8, Vec<u8>) {
    (number, 6, varint(2 * value as u64))
}

fn list(number: u8, items: &[Vec<u8>]) -> (u8, u8, Vec<u8>) {
    (number, 9, [vec![0xfc], varint(items.len() as u64), items.concat()].concat())
}

/// A file of Parquet: columns and row groups that all share one page, of 2^20 whole numbers in this encoding, packed by gzip.
fn pages(columns: usize, groups: usize, encoding: usize, unpacked: &[u8]) -> Vec<u8> {
    const ROWS: usize = 1 << 20;
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packed, unpacked).unwrap();
    let packed = packed.finish().unwrap();
    let about = structure(&[whole(1, ROWS), whole(2, encoding), whole(3, 3), whole(4, 3)]);
    let head = structure(&[whole(1, 0), whole(2, unpacked.len()), whole(3, packed.len()), (5, 12, about)]);
    let page = [head, packed].concat();
    let element = |at: usize| {
        let name = ["time".to_owned(), "a".to_owned()].into_iter().nth(at).unwrap_or(format!("c{at}"));
        let name = [varint(name.len() as u64), name.into_bytes()].concat();
        structure(&[whole(1, 2), whole(3, 0), (4, 8, name), whole(6, 10)])
    };
    let root = structure(&[(4, 8, vec![1, b's']), whole(5, columns)]);
    let schema: Vec<Vec<u8>> = [root].into_iter().chain((0..columns).map(element)).collect();
    let about = structure(&[whole(1, 2), whole(4, 2), whole(7, page.len()), whole(9, 4)]);
    let group = structure(&[list(1, &vec![structure(&[(3, 12, about)]); columns]), whole(3, ROWS)]);
    let description =
        structure(&[whole(1, 1), list(2, &schema), whole(3, ROWS), list(4, &vec![group; groups])]);
    let length = u32::try_from(description.len()).unwrap().to_le_bytes();
    [b"PAR1", &page[..], &description, &length, b"PAR1"].concat()
}

/// 2^20 whole numbers as differences of 0 and 1, in blocks of 128.
fn differences() -> Vec<u8> {
    let block = [vec![0], vec![1; 4], vec![0b1010_1010; 16]].concat();
    [varint(128), varint(4), varint(1 << 20), vec![0], block.repeat(1 << 13)].concat()
}

#[test]
fn the_pages_of_a_file_are_bounded_together() {
    // Columns of half a million runs each, which stand side by side.
    defused(
        "wide.parquet",
        &pages(100, 1, 5, &differences()),
        "cannot be read: the file unpacks to more than ",
    );
    // One value, again and again, in row groups that share their pages.
    let groups = pages(2, 40, 0, &vec![0; 8 << 20]);
    defused("groups.parquet", &groups, "cannot be read on: the file unpacks to more than ");
    defused("groups.parquet", &groups, " values are left out: of a file of ");
}
