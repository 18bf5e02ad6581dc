//! InfluxDB line protocol: `room,sensor=T1 temperature=23.7,n=1i 1422886740000000000`, one point per line.
//!
//! Format: <https://docs.influxdata.com/influxdb/v2/reference/syntax/line-protocol/>. A topic is a measurement with its tags, and
//! filters choose among the tags: `room#temperature[sensor=T1]`. Times are whole numbers; their size decides the unit
//! (nanoseconds, else micro-, milliseconds or seconds). Where the points of a series have different fields, the series has all
//! fields so far.

use super::lines::{self, Lines};
use super::topic::{Body, Field, Fields, Input, Listener, Times, Topic, TopicId, Value};
use super::{Place, RecordingError};
use shsa_core::time::Time;
use shsa_message::stamp;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// The most series: measurements with their tags and sets of fields.
const SERIES_MAX: usize = 1 << 14;

/// The most tags, and the most fields, of a point.
const PARTS_MAX: usize = 1 << 12;

/// Whether a text begins as line protocol does: all of its first lines are points, with a time.
pub(super) fn is_log(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    // The last line may be incomplete.
    let whole = text.rfind(['\n', '\r']).map_or("", |end| &text[..end]);
    let lines: Vec<&str> = lines::of(whole).filter(|line| !line.starts_with('#')).take(5).collect();
    !lines.is_empty() && lines.iter().all(|line| point(line).is_ok_and(|point| point.time.is_some()))
}

/// A point.
struct Point<'a> {
    /// The measurement and the tags, as written.
    series: &'a str,
    fields: Vec<(&'a str, &'a str)>,
    time: Option<Time>,
    /// The number of characters of the time.
    digits: Option<usize>,
}

/// A series that was reported as a topic.
struct Series {
    topic: TopicId,
    /// The names of its fields, as written.
    fields: Vec<String>,
}

/// Reads all points.
pub(super) fn read(input: &mut dyn Input, listener: &mut dyn Listener) -> Result<(), RecordingError> {
    let mut series: BTreeMap<String, Series> = BTreeMap::new();
    let (mut lines, mut untimed, mut too_many) = (Lines::new(input), 0_u64, 0_u64);
    let mut digits = None;
    while let Some(line) = lines.next(listener) {
        let text = line.text.trim();
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        let point = point(text);
        let is_whole = line.is_ended || point.as_ref().is_ok_and(|point| point.is_whole(digits));
        digits = point.as_ref().ok().and_then(|point| point.digits).or(digits);
        match point {
            // An incomplete time would be read as another time.
            _ if !is_whole => {
                listener.damaged(
                    Place::Line(line.number),
                    "the file ends within this line; line left out".into(),
                );
            }
            Ok(Point { time: None, .. }) => untimed += 1,
            Ok(point) => too_many += u64::from(!report(&point, &mut series, listener)),
            Err(problem) => listener.damaged(Place::Line(line.number), format!("{problem}; line left out")),
        }
    }
    if untimed > 0 {
        listener.damaged(Place::Whole, format!("{untimed} points are left out: they have no time"));
    }
    if too_many > 0 {
        let problem = format!("{too_many} points are left out: there are more than {SERIES_MAX} series");
        listener.damaged(Place::Whole, problem);
    }
    Ok(())
}

/// Reports a point; returns `false` where there are too many series.
fn report(point: &Point<'_>, series: &mut BTreeMap<String, Series>, listener: &mut dyn Listener) -> bool {
    let Some(time) = point.time else { return true };
    let is_known =
        |known: &Series| point.fields.iter().all(|(name, _)| known.fields.iter().any(|field| field == name));
    if !series.get(point.series).is_some_and(is_known) {
        if series.len() == SERIES_MAX {
            return false;
        }
        let known = report_series(point, series.get(point.series), listener);
        series.insert(point.series.to_owned(), known);
    }
    let Some(known) = series.get(point.series) else { return false };
    if listener.is_wanted(known.topic) {
        let texts: Vec<Option<Cow<'_, str>>> = known.fields.iter().map(|name| point.text(name)).collect();
        let mut values: Vec<Value<'_>> = Vec::with_capacity(texts.len());
        for (name, text) in known.fields.iter().zip(&texts) {
            values.push(text.as_deref().map_or_else(|| point.value(name), Value::Text));
        }
        listener.message(known.topic, Times::at(time), Body::Values(&values));
    }
    true
}

/// Reports the series of a point as a topic; with new fields, again.
fn report_series(point: &Point<'_>, before: Option<&Series>, listener: &mut dyn Listener) -> Series {
    let mut fields: Vec<String> = before.map(|series| series.fields.clone()).unwrap_or_default();
    for (name, _) in &point.fields {
        if !fields.iter().any(|field| field == name) && fields.len() < PARTS_MAX {
            fields.push((*name).to_owned());
        }
    }
    let parts: Vec<&str> = Split { rest: Some(point.series), at: ',', in_quotes: false }.collect();
    let (name, tags) = parts.split_first().map_or(("", &[][..]), |(name, tags)| (*name, tags));
    let tags = tags.iter().filter_map(|tag| halves(tag, '='));
    let tags: Vec<(Cow<'_, str>, Cow<'_, str>)> =
        tags.map(|(name, value)| (unescaped(name), unescaped(value))).collect();
    let tags: Vec<(&str, &str)> = tags.iter().map(|(name, value)| (&**name, &**value)).collect();
    let named = Fields::named(fields.iter().map(|field| Field::new(unescaped(field))));
    let name = unescaped(name);
    let topic = Topic { tags: &tags, ..Topic::new(&name, "InfluxDB point", named) };
    Series { topic: listener.topic(topic), fields }
}

impl Point<'_> {
    /// Whether a line without an end has its whole time: as many digits as the one before, or those of a time of today in seconds,
    /// milliseconds, microseconds or nanoseconds.
    fn is_whole(&self, digits: Option<usize>) -> bool {
        match (self.digits, digits) {
            (Some(own), Some(before)) => own == before,
            (own, _) => matches!(own, Some(10 | 13 | 16 | 19)),
        }
    }

    fn raw(&self, name: &str) -> Option<&str> {
        self.fields.iter().find(|(field, _)| *field == name).map(|(_, value)| *value)
    }

    /// The text of a field; `None` for a field that is no text.
    fn text(&self, name: &str) -> Option<Cow<'_, str>> {
        let quoted = self.raw(name)?.strip_prefix('"')?.strip_suffix('"')?;
        Some(if quoted.contains('\\') {
            quoted.replace("\\\"", "\"").replace("\\\\", "\\").into()
        } else {
            quoted.into()
        })
    }

    /// The value of a field that is no text.
    fn value(&self, name: &str) -> Value<'static> {
        let Some(raw) = self.raw(name) else { return Value::Missing };
        if let Some(whole) = raw.strip_suffix(['i', 'u']).and_then(|digits| digits.parse().ok()) {
            return Value::Whole(whole);
        }
        match raw {
            "t" | "T" | "true" | "True" | "TRUE" => Value::Whole(1),
            "f" | "F" | "false" | "False" | "FALSE" => Value::Whole(0),
            other => other.parse().map_or(Value::Missing, Value::Number),
        }
    }
}

/// Splits a line into series, fields and time.
fn point(line: &str) -> Result<Point<'_>, String> {
    let mut parts = Split { rest: Some(line), at: ' ', in_quotes: true }.filter(|part| !part.is_empty());
    let series = parts.next().ok_or("no measurement")?;
    let fields = parts.next().ok_or("no fields")?;
    let time = parts.next();
    if parts.next().is_some() {
        return Err("more than a measurement, fields and a time: a blank in a name is written '\\ '".into());
    }
    let fields = Split { rest: Some(fields), at: ',', in_quotes: true }.take(PARTS_MAX);
    let fields: Vec<(&str, &str)> = fields.map(field).collect::<Result<_, _>>()?;
    let digits = time.map(str::len);
    let time = time.map(|time| {
        let whole: i64 = time.parse().map_err(|_| format!("'{}' is no time", shown(time)))?;
        whole
            .checked_mul(stamp::likely_step(whole.unsigned_abs()).0)
            .map(Time)
            .ok_or("a time that is too late")
            .map_err(str::to_owned)
    });
    Ok(Point { series, fields, time: time.transpose()?, digits })
}

/// The name and the value of a field.
fn field(text: &str) -> Result<(&str, &str), String> {
    let found = halves(text, '=').filter(|(name, value)| !name.is_empty() && !value.is_empty());
    found.ok_or_else(|| format!("'{}' is no field", shown(text)))
}

fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

/// The two sides of the first separator without a backslash before it.
fn halves(text: &str, at: char) -> Option<(&str, &str)> {
    let mut parts = Split { rest: Some(text), at, in_quotes: true };
    let first = parts.next()?;
    Some((first, parts.rest?))
}

/// The parts of a text between separators that have no backslash before them and, where quotes count, are not in quotes.
struct Split<'a> {
    rest: Option<&'a str>,
    at: char,
    in_quotes: bool,
}

impl<'a> Iterator for Split<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let rest = self.rest?;
        let (mut is_escaped, mut is_quoted) = (false, false);
        for (index, byte) in rest.bytes().enumerate() {
            match byte {
                _ if is_escaped => is_escaped = false,
                b'\\' => is_escaped = true,
                b'"' if self.in_quotes => is_quoted = !is_quoted,
                byte if !is_quoted && char::from(byte) == self.at => {
                    self.rest = rest.get(index + 1..);
                    return rest.get(..index);
                }
                _ => {}
            }
        }
        self.rest = None;
        Some(rest)
    }
}

/// Removes the backslash before a comma, an equals sign or a blank.
fn unescaped(text: &str) -> Cow<'_, str> {
    if !text.contains('\\') {
        return text.into();
    }
    [",", "=", " "]
        .iter()
        .fold(text.to_owned(), |text, letter| text.replace(&format!("\\{letter}"), letter))
        .into()
}

#[cfg(test)]
mod tests {
    use super::super::tests::independent::{
        Reader, check_cut, check_flipped, check_values, collected, expected, sample,
    };
    use super::*;

    /// The reader, which has no options.
    const READ: Reader = |input, _options, listener| read(input, listener);

    const TEXT: &str = "# climate\nroom,site=Mons\\ 1,sensor=T1 temperature=23.7,note=\"a, b=\\\"c\\\" d\",n=1i 1422886740000000000\n\
room,sensor=T1,site=Mons\\ 1 on=true 1422886741\nroom,site=Mons\\ 1,sensor=T1 n=2i,extra\\ field=5 1422886742000\n\
cpu load=0.5\nroom temperature= 5\nroom a=1 2 3\nroom temperature=1 14228867";

    #[test]
    fn points_are_messages() {
        let all = collected(READ, TEXT.as_bytes());
        assert_eq!(
            all.shown(),
            [
                "room room[site=Mons 1][sensor=T1]: temperature, note, n x1",
                "room room[sensor=T1][site=Mons 1]: on x1",
                "room room[site=Mons 1][sensor=T1]: temperature, note, n, extra field x1",
            ]
        );
        let series = "room[site=Mons 1][sensor=T1]";
        assert_eq!(all.column(series, "note")[0].1, "'a, b=\"c\" d'");
        let second = 1_000_000_000;
        let at = 1_422_886_740 * second;
        assert_eq!(all.column(series, "n"), [(at, "1".into()), (at + 2 * second, "2".into())]);
        let shown: Vec<String> =
            all.damages.iter().map(|(place, what)| format!("{place:?} {what}")).collect();
        assert_eq!(
            shown,
            [
                "Line(6) 'temperature=' is no field; line left out",
                "Line(7) more than a measurement, fields and a time: a blank in a name is written '\\ '; line left out",
                "Line(8) the file ends within this line; line left out",
                "Whole 1 points are left out: they have no time",
            ]
        );
        assert!(is_log(b"# a\nroom a=1 1422886740\n") && !is_log(TEXT.as_bytes()) && !is_log(b"t,v\n1,2\n"));
    }

    #[test]
    fn the_last_line_may_lack_its_end() {
        #[track_caller]
        fn check(text: &str, points: usize) {
            let all = collected(READ, text.as_bytes());
            assert_eq!((all.count(), all.damages.is_empty()), (points, points > 0), "{text}");
        }
        check("room a=1 1422886740\nroom a=2 1422886741", 2);
        check("room a=1 1422886740000", 1);
        check("room a=1 142288674", 0);
        let all = collected(READ, b"room a=1 1422886740000\nroom a=2 1422886741");
        assert_eq!((all.count(), all.damages.len()), (1, 1));
    }

    #[test]
    fn rooms_are_read_as_python_does() {
        let (Some(bytes), Some(expected)) =
            (sample("influx/occupancy.lp"), expected("influx", "occupancy.lp"))
        else {
            return;
        };
        let all = collected(READ, &bytes);
        assert_eq!((all.damages.len(), all.count() as u64), (0, expected["points"].as_u64().unwrap()));
        for (name, of_field) in expected["fields"].as_object().unwrap() {
            let (topic, field) = name.split_once('#').unwrap();
            let full = topic.replace('[', "[site=Mons 1][");
            let (first, last) = check_values(&all.column(&full, field), of_field, name);
            assert_eq!(first, of_field["first"]["time_ns"].as_i64().unwrap());
            assert_eq!(last, of_field["last"]["time_ns"].as_i64().unwrap());
        }
        check_cut(READ, &bytes);
        check_flipped(READ, &bytes, 0.9);
    }
}
