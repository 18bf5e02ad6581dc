//! From the messages of a bag to samples: which topics and fields are wanted, and when they were stamped.

use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::path::Path;

use shsa_core::time::{Span, Time};
use shsa_message::path::is_text;

use super::gathered::Gathered;
use super::ros_message::{Definition, Plan, Taken};
use super::rosbag::{Event, walk};
use super::{Place, RawValue, RecordingError, TopicInfo, Want, mean_rate, names, unreadable};

/// One wanted field of a connection's messages.
struct Extract<'a> {
    want: &'a Want<'a>,
    value: Plan,
    stamp: Option<(Plan, Span)>,
    filters: Vec<(Plan, &'a str)>,
}

/// Reads the signals that ask for a topic of this bag.
pub(super) fn read(input: impl Read + Seek, wants: &[Want<'_>], gathered: &mut Gathered) {
    let mut connections: BTreeMap<u32, Vec<Extract<'_>>> = BTreeMap::new();
    let walked = walk(input, &mut |event| match event {
        Event::Connection { id, topic, kind, definition } => {
            connections.entry(id).or_insert_with(|| extracts(topic, kind, definition, wants, gathered));
        }
        Event::Message { connection, time_ns, data } => {
            for extract in connections.get(&connection).into_iter().flatten() {
                extract.deliver(Time(time_ns), data, gathered);
            }
        }
        Event::Damage { offset, problem } => gathered.damaged(Place::Offset(offset), problem),
    });
    if let Err(failure) = walked {
        gathered.damaged(Place::Whole, format!("reading stopped: {failure}"));
    }
}

/// What is wanted of a topic; a field that its messages do not have is said and passed over.
fn extracts<'a>(
    topic: &str,
    kind: &str,
    definition: &str,
    wants: &'a [Want<'a>],
    gathered: &mut Gathered,
) -> Vec<Extract<'a>> {
    gathered.know(topic);
    let is_asked = |want: &&Want<'_>| names::bare(want.source.in_bag().0) == names::bare(topic);
    let mut extracts = Vec::new();
    for want in wants.iter().filter(is_asked) {
        match Extract::of(want, &Definition::parse(kind, definition)) {
            Ok(extract) => {
                gathered.found_in(want.index, &format!("{topic}#{}", want.source.in_bag().1));
                extracts.push(extract);
            }
            Err(problem) => gathered.absent(want, &format!("topic {topic}: {problem}")),
        }
    }
    extracts
}

impl<'a> Extract<'a> {
    fn of(want: &'a Want<'a>, definition: &Definition) -> Result<Extract<'a>, String> {
        let field = want.source.in_bag().1;
        let value = definition.plan(field)?;
        if !value.is_numeric() {
            return Err(format!("'{field}' is neither a number nor a list of numbers"));
        }
        let stamp = match &want.source.time {
            Some(time) if time.path == "received" => None,
            Some(time) => Some((definition.plan(&time.path)?, time.step.unwrap_or(Span::from_millis(1000)))),
            None if definition.has_header() => Some((definition.plan("header.stamp")?, Span::ZERO)),
            None => None,
        };
        let filter = |(field, value): &'a (String, String)| match definition.plan(field)? {
            plan if plan.is_comparable() => Ok((plan, value.as_str())),
            _ => Err(format!("'{field}' is no number and no text: nothing can be compared with it")),
        };
        let filters = want.source.filters.iter().map(filter).collect::<Result<_, String>>()?;
        Ok(Extract { want, value, stamp, filters })
    }

    fn deliver(&self, received: Time, message: &[u8], gathered: &mut Gathered) {
        let Some(element) = self.filtered(message) else { return };
        let value = match (self.value.run(message), element) {
            (Some(Taken::Number(value)), None) => RawValue::Number(value),
            (Some(Taken::Time(time)), None) => RawValue::Number(Time(time).seconds()),
            (Some(Taken::Vector(values)), None) => RawValue::Vector(values),
            (Some(Taken::Vector(values)), Some(index)) if index < values.len() => {
                RawValue::Number(values[index])
            }
            _ => return gathered.missing(self.want.index),
        };
        let stamp = self.stamp(message).filter(|stamp| stamp.0 != 0).unwrap_or(received);
        gathered.sample(self.want.index, stamp, received, value);
    }

    /// `None`: the message does not pass the filters. A filter on a list of texts selects the element of the value
    /// that stands where its text stands in the list: `position[name=left]`.
    fn filtered(&self, message: &[u8]) -> Option<Option<usize>> {
        let mut element = None;
        for (plan, asked) in &self.filters {
            match plan.run(message)? {
                Taken::Texts(texts) => element = Some(texts.iter().position(|text| text == asked)?),
                taken => is_taken(&taken, asked).then_some(())?,
            }
        }
        Some(element)
    }

    /// The message's own stamp; zero means that nobody stamped it.
    fn stamp(&self, message: &[u8]) -> Option<Time> {
        let (plan, step) = self.stamp.as_ref()?;
        match plan.run(message)? {
            Taken::Time(time) => Some(Time(time)),
            Taken::Number(steps) => Some(Time::from_seconds(steps * step.seconds())),
            _ => None,
        }
    }
}

fn is_taken(taken: &Taken, asked: &str) -> bool {
    match taken {
        Taken::Text(text) => is_text(text, asked),
        Taken::Number(value) => is_text(&value.to_string(), asked),
        _ => false,
    }
}

/// Every topic of a bag by name, with its type.
pub(super) fn topics(input: impl Read + Seek, file: &Path) -> Result<Vec<TopicInfo>, RecordingError> {
    let mut names: BTreeMap<u32, (String, String)> = BTreeMap::new();
    let mut counts: BTreeMap<u32, (usize, Time, Time)> = BTreeMap::new();
    walk(input, &mut |event| match event {
        Event::Connection { id, topic, kind, .. } => {
            names.entry(id).or_insert_with(|| (topic.to_owned(), kind.to_owned()));
        }
        Event::Message { connection, time_ns, .. } => {
            let time = Time(time_ns);
            let (count, from, to) = counts.entry(connection).or_insert((0, time, time));
            *count += 1;
            *from = time.min(*from);
            *to = time.max(*to);
        }
        Event::Damage { .. } => {}
    })
    .map_err(|reason| unreadable(file, reason))?;
    let mut topics: BTreeMap<(String, String), (usize, Time, Time)> = BTreeMap::new();
    for (id, topic) in names {
        let (count, from, to) = counts.get(&id).copied().unwrap_or((0, Time::MAX, Time::MIN));
        let sum = topics.entry(topic).or_insert((0, Time::MAX, Time::MIN));
        *sum = (sum.0 + count, sum.1.min(from), sum.2.max(to));
    }
    let info = |((name, kind), (count, from, to)): ((String, String), (usize, Time, Time))| TopicInfo {
        name,
        kind,
        count,
        rate_hz: mean_rate(count, from, to),
    };
    Ok(topics.into_iter().map(info).collect())
}
