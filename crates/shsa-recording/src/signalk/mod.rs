//! Signal K: deltas, one JSON object per line, as its servers log them, or over several lines.
//!
//! Format: <https://signalk.org/specification/1.7.0/doc/data_model.html>. A topic is a path (`navigation.speedOverGround`), its
//! body the value. The tag `source` names the sender, and `context` the vessel, as other vessels report, too. The stamp is the
//! time of the update. The reception is the time that a logger has noted before the line, else the stamp. An update without a
//! time takes that of the one before.

mod delta;
mod joined;

use super::lines::{self, Lines};
use super::topic::{Body, Fields, Input, Listener, Times, Topic, TopicId};
use super::{Place, RecordingError};
use delta::{Delta, Entry, Update};
use joined::{Deltas, Joined, Text};
use shsa_core::time::Time;
use shsa_message::json::{Broken, unescaped};
use shsa_message::stamp;
use std::collections::BTreeMap;
use std::io::SeekFrom;

/// The most topics: paths, sources and contexts.
const TOPICS_MAX: usize = 1 << 14;

/// Whether a text begins as these logs do.
pub(super) fn is_log(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let first = lines::of(&text).next().unwrap_or_default();
    // A delta over several lines.
    let first = if first == "{" { &text } else { first };
    let has = |name: &str| first.contains(&format!("\"{name}\""));
    // A server sends a greeting before its first delta.
    let is_greeting = has("roles") && has("version") && has("self");
    noted(first).1.starts_with('{') && (has("updates") && (has("values") || has("context")) || is_greeting)
}

/// Reads all values.
pub(super) fn read(input: &mut dyn Input, listener: &mut dyn Listener) -> Result<(), RecordingError> {
    let first = first_time(input);
    if let Err(failure) = input.seek(SeekFrom::Start(0)) {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
        return Ok(());
    }
    let reader = Reader { last: first, ..Reader::default() };
    let (mut lines, mut joined) = (Lines::new(input), Joined::default());
    let mut reading = Reading { reader, delta: Delta::default(), listener };
    while let Some(line) = lines.next(reading.listener) {
        if let Some(text) = Text::of(line) {
            joined.take(text, &mut reading);
        }
    }
    joined.let_go(&mut reading);
    let Reading { reader, listener, .. } = reading;
    reader.finish(listener);
    Ok(())
}

/// Reports deltas.
struct Reading<'a> {
    reader: Reader,
    delta: Delta,
    listener: &'a mut dyn Listener,
}

impl Deltas for Reading<'_> {
    fn read(&mut self, line: &Text) -> Result<(), Broken> {
        let (noted, text) = noted(&line.text);
        self.delta.read(text)?;
        self.reader.report(&self.delta, text, noted, self.listener);
        Ok(())
    }

    fn lose(&mut self, line: &Text, broken: Broken) {
        let text = noted(&line.text).1;
        let column = broken.at + 1 + line.text.len() - text.len();
        let problem = match line.is_ended {
            true => format!("no JSON at column {column}: expected {}; line left out", broken.expected),
            false => "the file ends within this line; line left out".into(),
        };
        self.listener.damaged(Place::Line(line.number), problem);
    }
}

/// The time before a line, `1471172400153;A;{..`, and the rest of the line.
fn noted(line: &str) -> (Option<Time>, &str) {
    let line = line.trim();
    if line.starts_with('{') {
        return (None, line);
    }
    let Some(begin) = line.find('{').filter(|begin| (1..64).contains(begin)) else { return (None, line) };
    let (before, text) = line.split_at(begin);
    let time = before.split(';').next().and_then(|first| stamp::text(first.trim(), None));
    (time.map(|(time, _)| time), text)
}

/// The first time in the recording, which values before it take, too.
fn first_time(input: &mut dyn Input) -> Option<Time> {
    let (mut lines, mut joined, mut first) = (Lines::new(input), Joined::default(), First::default());
    while let Some(line) = lines.read() {
        if let Some(text) = line.ok().and_then(Text::of) {
            joined.take(text, &mut first);
        }
        if first.time.is_some() {
            return first.time;
        }
    }
    joined.let_go(&mut first);
    first.time
}

/// The first time that is found in deltas.
#[derive(Default)]
struct First {
    time: Option<Time>,
    delta: Delta,
    stamps: Stamps,
}

impl First {
    fn see(&mut self, found: Option<Time>) {
        self.time = self.time.or(found);
    }
}

impl Deltas for First {
    fn read(&mut self, line: &Text) -> Result<(), Broken> {
        let (noted, text) = noted(&line.text);
        self.delta.read(text)?;
        let stamp = self.delta.updates.iter().find_map(|update| self.stamps.of(update, text));
        self.see(noted.or(stamp));
        Ok(())
    }

    fn lose(&mut self, line: &Text, _broken: Broken) {
        self.see(noted(&line.text).0);
    }
}

/// The times of updates. Many in a row have the same, whose text is parsed once.
#[derive(Default)]
struct Stamps {
    text: String,
    time: Option<Time>,
}

impl Stamps {
    /// The time of an update in a line.
    fn of(&mut self, update: &Update, line: &str) -> Option<Time> {
        let text = update.timestamp?.of(line);
        if text != self.text {
            self.time = stamp::text(text, None).map(|(time, _)| time);
            self.text.clear();
            self.text.push_str(text);
        }
        self.time
    }
}

/// What the updates of a line share.
#[derive(Clone, Copy)]
struct Shared<'a> {
    line: &'a str,
    context: &'a str,
    /// The time that a logger has noted before the line.
    noted: Option<Time>,
}

#[derive(Default)]
struct Reader {
    last: Option<Time>,
    stamps: Stamps,
    /// By context, path and source.
    topics: BTreeMap<String, BTreeMap<String, BTreeMap<String, TopicId>>>,
    count: usize,
    /// The number of updates without a time.
    untimed: u64,
    /// The number of values without a path, and of paths without a value.
    incomplete: u64,
    /// The number of lines that are no deltas.
    other: u64,
    /// The number of values that were left out: beyond the most topics, or without any time.
    left_out: u64,
}

impl Reader {
    /// Reports the updates of a line.
    fn report(&mut self, delta: &Delta, line: &str, noted: Option<Time>, listener: &mut dyn Listener) {
        self.other += u64::from(delta.updates.is_empty());
        let context = delta.context.map_or("vessels.self".into(), |context| unescaped(context.of(line)));
        for update in &delta.updates {
            let shared = Shared { line, context: &context, noted };
            self.report_update(update, delta.entries(update), shared, listener);
        }
    }

    fn report_update(
        &mut self,
        update: &Update,
        entries: &[Entry],
        shared: Shared<'_>,
        listener: &mut dyn Listener,
    ) {
        let Shared { line, context, noted } = shared;
        let stamp = self.stamps.of(update, line);
        self.untimed += u64::from(stamp.is_none() && noted.is_none());
        self.incomplete += update.incomplete as u64;
        let Some(received) = noted.or(stamp).or(self.last) else {
            self.left_out += entries.len() as u64;
            return;
        };
        self.last = Some(received);
        let times = Times { received, published: None, stamp: stamp.filter(|_| noted.is_some()) };
        let source = update.source.map_or("".into(), |source| unescaped(source.of(line)));
        for entry in entries {
            let Some(topic) = self.topic(&unescaped(entry.path.of(line)), &source, context, listener) else {
                self.left_out += 1;
                continue;
            };
            if listener.is_wanted(topic) {
                listener.message(topic, times, Body::Bytes(entry.value(line).as_bytes()));
            }
        }
    }

    fn topic(
        &mut self,
        path: &str,
        source: &str,
        context: &str,
        listener: &mut dyn Listener,
    ) -> Option<TopicId> {
        let known = self.topics.get(context).and_then(|paths| paths.get(path)?.get(source));
        if let Some(known) = known {
            return Some(*known);
        }
        if self.count == TOPICS_MAX {
            return None;
        }
        self.count += 1;
        let tags = [("source", source), ("context", context)];
        let topic = listener.topic(Topic { tags: &tags, ..Topic::new(path, "Signal K value", Fields::Json) });
        let sources = self.topics.entry(context.to_owned()).or_default().entry(path.to_owned()).or_default();
        sources.insert(source.to_owned(), topic);
        Some(topic)
    }

    fn finish(&self, listener: &mut dyn Listener) {
        let notes = [
            (self.untimed, "updates have no time: each has that of the update before"),
            (self.incomplete, "values have no path, or paths no value: left out"),
            (self.other, "lines hold no update"),
        ];
        for (count, what) in notes.into_iter().filter(|(count, _)| *count > 0) {
            listener.note(Place::Whole, format!("{count} {what}"));
        }
        if self.left_out > 0 {
            let problem = format!(
                "{} values are left out: nothing tells their time, or there are too many topics",
                self.left_out
            );
            listener.damaged(Place::Whole, problem);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::collector::Reported;
    use super::super::tests::independent::{Reader, check_cut, check_flipped, collected, expected, sample};
    use super::*;

    /// The reader, which has no options.
    const READ: Reader = |input, _options, listener| read(input, listener);

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn paths_are_topics_of_each_source_and_vessel() {
        let text = r#"{"updates":[{"source":{"label":"gps"},"values":[{"path":"a.b","value":1}]}]}
{"context":"vessels.other","updates":[{"$source":"ais","timestamp":"1970-01-01T00:00:10Z","values":[{"path":"a.b","value":{"x":2}}]}]}
1200000000000;A;{"updates":[{"source":{"label":"gps"},"timestamp":"1970-01-01T00:00:11Z","values":[{"path":"a.b","value":3},{}]}]}
{"name":"server"}
{"updates":[{"source":"#;
        let all = collected(READ, text.as_bytes());
        let own = "a.b[source=gps][context=vessels.self]";
        assert_eq!(
            all.shown(),
            [format!("a.b {own}:  x2"), "a.b a.b[source=ais][context=vessels.other]:  x1".into()]
        );
        let messages = &all.topics[0].messages;
        assert_eq!(messages[0], (Times::at(Time(10 * SECOND)), vec!["1".to_owned()]));
        let noted = Times { stamp: Some(Time(11 * SECOND)), ..Times::at(Time(1_200_000_000 * SECOND)) };
        assert_eq!(messages[1], (noted, vec!["3".to_owned()]));
        let notes: Vec<&str> = all.notes.iter().map(|(_, what)| &**what).collect();
        assert_eq!(
            notes,
            [
                "1 updates have no time: each has that of the update before",
                "1 values have no path, or paths no value: left out",
                "1 lines hold no update",
            ]
        );
        assert_eq!(all.damages, [(Place::Line(5), "the file ends within this line; line left out".into())]);
        assert!(is_log(text.as_bytes()) && !is_log(br#"{"signal": "/a", "time_ns": 5, "value": 1}"#));
    }

    #[test]
    fn a_delta_may_take_several_lines() {
        let text = "{\n \"updates\": [{\"timestamp\": \"1970-01-01T00:00:10Z\",\n  \"values\": [\n   {\"path\": \"a\", \"value\": 1}]\n }]\n}\n";
        let all = collected(READ, text.repeat(2).as_bytes());
        assert_eq!((all.shown().len(), all.count(), all.damages.len()), (1, 2, 0));
        assert!(is_log(text.as_bytes()));
        assert_eq!(all.topics[0].messages[0].0, Times::at(Time(10 * SECOND)));
    }

    #[test]
    fn boats_are_read_as_python_does() {
        for file in ["boat_seattle.jsonl", "boat_kees.jsonl"] {
            let (Some(bytes), Some(expected)) =
                (sample(&format!("signalk/{file}")), expected("signalk", file))
            else {
                return;
            };
            let all = collected(READ, &bytes);
            assert_eq!(all.damages, []);
            let is_of = |topic: &&Reported, path: &str| topic.name == path;
            for (path, count) in expected["paths"].as_object().unwrap() {
                let found: usize =
                    all.topics.iter().filter(|it| is_of(it, path)).map(|topic| topic.messages.len()).sum();
                assert_eq!(found as u64, count.as_u64().unwrap(), "{path}");
            }
            for (name, count) in expected["by_source"].as_object().unwrap() {
                let (path, source) = name.split_once(" from ").unwrap();
                let is_from =
                    |it: &&Reported| is_of(it, path) && it.full.contains(&format!("[source={source}]"));
                let found: usize = all.topics.iter().filter(is_from).map(|topic| topic.messages.len()).sum();
                assert_eq!(found as u64, count.as_u64().unwrap(), "{name}");
            }
            check_cut(READ, &bytes);
            check_flipped(READ, &bytes, 0.9);
        }
    }
}
