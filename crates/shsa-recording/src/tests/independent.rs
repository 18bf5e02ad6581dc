//! Third-party recordings, where they are available: the readers report the same as independent readers, and report the rest of
//! truncated or changed files.

use super::super::topic::{Body, Input, Listener, Times, Topic, TopicId};
use super::collector::Collector;
use super::*;
use serde_json::Value;
use std::io::Cursor;

/// A reader of a format.
pub(in super::super) type Reader =
    fn(&mut dyn Input, &ReadOptions, &mut dyn Listener) -> Result<(), RecordingError>;

/// The path of a sample; `None`, with a loud message, where it is missing.
pub(in super::super) fn sample_path(path: &str) -> Option<PathBuf> {
    let full = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/formats")).join(path);
    if !full.exists() {
        eprintln!("SKIPPED: no recording at {}", full.display());
        return None;
    }
    Some(full)
}

/// The bytes of a sample.
pub(in super::super) fn sample(path: &str) -> Option<Vec<u8>> {
    sample_path(path).map(|path| fs::read(path).unwrap())
}

/// The content that a reader reports.
pub(in super::super) fn collected(reader: Reader, bytes: &[u8]) -> Collector {
    collected_with(reader, bytes, &ReadOptions::default())
}

/// The content that a reader reports with these options.
pub(in super::super) fn collected_with(reader: Reader, bytes: &[u8], options: &ReadOptions) -> Collector {
    let mut collector = Collector::default();
    reader(&mut Cursor::new(bytes), options, &mut collector).unwrap();
    collector
}

/// Counts messages and damages, and ignores values.
#[derive(Default)]
pub(in super::super) struct Counter {
    topics: usize,
    pub(in super::super) messages: usize,
    pub(in super::super) damages: Vec<String>,
}

impl Listener for Counter {
    fn file(&self) -> &Path {
        Path::new("log")
    }
    fn topic(&mut self, _topic: Topic<'_>) -> TopicId {
        self.topics += 1;
        TopicId(self.topics)
    }
    fn is_wanted(&self, _topic: TopicId) -> bool {
        true
    }
    fn message(&mut self, topic: TopicId, _times: Times, _body: Body<'_>) {
        assert!(topic.0 <= self.topics, "a topic that was not reported");
        self.messages += 1;
    }
    fn damaged(&mut self, place: Place, problem: String) {
        self.damages.push(format!("{place:?} {problem}"));
    }
    fn note(&mut self, _place: Place, _what: String) {}
}

/// The counts of a reader's reports.
pub(in super::super) fn counted(reader: Reader, bytes: &[u8]) -> Counter {
    let mut counter = Counter::default();
    // An unreadable file is an error, and no panic.
    let _outcome = reader(&mut Cursor::new(bytes), &ReadOptions::default(), &mut counter);
    counter
}

/// The entry of `expected.json` about a sample.
pub(in super::super) fn expected(folder: &str, file: &str) -> Option<Value> {
    let all: Value = serde_json::from_slice(&sample(&format!("{folder}/expected.json"))?).unwrap();
    Some(all[file].clone())
}

/// Checks the counts of topics by their full names.
#[track_caller]
pub(in super::super) fn check_counts(collector: &Collector, expected: &Value) {
    for (name, count) in expected.as_object().unwrap() {
        let found: usize =
            collector.topics.iter().filter(|it| it.full == *name).map(|it| it.messages.len()).sum();
        assert_eq!(found as u64, count.as_u64().unwrap(), "{name}");
    }
}

/// Checks a number against that of an independent reader.
#[track_caller]
fn check_number(found: f64, expected: &Value, what: &str) {
    let expected = expected.as_f64().unwrap();
    assert!((found - expected).abs() <= 1e-6 * expected.abs().max(1.0), "{what}: {found} and {expected}");
}

/// Checks the count, the first, the last and the mean of a field's values; returns the times of the first and the last.
#[track_caller]
pub(in super::super) fn check_values(values: &[(i64, String)], expected: &Value, what: &str) -> (i64, i64) {
    let numbers: Vec<f64> = values.iter().filter_map(|(_, value)| value.parse().ok()).collect();
    assert_eq!(numbers.len() as u64, expected["count"].as_u64().unwrap(), "{what}");
    check_number(numbers[0], &expected["first"]["value"], what);
    check_number(numbers[numbers.len() - 1], &expected["last"]["value"], what);
    check_number(numbers.iter().sum::<f64>() / numbers.len() as f64, &expected["mean"], what);
    (values[0].0, values[values.len() - 1].0)
}

/// Cuts the file at 20 places: the complete messages are reported, and so is the loss.
#[track_caller]
pub(in super::super) fn check_cut(reader: Reader, bytes: &[u8]) {
    let whole = counted(reader, bytes).messages;
    let mut last = 0;
    for step in 1..=20 {
        // Odd places, which are hardly ever the end of a message.
        let cut = bytes.len() * step / 21 + step % 3;
        let part = counted(reader, &bytes[..cut]);
        assert!(part.messages >= last && part.messages <= whole, "at {cut}: {} of {whole}", part.messages);
        last = part.messages;
    }
    assert!(last > whole * 17 / 20, "{last} of {whole}");
}

/// The places of 200 bytes, with the bit to change in each.
fn flips(length: usize) -> impl Iterator<Item = (usize, u8)> {
    (0..200_usize).map(move |step| ((step * 7_919 + 13).wrapping_mul(104_729) % length, 1 << (step % 8)))
}

/// Changes 200 bytes, each fourth of them alone and then all at once: at least this share of the content is reported.
#[track_caller]
pub(in super::super) fn check_flipped(reader: Reader, bytes: &[u8], least: f64) {
    let sound = counted(reader, bytes);
    let least = sound.messages as f64 * least;
    let mut bytes = bytes.to_vec();
    for (at, bit) in flips(bytes.len()).step_by(4) {
        bytes[at] ^= bit;
        let part = counted(reader, &bytes);
        assert!(
            part.messages as f64 >= least,
            "{at}: {} of {}: {:?}",
            part.messages,
            sound.messages,
            part.damages
        );
        bytes[at] ^= bit;
    }
    for (at, bit) in flips(bytes.len()) {
        bytes[at] ^= bit;
    }
    let part = counted(reader, &bytes);
    assert!(part.messages as f64 >= least, "{} of {}: {:?}", part.messages, sound.messages, part.damages);
    assert!(part.damages.len() > sound.damages.len(), "nothing is reported");
}
