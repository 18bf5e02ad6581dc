//! All columns of recordings: named, with their units, each with its values.

use super::Column;
use super::values::{Points, Values};
use crate::LabError;
use crate::learning::Signal;
use crate::naming::{unique, unit as guessed_unit, variable};
use shsa_core::observation::RawValue;
use shsa_core::time::Span;
use shsa_core::unit::{Dimension, Unit};
use shsa_message::source::Source;
use shsa_recording::{FieldInfo, ReadOptions, Recording, TopicInfo, Wanted};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// The most values of a column that tells sources apart.
const MOST_SOURCES: usize = 64;

/// Units as headers write them in words.
const WORDS: [(&[&str], &str); 15] = [
    (&["meter", "meters", "metre", "metres"], "m"),
    (&["degree", "degrees"], "deg"),
    (&["radian", "radians"], "rad"),
    (&["percent", "pct"], "%"),
    (&["volt", "volts", "v"], "V"),
    (&["ampere", "amperes", "amp", "amps", "a"], "A"),
    (&["watt", "watts", "w"], "W"),
    (&["second", "seconds", "sec"], "s"),
    (&["millisecond", "milliseconds"], "ms"),
    (&["microsecond", "microseconds"], "us"),
    (&["feet", "foot"], "ft"),
    (&["mile", "miles"], "mi"),
    (&["kelvin", "k"], "K"),
    (&["c"], "degC"),
    (&["f"], "degF"),
];

/// What the files say of a column.
#[derive(Clone, Debug)]
pub struct About {
    /// The name of the signal.
    pub signal: String,
    /// The name of its variable, as long as it has one of its own.
    pub variable: String,
    /// Where it is found.
    pub source: String,
    /// The unit of the header as it is written there.
    pub declared_unit: Option<String>,
    /// The unit that its name suggests, where the header has none.
    pub guessed_unit: Option<&'static str>,
}

/// The columns of recordings.
#[derive(Clone, Debug)]
pub struct Columns {
    /// Their values.
    pub columns: Vec<Column>,
    /// What the files say of each.
    pub about: Vec<About>,
    /// A time between each two sessions, in order, in seconds.
    pub joints: Vec<f64>,
    /// Fields that cannot be signals, with the reason.
    pub left_out: Vec<(String, String)>,
    /// What is to be reported of the recordings.
    pub warnings: Vec<String>,
    /// Whether a part of the recording is lost.
    pub degraded: bool,
}

/// The values of a field that were received live.
#[derive(Clone, Debug)]
pub struct Series {
    /// Where it was received.
    pub topic: String,
    /// The path of the field in its messages; empty for a message that is a number.
    pub path: String,
    /// The source as models write it.
    pub source: String,
    /// Times in seconds, with values.
    pub points: Vec<(f64, f64)>,
}

impl Columns {
    /// The columns of what was received live, named as those of recordings.
    #[must_use]
    pub fn of_series(all: Vec<Series>) -> Columns {
        let listed = |one: &Series| {
            let (topic, path) = (one.topic.clone(), one.path.clone());
            Listed { topic, bare: path.clone(), path, key: None, source: one.source.clone(), unit: None }
        };
        let listed: Vec<Listed> = all.iter().map(listed).collect();
        let mut about = named(&listed);
        let columns = all
            .into_iter()
            .zip(&mut about)
            .map(|(one, about)| Points::of(one.points).column(about, kind(&one.path)));
        let columns = columns.collect();
        Columns {
            columns,
            about,
            joints: Vec::new(),
            left_out: Vec::new(),
            warnings: Vec::new(),
            degraded: false,
        }
    }
}

/// Recordings, and how their columns are found.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    /// Files and folders of any format; files of the same time form one recording.
    pub recordings: Vec<PathBuf>,
    /// A column that tells apart whose values a row holds, such as the number of a station.
    pub by: Option<String>,
    /// What recordings do not say of themselves.
    pub options: ReadOptions,
}

impl Origin {
    /// Reads everything that is a number. Memory: 16 bytes a value.
    ///
    /// # Errors
    /// When a recording cannot be read, or its rows are those of several sources that nothing tells apart.
    pub fn read(&self) -> Result<Columns, LabError> {
        let options = &self.options;
        let files = shsa_recording::inventory(&self.recordings, options)?;
        let mut found =
            Fields { origin: self, listed_names: BTreeSet::new(), listed: Vec::new(), left_out: Vec::new() };
        for topic in files.iter().flat_map(|file| &file.topics) {
            found.of_topic(topic)?;
        }
        let Fields { listed, left_out, .. } = found;
        let mut about = named(&listed);
        let wanted: Vec<Wanted> =
            about.iter().map(|it| Wanted::new(it.signal.clone(), it.source.clone())).collect();
        let survey = shsa_recording::survey(&self.recordings, &wanted, options)?;
        let mut warnings: Vec<String> = self.mixed_rows(&survey.recording).into_iter().collect();
        let mut values = Values::new(wanted.len());
        if survey.can_stream {
            for session in 0..survey.recording.sessions.len() {
                values.begin();
                for sample in shsa_recording::stream(&self.recordings, &wanted, options, &survey, session)? {
                    values.take(&sample?);
                }
            }
        } else {
            let recording = shsa_recording::read(&self.recordings, &wanted, options)?;
            for (_, samples) in recording.by_session() {
                values.begin();
                samples.iter().for_each(|sample| values.take(sample));
            }
        }
        warnings.extend(survey.recording.warnings.iter().map(ToString::to_string));
        let (columns, joints) = values.in_order();
        let kinds: Vec<String> = listed.iter().map(|it| kind(&it.bare)).collect();
        let columns = columns.into_iter().zip(&mut about).zip(kinds);
        let columns = columns.map(|((points, about), kind)| points.column(about, kind)).collect();
        Ok(Columns { columns, about, joints, left_out, warnings, degraded: survey.recording.degraded })
    }

    /// What a source says of the time, so that the model needs no arguments.
    fn time(&self) -> String {
        let step = self.options.time_scale.map(|step| format!("*{}", step_text(step)));
        let column = self.options.time_column.as_ref();
        column.map_or(String::new(), |column| format!("@{column}{}", step.unwrap_or_default()))
    }

    /// What is to be reported where the rows of a table may be those of several sources.
    fn mixed_rows(&self, read: &Recording) -> Option<String> {
        let is_table = |place: &String| place.contains(".csv") || place.contains(".tsv");
        let goes_back = read.found.iter().any(|it| it.backward > 0 && it.places.iter().any(is_table));
        (self.by.is_none() && goes_back).then(|| {
            "times go back within a table: if its rows are of several sources, name the column that tells them apart (--by)"
                .to_owned()
        })
    }
}

/// A step of time as sources write it.
fn step_text(step: Span) -> String {
    let units = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us"), (1, "ns")];
    let unit = units.into_iter().find(|(size, _)| step.0 % size == 0).unwrap_or((1, "ns"));
    format!("{}{}", step.0 / unit.0, unit.1)
}

/// One field that can be a signal.
struct Listed {
    topic: String,
    path: String,
    /// The path without its unit.
    bare: String,
    /// The value of the column that tells sources apart.
    key: Option<(String, String)>,
    source: String,
    unit: Option<String>,
}

struct Fields<'a> {
    origin: &'a Origin,
    listed_names: BTreeSet<String>,
    listed: Vec<Listed>,
    left_out: Vec<(String, String)>,
}

impl Fields<'_> {
    fn of_topic(&mut self, topic: &TopicInfo) -> Result<(), LabError> {
        let keys = self.keys(topic)?;
        for field in &topic.fields {
            let plain = source(topic, &field.path, None, "");
            let is_key = Some(&field.path) == self.origin.by.as_ref();
            let is_time = self.origin.options.time_column.as_ref() == Some(&field.path);
            if is_key || is_time || !self.listed_names.insert(plain.clone()) {
                continue;
            }
            if topic.fields.iter().filter(|it| it.path == field.path).count() > 1 {
                self.left_out.push((plain, "several columns have this name".to_owned()));
                continue;
            }
            match reason(topic, field) {
                Some(reason) => self.left_out.push((plain, reason)),
                None => keys.iter().for_each(|key| self.list(topic, field, key.clone())),
            }
        }
        Ok(())
    }

    fn list(&mut self, topic: &TopicInfo, field: &FieldInfo, key: Option<(String, String)>) {
        let bare = bare(field);
        let is_alone = topic.fields.iter().filter(|it| self::bare(it) == bare).count() == 1;
        let path = if is_alone { bare } else { field.path.as_str() };
        let source = source(topic, path, key.as_ref(), &self.origin.time());
        if source.parse::<Source>().is_err() {
            self.left_out.push((source, "a source cannot name it".to_owned()));
            return;
        }
        let (topic, path, unit) = (topic.source.clone(), path.trim().to_owned(), field.unit.clone());
        let bare = bare.trim().to_owned();
        self.listed.push(Listed { topic, path, bare, key, source, unit });
    }

    /// The values of the column that tells sources apart; one without a key where there is no such column.
    fn keys(&self, topic: &TopicInfo) -> Result<Vec<Option<(String, String)>>, LabError> {
        let by = self.origin.by.as_ref().filter(|by| topic.fields.iter().any(|field| field.path == **by));
        let Some(by) = by else { return Ok(vec![None]) };
        let wanted = [Wanted::new(by.clone(), source(topic, by, None, "@row*1s"))];
        let read = shsa_recording::read(&self.origin.recordings, &wanted, &self.origin.options)?;
        let mut keys: BTreeSet<String> = BTreeSet::new();
        for sample in &read.samples {
            if let RawValue::Number(number) = sample.value {
                keys.insert(number.to_string());
            }
            if keys.len() > MOST_SOURCES {
                let message =
                    format!("{by} has more than {MOST_SOURCES} values: it does not tell sources apart");
                return Err(LabError::Unfit(message));
            }
        }
        if keys.is_empty() {
            return Err(LabError::Unfit(format!("{by} has no numbers")));
        }
        Ok(keys.into_iter().map(|key| Some((by.clone(), key))).collect())
    }
}

/// The path of a field without its unit.
fn bare(field: &FieldInfo) -> &str {
    let path = field.path.as_str();
    let Some(unit) = &field.unit else { return path };
    let without = [format!("[{unit}]"), format!("({unit})")];
    without.iter().find_map(|it| path.strip_suffix(it.as_str())).map_or(path, str::trim_end)
}

/// Why a field cannot be a signal.
fn reason(topic: &TopicInfo, field: &FieldInfo) -> Option<String> {
    let is_time = field.is_clock || is_named_time(topic, field);
    match field.kind {
        _ if topic.unreadable.is_some() => topic.unreadable.clone(),
        _ if is_time => Some("time".to_owned()),
        "number" => None,
        "" => Some("no value".to_owned()),
        "list" if topic.kind == shsa_recording::CAN_FRAME => {
            Some("bytes of a CAN frame, which a database of its messages explains (--dbc FILE)".to_owned())
        }
        kind => Some(kind.to_owned()),
    }
}

/// Whether a name is that of a time. The letter `t` is as likely a temperature, where the topic has another time.
fn is_named_time(topic: &TopicInfo, field: &FieldInfo) -> bool {
    let is_time =
        |it: &FieldInfo| shsa_recording::TIME_NAMES.iter().any(|name| bare(it).eq_ignore_ascii_case(name));
    let is_letter = |it: &FieldInfo| bare(it).eq_ignore_ascii_case("t");
    let has_other = || topic.fields.iter().any(|it| it.is_clock || is_time(it) && !is_letter(it));
    is_time(field) && !(is_letter(field) && has_other())
}

/// The source text of a field.
fn source(topic: &TopicInfo, path: &str, key: Option<&(String, String)>, time: &str) -> String {
    // The tags of a topic stand behind the field.
    let at = topic.source.find('[').filter(|_| topic.source.contains('='));
    let (name, tags) = topic.source.split_at(at.unwrap_or(topic.source.len()));
    let key = key.map_or(String::new(), |(column, value)| format!("[{column}={value}]"));
    match path {
        "" => format!("{}{key}{time}", topic.source),
        path => format!("{name}#{path}{tags}{key}{time}"),
    }
}

/// The names: that of the field alone where no other has it, else with the topic and the key.
fn named(listed: &[Listed]) -> Vec<About> {
    let mut names = BTreeSet::new();
    let about = |it: &Listed| {
        let own = variable("", &it.path);
        let is_alone = listed.iter().filter(|other| variable("", &other.path) == own).count() == 1;
        let key = it.key.as_ref().map(|(column, value)| {
            format!("{} {value}", column.trim_end_matches("id").trim_end_matches(['_', ' ']))
        });
        let name = match (is_alone && !it.path.is_empty(), &key) {
            (true, _) => own,
            (false, Some(key)) if listed.iter().all(|other| other.topic == it.topic) => {
                variable(key, &it.path)
            }
            (false, Some(key)) => variable(&format!("{} {key}", it.topic), &it.path),
            (false, None) => variable(&it.topic, &it.path),
        };
        let name = unique(&name, &mut names);
        let guessed_unit = if it.unit.is_none() { guessed_unit(&it.path, &it.topic) } else { None };
        About {
            signal: name.clone(),
            variable: name,
            source: it.source.clone(),
            declared_unit: it.unit.clone(),
            guessed_unit,
        }
    };
    listed.iter().map(about).collect()
}

/// A name without its numbers: `voltagecell` of `voltageCell1`.
fn kind(path: &str) -> String {
    let letters: String =
        path.to_lowercase().chars().map(|it| if it.is_alphabetic() { it } else { ' ' }).collect();
    letters.split_whitespace().collect::<Vec<_>>().join("_")
}

/// A unit as a header writes it.
fn unit_of(text: &str) -> Option<Unit> {
    let word = text.trim().to_lowercase();
    let known = WORDS.iter().find(|(words, _)| words.contains(&word.as_str())).map(|(_, unit)| *unit);
    Unit::parse(text).ok().or_else(|| Unit::parse(known?).ok())
}

impl Points {
    fn column(self, about: &mut About, kind: String) -> Column {
        let signal = Signal { name: about.signal.clone(), unit: None, points: self.points };
        let mut column = Column { signal, breaks: self.breaks, kind, turn: None };
        column.turn = column.seen_turn();
        about.declared_unit.iter().for_each(|unit| column.take_unit(unit));
        column
    }
}

impl Column {
    /// Takes a unit as a header writes it.
    pub(super) fn take_unit(&mut self, text: &str) {
        let unit = unit_of(text);
        let angle = unit.as_ref().filter(|unit| unit.dimension == Dimension::ANGLE);
        self.turn = angle.map(|unit| std::f64::consts::TAU / unit.scale);
        self.signal.unit = unit;
    }
}
