//! Reads associations from their tree.

use super::{ASSOCIATION, Association, Part, SENSOR, TrackSensor};
use shsa_core::knowledge::Text;
use shsa_core::time::Span;
use shsa_estimate::association::{Associator, Region, Sensor, Settings};
use shsa_message::path::Path;
use shsa_message::source::{Source, StampField};
use shsa_message::span::parse_span;
use shsa_model::reader::{Fields, Keys, Reader};
use shsa_model::tree::Node;

const EXAMPLE: &str = "associations: { border: { sensors: { .. } } }";
/// How to give associations.
pub(super) const HELP: &str = "write them like `associations: { border: { sensors: { .. } } }`";
const OF_SENSORS: &str =
    "radar_1: { tracks: /radar/1/tracks, x: x, y: y, error: [1, 0.5], output: /border/radar_1 }";
/// How old tracks may be by default.
const MAX_AGE: Span = Span::from_millis(1_000);
/// The most sensors of an association.
const SENSORS_MAX: usize = 16;

pub(super) fn associations(reader: &mut Reader, root: &Node) -> Vec<Association> {
    let fields = reader.fields(root, "associations: a mapping", &["associations"], EXAMPLE);
    let Some(node) = fields.get("associations") else {
        reader.wrong(root, "there are no associations", HELP);
        return Vec::new();
    };
    let entries = reader.entries(node, "names of associations", EXAMPLE);
    if entries.is_empty() {
        reader.wrong(node, "there are no associations", HELP);
    }
    entries.iter().filter_map(|(name, node)| association(reader, name, node)).collect()
}

fn association(reader: &mut Reader, name: &Text, node: &Node) -> Option<Association> {
    let fields = reader.fields_of(node, "an association", ASSOCIATION.iter().map(|key| key.0), EXAMPLE);
    let mut keys = Keys { reader, fields };
    let sensors = sensors(&mut keys, name);
    let misplaced = numbers(keys.reader, &keys.fields, "misplaced", "[3, 0.7]");
    let near = numbers(keys.reader, &keys.fields, "near", "[150, 2]");
    let gate = number(&mut keys, "gate", "0.999");
    let [region, inner] = ["region", "inner"].map(|key| region(&mut keys, key));
    let [count_over, pause] = ["count_over", "pause"].map(|key| span(&mut keys, key));
    let objects = keys.text("objects", "a topic", "/border/objects").map(|text| text.text);
    let settings = Settings {
        sensors: sensors.iter().map(|(_, sensor)| *sensor).collect(),
        misplaced: misplaced.unwrap_or_default(),
        gate: gate.unwrap_or(0.999),
        region,
        inner,
        near: near.unwrap_or_default(),
        count_over: count_over.unwrap_or(Span::ZERO),
        pause: pause.unwrap_or(Span::ZERO),
    };
    let associator = Associator::new(settings);
    match associator {
        Ok(associator) => {
            let sensors = sensors.into_iter().map(|(sensor, _)| sensor).collect();
            Some(Association { name: name.text.clone(), associator, sensors, objects })
        }
        Err(error) => {
            keys.reader.note(name.place, &format!("in `{}`, {error}", name.text), "give it another value");
            None
        }
    }
}

fn sensors(keys: &mut Keys<'_, '_>, name: &Text) -> Vec<(TrackSensor, Sensor)> {
    let help = format!("write them like `sensors: {{ {OF_SENSORS} }}`");
    let Some(node) = keys.fields.get("sensors") else {
        keys.reader.note(name.place, &format!("`{}` has no sensors", name.text), &help);
        return Vec::new();
    };
    let entries = keys.reader.entries(node, "names of sensors", OF_SENSORS);
    if entries.is_empty() || entries.len() > SENSORS_MAX {
        let message = format!("from 1 to {SENSORS_MAX} sensors are expected, found {}", entries.len());
        keys.reader.wrong(node, &message, &help);
    }
    entries.iter().filter_map(|(name, node)| sensor(keys.reader, name, node)).collect()
}

fn sensor(reader: &mut Reader, name: &Text, node: &Node) -> Option<(TrackSensor, Sensor)> {
    let fields = reader.fields_of(node, "a sensor", SENSOR.iter().map(|key| key.0), OF_SENSORS);
    let mut keys = Keys { reader, fields };
    for key in ["tracks", "x", "y", "error"].into_iter().filter(|key| keys.fields.get(key).is_none()) {
        let message = format!("the sensor `{}` has no `{key}`", name.text);
        keys.reader.note(name.place, &message, &format!("write it like `{OF_SENSORS}`"));
    }
    let topic = keys.text("tracks", "a topic", "/radar/1/tracks");
    let fields =
        Part::ALL.into_iter().filter_map(|(key, part)| Some((part, path(&mut keys, key)?))).collect();
    let time = time(&mut keys);
    let max_age = span(&mut keys, "max_age").unwrap_or(MAX_AGE);
    let output = keys.text("output", "the beginning of topics", "/radar/1/leaving").map(|text| text.text);
    let error = numbers(keys.reader, &keys.fields, "error", "[1.2, 0.6]")?;
    let topic = topic?.text;
    let sensor = TrackSensor { name: name.text.clone(), topic, fields, time, max_age, output };
    Some((sensor, Sensor { error }))
}

/// A path within a message.
fn path(keys: &mut Keys<'_, '_>, key: &str) -> Option<String> {
    let text = keys.text(key, "a path", "position.x")?;
    if let Err(error) = Path::parse(&text.text) {
        keys.reader.note(text.place, &error.to_string(), "write it like `position.x`");
        return None;
    }
    Some(text.text)
}

fn time(keys: &mut Keys<'_, '_>) -> Option<StampField> {
    let text = keys.text("time", "a path", "header.stamp")?;
    match format!("x@{}", text.text).parse::<Source>() {
        Ok(source) => source.time,
        Err(why) => {
            keys.reader.note(text.place, &why, "write it like `header.stamp` or `t*1 ms`");
            None
        }
    }
}

fn numbers(reader: &mut Reader, fields: &Fields<'_>, key: &str, example: &str) -> Option<[f64; 2]> {
    let (x, y) = reader.pair(fields.get(key)?, "two numbers", format_args!("{key}: {example}"))?;
    let [x, y] = [x, y].map(|text| finite(reader, &text));
    Some([x?, y?])
}

fn number(keys: &mut Keys<'_, '_>, key: &str, example: &str) -> Option<f64> {
    let text = keys.text(key, "a number", example)?;
    finite(keys.reader, &text)
}

fn finite(reader: &mut Reader, text: &Text) -> Option<f64> {
    let number = text.text.parse::<f64>().ok().filter(|number| number.is_finite());
    if number.is_none() {
        reader.note(text.place, &format!("`{}` is no number", text.text), "numbers have no units here");
    }
    number
}

fn span(keys: &mut Keys<'_, '_>, key: &str) -> Option<Span> {
    let text = keys.span(key)?;
    match parse_span(&text.text) {
        Ok(span) if span >= Span::ZERO => Some(span),
        Ok(_) => {
            keys.reader.note(text.place, "a time of at least 0 is expected", "write it like `500 ms`");
            None
        }
        Err(why) => {
            keys.reader.note(text.place, &why, "write it like `500 ms`");
            None
        }
    }
}

fn region(keys: &mut Keys<'_, '_>, key: &str) -> Option<Region> {
    let text = keys.text(key, "a condition of x and y", "\"x > 110 and x < 180\"")?;
    match Region::new(&text.text) {
        Ok(region) => Some(region),
        Err(error) => {
            keys.reader.note(text.place, &error.to_string(), "write it like `x > 110 and abs(y) < 8`");
            None
        }
    }
}
