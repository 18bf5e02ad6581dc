//! The text that gives the place of a signal in a recording or on a bus.

use crate::path::split_conditions;
use crate::span::parse_span;
use shsa_core::knowledge::SourceParts;
use shsa_core::time::Span;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

/// The place of a signal.
///
/// ```text
/// [FILE_OR_TOPIC '#'] FIELD { '[' COLUMN '=' VALUE ']' } [ '@' TIME [ '*' SPAN ] ] [ '!changed' ]
/// ```
///
/// | text | means |
/// |---|---|
/// | `wheel_speed#wheel_1` | column `wheel_1` (or `wheel_1 [m/s]`) of `wheel_speed.csv` |
/// | `odom#twist.twist.linear.x` | this field of the messages of the topic `/odom` |
/// | `joint_states#position[1]` | the second element of a list in a message |
/// | `joint_states#position[name=left_wheel]` | the element that stands where the list `name` has this text |
/// | `motes#temperature[mote_id=1]@reading*5s` | only rows of mote 1; the time is the column `reading`, 5 s a step |
/// | `log#speed@row*100ms` | the rows themselves are the clock |
/// | `airdata#xSpeed!changed` | a sample only when the value differs from the one before |
///
/// A file is named with or without extension and folders; a topic with or without its leading slash. In a bag, `@` names the
/// field of the stamp, and `@received` takes the time of recording instead of a header's. In JSON lines a signal is found by its
/// own name or by its source text as a whole. A column whose own name contains `@`, or ends like a filter or a flag, cannot be
/// named.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The file or topic; `None`: any file, and in a bag the field is a topic of plain numbers (field `data`).
    pub file: Option<String>,
    /// The column or the path of the field.
    pub field: String,
    /// Only rows or messages with these values in these columns count.
    pub filters: Vec<(String, String)>,
    /// The place of the time; `None`: recognised from the header or the message.
    pub time: Option<StampField>,
    /// Whether a value equal to the one before is no sample.
    pub changed: bool,
}

/// The place of a row's or message's time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StampField {
    /// The column, or the path in the message (see [`Path`](crate::path::Path)). `row`, where no column has this name, counts the
    /// rows from 0.
    pub path: String,
    /// The length of one step of a number. `None`: from the column's header. In a message, decimal numbers count seconds, and
    /// whole ones [the step that fits their size](crate::stamp::likely_step).
    pub step: Option<Span>,
}

/// A wanted field of a topic's messages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Field {
    /// The path of the field (see [`Path`](crate::path::Path)).
    pub path: String,
    /// The place of its time stamp; `None`: from the type's header, if it has one.
    pub stamp: Option<StampField>,
}

/// Whether a file has this name, with its ending and folders or without them.
#[must_use]
pub fn is_named(file: &Path, name: &str) -> bool {
    let name = name.strip_prefix("./").unwrap_or(name);
    file.ends_with(name) || file.with_extension("").ends_with(name)
}

impl Source {
    /// Whether the source names this file.
    #[must_use]
    pub fn is_of_file(&self, file: &Path) -> bool {
        self.file.as_deref().is_none_or(|name| is_named(file, name))
    }

    /// The topic of a bag, and the path of the field within its messages.
    #[must_use]
    pub fn in_bag(&self) -> (&str, &str) {
        match self.file.as_deref() {
            Some(topic) => (topic, &self.field),
            None => (&self.field, "data"),
        }
    }

    /// The topic on a bus, and the field of its messages, with the filters as conditions of its path. A source with a single name
    /// names the topic.
    #[must_use]
    pub fn on_bus(self) -> (Arc<str>, Field) {
        let (topic, field) = match self.file {
            Some(topic) => (topic, self.field),
            None => (self.field, String::new()),
        };
        let conditions = self.filters.iter().map(|(column, value)| format!("[{column}={value}]"));
        let path = field + &conditions.collect::<String>();
        (topic.into(), Field { path, stamp: self.time })
    }
}

/// The two parts of `TOPIC#FIELD`, unchanged; without a `#` there is no field.
#[must_use]
pub fn split_topic(text: &str) -> (&str, Option<&str>) {
    text.split_once('#').map_or((text, None), |(topic, field)| (topic, Some(field)))
}

/// The parts of a signal's source that identify its measurement; without a source text, the signal's own name is the source.
///
/// Neither a flag nor a time nor the slash before a topic changes the values, and `position` is the list of `position[1]` and of
/// `position[name=left]`. A signal's own name is free text, so only the topic counts there.
#[must_use]
pub fn parts(signal: &str, source: Option<&str>) -> SourceParts {
    let text = source.unwrap_or(signal);
    let topic = text.find('#').map(|end| 0..end);
    if text == signal {
        return SourceParts { topic, ..SourceParts::default() };
    }
    let field = text.trim_end();
    let field = field.strip_suffix("!changed").map_or(field, str::trim_end);
    let field = field.rsplit_once('@').map_or(field, |(field, _)| field.trim_end());
    let blanks = field.len() - field.trim_start().len();
    let is_in_root = field.contains('#') && field.trim_start().starts_with('/');
    let start = blanks + usize::from(is_in_root);
    let lists = lists(&field[start..]).map(|list| start..start + list.len()).collect();
    SourceParts { topic, measurement: Some(start..field.len()), lists }
}

/// The lists that a field is an element of, the innermost first.
fn lists(field: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(list(field), |field| list(field))
}

fn list(field: &str) -> Option<&str> {
    let (list, element) = field.strip_suffix(']')?.rsplit_once('[')?;
    let is_place = !element.is_empty() && element.bytes().all(|byte| byte.is_ascii_digit());
    (is_place || element.contains('=')).then(|| list.trim_end())
}

impl FromStr for Source {
    type Err = String;

    /// # Errors
    /// The part that does not follow the grammar.
    fn from_str(text: &str) -> Result<Source, String> {
        let (text, changed) = split_flag(text.trim())?;
        let (text, time) = split_time(text)?;
        let (text, filters) = split_conditions(text);
        let (file, field) = match split_topic(text) {
            (file, Some(field)) => (Some(file.trim()), field.trim()),
            (field, None) => (None, field.trim()),
        };
        if field.is_empty() {
            return Err("names no column or field; write FILE_OR_TOPIC#FIELD".into());
        }
        let file = file.filter(|file| !file.is_empty()).map(str::to_owned);
        let filters =
            filters.into_iter().map(|(column, value)| (column.to_owned(), value.to_owned())).collect();
        Ok(Source { file, field: field.into(), filters, time, changed })
    }
}

fn split_flag(text: &str) -> Result<(&str, bool), String> {
    match text.rsplit_once('!') {
        Some((rest, "changed")) => Ok((rest.trim_end(), true)),
        Some((_, flag)) if !flag.is_empty() && flag.bytes().all(|byte| byte.is_ascii_alphabetic()) => {
            Err(format!("'!{flag}' is no flag; there is only '!changed'"))
        }
        _ => Ok((text, false)),
    }
}

fn split_time(text: &str) -> Result<(&str, Option<StampField>), String> {
    let Some((rest, time)) = text.rsplit_once('@') else { return Ok((text, None)) };
    let (path, step) = match time.rsplit_once('*') {
        Some((path, step)) => (path, Some(parse_span(step)?)),
        None => (time, None),
    };
    if path.trim().is_empty() {
        return Err("names no column after '@'; write @TIME_COLUMN or @TIME_COLUMN*SPAN".into());
    }
    Ok((rest.trim_end(), Some(StampField { path: path.trim().into(), step })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let shown = match text.parse::<Source>() {
            Err(problem) => format!("error: {problem}"),
            Ok(Source { file, field, filters, time, changed }) => {
                let filters: Vec<_> = filters.iter().map(|(c, v)| format!(" where {c}={v}")).collect();
                let time = time.map_or(String::new(), |time| {
                    format!(" at {} x {:?}", time.path, time.step.map(|step| step.0))
                });
                let file = file.unwrap_or("any".into());
                format!("{file} | {field}{}{time}{}", filters.concat(), if changed { " changed" } else { "" })
            }
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn the_grammar() {
        check("scan#ranges", "scan | ranges");
        check("/odom#twist.twist.linear.x", "/odom | twist.twist.linear.x");
        check("wheel_speed#wheel_1 [m/s]", "wheel_speed | wheel_1 [m/s]");
        check("joint_states#position[1]", "joint_states | position[1]");
        check("airdata# xSpeed(m/s) !changed", "airdata | xSpeed(m/s) changed");
        check(
            "motes#temperature[mote_id=1]@reading*5s",
            "motes | temperature where mote_id=1 at reading x Some(5000000000)",
        );
        check(
            "m#a [m/s] [b=1][c = x y] @ t [s] * ms",
            "m | a [m/s] where b=1 where c=x y at t [s] x Some(1000000)",
        );
        check("log#speed@row*100ms!changed", "log | speed at row x Some(100000000) changed");
        check("speed", "any | speed");
        check("#speed", "any | speed");
        check("a#b@t", "a | b at t x None");
        check("hey!#b", "hey! | b");
    }

    #[test]
    fn what_breaks_the_grammar_is_said() {
        check("a#", "error: names no column or field; write FILE_OR_TOPIC#FIELD");
        check("a#b!changes", "error: '!changes' is no flag; there is only '!changed'");
        check("a#b@*5s", "error: names no column after '@'; write @TIME_COLUMN or @TIME_COLUMN*SPAN");
        check("a#b@t*5", "error: '5' has no unit of time; write it like 5s, 20 ms, us");
        check("a#b@t*0s", "error: '0s' is no positive span of time");
    }

    #[test]
    fn files_are_known_by_name() {
        #[track_caller]
        fn check(name: &str, file: &str, expected: bool) {
            let source: Source = format!("{name}#x").parse().unwrap();
            assert_eq!(source.is_of_file(Path::new(file)), expected);
        }
        check("wheel_speed", "data/wheel_speed.csv", true);
        check("wheel_speed.csv", "data/wheel_speed.csv", true);
        check("data/wheel_speed", "my/data/wheel_speed.csv", true);
        check("other/wheel_speed", "my/data/wheel_speed.csv", false);
        check("speed", "wheel_speed.csv", false);
        check("", "anything.csv", true);
    }

    #[test]
    fn topics_and_fields_are_those_of_a_bag_or_a_bus() {
        #[track_caller]
        fn check(text: &str, bag: (&str, &str), bus: (&str, &str)) {
            let source: Source = text.parse().unwrap();
            assert_eq!(source.in_bag(), bag);
            let (topic, field) = source.on_bus();
            assert_eq!((&*topic, &*field.path), bus);
        }
        check("odom#speed", ("odom", "speed"), ("odom", "speed"));
        check("speed", ("speed", "data"), ("speed", ""));
        check("joints#position[name=left]@t", ("joints", "position"), ("joints", "position[name=left]"));
    }

    /// Checks the topic, the measurement and its lists, with `|` between them.
    #[track_caller]
    fn check_parts(text: &str, expected: &str) {
        let SourceParts { topic, measurement, lists } = parts("name", Some(text));
        let part = |range: Option<&std::ops::Range<usize>>| range.map_or(text, |range| &text[range.clone()]);
        let mut found = vec![part(topic.as_ref()), part(measurement.as_ref())];
        found.extend(lists.iter().map(|list| part(Some(list))));
        assert_eq!(found.join("|"), expected);
    }

    #[test]
    fn what_does_not_change_the_values_is_no_part_of_a_measurement() {
        check_parts("odom#twist.x", "odom|odom#twist.x");
        check_parts("/odom#twist.x", "/odom|odom#twist.x");
        check_parts("t#x!changed", "t|t#x");
        check_parts(" t#x @ time*5s !changed ", " t|t#x");
        check_parts("log#speed [m/s]", "log|log#speed [m/s]");
        check_parts("/speed", "/speed|/speed");
        check_parts("@t", "@t|");
        check_parts("  ", "  |");
        check_parts("/", "/|/");
        check_parts("/#", "/|#");
    }

    #[test]
    fn an_element_is_part_of_its_lists() {
        check_parts("joints#position[2]", "joints|joints#position[2]|joints#position");
        check_parts("/j#p[name=left]", "/j|j#p[name=left]|j#p");
        check_parts("m#a [1] [b=2]@t", "m|m#a [1] [b=2]|m#a [1]|m#a");
        check_parts("m#a[x]", "m|m#a[x]");
    }

    #[test]
    fn the_own_name_of_a_signal_may_hold_anything() {
        for (name, topic) in [("t@1", None), ("t[1]", None), ("/t#a", Some(0..2))] {
            let expected = SourceParts { topic, ..SourceParts::default() };
            assert_eq!(parts(name, None), expected);
            assert_eq!(parts(name, Some(name)), expected);
        }
    }
}
