//! The entities of Home Assistant that describe a model: their configurations and states.

use super::unit;
use crate::healer::Healer;
use crate::outlet::Outlet;
use crate::view::bounds;
use serde_json::{Map, Value, json};
use shsa_bridge::Quality;
use shsa_core::knowledge::{KnowledgeBase, NeedId, Shape, SignalId};
use shsa_core::monitor::Symptom;
use shsa_format::event;
use std::fmt::Write;

/// The name of the program in configurations.
const PROGRAM: &str = "shsa";

/// The part of an entity's state that is read as its attributes.
const ATTRIBUTES: &str = "{{ value_json.attributes | tojson }}";

/// What an entity shows.
#[derive(Clone, Copy, Debug)]
pub(super) enum Subject {
    /// The value of a need, as a sensor.
    Need(NeedId),
    /// The verdict on a signal, as a binary sensor.
    Signal(SignalId),
}

/// Where the entities of a model are announced.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    /// The first part of the topics of configurations.
    pub(super) prefix: &'a str,
    /// The name of this instance.
    pub(super) instance: &'a str,
    /// The name of the model.
    pub(super) model: &'a str,
}

/// An entity of a model.
#[derive(Clone, Debug)]
pub(super) struct Entity {
    /// The name of the entity in topics and among the entities of its instance.
    pub(super) id: String,
    /// The topic of the configuration.
    pub(super) topic: String,
    /// The configuration, JSON.
    pub(super) configuration: String,
    /// The topic of the state.
    pub(super) state_topic: String,
}

impl Entity {
    /// The sensors of all needs of a model.
    pub(super) fn needs(place: Place<'_>, healer: &Healer) -> Vec<Entity> {
        let knowledge = healer.engine().knowledge();
        let entity = |(need, outlet)| {
            Entity::new(place, knowledge, Subject::Need(need), sensor(outlet, shape(knowledge, need)))
        };
        healer.outlets().map(entity).collect()
    }

    /// The binary sensors of all signals of a model.
    pub(super) fn signals(place: Place<'_>, healer: &Healer) -> Vec<Entity> {
        let knowledge = healer.engine().knowledge();
        let entity = |signal| Entity::new(place, knowledge, Subject::Signal(signal), binary_sensor());
        knowledge.signals().ids().map(entity).collect()
    }

    fn new(place: Place<'_>, knowledge: &KnowledgeBase, subject: Subject, own: Map<String, Value>) -> Entity {
        let Place { prefix, instance, model } = place;
        let (component, name) = match subject {
            Subject::Need(need) => ("sensor", knowledge.need_name(need)),
            Subject::Signal(signal) => ("binary_sensor", &*knowledge.signals()[signal].name),
        };
        let (node, id) = (topic_part(instance), subject.id(model, knowledge));
        let state_topic = format!("shsa/{instance}/homeassistant/{id}");
        let device = json!({
            "identifiers": [format!("{PROGRAM}_{node}")],
            "name": instance,
            "manufacturer": PROGRAM,
            "sw_version": env!("CARGO_PKG_VERSION"),
        });
        let mut configuration = json!({
            "name": name.trim_matches('/'),
            "unique_id": format!("{PROGRAM}_{node}_{id}"),
            "default_entity_id": format!("{component}.{}", plain(&format!("{instance}_{name}"))),
            "state_topic": state_topic,
            "json_attributes_topic": state_topic,
            "json_attributes_template": ATTRIBUTES,
            "availability": [
                { "topic": format!("shsa/{instance}/status") },
                { "topic": state_topic, "value_template": "{{ value_json.availability }}" },
            ],
            "availability_mode": "all",
            "payload_available": "online",
            "payload_not_available": "offline",
            "device": device,
            "origin": { "name": PROGRAM, "sw_version": env!("CARGO_PKG_VERSION") },
        });
        if let Some(configuration) = configuration.as_object_mut() {
            configuration.extend(own);
        }
        let topic = format!("{prefix}/{component}/{node}/{id}/config");
        Entity { id, topic, configuration: configuration.to_string(), state_topic }
    }
}

impl Subject {
    /// The name in topics: unique among the entities of an instance.
    pub(super) fn id(self, model: &str, knowledge: &KnowledgeBase) -> String {
        let (kind, name) = match self {
            Subject::Need(need) => ("need", knowledge.need_name(need)),
            Subject::Signal(signal) => ("signal", &*knowledge.signals()[signal].name),
        };
        format!("{}_{kind}_{}", topic_part(model), topic_part(name))
    }
}

/// Whether a need is for one number or for a list.
pub(super) fn shape(knowledge: &KnowledgeBase, need: NeedId) -> Shape {
    knowledge.variables()[knowledge.needs()[need].variable].shape
}

/// The configuration of a need's sensor. A list of numbers is too long for a state, so that its sensor has the quality as state.
fn sensor(outlet: &Outlet, shape: Shape) -> Map<String, Value> {
    let (unit, class) = match outlet.variable().1.filter(|_| shape == Shape::Scalar).map(unit::written) {
        Some((unit, class)) => (Some(unit), class),
        None => (None, None),
    };
    let own = match shape {
        Shape::Vector => {
            vec![("device_class", json!("enum")), ("options", json!(Quality::ALL.map(Quality::name)))]
        }
        Shape::Scalar => vec![("state_class", json!("measurement"))],
    };
    let unit = unit.map(|unit| ("unit_of_measurement", json!(unit)));
    let class = class.map(|class| ("device_class", json!(class)));
    let all =
        own.into_iter().chain(unit).chain(class).chain([("value_template", json!("{{ value_json.value }}"))]);
    all.map(|(key, value)| (key.to_owned(), value)).collect()
}

/// The configuration of a verdict's binary sensor.
fn binary_sensor() -> Map<String, Value> {
    let own = [
        ("device_class", "problem"),
        ("entity_category", "diagnostic"),
        ("value_template", "{{ value_json.problem }}"),
        ("payload_on", "ON"),
        ("payload_off", "OFF"),
    ];
    own.into_iter().map(|(key, value)| (key.to_owned(), json!(value))).collect()
}

/// The last decision about something: its kind, and the reasons in words.
#[derive(Clone, Debug)]
pub(super) struct Because {
    pub(super) kind: &'static str,
    pub(super) reasons: String,
}

/// What a state is written for at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Standing {
    /// The quality of a need, and whether another instance serves it.
    Need(Quality, bool),
    /// A verdict on a signal.
    Signal(Verdict),
}

/// The verdict on a signal, and how it misbehaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Verdict {
    word: &'static str,
    symptom: Option<&'static str>,
}

impl Verdict {
    /// The present verdict on a signal.
    pub(super) fn on(signal: SignalId, healer: &Healer) -> Verdict {
        let engine = healer.engine();
        let word = event::verdict(engine.absence(signal), engine.verdict(signal));
        Verdict { word, symptom: engine.fault(signal).map(Symptom::name) }
    }
}

/// The state of a need: its value, or `null` while none is known; where another instance serves it, that one tells.
pub(super) fn need(
    outlet: &Outlet,
    shape: Shape,
    is_here: bool,
    quality: Quality,
    because: Option<&Because>,
) -> Value {
    let (variable, unit) = outlet.variable();
    let [lowest, highest] = bounds(outlet.value().filter(|_| is_here), unit).map(|bound| bound.map(shown));
    // The middle of an uncertain value is no estimate.
    let known = lowest.zip(highest).filter(|_| quality != Quality::Uncertain);
    let value = match shape {
        Shape::Vector => json!(quality.name()),
        Shape::Scalar => json!(known.map(|(lowest, highest)| shown(f64::midpoint(lowest, highest)))),
    };
    let attributes = [
        ("variable", json!(variable)),
        ("signal", json!(outlet.topic())),
        ("quality", json!(quality.name())),
        ("source", json!(is_here.then_some(&outlet.provenance().source))),
        ("lowest", json!(lowest)),
        ("highest", json!(highest)),
    ];
    state(("value", value), is_here, &attributes, because)
}

/// A number without the noise of conversions between units: 12 of the 15 digits that are certain in a number of 64 bits.
fn shown(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// The state of a signal: whether its verdict is a problem, or `null` before the first verdict.
pub(super) fn signal(verdict: Verdict, because: Option<&Because>) -> Value {
    let problem = match verdict.word {
        "unknown" => None,
        "healthy" => Some("OFF"),
        _ => Some("ON"),
    };
    let attributes = [("verdict", json!(verdict.word)), ("symptom", json!(verdict.symptom))];
    state(("problem", json!(problem)), true, &attributes, because)
}

/// A state with its attributes and the last decision about it.
fn state(
    own: (&str, Value),
    is_here: bool,
    attributes: &[(&str, Value)],
    because: Option<&Because>,
) -> Value {
    let decision =
        [("decision", json!(because.map(|it| it.kind))), ("reason", json!(because.map(|it| &*it.reasons)))];
    let attributes =
        attributes.iter().chain(&decision).map(|(key, value)| ((*key).to_owned(), value.clone()));
    let (key, value) = own;
    json!({
        key: value,
        "availability": if is_here { "online" } else { "offline" },
        "attributes": attributes.collect::<Map<String, Value>>(),
    })
}

/// A name as a part of a discovery topic, which consists of letters, digits, `_` and `-`. Different names give different parts:
/// each byte of any other character is written as `-` and two digits.
fn topic_part(name: &str) -> String {
    let mut part = String::with_capacity(name.len());
    for byte in name.bytes() {
        if byte.is_ascii_alphanumeric() || byte == b'_' {
            part.push(char::from(byte));
        } else {
            let _cannot_fail = write!(part, "-{byte:02x}");
        }
    }
    part
}

/// A name as a suggestion for the id of an entity: lower case letters, digits and single `_`.
fn plain(name: &str) -> String {
    let words = name.split(|sign: char| !sign.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_topics_have_only_permitted_characters_and_differ_where_names_do() {
        let names =
            ["speed", "/speed", "speed/", "sp_eed", "sp-eed", "sp/eed", "sp-2feed", "grün", "a b", ""];
        let parts = names.map(topic_part);
        for (at, part) in parts.iter().enumerate() {
            let is_permitted = |sign: char| sign.is_ascii_alphanumeric() || "_-".contains(sign);
            assert!(part.chars().all(is_permitted), "{part}");
            assert!(!parts[..at].contains(part), "{part}");
        }
        assert_eq!(topic_part("/speed"), "-2fspeed");
    }

    #[test]
    fn numbers_have_no_noise_of_conversions() {
        for value in [20.1, -1e-7, 3e8, 0.0, 123_456.789_012] {
            assert_eq!(shown(value), value);
            assert_eq!(shown(value * (1.0 + 4.0 * f64::EPSILON)), value);
        }
    }

    #[test]
    fn ids_of_entities_are_suggested_in_lower_case() {
        assert_eq!(plain("Car_/Wheel/front-Left"), "car_wheel_front_left");
    }
}
