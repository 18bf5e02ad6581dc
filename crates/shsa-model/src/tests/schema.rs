//! The schema accepts every shipped model, and refuses the keys and shapes that the reader refuses.

use crate::tree::{self, Node, Value as Tree};
use crate::{load, schema};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A tree as an editor sees it: words that are numbers or truth values are these.
fn seen(node: &Node) -> Value {
    match &node.value {
        Tree::Null | Tree::Unread => Value::Null,
        Tree::Scalar(text) if matches!(text.text.as_str(), "true" | "false") => json!(text.text == "true"),
        Tree::Scalar(text) => serde_json::from_str::<serde_json::Number>(&text.text)
            .map_or_else(|_| Value::from(text.text.clone()), Value::Number),
        Tree::List(items) => items.iter().map(seen).collect(),
        Tree::Map(entries) => entries.iter().map(|(key, node)| (key.text.clone(), seen(node))).collect(),
    }
}

fn parsed(text: &str) -> Value {
    seen(&tree::read(text).root.expect("a document"))
}

/// Whether a value is valid by a schema that uses our subset of keywords; any other keyword fails the test.
fn is_valid(schema: &Value, value: &Value) -> bool {
    let words = schema.as_object().expect("a schema is an object");
    words.iter().all(|(word, rule)| match word.as_str() {
        "$schema" | "title" | "description" | "properties" => true,
        "type" => of_types(rule, value),
        "enum" => rule.as_array().unwrap().contains(value),
        "anyOf" => rule.as_array().unwrap().iter().any(|schema| is_valid(schema, value)),
        "items" => value.as_array().is_none_or(|items| items.iter().all(|item| is_valid(rule, item))),
        "minItems" => value.as_array().is_none_or(|items| items.len() as u64 >= rule.as_u64().unwrap()),
        "maxItems" => value.as_array().is_none_or(|items| items.len() as u64 <= rule.as_u64().unwrap()),
        "additionalProperties" => value.as_object().is_none_or(|fields| {
            fields.iter().all(|(name, value)| match schema["properties"].get(name) {
                Some(of_name) => is_valid(of_name, value),
                None => rule.as_bool().unwrap_or_else(|| is_valid(rule, value)),
            })
        }),
        _ => panic!("`{word}` is no word that this test knows"),
    })
}

fn of_types(types: &Value, value: &Value) -> bool {
    let found = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    *types == json!(found) || types.as_array().is_some_and(|types| types.contains(&json!(found)))
}

fn files(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(Path::new(ROOT).join(folder)).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|ending| ending == "yaml")).collect()
}

#[test]
fn every_shipped_model_is_valid() {
    let schema = schema::schema();
    let mut count = 0;
    for path in files("models").into_iter().chain(files("examples")) {
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(is_valid(&schema, &parsed(&text)), "{}", path.display());
        let line = "# yaml-language-server: $schema=../docs/model.schema.json\n";
        assert!(text.starts_with(line), "{}: an editor is not told of the schema", path.display());
        count += 1;
    }
    for path in files("stories") {
        let story = parsed(&std::fs::read_to_string(&path).unwrap());
        let model = story.get("model").filter(|model| model.is_object());
        assert!(model.is_none_or(|model| is_valid(&schema, model)), "{}", path.display());
        count += usize::from(model.is_some());
    }
    assert!(count > 40, "{count} models");
}

#[track_caller]
fn refuse(entry: &str) {
    let text = format!("shsa: 1\nvariables: {{ a: {{}} }}\nsignals: {{ /a: {{ variable: a }} }}\n{entry}\n");
    assert!(!load(&text, "broken").report.ok(), "the reader takes it: {entry}");
    assert!(!is_valid(&schema::schema(), &parsed(&text)), "the schema takes it: {entry}");
}

#[test]
fn what_is_broken_is_refused() {
    assert!(!is_valid(&schema::schema(), &parsed("shsa: 2")));
    refuse("need: { a: {} }");
    refuse("needs: { a: { max_ag: 1 s } }");
    refuse("needs: { a: { when_unsure: maybe } }");
    refuse("needs: { a: { max_age: [1 s, 2 s] } }");
    refuse("needs: [a]");
    refuse("relations: { r: { equation: [a = 1] } }");
    refuse("constants: { c: [1, 2, 3] }");
    refuse("functions: { 'f(x)': [1] }");
    refuse("utility: { aggregate: mean, relation: 1 }");
    refuse("needs: { a: [{ max_age: 1 s, integrity: E }] }");
    let held = |hold: &str| {
        format!("shsa: 1\nvariables: {{ a: {{}} }}\nsignals: {{ /a: {{ variable: a, hold: {hold} }} }}\n")
    };
    assert!(is_valid(&schema::schema(), &parsed(&held("true"))) && load(&held("true"), "sound").report.ok());
    assert!(!is_valid(&schema::schema(), &parsed(&held("[1]"))) && !load(&held("[1]"), "broken").report.ok());
}

#[test]
fn the_schema_in_the_documents_is_this_one() {
    let stored = std::fs::read_to_string(Path::new(ROOT).join("docs/model.schema.json")).unwrap_or_default();
    assert!(stored == schema::text(), "`shsa model schema > docs/model.schema.json` writes another one");
}
