//! `docs/recordings.md` against the tables of formats, times and faults; what its examples find is read from the page itself.

use super::document::{Document, code};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_format::fault::{Fault, KINDS, Made};
use shsa_message::source::Source;
use shsa_message::span::TIME_UNITS;
use shsa_recording::{FORMATS, ReadOptions, Recording, Sample, TIME_NAMES, Wanted, read_bytes};
use std::path::Path;

fn page() -> Document {
    Document::read("recordings.md")
}

/// The first of the blocks of a language.
fn block(language: &str) -> String {
    page().blocks(language).remove(0)
}

fn recorded(file: &str, text: &str, signal: &str, source: &str) -> Recording {
    let wanted = [Wanted::new(signal, source)];
    let read = read_bytes(Path::new(file), text.as_bytes(), &wanted, &ReadOptions::default());
    let recording = read.unwrap_or_else(|error| panic!("{source}: {error}"));
    assert!(recording.warnings.is_empty(), "{source}: {:?}", recording.warnings);
    recording
}

/// `1.5@0 1.75@0.1`: values with the times of their reception in seconds.
fn shown(samples: &[Sample]) -> String {
    let one = |sample: &Sample| match &sample.value {
        RawValue::Number(value) => format!("{value}@{}", sample.received.seconds()),
        other => panic!("{other:?} is no number"),
    };
    samples.iter().map(one).collect::<Vec<_>>().join(" ")
}

#[test]
fn every_format_and_ending_is_described() {
    let rows = page().section("Formats").rows("format");
    let mut documented: Vec<Vec<String>> = rows.iter().map(|row| code(&row[1])).collect();
    let mut known: Vec<Vec<&str>> = FORMATS.iter().map(|row| row.endings.to_vec()).collect();
    documented.sort();
    known.sort();
    assert_eq!(documented, known);
}

#[test]
fn every_source_of_a_table_finds_its_values() {
    let table = block("csv");
    let rows = page().section("Source").rows("source");
    let (of_table, of_messages): (Vec<_>, Vec<_>) = rows.into_iter().partition(|row| row.len() == 3);
    for row in &of_table {
        let source = code(&row[0]).remove(0);
        let found = recorded("log.csv", &table, "/a", &source);
        assert_eq!(shown(&found.samples), code(&row[2]).remove(0), "{source}");
    }
    assert!(of_table.len() > 5 && of_messages.len() > 5);
    for row in &of_messages {
        let source = code(&row[0]).remove(0);
        assert!(source.parse::<Source>().is_ok(), "{source}");
    }
}

#[test]
fn lines_of_json_are_read_as_described() {
    let text = block("jsonl");
    let value = |signal: &str| recorded("a.jsonl", &text, signal, "").samples.remove(0);
    assert_eq!(value("/speed").value, RawValue::Number(1.5));
    assert_eq!(value("/speed").received, Time(20_000_000));
    assert_eq!(value("/fused").value, RawValue::Interval { lo: 1.4, hi: 1.6 });
    assert_eq!(value("/fused").received, Time(200_000_000));
    let RawValue::Vector(scan) = value("/scan").value else { panic!("a list is a vector") };
    assert!(scan[0] == 1.0 && scan[1].is_nan() && scan[2] == f64::INFINITY, "{scan:?}");
}

/// Written lines have the keys that are reported, and no other.
#[test]
fn every_key_of_a_line_is_described() {
    let sample = Sample { wanted: 0, time: Time(5), received: Time(7), value: RawValue::Number(1.0) };
    let mut line = Vec::new();
    shsa_recording::write_jsonl(&mut line, [&sample], |_| "/a").unwrap();
    let line: serde_json::Value = serde_json::from_slice(&line).unwrap();
    let keys = line.as_object().unwrap().keys().map(String::as_str).collect::<Vec<_>>();
    page().section("JSON lines").names_exactly("key", keys);
}

#[test]
fn every_name_and_unit_of_time_is_described() {
    let section = page().section("Time");
    assert_eq!(section.named("column"), TIME_NAMES);
    section.names_exactly("unit", TIME_UNITS.iter().flat_map(|(names, _)| names.iter().copied()));
    for (row, (names, span)) in section.rows("unit").iter().zip(TIME_UNITS) {
        let seconds: f64 = row[1].strip_suffix(" s").unwrap().parse().unwrap();
        assert!((seconds - span.seconds()).abs() < 1e-15, "{names:?}");
    }
}

#[test]
fn every_fault_is_described() {
    page().section("Faults").names_exactly("kind", KINDS.map(|(kind, _)| kind));
    for row in page().section("Faults").rows("kind") {
        let (_, made) = KINDS.into_iter().find(|(kind, _)| code(&row[0]) == [*kind]).unwrap();
        let words: &[&str] = match made {
            Made::Alone(_) => &["none"],
            Made::Perhaps(_) => &["none, or a value"],
            Made::Of(_) => &["a number", "a value"],
            Made::OfSpan(_) => &["a time"],
        };
        assert!(words.contains(&row[1].as_str()), "{row:?}");
    }
}

#[test]
fn every_fault_does_what_the_table_says() {
    for row in page().section("Faults").rows("kind") {
        let [kind, example, values] = [&row[0], &row[3], &row[4]].map(|cell| code(cell).remove(0));
        assert!(example.starts_with(&kind), "{example}");
        let fault: Fault = example.parse().unwrap();
        let at = |second: i64| Time(second * 1_000_000_000);
        let sample = |second: i64| Sample {
            wanted: 0,
            time: at(second),
            received: at(second),
            value: RawValue::Number(10.0 * (second + 1) as f64),
        };
        let mut samples: Vec<Sample> = (0..4).map(sample).collect();
        fault.inject(&mut samples, 0, None, at(0), 1);
        assert_eq!(shown(&samples), values, "{example}");
    }
}
