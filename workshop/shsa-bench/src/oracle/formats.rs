//! Recordings compared with the results of independent readers. Every `expected.json` below a folder names files beside it. Of
//! each file it gives the message counts of the topics, and of some fields the number of values, the first, the last and the
//! mean.
//!
//! Files are read through the readers of the product. A field of several topics (from several sources, say) is read from each,
//! and the values are joined, as the other reader did.

use super::Compared;
use anyhow::Context;
use serde_json::{Map, Value};
use shsa_core::observation::RawValue;
use shsa_recording::{ReadOptions, Recording, Sample, TopicInfo, Wanted, inventory, read};
use std::path::{Path, PathBuf};
use std::{fs, slice};

/// Counts the rows in the place of times.
const ROWS: &str = "@row*1s";

/// How far numbers may be apart, beside their size.
const TOLERANCE: f64 = 1e-6;

/// Keys that hold counts by topic.
const COUNTS: [&str; 7] = ["topics", "datasets", "messages", "sentences", "paths", "by_source", "pgns"];

/// Keys that hold the count of all messages.
const TOTALS: [&str; 4] = ["messages", "points", "rows", "frames"];

/// Keys of the time in nanoseconds, and of the time in seconds; both are the reception here.
const NANOSECONDS: [&str; 2] = ["received_ns", "time_ns"];
const SECONDS: [&str; 2] = ["unix_s", "time_s"];

/// Smaller seconds count from another moment than the epoch.
const EPOCH_MIN_S: f64 = 1e9;

/// Compares all files named by `expected.json` in the folder and in the folders below it.
pub(super) fn compare(folder: &Path, compared: &mut Compared) -> anyhow::Result<()> {
    let mut found = Vec::new();
    find(folder, 0, &mut found)?;
    anyhow::ensure!(!found.is_empty(), "{}: no expected.json in it or below", folder.display());
    for path in found {
        let text = fs::read_to_string(&path).with_context(|| format!("{} cannot be read", path.display()))?;
        let files: Map<String, Value> = super::read(&path, &text)?;
        let folder = path.parent().unwrap_or(folder);
        for (name, expected) in &files {
            File::new(folder, name, expected).compare(compared);
        }
    }
    Ok(())
}

fn find(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let entries = fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()?;
    paths.sort();
    found.extend(paths.iter().filter(|path| path.ends_with("expected.json")).cloned());
    for below in paths.iter().filter(|path| path.is_dir() && depth < 3) {
        find(below, depth + 1, found)?;
    }
    Ok(())
}

/// A recording and its expected contents.
struct File<'a> {
    path: PathBuf,
    expected: &'a Value,
    options: ReadOptions,
}

/// A recording, and where the fields are found in it of which something is expected.
pub(crate) struct Recorded {
    pub(crate) path: PathBuf,
    pub(crate) options: ReadOptions,
    pub(crate) wanted: Vec<Wanted>,
}

/// All recordings that a folder's `expected.json` names, and those below it.
pub(crate) fn recorded(folder: &Path) -> anyhow::Result<Vec<Recorded>> {
    let mut found = Vec::new();
    find(folder, 0, &mut found)?;
    let mut recordings = Vec::new();
    for path in found {
        let text = fs::read_to_string(&path).with_context(|| format!("{} cannot be read", path.display()))?;
        let files: Map<String, Value> = super::read(&path, &text)?;
        for (name, expected) in &files {
            let file = File::new(path.parent().unwrap_or(folder), name, expected);
            let topics = file.topics()?;
            let fields = expected["fields"].as_object().into_iter().flatten();
            // Several topics that have a field are read by the first.
            let places = fields.filter_map(|(name, of_field)| {
                let place = places(&topics, name).into_iter().next()?;
                let at = if has_row_times(of_field) { ROWS } else { "" };
                let source = format!("{}{}{}{at}", place.before, place.field, place.behind);
                value_of(&of_field["first"]).map(|_| Wanted::new(source.clone(), source))
            });
            let wanted: Vec<Wanted> = places.collect();
            if !wanted.is_empty() {
                recordings.push(Recorded { path: file.path, options: file.options, wanted });
            }
        }
    }
    Ok(recordings)
}

/// A topic that has a field, as its source text begins and goes on behind the field.
struct Place {
    before: String,
    field: String,
    behind: String,
}

impl<'a> File<'a> {
    fn new(folder: &Path, name: &str, expected: &'a Value) -> File<'a> {
        let dbc = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "dbc");
        let entries = fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
        let options = ReadOptions { dbc: entries.filter(dbc).collect(), ..ReadOptions::default() };
        File { path: folder.join(name), expected, options }
    }

    fn compare(&self, compared: &mut Compared) {
        let topics = match self.topics() {
            Ok(topics) => topics,
            Err(problem) => return compared.answer(vec![self.located(&format!("{problem:#}"))]),
        };
        for key in COUNTS {
            for (name, count) in self.expected[key].as_object().into_iter().flatten() {
                let found = count_of(&topics, name);
                // Messages without a name here (groups of NMEA 2000, say) are in the total count.
                if found > 0 || key != "pgns" {
                    self.number(compared, &format!("{key} {name}"), found as f64, count);
                }
            }
        }
        for key in TOTALS {
            if self.expected[key].is_u64() {
                let all: usize = topics.iter().map(|topic| topic.count).sum();
                self.number(compared, key, all as f64, &self.expected[key]);
            }
        }
        for (name, expected) in self.expected["fields"].as_object().into_iter().flatten() {
            let differences = self.field(&topics, name, expected);
            let differences = differences.unwrap_or_else(|problem| vec![format!("{problem:#}")]);
            compared
                .answer(differences.into_iter().map(|it| self.located(&format!("{name}: {it}"))).collect());
        }
    }

    fn located(&self, what: &str) -> String {
        format!("{}: {what}", self.path.display())
    }

    /// The topics of the file, or of all files of the folder.
    fn topics(&self) -> anyhow::Result<Vec<TopicInfo>> {
        let files = inventory(slice::from_ref(&self.path), &self.options)?;
        Ok(files.into_iter().flat_map(|file| file.topics).collect())
    }

    fn number(&self, compared: &mut Compared, what: &str, found: f64, expected: &Value) {
        let is_equal = expected.as_f64().is_some_and(|expected| is_near(found, expected));
        let difference = (!is_equal).then(|| self.located(&format!("{what}: {found} instead of {expected}")));
        compared.answer(difference.into_iter().collect());
    }

    /// The differences in the values of a field.
    fn field(&self, topics: &[TopicInfo], name: &str, expected: &Value) -> anyhow::Result<Vec<String>> {
        let places = places(topics, name);
        anyhow::ensure!(!places.is_empty(), "no topic has it");
        if let Some(text) =
            expected["first"]["value"].as_str().filter(|_| value_of(&expected["first"]).is_none())
        {
            return self.text(topics, &places, text, expected);
        }
        // Of one topic after the other: two that are one here may overlap, and would be two sessions.
        let read_at = |at: &str| {
            let read_place = |place: &Place| {
                let source = format!("{}{}{}{at}", place.before, place.field, place.behind);
                read(slice::from_ref(&self.path), &[Wanted::new("/x", source)], &self.options)
            };
            places.iter().map(read_place).collect::<Result<Vec<Recording>, _>>()
        };
        let mut all = read_at(if has_row_times(expected) { ROWS } else { "" })?;
        let mut has_times = true;
        if all.iter().any(|it| it.sessions.len() > 1 && it.degraded) {
            // Rows in no order of time are parted, and some left out: they are compared as they stand in the file.
            (all, has_times) = (read_at(ROWS)?, false);
        }
        let all: Vec<Vec<Sample>> = all.into_iter().map(|it| it.samples).collect();
        Ok(differences(&all, expected, has_times))
    }
}

impl File<'_> {
    /// What differs in a field of texts: a number beside it is asked for where it is this text, at the beginning and at the end.
    fn text(
        &self,
        topics: &[TopicInfo],
        places: &[Place],
        first: &str,
        expected: &Value,
    ) -> anyhow::Result<Vec<String>> {
        let last = expected["last"]["value"].as_str().unwrap_or(first);
        let mut differences = Vec::new();
        for place in places {
            let (list, kind) = match place.field.rsplit_once('[') {
                Some((list, _)) => (list, "list"),
                None => (place.field.as_str(), "number"),
            };
            let topic =
                topics.iter().find(|topic| format!("{}#", split_tags(&topic.source).0) == place.before);
            let beside = topic.and_then(|topic| {
                topic.fields.iter().find(|field| is_beside(&field.path, list, kind, field.kind))
            });
            let beside = beside.context("no number stands beside the texts")?;
            let of_text = |text: &str| {
                let source =
                    format!("{}{}[{list}={text}]{}@received", place.before, beside.path, place.behind);
                read(slice::from_ref(&self.path), &[Wanted::new("/x", source)], &self.options)
            };
            let (begin, end) = (of_text(first)?.samples, of_text(last)?.samples);
            if first == last && begin.len() as u64 != expected["count"].as_u64().unwrap_or(0) {
                differences.push(format!("'{first}' {} times instead of {}", begin.len(), expected["count"]));
            }
            for (what, sample, text) in [("first", begin.first(), first), ("last", end.last(), last)] {
                let Some(sample) = sample else {
                    differences.push(format!("'{text}' is nowhere"));
                    continue;
                };
                differences.extend(time_difference(what, sample.received.0, &expected[what]));
            }
        }
        Ok(differences)
    }
}

/// Whether a field stands in the same part of a message as texts do, and is of this kind.
fn is_beside(path: &str, texts: &str, kind: &str, is: &str) -> bool {
    let part = |path: &str| path.rsplit_once('.').map_or(String::new(), |(part, _)| part.to_owned());
    path != texts && is == kind && part(path) == part(texts)
}

/// A number, also one that JSON has no sign for.
fn value_of(end: &Value) -> Option<f64> {
    let value = &end["value"];
    value
        .as_f64()
        .or_else(|| value.as_str().filter(|text| ["inf", "-inf", "nan"].contains(text))?.parse().ok())
}

/// Whether the other reader counted rows as there is no time.
fn has_row_times(expected: &Value) -> bool {
    expected["first"].get("row").is_some()
}

fn is_near(found: f64, expected: f64) -> bool {
    found == expected || (found - expected).abs() <= TOLERANCE * expected.abs().max(1.0)
}

/// The number of messages of all topics with this name.
fn count_of(topics: &[TopicInfo], name: &str) -> usize {
    let (name, source) =
        name.split_once(" from ").map_or((name, None), |(path, source)| (path, Some(source)));
    let source = source.map(|source| format!("[source={source}]"));
    let is_meant = |topic: &&TopicInfo| {
        let full = split_tags(&topic.source).0;
        let maker = full.strip_prefix('P').unwrap_or(full);
        let is_called = topic.name == name || full == name || maker == name;
        is_called && source.as_ref().is_none_or(|source| topic.source.contains(source.as_str()))
    };
    topics.iter().filter(is_meant).map(|topic| topic.count).sum()
}

/// Splits a topic's source text into the text without tags, and the tags.
fn split_tags(source: &str) -> (&str, &str) {
    let begin = source.char_indices().filter(|(_, letter)| *letter == '[').map(|(at, _)| at);
    let is_tag =
        |at: &usize| source.get(*at..).is_some_and(|rest| rest.split(']').next().unwrap_or("").contains('='));
    source.split_at(begin.into_iter().find(is_tag).unwrap_or(source.len()))
}

/// The topics that have a field, by the name that the other reader gives it.
fn places(topics: &[TopicInfo], name: &str) -> Vec<Place> {
    let place = |topic: &TopicInfo, field: &str| {
        let (full, tags) = split_tags(&topic.source);
        let before = if field.is_empty() { full.to_owned() } else { format!("{full}#") };
        Place { before, field: field.to_owned(), behind: tags.to_owned() }
    };
    let Some((asked, field)) = name.split_once('#') else { return places_of_path(topics, name, &place) };
    let (bare, tags) = split_tags(asked);
    let fits = |topic: &&TopicInfo| {
        let (full, own) = split_tags(&topic.source);
        let is_called = [bare, bare.trim_start_matches('/')].contains(&full.trim_start_matches('/'))
            || topic.name == bare;
        is_called && own.contains(tags)
    };
    let mut matching: Vec<&TopicInfo> = topics.iter().filter(fits).collect();
    // Of several devices, other readers take the first.
    let first = format!("{bare}[0]");
    if matching.iter().any(|topic| topic.source == first) {
        matching.retain(|topic| topic.source == first);
    }
    // A series that was declared again with more fields is one topic.
    matching.dedup_by(|one, other| one.source == other.source);
    matching.into_iter().map(|topic| place(topic, nmea_field(topic, field))).collect()
}

/// The places of a column, or of a path that ends within the value.
fn places_of_path(topics: &[TopicInfo], name: &str, place: &dyn Fn(&TopicInfo, &str) -> Place) -> Vec<Place> {
    let of_path = topics.iter().filter_map(|topic| {
        let rest = name.strip_prefix(topic.name.as_str())?;
        (rest.is_empty() || rest.starts_with('.')).then(|| place(topic, rest.trim_start_matches('.')))
    });
    let of_path: Vec<Place> = of_path.collect();
    if !of_path.is_empty() {
        return of_path;
    }
    let bare = name.rsplit_once(" [").map_or(name, |(bare, _)| bare);
    let of_column = |topic: &TopicInfo| {
        let field = topic.fields.iter().find(|field| field.path == name || field.path == bare)?;
        Some(place(topic, &field.path))
    };
    topics.iter().filter_map(of_column).collect()
}

/// Our name of a field of NMEA.
fn nmea_field<'a>(topic: &TopicInfo, field: &'a str) -> &'a str {
    match field {
        _ if !topic.kind.starts_with("NMEA") => field,
        "speed_kn" | "wind_speed_kn" => "speed",
        "speed_kmph" => "speed_kmh",
        "latitude_deg" => "latitude",
        "depth_m" => "depth",
        "altitude_m" => "altitude",
        "wind_angle_deg" => "angle",
        other => other,
    }
}

/// The difference between the reception and an expected epoch time, if it is a microsecond or more.
fn time_difference(what: &str, received_ns: i64, asked: &Value) -> Option<String> {
    let nanoseconds = NANOSECONDS.iter().find_map(|key| asked[*key].as_i64());
    let seconds =
        SECONDS.iter().find_map(|key| asked[*key].as_f64()).filter(|seconds| *seconds > EPOCH_MIN_S);
    let expected_ns = nanoseconds.or_else(|| seconds.map(|seconds| (seconds * 1e9).round() as i64))?;
    let is_equal = (received_ns - expected_ns).abs() < 1_000;
    (!is_equal).then(|| format!("{what} at {received_ns} ns instead of {expected_ns}"))
}

/// What differs between the samples of some topics and what is expected of all together.
fn differences(all: &[Vec<Sample>], expected: &Value, has_times: bool) -> Vec<String> {
    let number = |sample: &Sample| match sample.value {
        RawValue::Number(value) => value,
        _ => f64::NAN,
    };
    let differ = |what: &str, found: f64, expected: Option<f64>| {
        // What is not a number has no mean there.
        let is_equal = expected.map_or(found.is_nan(), |expected| is_near(found, expected));
        let expected = expected.map_or("no number".to_owned(), |expected| expected.to_string());
        (!is_equal).then(|| format!("{what} {found} instead of {expected}"))
    };
    let mut differences = Vec::new();
    let count: usize = all.iter().map(Vec::len).sum();
    let sum: f64 = all.iter().flatten().map(number).sum();
    differences.extend(differ("count", count as f64, expected["count"].as_f64()));
    if expected.get("mean").is_some() {
        differences.extend(differ("mean", sum / count as f64, expected["mean"].as_f64()));
    }
    for (what, samples) in [
        ("first", all.iter().filter_map(|samples| samples.first()).collect::<Vec<_>>()),
        ("last", all.iter().filter_map(|samples| samples.last()).collect()),
    ] {
        // Where several topics are joined, one of them has the expected first value.
        let asked = &expected[what];
        let nearest = samples.iter().min_by(|one, other| {
            let far = |sample: &Sample| (number(sample) - value_of(asked).unwrap_or(0.0)).abs();
            far(one).total_cmp(&far(other))
        });
        let Some(sample) = nearest else { continue };
        differences.extend(differ(what, number(sample), value_of(asked)));
        differences.extend(time_difference(what, sample.received.0, asked).filter(|_| has_times));
    }
    differences
}
