//! A change of a text has the same effect as the change of the model, and all other text stays.

use crate::live::{Live, Written};
use crate::patch::patched;
use crate::{read, write};
use proptest::prelude::*;
use shsa_core::knowledge::Draft;

const MODEL: &str = "\
shsa: 1
# What is known.
variables: { x: { unit: m, range: [0, 9] }, y: { unit: m } }

relations:
  same: y = x                 # exact, as yet
signals:
  # Measured last year.
  /a: { variable: x, rate: 10 Hz, value_error: 0.1 }   # the old one
  /b:
    variable: y
    rate: 5 Hz                # as it comes
    value_error: 0.2          # by its data sheet
    properties:
      accuracy: 0.9
needs:
  x: { max_age: 1 s }
";

fn written(text: &str) -> Written<'_> {
    Written { name: "model", text }
}

fn after(change: &str) -> String {
    patched(written(MODEL), written(change)).unwrap_or_else(|report| panic!("{}", report.render(false)))
}

/// The removed lines of the model and the new ones.
fn difference(text: &str) -> String {
    let gone = MODEL
        .lines()
        .filter(|line| !text.lines().any(|other| other == *line))
        .map(|line| format!("-{line}\n"));
    let new = text
        .lines()
        .filter(|line| !MODEL.lines().any(|other| other == *line))
        .map(|line| format!("+{line}\n"));
    gone.chain(new).collect()
}

#[track_caller]
fn check(change: &str, expected: &str) {
    assert_eq!(difference(&after(change)), expected);
}

#[test]
fn a_change_without_an_entry_changes_nothing() {
    assert_eq!(after(""), MODEL);
    assert_eq!(after("# Calibrated: all numbers stay.\n\n"), MODEL);
}

#[test]
fn values_are_put_in_their_places() {
    check(
        "signals:\n  /a: { variable: x, rate: 10 Hz, value_error: [-0.1, 0.3] }\n",
        "-  /a: { variable: x, rate: 10 Hz, value_error: 0.1 }   # the old one\n\
         +  /a: { variable: x, rate: 10 Hz, value_error: [-0.1, 0.3] }   # the old one\n",
    );
    check(
        "signals:\n  /b: { variable: y, rate: 5 Hz, value_error: 0.3 + 1 %, properties: { accuracy: 0.9 } }\n",
        "-    value_error: 0.2          # by its data sheet\n+    value_error: 0.3 + 1 %          # by its data sheet\n",
    );
    check(
        "relations:\n  same: { equation: y = x, error: 0.1 }\n",
        "-  same: y = x                 # exact, as yet\n+  same: { equation: y = x, error: 0.1 }                 # exact, as yet\n",
    );
}

#[test]
fn keys_and_entries_are_added_and_removed() {
    check(
        "signals:\n  /a: { variable: x, rate: 10 Hz, value_error: 0.1, delay: 20 ms }\n  /b: { variable: y, rate: 5 Hz, value_error: 0.2, properties: { accuracy: 0.9 }, delay: 5 ms }\n",
        "-  /a: { variable: x, rate: 10 Hz, value_error: 0.1 }   # the old one\n\
         +  /a: { variable: x, rate: 10 Hz, value_error: 0.1, delay: 20 ms }   # the old one\n+    delay: 5 ms\n",
    );
    check(
        "signals:\n  /b: { variable: y, value_error: 0.2, properties: { accuracy: 0.9 } }\n",
        "-    rate: 5 Hz                # as it comes\n",
    );
    check(
        "signals:\n  /a: { variable: x, rate: 10 Hz }\n",
        "-  /a: { variable: x, rate: 10 Hz, value_error: 0.1 }   # the old one\n+  /a: { variable: x, rate: 10 Hz }   # the old one\n",
    );
    check(
        "signals:\n  /c: { variable: x }\n  /d: { variable: y }\n",
        "+  /c: { variable: x }\n+  /d: { variable: y }\n",
    );
    check(
        "constants:\n  k: 2\nrelations:\n  twice: y = k * x\n",
        "+  twice: y = k * x\n+constants:\n+  k: 2\n",
    );
    check("relations:\n  same: null\n", "-  same: y = x                 # exact, as yet\n");
}

#[test]
fn what_is_wrong_is_reported() {
    let refuse = |change: &str, words: &str| {
        let report = patched(written(MODEL), written(change)).expect_err(change);
        assert!(report.render(false).contains(words), "{}", report.render(false));
    };
    refuse("signals:\n  /a: { variabel: x }\n", "did you mean `variable`?");
    refuse("available: { /a: false }\n", "cannot be put into the text");
}

/// A draft without its places.
fn meant(draft: &Draft) -> serde_json::Value {
    serde_json::from_str(&write::json(draft)).unwrap()
}

proptest! {
    #[test]
    fn the_text_says_what_the_changed_model_does(
        error in prop::option::of(0.0..9.0_f64),
        bounds in any::<bool>(),
        delay in prop::option::of(1..900_u32),
        range in prop::option::of(0..9_u32),
        name in prop::sample::select(vec!["/a", "/b", "/c", "a name: with # signs"]),
    ) {
        let error = error.map(|error| if bounds { format!(", value_error: [-{error}, {error}]") } else { format!(", value_error: {error}") });
        let delay = delay.map(|delay| format!(", delay: {delay} ms"));
        let range = range.map(|high| format!("variables: {{ x: {{ unit: m, range: [0, {high}] }} }}\n")).unwrap_or_default();
        let (error, delay) = (error.unwrap_or_default(), delay.unwrap_or_default());
        let change = format!("{range}signals:\n  \"{name}\": {{ variable: x{error}{delay} }}\n");
        let (mut live, _) = Live::load(written(MODEL)).unwrap();
        live.change(written(&change)).unwrap();
        let text = after(&change);
        prop_assert_eq!(meant(&read(&text, "again").unwrap().draft), meant(live.draft()));
        for comment in ["# What is known.", "# Measured last year.", "# exact, as yet"] {
            prop_assert!(text.contains(comment), "{}", text);
        }
    }
}
