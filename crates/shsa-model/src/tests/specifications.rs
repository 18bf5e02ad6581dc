//! Temporal specifications: what they become, errors at their place, and how they are written.

use super::{check, loaded};
use crate::{read, write};

const PLANT: &str = "variables: { command: { unit: '%' }, flow: { unit: l/s } }
specifications:
  never_over: flow < 10 l/s
  answers: { when: command > 50 %, eventually: flow > 1 l/s, within: 2 s }
  drains: { when: command < 1 %, always: flow < 1 l/s, for: 5 s, properties: { prior: 1e-4 } }
  pulses: { eventually: flow > 1 l/s, within: 1 h }
signals:
  /command: { variable: command, rate: 10 Hz, value_error: 1 }
  /flow: { variable: flow, rate: 10 Hz, value_error: 0.1 }";

fn plant(from: &str, to: &str) -> String {
    assert!(PLANT.contains(from), "{from}");
    PLANT.replace(from, to)
}

#[test]
fn a_specification_is_a_verdict_that_is_computed_and_required() {
    let knowledge = loaded(PLANT).knowledge;
    let names = knowledge.specifications().iter().map(|it| {
        let relation = |id| knowledge.relations()[id].name.as_str();
        (knowledge.variables()[it.variable].name.as_str(), relation(it.verdict), relation(it.required))
    });
    let expected = ["never_over", "answers", "drains", "pulses"];
    let required = expected.map(|name| format!("{name} is required"));
    let expected: Vec<_> =
        expected.iter().zip(&required).map(|(name, required)| (*name, *name, required.as_str())).collect();
    assert_eq!(names.collect::<Vec<_>>(), expected);
    let texts = knowledge.specifications().iter().map(|it| knowledge.relations()[it.verdict].text.as_str());
    assert_eq!(
        texts.collect::<Vec<_>>(),
        [
            "always flow < 10 l/s",
            "when command > 50 %, eventually flow > 1 l/s within 2 s",
            "when command < 1 %, always flow < 1 l/s for 5 s",
            "eventually flow > 1 l/s within 1 h",
        ]
    );
}

#[test]
fn specifications_are_written_as_they_were_read() {
    let written = write::yaml(&read(&format!("shsa: 1\n{PLANT}"), "plant").unwrap().draft);
    assert!(written.contains("when: command > 50 %, eventually: flow > 1 l/s, within: 2 s"), "{written}");
    assert!(!written.contains("is required"), "{written}");
}

#[test]
fn what_a_specification_lacks_is_reported() {
    check(
        &plant(", within: 2 s", ""),
        "5:3 error: specification `answers` does not say within which time (write `within`, such as `within: 2 s`)",
    );
    check(
        &plant("within: 1 h", "for: 1 h"),
        "7:3 error: specification `pulses` does not say within which time (write `within`, such as `within: 2 s`)",
    );
    check(
        &plant("{ eventually: flow > 1 l/s, within: 1 h }", "{ when: flow > 1 l/s }"),
        "7:3 error: specification `pulses` requires nothing (give it a condition under `always` or `eventually`)",
    );
    check(
        &plant("within: 2 s", "within: 2 m"),
        "5:70 error: `2 m` is no time (write a time like `300 ms` or `2 s`)",
    );
    check(
        &plant("within: 2 s", "within: 0 s"),
        "5:70 error: `0 s` is no time to wait for (write more than 0 s, at most a million seconds)",
    );
    check(
        &plant("flow < 10 l/s", "flow < 10 m"),
        "4:15 error: `<` of m^3/s and m (both sides must have the same unit)",
    );
    check(
        &plant("flow < 10 l/s", "2 > 1"),
        "4:3 error: this specification is about no variable (name variables in its conditions)",
    );
    check(
        &plant("never_over", "flow"),
        "4:3 error: variable `flow` is given twice (keep one, or rename one)",
    );
    check(
        &plant("never_over", "once"),
        "4:3 error: `once` cannot be a name (a name has letters, digits and `_`, begins with a letter, and means nothing else)",
    );
    check(
        &plant("flow < 10 l/s", "{ always: flow < 10 l/s, for: 5 s }"),
        "4:45 error: `for` has no meaning without `when` (say since when, or leave `for` away)",
    );
}
