//! All columns of recordings, as `draft` and `learn` read them: named, with their units, each with its values.

use crate::reading::ReadArguments;
use crate::scan::draft::{unique, unit as guessed_unit, variable};
use crate::show;
use anyhow::{Context, bail};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_core::unit::{Dimension, Unit};
use shsa_format::recording::{self, FieldInfo, Recording, Sample, TopicInfo, Wanted};
use shsa_lab::drafting::Column;
use shsa_lab::learning::Signal;
use shsa_message::source::Source;
use std::collections::BTreeSet;
use std::io::{Write as _, stdout};
use std::path::{Path, PathBuf};

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

/// How the columns of recordings are found.
#[derive(clap::Args)]
pub(crate) struct ColumnArguments {
    /// Files and folders of any format; files of the same time form one recording.
    #[arg(required = true, value_name = "RECORDING")]
    pub(crate) recordings: Vec<PathBuf>,
    /// A column that tells apart whose values a row holds, such as the number of a station.
    #[arg(long, value_name = "COLUMN")]
    by: Option<String>,
    #[command(flatten)]
    pub(crate) reading: ReadArguments,
}

/// What the files say of a column.
pub(crate) struct About {
    /// The name of the signal.
    pub(crate) signal: String,
    /// The name of its variable, as long as it has one of its own.
    pub(crate) variable: String,
    /// Where it is found.
    pub(crate) source: String,
    /// The unit of the header as it is written there.
    pub(crate) declared_unit: Option<String>,
    /// The unit that its name suggests, where the header has none.
    pub(crate) guessed_unit: Option<&'static str>,
}

/// The columns of recordings.
pub(crate) struct Columns {
    pub(crate) columns: Vec<Column>,
    pub(crate) about: Vec<About>,
    /// Fields that cannot be signals, with the reason.
    pub(crate) left_out: Vec<(String, String)>,
    /// Whether a part of the recording is lost.
    pub(crate) degraded: bool,
}

impl ColumnArguments {
    /// Reads everything that is a number. Memory: 16 bytes a value.
    ///
    /// # Errors
    /// When a recording cannot be read, or its rows are those of several sources that nothing tells apart.
    pub(crate) fn read(&self) -> anyhow::Result<Columns> {
        let options = self.reading.options();
        let files = recording::inventory(&self.recordings, &options)?;
        let mut found = Fields {
            arguments: self,
            listed_names: BTreeSet::new(),
            listed: Vec::new(),
            left_out: Vec::new(),
        };
        for topic in files.iter().flat_map(|file| &file.topics) {
            found.of_topic(topic)?;
        }
        let Fields { listed, left_out, .. } = found;
        let mut about = named(&listed);
        let wanted: Vec<Wanted> =
            about.iter().map(|it| Wanted::new(it.signal.clone(), it.source.clone())).collect();
        let survey = recording::survey(&self.recordings, &wanted, &options)?;
        self.warn_of_mixed_rows(&survey.recording);
        let mut values = Values::new(wanted.len());
        if survey.can_stream {
            for sample in recording::stream(&self.recordings, &wanted, &options, &survey)? {
                values.take(&sample?);
            }
        } else {
            let recording = recording::read(&self.recordings, &wanted, &options)?;
            for (_, samples) in recording.by_session() {
                values.begin();
                samples.iter().for_each(|sample| values.take(sample));
            }
        }
        survey.recording.warnings.iter().for_each(show::warn);
        let kinds: Vec<String> = listed.iter().map(|it| kind(&it.bare)).collect();
        let columns = values.columns.into_iter().zip(&mut about).zip(kinds);
        let columns = columns.map(|((points, about), kind)| points.column(about, kind)).collect();
        Ok(Columns { columns, about, left_out, degraded: survey.recording.degraded })
    }

    /// What a source says of the time, so that the model needs no arguments.
    fn time(&self) -> String {
        let options = self.reading.options();
        let step = options.time_scale.map(|step| format!("*{}", step_text(step)));
        options.time_column.map_or(String::new(), |column| format!("@{column}{}", step.unwrap_or_default()))
    }

    /// Warns where the rows of a table may be those of several sources.
    fn warn_of_mixed_rows(&self, read: &Recording) {
        let is_table = |place: &String| place.contains(".csv") || place.contains(".tsv");
        if self.by.is_none() && read.found.iter().any(|it| it.backward > 0 && it.places.iter().any(is_table))
        {
            show::warn(
                "times go back within a table: if its rows are of several sources, name the column that tells them apart (--by)",
            );
        }
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
    arguments: &'a ColumnArguments,
    listed_names: BTreeSet<String>,
    listed: Vec<Listed>,
    left_out: Vec<(String, String)>,
}

impl Fields<'_> {
    fn of_topic(&mut self, topic: &TopicInfo) -> anyhow::Result<()> {
        let keys = self.keys(topic)?;
        for field in &topic.fields {
            let plain = source(topic, &field.path, None, "");
            let is_key = Some(&field.path) == self.arguments.by.as_ref();
            let is_time = self.arguments.reading.options().time_column.as_ref() == Some(&field.path);
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
        let source = source(topic, path, key.as_ref(), &self.arguments.time());
        if source.parse::<Source>().is_err() {
            self.left_out.push((source, "a source cannot name it".to_owned()));
            return;
        }
        let (topic, path, unit) = (topic.source.clone(), path.trim().to_owned(), field.unit.clone());
        let bare = bare.trim().to_owned();
        self.listed.push(Listed { topic, path, bare, key, source, unit });
    }

    /// The values of the column that tells sources apart; one without a key where there is no such column.
    fn keys(&self, topic: &TopicInfo) -> anyhow::Result<Vec<Option<(String, String)>>> {
        let by = self.arguments.by.as_ref().filter(|by| topic.fields.iter().any(|field| field.path == **by));
        let Some(by) = by else { return Ok(vec![None]) };
        let wanted = [Wanted::new(by.clone(), source(topic, by, None, "@row*1s"))];
        let read = recording::read(&self.arguments.recordings, &wanted, &self.arguments.reading.options())?;
        let mut keys: BTreeSet<String> = BTreeSet::new();
        for sample in &read.samples {
            if let RawValue::Number(number) = sample.value {
                keys.insert(number.to_string());
            }
            if keys.len() > MOST_SOURCES {
                bail!("{by} has more than {MOST_SOURCES} values: it does not tell sources apart");
            }
        }
        if keys.is_empty() {
            bail!("{by} has no numbers");
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
    let is_time = recording::TIME_NAMES.iter().any(|name| bare(field).eq_ignore_ascii_case(name));
    match field.kind {
        _ if topic.unreadable.is_some() => topic.unreadable.clone(),
        _ if is_time => Some("time".to_owned()),
        "number" => None,
        "" => Some("no value".to_owned()),
        kind => Some(kind.to_owned()),
    }
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
pub(crate) fn unit_of(text: &str) -> Option<Unit> {
    let word = text.trim().to_lowercase();
    let known = WORDS.iter().find(|(words, _)| words.contains(&word.as_str())).map(|(_, unit)| *unit);
    Unit::parse(text).ok().or_else(|| Unit::parse(known?).ok())
}

/// The values of all columns while they are read.
struct Values {
    columns: Vec<Points>,
    /// Where the first moment of the session lies, and how much later the session is put.
    first: Option<Time>,
    shift_s: f64,
    last_s: f64,
}

#[derive(Clone, Default)]
struct Points {
    points: Vec<(f64, f64)>,
    breaks: Vec<usize>,
}

impl Values {
    fn new(count: usize) -> Values {
        Values { columns: vec![Points::default(); count], first: None, shift_s: 0.0, last_s: 0.0 }
    }

    /// Begins a session, which follows at the end of the one before.
    fn begin(&mut self) {
        if self.first.take().is_some() {
            self.shift_s = self.last_s + 1.0;
        }
        for column in self.columns.iter_mut().filter(|column| !column.points.is_empty()) {
            column.breaks.push(column.points.len());
        }
    }

    fn take(&mut self, sample: &Sample) {
        let first = *self.first.get_or_insert(sample.time);
        let (RawValue::Number(value), Some(column)) = (&sample.value, self.columns.get_mut(sample.wanted))
        else {
            return;
        };
        let time_s = (sample.time - first).seconds() + self.shift_s;
        self.last_s = self.last_s.max(time_s);
        column.points.push((time_s, *value));
    }
}

impl Points {
    fn column(self, about: &mut About, kind: String) -> Column {
        let unit = about.declared_unit.as_deref().and_then(unit_of);
        let angle = unit.as_ref().filter(|unit| unit.dimension == Dimension::ANGLE);
        let turn = angle.map(|unit| std::f64::consts::TAU / unit.scale);
        let signal = Signal { name: about.signal.clone(), unit, points: self.points };
        Column { signal, breaks: self.breaks, kind, turn }
    }
}

/// The text of a file to write, `-` being standard output.
pub(crate) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    if path.as_os_str() == "-" {
        stdout().write_all(text.as_bytes())?;
        return Ok(());
    }
    std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
