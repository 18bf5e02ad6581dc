//! From messages to samples: which topics and fields are wanted, and which stamp counts.

use super::extract::{Extract, Message, Naming, Oddities, conditions_of};
use super::fields::{Locator, Unlocated};
use super::files::without_packing;
use super::gathered::{Gathered, Numbers};
use super::members::Members;
use super::topic::{Body, Fields, Listener, Row, Rows, Times, Topic, TopicId};
use super::{Place, RecordingError, Want, names};
use shsa_core::time::Time;
use shsa_message::path::is_text;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The most reasons why topics do not have signals that are kept.
const ABSENT_MAX: usize = 1 << 10;

/// Extracts the wanted signals from the messages of one file.
pub(super) struct Extraction<'a, 'g> {
    wants: &'a [Want<'a>],
    gathered: &'g mut Gathered,
    file: PathBuf,
    naming: Naming,
    topics: Vec<Reported<'a>>,
    /// For each wanted signal the topics that its source fits; more than one are an error.
    choices: BTreeMap<usize, Vec<String>>,
    /// For wanted signals, why topics that their sources fit do not have them; others may come that do.
    absent: Vec<(usize, String)>,
    /// Why the file cannot be read as requested.
    error: Option<RecordingError>,
}

/// A reported topic.
struct Reported<'a> {
    extracts: Vec<Extract<'a>>,
    /// The places of the stamp in its messages, the best first; none where no signal takes it.
    stamps: Vec<Locator>,
    /// The members of its messages that are looked for, where these are JSON.
    members: Option<Members>,
}

impl<'a> Reported<'a> {
    fn new(topic: &Topic<'_>, mut extracts: Vec<Extract<'a>>, naming: Naming) -> Reported<'a> {
        let has_stamp = naming != Naming::Signal && extracts.iter().any(Extract::takes_own_stamp);
        let mut stamps = if has_stamp { topic.fields.header_stamp().unwrap_or_default() } else { Vec::new() };
        let is_json = matches!(topic.fields, Fields::Json) && !extracts.is_empty();
        let mut members = is_json.then(Members::default);
        if let Some(members) = &mut members {
            extracts.iter_mut().for_each(|extract| extract.join(members));
            stamps.iter_mut().for_each(|stamp| stamp.join(members));
        }
        Reported { extracts, stamps, members }
    }
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
        Extraction { wants, gathered, file, naming, topics, choices, absent: Vec::new(), error: None }
    }

    /// Ends the file.
    ///
    /// # Errors
    /// When a source fits several topics of the file.
    pub(super) fn finish(self) -> Result<(), RecordingError> {
        if let Some(error) = self.error {
            return Err(error);
        }
        for (index, reason) in &self.absent {
            let want = self.wants.iter().find(|want| want.index == *index);
            let want = want.filter(|_| !self.choices.contains_key(index));
            want.into_iter().for_each(|want| self.gathered.absent(want, reason));
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
        |(name, asked): &(String, String)| topic.tag(name).is_none_or(|value| is_text(value, asked));
    is_named && conditions_of(want, naming).iter().all(is_tagged)
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
                return self.lack(want, problem);
            }
            _ => return self.lack(want, format!("topic {}: {}", topic.full, wrong.problem)),
        };
        self.error.get_or_insert(error);
    }
}

impl Extraction<'_, '_> {
    /// Notes why a topic does not have a signal.
    fn lack(&mut self, want: &Want<'_>, reason: String) {
        let lacking = (want.index, reason);
        if !self.absent.contains(&lacking) && self.absent.len() < ABSENT_MAX {
            self.absent.push(lacking);
        }
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
            match Extract::new(want, &topic, field, self.naming) {
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
        self.topics.push(Reported::new(&topic, extracts, self.naming));
        TopicId(self.topics.len() - 1)
    }

    fn is_wanted(&self, topic: TopicId) -> bool {
        self.topics.get(topic.0).is_some_and(|topic| !topic.extracts.is_empty())
    }

    fn is_field_wanted(&self, topic: TopicId, field: usize) -> bool {
        self.topics.get(topic.0).is_some_and(|topic| topic.extracts.iter().any(|it| it.reads(field)))
    }

    fn needs_time(&self, topic: TopicId) -> bool {
        self.topics.get(topic.0).is_some_and(|topic| topic.extracts.iter().any(Extract::needs_time))
    }

    fn message(&mut self, topic: TopicId, times: Times, body: Body<'_>) {
        let Some(Reported { extracts, stamps, members }) = self.topics.get_mut(topic.0) else { return };
        let body = match (members, body) {
            (Some(members), Body::Bytes(bytes)) => Body::Members(members.find(bytes)),
            (_, body) => body,
        };
        // All signals of a message have the same stamp, which is looked for once.
        let in_header = || stamps.iter().find_map(|stamp| stamp.stamp(body, None));
        let own = times.stamp.filter(|stamp| stamp.0 != 0).or_else(in_header);
        for extract in extracts {
            extract.deliver(Message { times, own, body }, self.gathered);
        }
    }

    fn rows(&mut self, topic: TopicId, times: &[Time], rows: &dyn Rows) {
        let Some(Reported { extracts, .. }) = self.topics.get_mut(topic.0) else { return };
        for extract in &mut *extracts {
            let Some(column) = extract.column() else { return self.each_row(topic, times, rows) };
            extract.load(rows, column);
        }
        // Rows with a number for each signal are taken together, the others one by one.
        let mut at = 0;
        while let Some(Reported { extracts, .. }) = self.topics.get(topic.0) {
            let (from, rest) = (at, times.get(at..).unwrap_or_default());
            let columns: Vec<Numbers<'_>> = extracts.iter().map(|extract| extract.loaded(from)).collect();
            let has_number =
                |row: usize| move |(_, numbers): &Numbers<'_>| matches!(numbers.get(row), Some(Some(_)));
            let whole = (0..rest.len()).take_while(|row| columns.iter().all(has_number(*row))).count();
            self.gathered.rows(rest.get(..whole).unwrap_or_default(), &columns);
            let Some(time) = rest.get(whole) else { return };
            at += whole;
            self.message(topic, Times::at(*time), Body::Columns(&Row { rows, at }));
            at += 1;
        }
    }

    fn damaged(&mut self, place: Place, problem: String) {
        self.gathered.damaged(place, problem);
    }

    fn note(&mut self, place: Place, what: String) {
        self.gathered.warn(place, what);
    }
}
