//! One wanted field of a topic: from a message, or from rows of a table, to samples.

use super::fields::{Locator, Unlocated};
use super::gathered::{Gathered, Numbers};
use super::members::Members;
use super::topic::{Body, Fields, Rows, Times, Topic};
use super::{Want, stamp};
use shsa_core::time::{Span, Time};
use shsa_message::span::time_unit;

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
pub(super) struct Extract<'a> {
    want: &'a Want<'a>,
    naming: Naming,
    value: Locator,
    clock: Clock,
    conditions: Vec<(Locator, &'a str)>,
    /// The number of messages so far.
    count: i64,
    pub(super) oddities: Oddities,
    /// The numbers of the field in the current rows.
    numbers: Vec<Option<f64>>,
}

/// Cells of a table that are no numbers.
#[derive(Default)]
pub(super) struct Oddities {
    /// The field.
    pub(super) field: String,
    pub(super) empty: usize,
    pub(super) not_numbers: usize,
    pub(super) first: Option<String>,
}

/// The clock that stamps a message.
enum Clock {
    Received,
    Published,
    /// The stamp of the message itself, else the time of reception.
    Own,
    /// A field, with the length of one step.
    Field(Locator, Option<Span>),
    /// The number of the message, with the length of one step.
    Row(Span),
}

/// A message with its times.
#[derive(Clone, Copy)]
pub(super) struct Message<'a> {
    pub(super) times: Times,
    /// The stamp of the message itself: that of the format, else that in its header.
    pub(super) own: Option<Time>,
    pub(super) body: Body<'a>,
}

impl<'a> Extract<'a> {
    /// The extraction of a signal from a topic.
    ///
    /// # Errors
    /// The problem, where the field or the signal's own time is missing.
    pub(super) fn new(
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
        for (name, asked) in conditions_of(want, naming).iter().filter(|(name, _)| topic.tag(name).is_none())
        {
            let locator = topic.fields.locate(name)?;
            if !locator.can_be_compared() {
                return Err(
                    format!("'{name}' is no number and no text: nothing can be compared with it").into()
                );
            }
            conditions.push((locator, asked.as_str()));
        }
        let clock = if naming == Naming::Signal { Clock::Own } else { Clock::of(want, topic)? };
        let field = match (&topic.fields, &value) {
            (Fields::Named(fields), Locator::Named(at, _)) => fields.get(*at).map(|field| field.name.clone()),
            _ => None,
        };
        let oddities = Oddities { field: field.unwrap_or_default(), ..Oddities::default() };
        Ok(Extract { want, naming, value, clock, conditions, count: 0, oddities, numbers: Vec::new() })
    }

    /// Has the fields of a JSON value found in one pass.
    pub(super) fn join(&mut self, members: &mut Members) {
        self.value.join(members);
        self.conditions.iter_mut().for_each(|(locator, _)| locator.join(members));
        match &mut self.clock {
            Clock::Field(locator, _) => locator.join(members),
            Clock::Own | Clock::Received | Clock::Published | Clock::Row(_) => {}
        }
    }

    /// Whether the stamp of the message itself counts.
    pub(super) fn takes_own_stamp(&self) -> bool {
        matches!(self.clock, Clock::Own)
    }

    /// Whether the time of reception matters.
    pub(super) fn needs_time(&self) -> bool {
        !matches!(self.clock, Clock::Field(..) | Clock::Row(_))
    }

    /// Whether the named field of this index is read.
    pub(super) fn reads(&self, field: usize) -> bool {
        let is_it = |locator: &Locator| matches!(locator, Locator::Named(at, _) if *at == field);
        let is_clock = match &self.clock {
            Clock::Field(locator, _) => is_it(locator),
            _ => false,
        };
        is_clock || is_it(&self.value) || self.conditions.iter().any(|(locator, _)| is_it(locator))
    }

    /// Gives the sample of a message, if it has one.
    pub(super) fn deliver(&mut self, message: Message<'_>, gathered: &mut Gathered) {
        let Message { times, own, body } = message;
        let row = self.count;
        self.count += 1;
        let mut chosen = None;
        for (locator, asked) in &self.conditions {
            let Some(found) = locator.find(body, asked) else { return };
            chosen = found.or(chosen);
        }
        let Some(value) = self.value.value(body, chosen) else {
            if self.naming == Naming::File {
                self.oddities.see(self.value.text(body));
            }
            return gathered.missing(self.want.index);
        };
        let stamp = match &self.clock {
            Clock::Received => None,
            Clock::Published => times.published,
            Clock::Own => own,
            Clock::Field(locator, step) => locator.stamp(body, *step),
            Clock::Row(step) => Some(Time(step.0.saturating_mul(row))),
        };
        // In a table the time that the source names is the only one.
        let own = stamp.filter(|_| self.naming == Naming::File);
        if own.is_none() && self.naming == Naming::File && matches!(self.clock, Clock::Field(..)) {
            return gathered.missing(self.want.index);
        }
        let received = own.unwrap_or(times.received);
        gathered.sample(self.want.index, stamp.unwrap_or(received), received, value);
    }

    /// The column, where each row gives its number in it at the row's time.
    pub(super) fn column(&self) -> Option<usize> {
        match (&self.value, &self.clock) {
            (Locator::Named(column, None), Clock::Own | Clock::Received | Clock::Published) => {
                self.conditions.is_empty().then_some(*column)
            }
            _ => None,
        }
    }

    /// Takes the numbers of a column in these rows.
    pub(super) fn load(&mut self, rows: &dyn Rows, column: usize) {
        self.numbers.clear();
        rows.numbers(column, &mut self.numbers);
    }

    /// The signal, and its numbers in the rows from this one on.
    pub(super) fn loaded(&self, from: usize) -> Numbers<'_> {
        (self.want.index, self.numbers.get(from..).unwrap_or_default())
    }
}

/// The filters of a source; none for a signal that is named as a whole.
pub(super) fn conditions_of<'w>(want: &'w Want<'_>, naming: Naming) -> &'w [(String, String)] {
    if naming == Naming::Signal { &[] } else { &want.source.filters }
}

impl Clock {
    /// The clock that a source names.
    fn of(want: &Want<'_>, topic: &Topic<'_>) -> Result<Clock, Unlocated> {
        let Some(time) = &want.source.time else { return Ok(Clock::Own) };
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
}

/// The unit of time in a column's header.
fn unit_of_time(fields: &Fields, locator: &Locator) -> Option<Span> {
    let (Fields::Named(fields), Locator::Named(at, _)) = (fields, locator) else { return None };
    let field = fields.get(*at)?;
    stamp::unit_of(&field.name).or_else(|| time_unit(field.unit.as_deref()?))
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
