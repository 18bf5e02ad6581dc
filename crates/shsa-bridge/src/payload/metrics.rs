//! Payloads of Sparkplug B, in which each value has a name, a time and a quality of its own.

use super::Unreadable;
use super::explore::{Content, FIELDS_MAX, Leaf};
use super::reader::Reading;
use super::scalar::word;
use crate::Quality;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::path::Path;
use shsa_message::source::Field;
use shsa_message::sparkplug::{Metric, Payload, Value, quality};

/// The type of a message with a payload of Sparkplug B, in which every metric has its name and, where it matters, its type.
pub const METRICS: &str = "spBv1.0";
/// The type of a message that says that all values of its topic are out of date; the payload is a text with the reason.
pub const STALE: &str = "spBv1.0/stale";

/// Reads the same metrics of one payload after the other.
///
/// | found | read as |
/// |---|---|
/// | a number, a truth value, a text that is a number or a word for on or off | a number |
/// | an array of numbers | a vector; with `[1]` behind the name its second element |
/// | no value, a text, a data set, a template, a quality other than good | an invalid value |
/// | a metric that is historical, or a substitute of another instance | nothing |
///
/// The stamp is the time of the metric, else that of the payload; with `@published` always that of the payload, with `@received`
/// there is none.
#[derive(Clone, Debug)]
pub(super) struct Metrics {
    /// Names with the elements and the fields that they are for, in the order of names.
    names: Vec<Name>,
    stamps: Vec<StampPlace>,
}

#[derive(Clone, Debug)]
struct Name {
    name: String,
    element: Option<usize>,
    field: usize,
}

/// Where the stamp of a field is.
#[derive(Clone, Debug)]
enum StampPlace {
    Metric,
    Payload,
    Nowhere,
    /// Metrics have no such stamp.
    Unknown(String),
}

impl Metrics {
    /// A reader of these fields, whose paths are names of metrics.
    pub(super) fn new(fields: &[Field]) -> Metrics {
        let mut names = Vec::new();
        for (field, asked) in fields.iter().enumerate() {
            let name = metric_name(&asked.path);
            if let Some((list, element)) = element(&name) {
                names.push(Name { name: list.to_owned(), element: Some(element), field });
            }
            names.push(Name { name, element: None, field });
        }
        names.sort_by(|one, other| one.name.cmp(&other.name));
        let stamp = |field: &Field| match field.stamp.as_ref().map(|stamp| &*stamp.path) {
            None => StampPlace::Metric,
            Some("published") => StampPlace::Payload,
            Some("received") => StampPlace::Nowhere,
            Some(other) => StampPlace::Unknown(other.to_owned()),
        };
        Metrics { names, stamps: fields.iter().map(stamp).collect() }
    }

    /// Reads a payload of a type of [`is_metrics`], and passes on each metric with the index of its field. `O(bytes)`, without an
    /// allocation for numbers.
    pub(super) fn read(
        &self,
        message_type: &str,
        bytes: &[u8],
        mut each: impl FnMut(usize, Result<Reading, Unreadable>),
    ) {
        let payload = match of(message_type, bytes) {
            Ok(payload) => payload,
            Err(why) => return (0..self.stamps.len()).for_each(|field| each(field, Err(why.clone()))),
        };
        for metric in payload.metrics().filter(is_evidence) {
            let Some(name) = metric.name else { continue };
            let from = self.names.partition_point(|known| *known.name < *name);
            for known in self.names[from..].iter().take_while(|known| known.name == name) {
                let is_other = known.element.is_some() && !matches!(metric.value, Value::Bytes(_));
                let Some(stamp) = self.stamps.get(known.field).filter(|_| !is_other) else { continue };
                let reading = value(&metric, known.element)
                    .and_then(|value| Ok(Reading { value, stamp: stamp.of(&metric, &payload)? }));
                each(known.field, reading);
            }
        }
    }
}

impl StampPlace {
    fn of(&self, metric: &Metric<'_>, payload: &Payload<'_>) -> Result<Option<Time>, Unreadable> {
        let milliseconds = match self {
            StampPlace::Metric => metric.timestamp.filter(|time| *time > 0).or(payload.timestamp),
            StampPlace::Payload => payload.timestamp,
            StampPlace::Nowhere => None,
            StampPlace::Unknown(path) => {
                let why = format!("a metric has no stamp `{path}`, only @published and @received");
                return Err(Unreadable::Layout(why));
            }
        };
        let nanoseconds = |time: u64| i64::try_from(time).ok()?.checked_mul(1_000_000).map(Time);
        Ok(milliseconds.filter(|time| *time > 0).and_then(nanoseconds))
    }
}

/// Whether this is the type of a message with metrics, or about them.
pub(super) fn is_metrics(message_type: &str) -> bool {
    message_type == METRICS || message_type == STALE
}

/// All metrics of a message, in order.
///
/// # Errors
/// When the values are out of date, or the bytes are no payload.
pub(super) fn leaves(message_type: &str, bytes: &[u8]) -> Result<Vec<Leaf>, Unreadable> {
    let leaf = |metric: Metric<'_>| {
        let content = match (value(&metric, None), metric.value) {
            (Ok(value), _) => Content::Value(value),
            (Err(_), Value::Text(text)) => Content::Text(text.chars().take(200).collect()),
            (Err(_), _) => Content::Null,
        };
        Some(Leaf { path: path_of(metric.name?), content })
    };
    let payload = of(message_type, bytes)?;
    Ok(payload.metrics().filter_map(leaf).take(FIELDS_MAX).collect())
}

fn of<'a>(message_type: &str, bytes: &'a [u8]) -> Result<Payload<'a>, Unreadable> {
    if message_type == STALE {
        return Err(Unreadable::Layout(String::from_utf8_lossy(bytes).chars().take(200).collect()));
    }
    let none = || Unreadable::Layout("a payload that is none of Sparkplug B".to_owned());
    Payload::read(bytes).ok_or_else(none)
}

/// Whether a metric says something about its signal now: another instance may have computed it.
fn is_evidence(metric: &Metric<'_>) -> bool {
    let status = metric.text_property("status").and_then(Quality::named);
    let is_computed = matches!(status, Some(Quality::Substitute | Quality::Uncertain | Quality::LastUsable));
    !metric.is_historical && !is_computed
}

fn value(metric: &Metric<'_>, element: Option<usize>) -> Result<RawValue, Unreadable> {
    let name = || format!("`{}`", metric.name.unwrap_or_default());
    let wrong = |found: &str| Unreadable::Kind { field: name(), found: found.to_owned(), wanted: "number" };
    match metric.quality() {
        quality::GOOD => {}
        quality::BAD => return Err(wrong("of bad quality (0)")),
        quality::STALE => return Err(wrong("stale (500)")),
        other => return Err(wrong(&format!("of the quality {other}"))),
    }
    if metric.is_null {
        return Err(wrong("null"));
    }
    if let Some(number) = metric.number() {
        return Ok(RawValue::Number(number));
    }
    match metric.value {
        Value::Text(text) => word(text).map(RawValue::Number).ok_or_else(|| wrong("a text")),
        Value::Bytes(_) => {
            let numbers = metric.numbers().ok_or_else(|| wrong("an array of other things"))?;
            match element {
                None => Ok(RawValue::Vector(numbers)),
                Some(index) => {
                    let absent = || Unreadable::Absent { field: format!("element {index} of {}", name()) };
                    numbers.get(index).copied().map(RawValue::Number).ok_or_else(absent)
                }
            }
        }
        Value::Absent => Err(wrong("without a value")),
        _ => Err(wrong("a data set or a template")),
    }
}

/// The name of the metric that a path gives: as it stands, or after a slash with `~1` for a slash and `~0` for `~`.
fn metric_name(path: &str) -> String {
    match path.strip_prefix('/') {
        Some(name) => name.replace("~1", "/").replace("~0", "~"),
        None => path.to_owned(),
    }
}

/// The path that gives a metric.
fn path_of(name: &str) -> String {
    let is_plain = !name.starts_with('/') && !name.contains('[') && Path::parse(name).is_ok();
    if is_plain { name.to_owned() } else { format!("/{}", name.replace('~', "~0").replace('/', "~1")) }
}

/// Splits `name[1]`.
fn element(name: &str) -> Option<(&str, usize)> {
    let (list, index) = name.strip_suffix(']')?.rsplit_once('[')?;
    Some((list, index.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Message;
    use crate::payload::{Reader, explore};
    use shsa_message::source::StampField;
    use shsa_message::sparkplug::{DataType, NewMetric, NewValue, Property, QUALITY, Writer};

    fn payload(metrics: &[NewMetric<'_>]) -> Message {
        let mut writer = Writer::new(70, Some(1));
        metrics.iter().for_each(|metric| writer.push(metric));
        let message = Message::new("G/N".into(), Time(0), crate::Payload::Bytes(writer.finish().into()));
        Message { message_type: Some(METRICS.into()), ..message }
    }

    fn metric<'a>(name: &'a str, value: NewValue<'a>) -> NewMetric<'a> {
        let data_type = Some(value.data_type());
        NewMetric { name, timestamp: 50, data_type, value: Some(value), properties: &[] }
    }

    #[track_caller]
    fn check(path: &str, stamp: &str, message: &Message, expected: &str) {
        let stamp = Some(StampField { path: stamp.into(), step: None }).filter(|it| !it.path.is_empty());
        let mut reader = Reader::new(&[Field { path: path.into(), stamp }], 1 << 20).unwrap();
        let mut shown = Vec::new();
        reader.read(message, |_, reading| {
            shown.push(match reading {
                Ok(Reading { value, stamp }) => format!("{value:?} at {:?}", stamp.map(|stamp| stamp.0)),
                Err(why) => format!("? {why}"),
            });
        });
        assert_eq!(shown.join(" | "), expected);
    }

    #[test]
    fn metrics_are_found_by_their_names() {
        let message = payload(&[
            metric("Inputs/A", NewValue::Number(1.5)),
            metric("on", NewValue::Truth(true)),
            metric("Temp [C]", NewValue::Whole(7)),
            metric("list", NewValue::Numbers(&[1.0, 2.0])),
            metric("text", NewValue::Text(" 2.5 ")),
            metric("word", NewValue::Text("open")),
            metric("Inputs/A", NewValue::Number(2.5)),
        ]);
        let at = |value: &str| format!("{value} at Some(50000000)");
        check("Inputs/A", "", &message, &format!("{} | {}", at("Number(1.5)"), at("Number(2.5)")));
        check("on", "", &message, &at("Number(1.0)"));
        check("/Temp [C]", "", &message, &at("Number(7.0)"));
        check("list", "", &message, &at("Vector([1.0, 2.0])"));
        check("list[1]", "", &message, &at("Number(2.0)"));
        check("list[2]", "", &message, "? element 2 of `list` is absent");
        check("text", "", &message, &at("Number(2.5)"));
        check("word", "", &message, "? `word` is a text, no number");
        check("other", "", &message, "");
        check("on", "published", &message, "Number(1.0) at Some(70000000)");
        check("on", "received", &message, "Number(1.0) at None");
        check("on", "t", &message, "? a metric has no stamp `t`, only @published and @received");
    }

    #[test]
    fn what_is_not_good_now_is_invalid_or_nothing() {
        let of = |key, property| {
            let properties = [(key, property)];
            payload(&[NewMetric { properties: &properties, ..metric("a", NewValue::Number(1.0)) }])
        };
        check("a", "", &of(QUALITY, Property::Whole(192)), "Number(1.0) at Some(50000000)");
        check("a", "", &of(QUALITY, Property::Whole(0)), "? `a` is of bad quality (0), no number");
        check("a", "", &of(QUALITY, Property::Whole(500)), "? `a` is stale (500), no number");
        check("a", "", &of(QUALITY, Property::Whole(64)), "? `a` is of the quality 64, no number");
        check("a", "", &of("status", Property::Text("UncertainSubstituteValue")), "");
        check("a", "", &of("status", Property::Text("running")), "Number(1.0) at Some(50000000)");
        let null = NewMetric { value: None, ..metric("a", NewValue::Number(1.0)) };
        check("a", "", &payload(&[null]), "? `a` is null, no number");
        let text = crate::Payload::Bytes("the device has died (DDEATH)".into());
        let stale = Message { message_type: Some(STALE.into()), ..Message::new("G/N".into(), Time(0), text) };
        check("a", "", &stale, "? the device has died (DDEATH)");
        let garbage = Message { message_type: Some(METRICS.into()), ..stale };
        check("a", "", &garbage, "? a payload that is none of Sparkplug B");
    }

    #[test]
    fn every_listed_path_is_read() {
        let names = ["Inputs/A", "Temp [C]", "a.b", "a..b", "/x", "t~1", "v[2]"];
        let metrics = names.map(|name| metric(name, NewValue::Number(3.0)));
        let message = payload(&metrics);
        let leaves = explore(&message).unwrap();
        assert_eq!(leaves.len(), names.len());
        for Leaf { path, .. } in leaves {
            check(&path, "", &message, "Number(3.0) at Some(50000000)");
        }
        assert_eq!(DataType::DOUBLE, NewValue::Number(0.0).data_type());
    }
}
