//! Large JSON texts and invalid JSON texts.

use super::brief;
use crate::{load, tree};
use proptest::prelude::*;
use std::fmt::Write;

/// A model with this number of relations, as JSON.
fn large(relations: usize) -> String {
    let line = |text: &mut String, at: usize, entry: String| {
        let comma = if at == 0 { "" } else { "," };
        write!(text, "{comma}\n  {entry}").unwrap();
    };
    let mut text = String::from("{\"shsa\": 1,\n\"relations\": {");
    for at in 0..relations {
        let (first, second) = (at + 1 + at % 5, at + 2 + at % 11);
        let equation = format!("\"r{at}\": \"v{at} = v{first} + 2 * v{second}\"");
        let structure = format!(
            "\"r{at}\": {{\"output\": \"v{at}\", \"inputs\": [\"v{first}\", \"v{second}\"], \"properties\": {{\"cost\": {}}}}}",
            1 + at % 9
        );
        line(&mut text, at, if at % 20 == 0 { equation } else { structure });
    }
    text += "},\n\"variables\": {";
    for at in 0..relations + 12 {
        line(&mut text, at, format!("\"v{at}\": {{}}"));
    }
    text += "},\n\"signals\": {";
    for at in 0..12 {
        line(
            &mut text,
            at,
            format!("\"/s/{at}\": {{\"variable\": \"v{}\", \"rate\": \"10 Hz\"}}", relations + at),
        );
    }
    text + "},\n\"needs\": {\n  \"v0\": {\"max_age\": \"300 ms\"}}}\n"
}

#[test]
fn a_large_model_is_the_same_from_json_and_from_yaml() {
    let text = large(20_000);
    // A comment makes the text YAML.
    let yaml = format!("# large\n{text}");
    let [json, yaml] = [&text, &yaml].map(|text| load(text, "large"));
    assert_eq!((brief(&json), brief(&yaml)), (String::new(), String::new()));
    assert_eq!(json.knowledge.relations().len(), 20_000);
    assert!(format!("{:?}", json.knowledge) == format!("{:?}", yaml.knowledge));
}

#[test]
fn places_are_the_same_from_json_and_from_yaml() {
    let broken = large(3_000)
        .replace("\"r2980\": \"v2980 =", "\"r2980\": \"v2980 ==")
        .replace("[\"v2111\",", "[\"w2111\",")
        .replace("\"v1500\": {}", "\"v1500\": {\"unti\": \"m\", \"unit\": \"metres\"}")
        .replace("\"r77\": {\"output\"", "\"r77\": {\"out\\u0070ut\"")
        .replace("\"r78\": {\"output\"", "\"r78\": {\"\\u00e4\": [null], \"output\"")
        .replace("\"/s/3\": {\"variable\"", "\"/s/3\": {\"rate\": \" 5 Hx \", \"variable\"")
        .replace("\"needs\"", "\"needz\": [], \"needs\"");
    let [json, yaml] = [broken.clone(), format!(" {broken} # YAML")].map(|text| brief(&load(&text, "large")));
    let moved = |text: &str| text.replace("1:2 ", "1:1 ").replace("2:2 ", "2:1 ");
    assert!(json.lines().count() > 6 && json.contains("2983:39 "), "{json}");
    assert_eq!(json, moved(&yaml));
}

#[track_caller]
fn check(text: &str, expected: &str) {
    assert_eq!(brief(&load(text, "m.json")), expected);
}

#[test]
fn broken_json_is_reported_with_its_place_and_help() {
    let check = |rest: &str, expected: &str| {
        let expected = expected.replace("none:", "error: this is no JSON:");
        check(&format!("{{\"shsa\": 1,\n{rest}"), &expected);
    };
    let closing = "(take the comma before it away)";
    check("\"needs\": [1, 2}", "2:15 none: a `,` or `]` is missing");
    check("\"needs\": {\"a\" 1}}", "2:15 none: a `:` is missing (write `\"key\": value`)");
    check("\"needs\": {} \"a\": 1}", "2:13 none: a `,` or `}` is missing");
    check("\"needs\": {}", "1:1 none: this bracket is not closed");
    check("\"needs\": {}} x", "2:14 none: something follows behind the end (a model is one object)");
    check("\"needs", "2:1 none: these quotes are not closed");
    check(
        "\"a\": \"\\q\", 'b",
        "2:7 none: there is no such escape (known: `\\\"`, `\\\\`, `\\/`, `\\b`, `\\f`, `\\n`, `\\r`, `\\t`, `\\u00e4`)",
    );
    check("\"a\": \"\\u12\", 'b", "2:7 none: this escape needs four digits (write it like `\\u00e4`)");
    let half =
        "this escape is half a character (a character beyond U+FFFF is written as two: `\\ud83d\\ude00`)";
    check("\"a\": \"x\\ud83d\", 'b", &format!("2:8 none: {half}"));
    check("\"a\": \"\\ude00\\ud83d\", 'b", &format!("2:7 none: {half}"));
    check("\"a\": [1,], \"b", "2:9 none: a value is missing (take the comma before it away)");
    check("\"a\": 01 'b", "2:6 none: this is no number (write it like `-1.5e-3`)");
    check("\"a\": {\"b\": 1,}, \"b", &format!("2:14 none: a key in quotes is missing {closing}"));
}

#[test]
fn json_is_bounded() {
    let deep = |open: &str| format!("{{\"a\": {}", open.repeat(100_000));
    check(&deep("["), "1:70 error: nested more than 64 levels deep");
    check(&deep("{\"b\":"), "1:322 error: nested more than 64 levels deep");
    let many = format!("{{\"relations\": {{\"r\": [{}1]}}}}", "1,".repeat(1_000_000));
    assert!(brief(&load(&many, "m.json")).contains("more than 1000000 values in one entry"));
    let late = format!("{{\"relations\": {{\"r\": \"{}\"}},\n}} x", "x".repeat(1 << 20));
    check(&late, "2:1 error: this is no JSON: a key in quotes is missing (take the comma before it away)");
}

#[test]
fn keys_and_numbers_of_json_are_checked_as_in_yaml() {
    check(
        "{\"shsa\": 1,\n\"variables\": {\"a\": {\"unit\": \"m\", \"unit\": \"s\"},\n\"a\": {}}, \"variables\": {}}",
        "2:16 warning: nothing uses `a`
2:35 error: `unit` is given twice (it is given in line 2 already: keep one)
3:2 error: variable `a` is given twice (keep one, or rename one)
3:12 error: `variables` is given twice (it is given in line 2 already: keep one)",
    );
    let huge = |number: &str| {
        let text = format!(
            "{{\"shsa\": 1, \"variables\": {{\"a\": {{\"properties\": {{\"cost\": {number}}}}}}},\n\"signals\": {{\"s\": {{\"variable\": \"a\"}}}}}}"
        );
        brief(&load(&text, "m.json"))
    };
    assert_eq!(huge("1e308"), "");
    assert_eq!(huge("1e309"), "1:56 error: this number is too large");
    assert_eq!(huge(&"9".repeat(400)), "1:56 error: this number is too large");
    assert_eq!(huge("true"), "1:56 error: a number is missing before `true`");
}

#[test]
fn braces_and_quotes_may_be_yaml_too() {
    for text in ["{\"shsa\": 1, variables: {a: }, # nothing\nsignals: {s: {variable: a}}}", "{\"shsa\": 1,}"]
    {
        assert!(load(text, "m.yaml").report.ok() && tree::read(text).root.is_some(), "{text}");
    }
}

/// Texts of relations: of the usual form, almost of it, and not at all.
fn relation() -> impl Strategy<Value = String> {
    let word = || {
        prop::sample::select(vec![
            "\"a\"",
            "\"b\"",
            "\" c \"",
            "\"\\u0061\"",
            "\"\"",
            "2",
            "null",
            "[\"a\"]",
            "{}",
        ])
    };
    let key = prop::sample::select(vec![
        "output",
        "output",
        "outputs",
        "inputs",
        "out\\u0070ut",
        "properties",
        "for",
        "inputz",
    ]);
    let list = prop::collection::vec(word(), 0..4).prop_map(|words| format!("[{}]", words.join(", ")));
    let name = prop::sample::select(vec!["cost", "accuracy", "c\\u006fst"]);
    let map = prop::collection::vec((name, word()), 0..3).prop_map(|entries| {
        let entries: Vec<_> = entries.into_iter().map(|(name, word)| format!("\"{name}\": {word}")).collect();
        format!("{{{}}}", entries.join(","))
    });
    let value = prop_oneof![word().prop_map(str::to_owned), list, map];
    prop::collection::vec((key, value), 0..5).prop_map(|entries| {
        let entries: Vec<_> = entries.into_iter().map(|(key, value)| format!("\"{key}\": {value}")).collect();
        format!("{{{}}}", entries.join(", "))
    })
}

proptest! {
    #[test]
    fn relations_are_the_same_whichever_way_they_are_read(relation in relation()) {
        let text = format!(
            "{{\"shsa\": 1, \"variables\": {{\"a\": {{}}, \"b\": {{}}, \"c\": {{}}}},\n\"relations\": {{\"r\": {relation}}}}}"
        );
        let [json, yaml] = [text.clone(), format!("{text} # YAML")].map(|text| load(&text, "m"));
        prop_assert_eq!(brief(&json), brief(&yaml), "{}", text);
        prop_assert_eq!(format!("{:?}", json.knowledge), format!("{:?}", yaml.knowledge));
    }
}
