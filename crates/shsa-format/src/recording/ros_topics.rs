//! From the messages of a bag to samples: which topics and fields are wanted, and when they were stamped.

use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::path::Path;

use shsa_core::time::{Span, Time};
use shsa_message::MessageError;
use shsa_message::path::Path as FieldPath;
use shsa_message::ros::{Body, Count, Layout, Plan, Target, Types, chosen};

use super::gathered::Gathered;
use super::rosbag::{Event, walk};
use super::{Place, RecordingError, TopicInfo, Want, mean_rate, names, unreadable};

/// One wanted field of a connection's messages.
struct Extract<'a> {
    want: &'a Want<'a>,
    value: Plan,
    stamp: Option<(Plan, Span)>,
    filters: Vec<(Plan, String)>,
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
        let messages = Messages { kind, types: Types::of_bag(kind, definition) };
        match Extract::of(want, &messages) {
            Ok(extract) => {
                gathered.found_in(want.index, &format!("{topic}#{}", want.source.in_bag().1));
                extracts.push(extract);
            }
            Err(problem) => gathered.absent(want, &format!("topic {topic}: {problem}")),
        }
    }
    extracts
}

/// What is known of a connection's messages.
struct Messages<'a> {
    kind: &'a str,
    types: Types,
}

impl Messages<'_> {
    fn plan(&self, path: &str) -> Result<Plan, String> {
        let path = FieldPath::parse(path);
        path.and_then(|path| Plan::new(&self.types, Layout::Packed, self.kind, &path.steps)).map_err(said)
    }

    fn header_stamp(&self) -> Option<Plan> {
        let path = self.types.header_stamp(self.kind)?;
        Plan::new(&self.types, Layout::Packed, self.kind, &path).ok()
    }
}

/// What is wrong with a field, with what a bag has instead.
fn said(problem: MessageError) -> String {
    match problem {
        MessageError::NoIndex { index, name, .. } => {
            format!("'[{index}]' is no index; write it like {name}[0]")
        }
        MessageError::UnknownType { name, .. } => format!("the type {name} is not defined in the bag"),
        MessageError::UnknownField { name, owner, known } => {
            let hint = names::hint(&name, known.iter().map(String::as_str));
            format!("no field '{name}' in {owner}{hint}")
        }
        other => other.to_string(),
    }
}

impl<'a> Extract<'a> {
    fn of(want: &'a Want<'a>, messages: &Messages<'_>) -> Result<Extract<'a>, String> {
        let field = want.source.in_bag().1;
        let value = messages.plan(field)?;
        if !matches!(value.target, Target::Primitive(_) | Target::Time) {
            return Err(format!("'{field}' is neither a number nor a list of numbers"));
        }
        let stamp = match &want.source.time {
            Some(time) if time.path == "received" => None,
            Some(time) => Some((messages.plan(&time.path)?, time.step.unwrap_or(Span::from_millis(1000)))),
            None => messages.header_stamp().map(|plan| (plan, Span::ZERO)),
        };
        let filter = |(field, value): &(String, String)| match messages.plan(field)? {
            plan if is_comparable(&plan) => Ok((plan, value.clone())),
            _ => Err(format!("'{field}' is no number and no text: nothing can be compared with it")),
        };
        let filters = want.source.filters.iter().map(filter).collect::<Result<_, String>>()?;
        Ok(Extract { want, value, stamp, filters })
    }

    fn deliver(&self, received: Time, message: &[u8], gathered: &mut Gathered) {
        let body = Body::packed(message);
        let Some(element) = chosen(&self.filters, body) else { return };
        let Some(value) = self.value.value(body, element) else { return gathered.missing(self.want.index) };
        let stamp = self.stamp.as_ref().and_then(|(plan, step)| plan.stamp(body, *step));
        gathered.sample(self.want.index, stamp.unwrap_or(received), received, value);
    }
}

/// Whether a field is a number, a text, or a list of texts.
fn is_comparable(plan: &Plan) -> bool {
    match plan.target {
        Target::Primitive(_) | Target::Time => plan.count == Count::One,
        Target::Text => true,
        Target::Message => false,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_bag_does_not_have_is_said() {
        #[track_caller]
        fn check(definition: &str, path: &str, expected: &str) {
            let types = Types::of_bag("other/Flag", definition);
            assert_eq!(Messages { kind: "other/Flag", types }.plan(path).unwrap_err(), expected);
        }
        check("bool set", "sett", "no field 'sett' in other/Flag; did you mean 'set'? (there is: set)");
        check("float32[] ranges", "ranges[x]", "'[x]' is no index; write it like ranges[0]");
        check("B b\nint8 last", "last", "the type other/B is not defined in the bag");
    }
}
