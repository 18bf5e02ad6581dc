//! The memory for loading a large model, a ratchet that may only go down, and for files that are made to take much memory.

use shsa_format::model::load;
use shsa_format::recording::{ReadOptions, Wanted, read};
use std::fmt::Write;

/// Relations that are structure only, half as many variables, a sixth as many signals: what large models are made of.
fn model(relations: usize) -> String {
    let variables = relations / 2 + 40;
    let mut text = String::from("{\"shsa\": 1, \"variables\": {\"v0\": {}");
    for at in 1..variables {
        write!(text, ", \"v{at}\": {{}}").unwrap();
    }
    text += "}, \"relations\": {";
    for at in 0..relations {
        let (comma, output) = (if at == 0 { "" } else { ", " }, at / 2);
        let (first, second) = (output + 1 + at % 7, output + 9 + at % 29);
        write!(text, "{comma}\"r{at}\": {{\"output\": \"v{output}\", \"inputs\": [\"v{first}\", \"v{second}\"], \"properties\": {{\"cost\": 2}}}}").unwrap();
    }
    text += "}, \"signals\": {";
    for at in 0..relations / 6 {
        let (comma, variable) = (if at == 0 { "" } else { ", " }, variables - 1 - 3 * at);
        write!(
            text,
            "{comma}\"/s/{at}\": {{\"variable\": \"v{variable}\", \"properties\": {{\"accuracy\": 0.9}}}}"
        )
        .unwrap();
    }
    text + "}}"
}

#[test]
fn a_relation_takes_little_memory() {
    const RELATIONS: usize = 8_192;
    let text = model(RELATIONS);
    let mut loaded = None;
    let counted = allocation_counter::measure(|| loaded = Some(load(&text, "m.json")));
    let loaded = loaded.unwrap();
    assert!(loaded.report.ok(), "{}", loaded.report.render(false));
    assert_eq!(loaded.knowledge.relations().len(), RELATIONS);
    let a_relation = |bytes: u64| bytes / RELATIONS as u64;
    let (kept, peak) = (a_relation(counted.bytes_current.unsigned_abs()), a_relation(counted.bytes_max));
    let allocations = a_relation(counted.count_total);
    assert!(kept <= 620, "{kept} bytes a relation are kept");
    assert!(peak <= 680, "{peak} bytes a relation are taken at the peak");
    assert!(allocations <= 18, "{allocations} allocations a relation");
}

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
    defused("large.jsonl.zst", &packed, "unpack it first (zstd -d)");
}
