//! Recordings as texts and bytes in, samples and warnings as text out.

mod bag_writer;
mod bags;
mod fits;
pub(super) mod independent;
mod lines;
mod mcap_writer;
pub(super) mod parquet_writer;
mod mutated;
mod real;
mod ros2;
mod samples;
mod sessions;
mod sqlite_writer;
mod tables;
mod zones;
pub(super) mod collector;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use super::*;

/// A folder for one test, removed at its end.
pub(super) struct Folder(pub(super) PathBuf);

impl Folder {
    fn new() -> Folder {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("shsa-recording-{}-{}", process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).unwrap();
        Folder(folder)
    }

    pub(super) fn with(files: &[(&str, &[u8])]) -> Folder {
        let folder = Folder::new();
        for (name, bytes) in files {
            fs::write(folder.0.join(name), bytes).unwrap();
        }
        folder
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.0).ok();
    }
}

/// Bytes as gzip packs them.
fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// The topics of a file.
fn topics(file: &Path) -> Vec<TopicInfo> {
    inventory(&[file.into()], &ReadOptions::default()).unwrap().remove(0).topics
}

/// Sources as wanted signals of the same names.
fn wanted(sources: &[&str]) -> Vec<Wanted> {
    sources.iter().map(|source| Wanted::new(*source, *source)).collect()
}

/// Checks that the files of a folder are read as bytes that the caller gives as they are on the disk.
#[track_caller]
fn compare_with_given(
    result: &Result<Recording, RecordingError>,
    folder: &Path,
    wanted: &[Wanted],
    options: &ReadOptions,
) {
    let own = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let bytes = |path: PathBuf| (path.clone(), Arc::new(fs::read(path).unwrap()) as Arc<dyn Bytes>);
    let files = Files::given(own.chain(options.dbc.iter().cloned()).map(bytes));
    let given = read(&[folder.into()], wanted, &ReadOptions { files, ..options.clone() });
    assert_eq!(format!("{given:?}"), format!("{result:?}"));
}

/// Reads these files as one folder, and shows samples, warnings, and whether a part is lost.
fn shown(files: &[(&str, &[u8])], sources: &[&str], options: &ReadOptions) -> String {
    let folder = Folder::with(files);
    let paths = std::slice::from_ref(&folder.0);
    let result = read(paths, &wanted(sources), options);
    compare_with_stream(&result, paths, &wanted(sources), options);
    compare_with_given(&result, &folder.0, &wanted(sources), options);
    let text = match result {
        Ok(recording) => show(&recording),
        Err(error) => format!("error: {error}"),
    };
    text.replace(&format!("{}/", folder.0.display()), "")
}

/// Checks that a survey gives the same without samples, and that a stream gives the same samples where the survey allows it.
#[track_caller]
fn compare_with_stream(
    read: &Result<Recording, RecordingError>,
    paths: &[PathBuf],
    wanted: &[Wanted],
    options: &ReadOptions,
) {
    let survey = survey(paths, wanted, options);
    let read = match (read, &survey) {
        (Ok(read), Ok(_)) => read,
        (Err(read), Err(surveyed)) => return assert_eq!(read.to_string(), surveyed.to_string()),
        (read, survey) => panic!("{read:?} and {survey:?}"),
    };
    let survey = survey.unwrap();
    if survey.can_stream {
        assert_eq!(survey.recording, Recording { samples: Vec::new(), ..read.clone() });
    }
    assert_eq!(survey.count, read.samples.len());
    // Samples are in the order of their sessions.
    let times = || read.samples.iter().map(|sample| sample.received);
    assert_eq!(survey.span, times().min().zip(times().max()));
    if survey.can_stream {
        let sessions = 0..survey.recording.sessions.len();
        let streamed: Vec<String> = sessions
            .flat_map(|session| stream(paths, wanted, options, &survey, session).unwrap())
            .map(|sample| show_sample(&sample.unwrap()))
            .collect();
        assert_eq!(streamed, read.samples.iter().map(show_sample).collect::<Vec<_>>());
    }
}

fn show(recording: &Recording) -> String {
    let mut lines: Vec<String> = recording.samples.iter().map(show_sample).collect();
    lines.extend(recording.warnings.iter().map(|warning| format!("! {warning}")));
    if recording.degraded {
        lines.push("degraded".into());
    }
    lines.join("\n")
}

/// `index@stamp=value`, with `<reception` where that differs, times in milliseconds.
fn show_sample(Sample { wanted, time, received, value }: &Sample) -> String {
    let ms = |time: &Time| time.0 as f64 / 1e6;
    let late = if time == received { String::new() } else { format!("<{}", ms(received)) };
    let value = match value {
        RawValue::Number(value) => value.to_string(),
        RawValue::Interval { lo, hi } => format!("{lo}..{hi}"),
        RawValue::Vector(values) => format!("{values:?}"),
    };
    format!("{wanted}@{}{late}={value}", ms(time))
}

#[test]
fn folders_give_their_recordings_in_the_order_of_names() {
    let files: [(&str, &[u8]); 4] = [
        ("b.csv", b"t [s],x\n1,10\n2,20\n"),
        ("a.jsonl", b"{\"signal\": \"a#x\", \"time_ns\": 1000000000, \"value\": 1}\n"),
        ("README.md", b"no recording"),
        ("unasked.csv", b"no,time\n1,2\n"),
    ];
    let all = shown(&files, &["b#x", "a#x"], &ReadOptions::default());
    assert_eq!(all, "1@1000=1\n0@1000=10\n0@2000=20");
}

#[test]
fn long_files_are_streamed_side_by_side_in_the_order_of_reception() {
    let rows = |from: usize, step: usize| -> String {
        (0..9_000).map(|row| format!("{},{row}\n", from + step * row)).collect()
    };
    let (one, two) = (format!("t [ms],a\n{}", rows(0, 2)), format!("t [ms],b\n{}", rows(4, 3)));
    let folder = Folder::with(&[("one.csv", one.as_bytes()), ("two.csv", two.as_bytes())]);
    let paths = std::slice::from_ref(&folder.0);
    let survey = survey(paths, &wanted(&["a", "b"]), &ReadOptions::default()).unwrap();
    assert_eq!((survey.count, survey.can_stream), (18_000, true));
    shown(&[("one.csv", one.as_bytes()), ("two.csv", two.as_bytes())], &["a", "b"], &ReadOptions::default());
}

#[test]
fn what_is_out_of_order_in_its_file_is_sorted_while_it_is_streamed() {
    // More samples than a sorted run has, of two signals that follow each other, as in groups of channels; in the other file lists.
    let line = |signal: &str, time: usize, value: &str| {
        format!("{{\"signal\": \"{signal}\", \"time_ns\": {time}, \"value\": {value}}}\n")
    };
    let values = ["1", "null", "{\"lo\": 1, \"hi\": 2}", "[1, null, 3]", "[]"];
    let one: String = ["a", "b"]
        .iter()
        .flat_map(|name| (0..80_000).map(move |at| line(name, at / 2, values[at % 5])))
        .collect();
    let two: String = (0..300).rev().map(|at| line("c", 90 * at, "[1, 2, 3]")).collect();
    let files = [("one.jsonl", one.as_bytes()), ("two.jsonl", two.as_bytes())];
    let folder = Folder::with(&files);
    let paths = std::slice::from_ref(&folder.0);
    let survey = survey(paths, &wanted(&["a", "b", "c"]), &ReadOptions::default()).unwrap();
    assert_eq!((survey.count, survey.can_stream), (160_300, true));
    shown(&files, &["a", "b", "c"], &ReadOptions::default());
}

#[test]
fn a_file_whose_clock_was_set_is_streamed_too() {
    // Forwards by a day, back over an hour, and two wrong times, each with a slower signal that follows.
    let day = 86_400;
    let times = (0..9_000).chain(day..day + 9_000).chain(day + 5_400..day + 12_000);
    let wrong = |at: usize| if at == 700 || at == 20_000 { 900_000_000 } else { 0 };
    let row = |(at, time): (usize, usize)| {
        format!("{},{at},{}\n", time + wrong(at), if at % 60 == 0 { "1" } else { "" })
    };
    let text: String = ["t [s],a,b\n".to_owned()].into_iter().chain(times.enumerate().map(row)).collect();
    let folder = Folder::with(&[("one.csv", text.as_bytes())]);
    let survey =
        survey(std::slice::from_ref(&folder.0), &wanted(&["a", "b"]), &ReadOptions::default()).unwrap();
    assert_eq!((survey.recording.sessions.len(), survey.can_stream), (3, true));
    shown(&[("one.csv", text.as_bytes())], &["a", "b"], &ReadOptions::default());
}

#[test]
fn what_gzip_has_packed_is_read() {
    let table = b"t [s],a\n1,5\n2,6\n";
    let packed = gzipped(table);
    let expected = "0@1000=5\n0@2000=6";
    for name in ["one.csv.gz", "one.csv"] {
        assert_eq!(shown(&[(name, &packed)], &["a"], &ReadOptions::default()), expected);
    }
    // Tools join packed files.
    let twice = [gzipped(&table[..11]), gzipped(&table[11..])].concat();
    assert_eq!(shown(&[("one.csv.gz", &twice)], &["one#a"], &ReadOptions::default()), expected);
}

#[test]
fn formats_are_known_by_content_then_by_extension() {
    #[track_caller]
    fn check(name: &str, bytes: &[u8], expected: &str) {
        let folder = Folder::with(&[(name, bytes)]);
        let said = match files::format_of_file(&folder.0.join(name), &Files::Disk) {
            Ok(row) => format!("{:?}", row.format),
            Err(RecordingError::UnknownFormat { .. }) => "unknown".into(),
            Err(RecordingError::Convert { what, .. }) => what.into(),
            Err(RecordingError::NoLine { tried, .. }) => tried.join(", "),
            Err(error) => error.to_string(),
        };
        assert_eq!(said, expected);
    }
    check("a.csv", b"t,x\n", "Csv");
    check("a.CSV", b"", "Csv");
    check("a.csv", b"#ROSBAG V2.0\n", "Bag");
    check("a", b" {\"signal\"", "JsonLines");
    check("a.ndjson", b"", "JsonLines");
    check("a.bag", b"#ROS", "Bag");
    check("a.bag", b"PK\x03\x04", "a ZIP archive");
    check("a.csv.xz", b"\xfd7zXZ\0", "a file packed by xz");
    check("a.csv.bz2", b"BZh91AY&SY", "a file packed by bzip2");
    check("a.csv", b"BZh9,x\n", "Csv");
    check(
        "a.log",
        b"nothing\n",
        "NMEA 0183, DataFlash log as text, mavlogdump, CAN frames, candump, Signal K deltas",
    );
    check("a.lp", b"nothing\n", "InfluxDB line protocol");
    check("a.log", b"", "Nmea");
    let late = "nothing of note\n".repeat(300) + "(1.0) can0 123#01\n";
    check("a.log", late.as_bytes(), "Candump");
    check("a", b"\x89MCAP0\r\n", "Mcap");
    check("a.png", b"\x89PNG\r\n", "unknown");
}

#[test]
fn what_cannot_be_read_is_said() {
    let folder = Folder::with(&[("a.png", b"\x89PNG")]);
    let read_one = |path: &Path| read(&[path.into()], &[], &ReadOptions::default()).unwrap_err().to_string();
    let said = read_one(&folder.0.join("a.png"));
    assert!(said.contains("a.png: not a recording that is known here; known are: MCAP (.mcap); "), "{said}");
    let said = read_one(&folder.0);
    assert!(said.contains("no recording in this folder"), "{said}");
    let said = read_one(&folder.0.join("gone.csv"));
    assert!(said.contains("gone.csv: cannot be read: "), "{said}");
    let wanted = [Wanted::new("/a", "a#")];
    let said = read(&[], &wanted, &ReadOptions::default()).unwrap_err().to_string();
    assert_eq!(said, "signal /a: source 'a#': names no column or field; write FILE_OR_TOPIC#FIELD");
}
