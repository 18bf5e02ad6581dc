//! From messages to samples: which topics and fields are wanted, and which stamp counts.

use super::fields::{Locator, Unlocated};
use super::files::without_packing;
use super::gathered::Gathered;
use super::members::Members;
use super::topic::{Body, Fields, Listener, Times, Topic, TopicId};
use super::{Place, RecordingError, Want, names, stamp};
use shsa_core::time::{Span, Time};
use shsa_message::path::is_text;
use shsa_message::span::time_unit;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Extracts the wanted signals from the messages of one file.
pub(super) struct Extraction<'a, 'g> {
    wants: &'a [Want<'a>],
    gathered: &'g mut Gathered,
    file: PathBuf,
    naming: Naming,
    topics: Vec<Reported<'a>>,
    /// For each wanted signal the topics that its source fits; more than one are an error.
    choices: BTreeMap<usize, Vec<String>>,
    /// Why the file cannot be read as requested.
    error: Option<RecordingError>,
}

/// A reported topic.
struct Reported<'a> {
    extracts: Vec<Extract<'a>>,
    /// The members of its messages that are looked for, where these are JSON.
    members: Option<Members>,
}

/// How sources name a topic of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Naming {
    /// By the topic's name.
    Topic,
    /// By the file's name: the file is the only topic.
    File,
    /// By the signal's name, or by the source as a whole.
    Signal,
}

/// One wanted field of a topic.
struct Extract<'a> {
    want: &'a Want<'a>,
    value: Locator,
    clock: Clock,
    conditions: Vec<(Locator, &'a str)>,
    /// The number of messages so far.
    count: i64,
    oddities: Oddities,
}

/// Cells of a table that are no numbers.
#[derive(Default)]
struct Oddities {
    /// The field.
    field: String,
    empty: usize,
    not_numbers: usize,
    first: Option<String>,
}

/// The clock that stamps a message.
enum Clock {
    Received,
    Published,
    /// The stamp of the format, else the first of these fields that the message has, else the time of reception.
    Own(Vec<Locator>),
    /// A field, with the length of one step.
    Field(Locator, Option<Span>),
    /// The number of the message, with the length of one step.
    Row(Span),
}

impl<'a, 'g> Extraction<'a, 'g> {
    /// An extraction from the current file of `gathered`.
    pub(super) fn new(
        wants: &'a [Want<'a>],
        gathered: &'g mut Gathered,
        naming: Naming,
    ) -> Extraction<'a, 'g> {
        let file = gathered.file().to_path_buf();
        let (topics, choices) = (Vec::new(), BTreeMap::new());
        Extraction { wants, gathered, file, naming, topics, choices, error: None }
    }

    /// Ends the file.
    ///
    /// # Errors
    /// When a source fits several topics of the file.
    pub(super) fn finish(self) -> Result<(), RecordingError> {
        if let Some(error) = self.error {
            return Err(error);
        }
        if self.naming == Naming::File {
            report_oddities(&self.topics, self.gathered);
        }
        let several = self.choices.into_iter().find(|(_, choices)| choices.len() > 1);
        let Some((index, choices)) = several else { return Ok(()) };
        let Some(want) = self.wants.iter().find(|want| want.index == index) else { return Ok(()) };
        Err(RecordingError::AmbiguousTopic {
            file: self.file,
            signal: want.signal.to_owned(),
            topic: want.source.in_bag().0.to_owned(),
            choices,
        })
    }
}

/// The extraction of a signal from a topic; `None` where the signal's own time is in a missing field.
fn extract<'a>(
    want: &'a Want<'a>,
    topic: &Topic<'_>,
    field: &str,
    naming: Naming,
) -> Result<Extract<'a>, Unlocated> {
    let value = topic.fields.locate(field)?;
    if !value.can_be_number() {
        return Err(format!("'{field}' is neither a number nor a list of numbers").into());
    }
    let mut conditions = Vec::new();
    for (name, asked) in conditions_of(want, naming).iter().filter(|(name, _)| tag(topic, name).is_none()) {
        let locator = topic.fields.locate(name)?;
        if !locator.can_be_compared() {
            return Err(format!("'{name}' is no number and no text: nothing can be compared with it").into());
        }
        conditions.push((locator, asked.as_str()));
    }
    let clock = if naming == Naming::Signal { Clock::Own(Vec::new()) } else { clock_of(want, topic)? };
    let field = match (&topic.fields, &value) {
        (Fields::Named(fields), Locator::Named(at, _)) => fields.get(*at).map(|field| field.name.clone()),
        _ => None,
    };
    let oddities = Oddities { field: field.unwrap_or_default(), ..Oddities::default() };
    Ok(Extract { want, value, clock, conditions, count: 0, oddities })
}

/// The filters of a source; none for a signal that is named as a whole.
fn conditions_of<'w>(want: &'w Want<'_>, naming: Naming) -> &'w [(String, String)] {
    if naming == Naming::Signal { &[] } else { &want.source.filters }
}

/// Reports which cells of a table were taken as missing.
fn report_oddities(topics: &[Reported<'_>], gathered: &mut Gathered) {
    let mut reported: Vec<String> = Vec::new();
    let extracts = topics.iter().flat_map(|topic| &topic.extracts);
    for Oddities { field, empty, not_numbers, first } in extracts.map(|it| &it.oddities) {
        let example = first.as_ref().map_or(String::new(), |first| format!(" (the first: '{first}')"));
        let message = format!(
            "column '{field}': {empty} cells are empty and {not_numbers} are no numbers{example}; taken as missing"
        );
        if empty + not_numbers > 0 && !reported.contains(&message) {
            gathered.warn(Place::Whole, message.clone());
            reported.push(message);
        }
    }
}

fn tag<'t>(topic: &Topic<'t>, name: &str) -> Option<&'t str> {
    topic.tags.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
}

/// Whether a source fits this topic, by its name and tags.
fn is_meant(want: &Want<'_>, topic: &Topic<'_>, file: &Path, naming: Naming) -> bool {
    let is_named = match naming {
        Naming::File => want.source.is_of_file(&without_packing(file)),
        Naming::Topic => {
            let asked = names::bare(want.source.in_bag().0);
            asked == names::bare(topic.name) || asked == names::bare(topic.full)
        }
        Naming::Signal => names::bare(want.signal) == names::bare(topic.name) || want.text == topic.name,
    };
    let is_tagged =
        |(name, asked): &(String, String)| tag(topic, name).is_none_or(|value| is_text(value, asked));
    is_named && conditions_of(want, naming).iter().all(is_tagged)
}

fn clock_of(want: &Want<'_>, topic: &Topic<'_>) -> Result<Clock, Unlocated> {
    let Some(time) = &want.source.time else {
        return Ok(Clock::Own(topic.fields.header_stamp().unwrap_or_default()));
    };
    Ok(match time.path.as_str() {
        "received" => Clock::Received,
        "published" => Clock::Published,
        path => match (topic.fields.locate(path), time.step) {
            (Ok(locator), step) => {
                let step = step.or_else(|| unit_of_time(&topic.fields, &locator));
                Clock::Field(locator, step)
            }
            (Err(_), step) if path == "row" => Clock::Row(step.unwrap_or(Span::from_millis(1_000))),
            (Err(problem), _) => return Err(problem),
        },
    })
}

/// The unit of time in a column's header.
fn unit_of_time(fields: &Fields, locator: &Locator) -> Option<Span> {
    let (Fields::Named(fields), Locator::Named(at, _)) = (fields, locator) else { return None };
    let field = fields.get(*at)?;
    stamp::unit_of(&field.name).or_else(|| time_unit(field.unit.as_deref()?))
}

impl<'a> Extraction<'a, '_> {
    /// Notes that the field of a signal is missing in a topic, or that several fields fit.
    fn unlocated(&mut self, want: &Want<'_>, topic: &Topic<'_>, field: &str, wrong: Unlocated) {
        let file = self.file.clone();
        let signal = want.signal.to_owned();
        let is_any = self.naming == Naming::File && want.source.file.is_none();
        let names = || match &topic.fields {
            Fields::Named(fields) => fields.iter().map(|field| field.name.clone()).collect(),
            _ => Vec::new(),
        };
        let clock = want.source.time.as_ref().filter(|time| {
            let is_field = !["received", "published", "row"].contains(&time.path.as_str());
            is_field && topic.fields.locate(&time.path).is_err() && topic.fields.locate(field).is_ok()
        });
        let error = match (&wrong.choices[..], clock, self.naming) {
            ([_, ..], ..) => RecordingError::AmbiguousColumn {
                file,
                signal,
                column: field.to_owned(),
                columns: wrong.choices.clone(),
            },
            (_, Some(clock), Naming::File) => RecordingError::NoTime {
                file,
                problem: format!("signal {signal}: no time column '{}'", clock.path),
                columns: names(),
            },
            _ if is_any => return names().iter().for_each(|name| self.gathered.know(name)),
            _ if self.naming == Naming::File => {
                let problem = wrong.problem.replacen("no field", "no column", 1);
                return self.gathered.absent(want, &problem);
            }
            _ => return self.gathered.absent(want, &format!("topic {}: {}", topic.full, wrong.problem)),
        };
        self.error.get_or_insert(error);
    }
}

impl Listener for Extraction<'_, '_> {
    fn file(&self) -> &Path {
        &self.file
    }

    fn topic(&mut self, topic: Topic<'_>) -> TopicId {
        for name in [topic.name, topic.full] {
            self.gathered.know(name);
        }
        let mut extracts = Vec::new();
        let wants = self.wants;
        for want in wants {
            if !is_meant(want, &topic, &self.file, self.naming) {
                continue;
            }
            let field = match self.naming {
                Naming::Topic => want.source.in_bag().1,
                Naming::File => &want.source.field,
                Naming::Signal => "value",
            };
            match extract(want, &topic, field, self.naming) {
                Ok(extract) => {
                    let choices = self.choices.entry(want.index).or_default();
                    let choice = topic.choice();
                    if !choices.contains(&choice) {
                        choices.push(choice);
                    }
                    let part = match self.naming {
                        Naming::Topic => format!("{}#{field}", topic.full),
                        Naming::File => extract.oddities.field.clone(),
                        Naming::Signal => topic.name.to_owned(),
                    };
                    if self.naming == Naming::Signal {
                        self.gathered.believe(want.index);
                    }
                    self.gathered.found_in(want.index, &part);
                    extracts.push(extract);
                }
                Err(wrong) => self.unlocated(want, &topic, field, wrong),
            }
        }
        let is_json = matches!(topic.fields, Fields::Json) && !extracts.is_empty();
        let mut members = is_json.then(Members::default);
        if let Some(members) = &mut members {
            extracts.iter_mut().for_each(|extract| extract.join(members));
        }
        self.topics.push(Reported { extracts, members });
        TopicId(self.topics.len() - 1)
    }

    fn is_wanted(&self, topic: TopicId) -> bool {
        self.topics.get(topic.0).is_some_and(|topic| !topic.extracts.is_empty())
    }

    fn is_field_wanted(&self, topic: TopicId, field: usize) -> bool {
        let is_it = |locator: &Locator| matches!(locator, Locator::Named(at, _) if *at == field);
        let reads = |extract: &Extract<'_>| {
            let clock = match &extract.clock {
                Clock::Field(locator, _) => is_it(locator),
                _ => false,
            };
            clock || is_it(&extract.value) || extract.conditions.iter().any(|(locator, _)| is_it(locator))
        };
        self.topics.get(topic.0).is_some_and(|topic| topic.extracts.iter().any(reads))
    }

    fn needs_time(&self, topic: TopicId) -> bool {
        let is_own = |clock: &Clock| !matches!(clock, Clock::Field(..) | Clock::Row(_));
        self.topics.get(topic.0).is_some_and(|topic| topic.extracts.iter().any(|it| is_own(&it.clock)))
    }

    fn message(&mut self, topic: TopicId, times: Times, body: Body<'_>) {
        let Some(Reported { extracts, members }) = self.topics.get_mut(topic.0) else { return };
        let body = match (members, body) {
            (Some(members), Body::Bytes(bytes)) => Body::Members(members.find(bytes)),
            (_, body) => body,
        };
        for extract in extracts {
            extract.deliver(times, body, self.naming, self.gathered);
        }
    }

    fn damaged(&mut self, place: Place, problem: String) {
        self.gathered.damaged(place, problem);
    }

    fn note(&mut self, place: Place, what: String) {
        self.gathered.warn(place, what);
    }
}

impl Extract<'_> {
    /// Has the fields of a JSON value found in one pass.
    fn join(&mut self, members: &mut Members) {
        self.value.join(members);
        self.conditions.iter_mut().for_each(|(locator, _)| locator.join(members));
        match &mut self.clock {
            Clock::Own(locators) => locators.iter_mut().for_each(|locator| locator.join(members)),
            Clock::Field(locator, _) => locator.join(members),
            Clock::Received | Clock::Published | Clock::Row(_) => {}
        }
    }

    fn deliver(&mut self, times: Times, body: Body<'_>, naming: Naming, gathered: &mut Gathered) {
        let row = self.count;
        self.count += 1;
        let mut chosen = None;
        for (locator, asked) in &self.conditions {
            let Some(found) = locator.find(body, asked) else { return };
            chosen = found.or(chosen);
        }
        let Some(value) = self.value.value(body, chosen) else {
            if naming == Naming::File {
                self.oddities.see(self.value.text(body));
            }
            return gathered.missing(self.want.index);
        };
        let stamp = self.clock.stamp(times, body, row);
        // In a table the time that the source names is the only one.
        let own = stamp.filter(|_| naming == Naming::File);
        if own.is_none() && naming == Naming::File && matches!(self.clock, Clock::Field(..)) {
            return gathered.missing(self.want.index);
        }
        let received = own.unwrap_or(times.received);
        gathered.sample(self.want.index, stamp.unwrap_or(received), received, value);
    }
}

impl Oddities {
    /// Counts a cell that is no number; `None` is an empty cell.
    fn see(&mut self, text: Option<String>) {
        match text {
            None => self.empty += 1,
            Some(text) => {
                self.not_numbers += 1;
                self.first.get_or_insert_with(|| text.chars().take(40).collect());
            }
        }
    }
}

impl Clock {
    fn stamp(&self, times: Times, body: Body<'_>, row: i64) -> Option<Time> {
        match self {
            Clock::Received => None,
            Clock::Published => times.published,
            Clock::Own(locators) => {
                let own = || locators.iter().find_map(|locator| locator.stamp(body, None));
                times.stamp.filter(|stamp| stamp.0 != 0).or_else(own)
            }
            Clock::Field(locator, step) => locator.stamp(body, *step),
            Clock::Row(step) => Some(Time(step.0.saturating_mul(row))),
        }
    }
}
