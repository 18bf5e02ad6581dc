//! Texts that are no models: one clear error each, never a panic, never more than linear time.

use super::{EVERYTHING, brief, check, serious};
use crate::{load, load_file};
use proptest::prelude::*;
use std::fs;

#[track_caller]
fn check_whole(text: &str, expected: &str) {
    let loaded = load(text, "m.yaml");
    assert_eq!(brief(&loaded), expected);
    assert!(!loaded.report.ok());
}

#[test]
fn what_is_no_model_is_named() {
    let empty = "0:0 error: the model is empty (begin with `shsa: 1` and `variables:`)";
    check_whole("", empty);
    check_whole(" \n# nothing\n", empty);
    let other = "error: expected a model: a mapping, found one value (write it like `shsa: 1`)";
    check_whole("hello", &format!("1:1 {other}"));
    check_whole("\u{feff}\nhello", &format!("2:1 {other}"));
    check_whole("- 1", "1:1 error: expected a model: a mapping, found a list (write it like `shsa: 1`)");
}

#[test]
fn syntax_errors_are_placed() {
    check(
        "variables:\n\tx: {}\n",
        "3:2 error: this is no YAML: tabs disallowed within this context (block indentation) (indent with blanks, not with tabs)",
    );
    check("variables: { x: {}\n", "2:12 error: this is no YAML: unclosed bracket '{'");
    check("a: b: c", "2:5 error: this is no YAML: mapping values are not allowed in this context");
    check("a: *unknown", "2:4 error: this is no YAML: while parsing node, found unknown anchor");
    check("a: 'open", "2:4 error: this is no YAML: unclosed quote");
    check("a: \u{0}", "2:4 error: this is no YAML: unexpected character: `\\u{0}'");
    check("{\"a\": 1,, \"b\"}", "2:1 error: this is no YAML: simple key expected ':'");
    check("? [a]\n: 1\nutility: norm", "2:3 error: this key is not a word (a key is written `name:`)");
    check(
        "utility: norm\n---\nshsa: 1",
        "3:1 error: a second document begins here (a model is one document: remove the `---`)",
    );
}

#[test]
fn control_characters_stay_away_from_the_terminal() {
    for text in ["{shsa: 1, \"\\e[31m\": 1}", "a: \u{1b}[31m", "a: \u{7f}"] {
        let report = load(text, "m.yaml").report;
        assert!(!report.ok() && !report.render(false).contains(['\u{1b}', '\u{7f}']), "{report:?}");
    }
}

#[test]
fn nesting_and_aliases_are_bounded() {
    let deep = format!("a: {}", "[".repeat(100_000));
    check(&deep, "2:68 error: nested more than 64 levels deep");
    let deep = format!("a: {}", "{b: ".repeat(100_000));
    check(&deep, "2:260 error: nested more than 64 levels deep");
    let lists = |name: char, of: char| format!("{name}: &{name} [{}]\n", vec![format!("*{of}"); 9].join(","));
    let laughs: String = ('b'..='i').map(|name| lists(name, char::from(name as u8 - 1))).collect();
    let help = "(aliases may copy 10000 values in all: write the values out)";
    let refused = |place: &str| format!("{place} error: this alias repeats itself or too much {help}");
    check(&format!("a: &a [1,2,3]\n{laughs}"), &refused("6:14"));
    check("a: &a [*a]", &refused("2:8"));
}

#[test]
fn a_line_of_any_length_is_shown_in_part() {
    let blanks = " ".repeat(1000);
    let text = format!("{{\"shsa\": 1, \"variables\": {{{blanks}\"ä\": {{\"unti\": \"m\"}}}}}}{blanks}");
    let loaded = load(&text, "long.json");
    let found = loaded.report.diagnostics.iter().find(|found| found.message.contains("unti")).unwrap();
    assert_eq!((found.line, found.column, &found.source_line[found.span.clone()]), (1, 1034, "unti"));
    assert!(found.source_line.len() < 300);
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = std::env::temp_dir().join(format!("shsa-model-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let brief_of = |name: &str| brief(&load_file(&folder.join(name)));
    assert!(brief_of("absent.yaml").starts_with("0:0 error: cannot read the model: "));
    assert!(brief_of("").starts_with("0:0 error: cannot read the model: "));
    fs::write(folder.join("binary"), b"shsa: 1\n\xff\xfe").unwrap();
    assert_eq!(brief_of("binary"), "0:0 error: the model is no text: byte 8 is not UTF-8 (save it as UTF-8)");
    fs::write(folder.join("right.yaml"), EVERYTHING).unwrap();
    assert_eq!(serious(&load_file(&folder.join("right.yaml"))), "");
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn many_names_and_problems_stay_fast() {
    let variables: String = (0..20_000).map(|i| format!("  v{i}: {{ unti: m }}\n")).collect();
    let relations: String = (0..20_000).map(|i| format!("  r{i}: v{i} = w{i}\n")).collect();
    let loaded = load(&format!("shsa: 1\nvariables:\n{variables}relations:\n{relations}"), "m.yaml");
    assert_eq!(loaded.report.diagnostics.len(), 20_000);
    assert!(loaded.report.render(false).ends_with("and 19900 more\n"));
}

/// Pieces that hit the keys, formulas and quantities of models more often than random characters do.
const PIECES: [&str; 24] = [
    "\n",
    "  ",
    ": ",
    "[",
    "]",
    "{",
    "}",
    "&a ",
    "*a",
    "- ",
    "|\n",
    "'",
    "\"",
    "=",
    "+",
    "x",
    "previous(",
    " ms",
    "1e309",
    "%",
    "\t",
    "\u{0}",
    "ä",
    "---\n",
];

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in any::<String>()) {
        let _ = load(&text, "m.yaml").report.render(true);
    }

    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = load(&String::from_utf8_lossy(&bytes), "m.yaml").report.render(false);
    }

    #[test]
    fn no_changed_model_makes_it_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0..12_usize, 0..PIECES.len()), 1..8),
    ) {
        let mut text: Vec<char> = EVERYTHING.chars().collect();
        for (at, removed, piece) in changes {
            let from = at.index(text.len());
            let to = (from + removed).min(text.len());
            text.splice(from..to, PIECES[piece].chars());
        }
        let loaded = load(&text.into_iter().collect::<String>(), "m.yaml");
        let rendered = loaded.report.render(false);
        for found in &loaded.report.diagnostics {
            prop_assert!(found.source_line.get(found.span.clone()).is_some(), "{found:?}");
        }
        prop_assert_eq!(rendered.is_empty(), loaded.report.diagnostics.is_empty());
    }
}
