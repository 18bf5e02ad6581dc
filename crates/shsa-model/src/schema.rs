//! The JSON Schema of models, made from the tables of their keys, for completion and checks in editors.
//!
//! The schema has keys, choices and shapes. Only the checks of the core know quantities and formulas.

use serde_json::{Map, Value, json};

use super::keys::{Form, Holds, Key, SECTIONS, Section, Short};

/// The schema as text; ends with a line feed.
#[must_use]
pub fn text() -> String {
    format!("{:#}\n", schema())
}

/// The schema, by draft 2020-12.
#[must_use]
pub fn schema() -> Value {
    let sections: Map<String, Value> =
        SECTIONS.iter().map(|section| (section.name.to_owned(), of_section(section))).collect();
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A model for shsa",
        "type": "object",
        "properties": sections,
        "additionalProperties": false,
    })
}

fn of_section(section: &Section) -> Value {
    match section.holds {
        Holds::Version => json!({ "enum": [1, "1"] }),
        Holds::Values(form) => named(of_form(form)),
        Holds::Mapping(keys) => json!({ "anyOf": [word(), of_keys(keys)] }),
        Holds::Entries(keys, short) => of_entries(keys, short),
    }
}

fn named(entry: Value) -> Value {
    json!({ "type": ["object", "null"], "additionalProperties": entry })
}

fn of_entries(keys: &[Key], short: Short) -> Value {
    named(match short {
        Short::None => of_keys(keys),
        Short::Text => json!({ "anyOf": [word(), of_keys(keys)] }),
        Short::List => json!({ "anyOf": [of_keys(keys), { "type": "array", "items": of_keys(keys) }] }),
    })
}

fn of_keys(keys: &[Key]) -> Value {
    let properties: Map<String, Value> = keys.iter().map(|key| (key.name.to_owned(), of_key(key))).collect();
    json!({ "type": ["object", "null"], "properties": properties, "additionalProperties": false })
}

/// Keys, and bounds under other names.
fn of_statement(keys: &[Key]) -> Value {
    let mut schema = of_keys(keys);
    schema["additionalProperties"] = word();
    schema
}

fn of_key(key: &Key) -> Value {
    let mut schema = of_form(key.form);
    schema["description"] = json!(format!("{}: `{}: {}`", key.what, key.name, key.example));
    schema
}

fn of_form(form: Form) -> Value {
    let names = || json!({ "type": "array", "items": { "type": "string" } });
    match form {
        Form::Text => json!({ "type": ["string", "number", "null"] }),
        Form::Choice(choices) => {
            let choices: Vec<Value> = choices().into_iter().map(Value::from).chain([Value::Null]).collect();
            json!({ "enum": choices })
        }
        Form::FlagOrText => json!({ "type": ["boolean", "string", "number", "null"] }),
        Form::Bounds => json!({ "anyOf": [word(), pair()] }),
        Form::Pair => pair(),
        Form::Names => json!({ "anyOf": [{ "type": ["string", "null"] }, names()] }),
        Form::Numbers => numbers(),
        Form::Words => json!({ "type": ["object", "null"], "additionalProperties": { "type": "string" } }),
        Form::Statements(keys) => {
            json!({ "type": ["object", "null"], "additionalProperties": of_statement(keys) })
        }
        Form::Entries(keys, short) => of_entries(keys, short),
        Form::Shares => json!({ "anyOf": [{ "type": "string" }, names(), numbers()] }),
    }
}

fn word() -> Value {
    json!({ "type": ["string", "number", "null"] })
}

fn pair() -> Value {
    let bound = json!({ "type": ["string", "number"] });
    json!({ "type": ["array", "null"], "items": bound, "minItems": 2, "maxItems": 2 })
}

fn numbers() -> Value {
    json!({ "type": ["object", "null"], "additionalProperties": { "type": ["string", "number"] } })
}
