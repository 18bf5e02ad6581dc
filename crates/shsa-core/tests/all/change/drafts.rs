//! Short constructors for parts of models.

use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Edit, NeedDraft, Place, PropertyDrafts, RelationDraft, Section, SignalDraft,
    Text, VariableDraft,
};

pub(crate) fn text(text: &str) -> Text {
    Text { text: text.to_owned(), place: Place::default() }
}

pub(crate) fn properties(properties: &[(&str, &str)]) -> PropertyDrafts {
    properties.iter().map(|(name, value)| (text(name), text(value))).collect()
}

pub(crate) fn variable(name: &str, unit: &str, max_rate: &str) -> VariableDraft {
    let max_rate = (!max_rate.is_empty()).then(|| text(max_rate));
    VariableDraft { name: text(name), unit: Some(text(unit)), max_rate, ..VariableDraft::default() }
}

pub(crate) fn signal(name: &str, variable: &str, rate: &str, error: &str) -> SignalDraft {
    SignalDraft {
        name: text(name),
        variable: Some(text(variable)),
        rate: Some(text(rate)),
        value_error: Some(Bounds::One(text(error))),
        time_error: Some(Bounds::One(text("5 ms"))),
        ..SignalDraft::default()
    }
}

pub(crate) fn relation(name: &str, equation: &str, output: &str, error: &str) -> RelationDraft {
    RelationDraft {
        name: text(name),
        body: BodyDraft::Equation(text(equation)),
        directions: (!output.is_empty()).then(|| vec![text(output)]),
        condition: None,
        error: (!error.is_empty()).then(|| Bounds::One(text(error))),
        learn: Vec::new(),
        properties: Vec::new(),
    }
}

pub(crate) fn structure(name: &str, outputs: &[&str], inputs: &[&str]) -> RelationDraft {
    let texts = |names: &[&str]| names.iter().map(|name| text(name)).collect();
    let body = BodyDraft::Structure { outputs: texts(outputs), inputs: texts(inputs) };
    RelationDraft { body, ..relation(name, "", "", "") }
}

pub(crate) fn need(variable: &str, max_age: &str) -> NeedDraft {
    NeedDraft { variable: text(variable), max_age: Some(text(max_age)), ..NeedDraft::default() }
}

pub(crate) fn remove(section: Section, name: &str) -> Edit {
    Edit::Remove(section, text(name))
}

/// A vehicle and a balloon in one model, unconnected.
pub(crate) fn two_systems() -> Draft {
    Draft {
        variables: vec![
            variable("speed", "m/s", "6 m/s^2"),
            variable("height", "m", "10 m/s"),
            variable("climb", "m/s", "12 m/s^2"),
            variable("gain", "m", ""),
        ],
        relations: vec![
            relation("climbing", "climb = derivative(height, 1 s)", "climb", "0.5 m/s"),
            relation("gaining", "gain = integral(climb)", "gain", "0.1 m"),
        ],
        signals: vec![
            signal("wheel_1", "speed", "25 Hz", "0.5"),
            signal("wheel_2", "speed", "20 Hz", "0.5"),
            signal("gnss", "speed", "10 Hz", "0.3"),
            signal("barometer", "height", "20 Hz", "0.4"),
            signal("lidar", "height", "10 Hz", "0.2"),
            signal("vario", "climb", "25 Hz", "0.4"),
        ],
        needs: vec![
            need("speed", "300 ms"),
            need("height", "300 ms"),
            need("climb", "300 ms"),
            need("gain", "500 ms"),
        ],
        ..Draft::default()
    }
}

/// The same systems, where the climb may be the mean of the last second.
pub(crate) fn two_patient_systems() -> Draft {
    let mut draft = two_systems();
    draft.needs[2] = need("climb", "1500 ms");
    draft
}
