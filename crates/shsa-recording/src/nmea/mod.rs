//! NMEA 0183: sentences of ships' instruments and GNSS receivers, one per line.
//!
//! A topic is the sentence (`RMC`), and in full with its talker (`GPRMC`). Only sentences of GNSS have a time: other sentences
//! take the time of the last `RMC`, `ZDA`, `GGA`, `GNS`, `GLL` or `GST`, and those before the first one take its time. Times of day
//! without a date anywhere in the file count from 1970-01-01. Where a
//! logger has noted the time of each line, or a TAG block has it, that time is the reception, and the GNSS time is the stamp.

mod sentence;
mod table;

use super::lines::{self, Lines};
use super::topic::{Body, Fields, Input, Listener, Times, Topic, TopicId, Value};
use super::{Place, RecordingError};
use sentence::{Flaw, Sentence, sentence};
use shsa_core::time::{Span, Time};
use shsa_message::stamp::civil;
use std::collections::BTreeMap;
use std::io::SeekFrom;
use table::{Known, entry, other_fields, time_of_day};

/// The most topics; sentences of further ones count as unknown.
const TOPICS_MAX: usize = 1 << 10;

/// How many sentences decide whether the recording has checksums.
const LOOKED_AT: usize = 200;

/// Most sentences have no more cells.
const CELLS_USUAL: usize = 24;

const DAY: Span = Span::from_millis(86_400_000);

/// Whether a text begins as these recordings do: one of its first lines is a sentence.
pub(super) fn is_log(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    lines::of(&text).take(100).any(|line| sentence(line, true).is_ok())
}

/// Reads all sentences.
pub(super) fn read(input: &mut dyn Input, listener: &mut dyn Listener) -> Result<(), RecordingError> {
    let rehearsal = Rehearsal::of(input);
    if let Err(failure) = input.seek(SeekFrom::Start(0)) {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
        return Ok(());
    }
    if rehearsal.has_no_date {
        let note = "no sentence has a date (RMC, ZDA): the times of day count from 1970-01-01";
        listener.note(Place::Whole, note.to_owned());
    }
    let mut reader = Reader { clock: Clock { now: rehearsal.first }, ..Reader::default() };
    let mut lines = Lines::new(input);
    while let Some(line) = lines.next(listener) {
        match sentence(&line.text, rehearsal.has_checksums) {
            Ok(found) => reader.report(&found, line.number, listener),
            Err(Flaw::Torn) if !line.is_ended => {
                listener.damaged(
                    Place::Line(line.number),
                    "the file ends within this line; line left out".into(),
                );
            }
            Err(Flaw::Torn) => {
                let problem = "a torn sentence: its checksum is wrong or absent; line left out";
                listener.damaged(Place::Line(line.number), problem.into());
            }
            Err(Flaw::Other) => reader.other += u64::from(!line.text.trim().is_empty()),
        }
    }
    reader.finish(rehearsal.has_checksums, listener);
    Ok(())
}

/// The properties of a recording that must be known before its first sentence.
struct Rehearsal {
    /// The first time with a date; where there is none, nor a noted time, the first time of day on 1970-01-01.
    first: Option<Time>,
    has_no_date: bool,
    has_checksums: bool,
}

impl Rehearsal {
    fn of(input: &mut dyn Input) -> Rehearsal {
        let mut lines = Lines::new(input);
        let (mut first, mut looked_at, mut with) = (None, 0, 0);
        let (mut of_day, mut is_noted) = (None, false);
        while let Some(line) = lines.read() {
            let Ok(line) = line else { continue };
            let Ok(found) = sentence(&line.text, false) else { continue };
            looked_at += 1;
            with += usize::from(line.text.contains('*'));
            is_noted |= found.noted.is_some();
            if let (None, Ok(sound)) = (first, sentence(&line.text, with > 0)) {
                first = dated(&sound);
                of_day = of_day.or_else(|| self::of_day(&sound));
            }
            if first.is_some() && looked_at >= LOOKED_AT
                || found.noted.is_some() && looked_at >= 10 * LOOKED_AT
            {
                break;
            }
        }
        // Checksums are in all sentences of a recording or in none.
        let has_no_date = first.is_none() && of_day.is_some() && !is_noted;
        let first = first.or(of_day.filter(|_| has_no_date).map(|of_day| Time(0) + of_day));
        Rehearsal { first, has_no_date, has_checksums: with > 0 || looked_at == 0 }
    }
}

/// The GNSS time, carried from sentence to sentence.
#[derive(Default)]
struct Clock {
    now: Option<Time>,
}

impl Clock {
    /// The time in a sentence; its date is the one that brings it nearest to the time before.
    fn own(&mut self, sentence: &Sentence<'_>) -> Option<Time> {
        let time = dated(sentence).or_else(|| {
            let of_day = of_day(sentence)?;
            let now = self.now?;
            let day = Time(now.0.div_euclid(DAY.0) * DAY.0);
            let days = [day - DAY, day, day + DAY];
            days.into_iter().map(|day| day + of_day).min_by_key(|time| (*time - now).abs())
        });
        self.now = time.or(self.now);
        time
    }
}

/// The time of day in a sentence without a date.
fn of_day(sentence: &Sentence<'_>) -> Option<Span> {
    let (time, date) = match kind_of(sentence.address) {
        "GGA" | "GNS" | "GST" => (0, None),
        "GLL" => (4, None),
        "RMC" => (0, Some(8)),
        "ZDA" => (0, Some(3)),
        _ => return None,
    };
    let cell = |at: usize| sentence.cells().nth(at).map(str::trim);
    // A date that is there and implausible makes the time of day implausible, too.
    let has_date = date.and_then(cell).is_some_and(|date| !date.is_empty());
    if has_date { None } else { time_of_day(cell(time)?) }
}

/// The time of a sentence that also has the date.
fn dated(sentence: &Sentence<'_>) -> Option<Time> {
    let kind = kind_of(sentence.address);
    if !matches!(kind, "RMC" | "ZDA") {
        return None;
    }
    let mut first = [""; 9];
    first.iter_mut().zip(sentence.cells()).for_each(|(first, cell)| *first = cell);
    let cell = |at: usize| first.get(at).copied();
    let number = |text: Option<&str>| text?.parse::<i64>().ok();
    let (year, month, day) = match kind {
        "RMC" => {
            let date = cell(8).filter(|date| date.len() == 6)?;
            let part = |from: usize| number(date.get(from..from + 2));
            (2_000 + part(4)?, part(2)?, part(0)?)
        }
        _ => (number(cell(3))?, number(cell(2))?, number(cell(1))?),
    };
    // Receivers without a fix send a year before 2000; written in two digits, it looks like one at the end of the century.
    let is_plausible = (2_000..2_080).contains(&year);
    let of_day = time_of_day(cell(0)?).filter(|_| is_plausible)?;
    civil(year, month, day, of_day.0)
}

/// The sentence without its talker; a proprietary sentence whole.
fn kind_of(address: &str) -> &str {
    if address.starts_with('P') { address } else { address.get(2..).unwrap_or(address) }
}

#[derive(Default)]
struct Reader {
    clock: Clock,
    /// By address.
    topics: BTreeMap<String, ReportedTopic>,
    /// By address and name.
    transducers: BTreeMap<String, BTreeMap<String, TopicId>>,
    /// The number of all topics.
    count: usize,
    /// The number of lines without a sentence.
    other: u64,
    /// The number of sentences without a known time.
    untimed: u64,
}

/// A topic that was reported.
#[derive(Clone, Copy)]
struct ReportedTopic {
    id: TopicId,
    known: Option<&'static Known>,
}

impl Reader {
    fn report(&mut self, sentence: &Sentence<'_>, line: u64, listener: &mut dyn Listener) {
        let own = self.clock.own(sentence);
        let Some(received) = sentence.noted.or(self.clock.now) else {
            self.untimed += 1;
            return;
        };
        let times = Times { received, published: None, stamp: own.filter(|_| sentence.noted.is_some()) };
        if kind_of(sentence.address) == "XDR" {
            return self.transducers(sentence, times, listener);
        }
        let mut cells = Vec::with_capacity(CELLS_USUAL);
        cells.extend(sentence.cells().map(str::trim));
        let Some(topic) = self.report_topic(sentence.address, cells.len(), listener) else {
            self.other += 1;
            return;
        };
        let mut values = Vec::with_capacity(cells.len());
        match topic.known {
            Some(known) => {
                if let Some(at) = known.values(&cells, &mut values) {
                    let problem = format!(
                        "{} has lost commas: what stands behind field {at} is left out",
                        sentence.address
                    );
                    listener.damaged(Place::Line(line), problem);
                }
            }
            None => values.extend(cells.iter().map(|cell| Value::Text(cell))),
        }
        if listener.is_wanted(topic.id) {
            listener.message(topic.id, times, Body::Values(&values));
        }
    }

    fn report_topic(
        &mut self,
        address: &str,
        cells: usize,
        listener: &mut dyn Listener,
    ) -> Option<ReportedTopic> {
        if let Some(topic) = self.topics.get(address) {
            return Some(*topic);
        }
        if self.count == TOPICS_MAX {
            return None;
        }
        self.count += 1;
        let name = kind_of(address);
        let known = entry(name);
        let fields = match known {
            Some(known) => Fields::named(known.fields()),
            None => Fields::named(other_fields(cells)),
        };
        let kind = format!("NMEA {name}");
        let id = listener.topic(Topic { full: address, ..Topic::new(name, &kind, fields) });
        let topic = ReportedTopic { id, known };
        self.topics.insert(address.to_owned(), topic);
        Some(topic)
    }

    /// `XDR` has four cells for each transducer: kind, value, unit, name.
    fn transducers(&mut self, sentence: &Sentence<'_>, times: Times, listener: &mut dyn Listener) {
        let cells: Vec<&str> = sentence.cells().map(str::trim).collect();
        for cells in cells.chunks(4) {
            let [kind, value, unit, name @ ..] = cells else { continue };
            let name = name.first().copied().filter(|name| !name.is_empty()).unwrap_or(kind);
            let known = self.transducers.get(sentence.address).and_then(|names| names.get(name));
            let id = match known {
                Some(id) => *id,
                None if self.count == TOPICS_MAX => continue,
                None => {
                    self.count += 1;
                    let unit = Some(unit_of(kind, unit)).filter(|unit| !unit.is_empty());
                    let fields = [super::topic::Field { name: "value".to_owned(), unit }];
                    let tags = [("name", name)];
                    let topic = Topic::new("XDR", "NMEA XDR", Fields::named(fields));
                    let id = listener.topic(Topic { full: sentence.address, tags: &tags, ..topic });
                    let names = self.transducers.entry(sentence.address.to_owned()).or_default();
                    names.insert(name.to_owned(), id);
                    id
                }
            };
            if listener.is_wanted(id) {
                let value = value.parse().map_or(Value::Missing, Value::Number);
                listener.message(id, times, Body::Values(&[value]));
            }
        }
    }

    fn finish(&self, has_checksums: bool, listener: &mut dyn Listener) {
        if !has_checksums {
            listener
                .note(Place::Whole, "no sentence has a checksum: nothing tells which are torn".to_owned());
        }
        if self.other > 0 {
            listener.note(Place::Whole, format!("{} lines are no sentences", self.other));
        }
        if self.untimed > 0 {
            let problem = format!(
                "{} sentences are left out: none tells the time (RMC, ZDA, GGA, GNS, GLL, GST)",
                self.untimed
            );
            listener.damaged(Place::Whole, problem);
        }
    }
}

/// The unit of a transducer: the meaning of `C` depends on the kind.
fn unit_of(kind: &str, unit: &str) -> String {
    let unit = match (kind, unit) {
        ("C", "C") => "degC",
        ("C", "F") => "degF",
        ("C", "K") => "K",
        ("A", "D") => "deg",
        ("P", "B") => "bar",
        ("P", "P") => "Pa",
        ("H" | "V" | "E" | "L", "P") => "%",
        ("D", "M") | ("V", "M") => {
            if kind == "V" {
                "m^3"
            } else {
                "m"
            }
        }
        ("U", "V") => "V",
        ("I", "A") => "A",
        ("T", "R") => "1/min",
        (_, other) => other,
    };
    unit.to_owned()
}

#[cfg(test)]
mod tests;
