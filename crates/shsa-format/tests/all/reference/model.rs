//! `docs/model.md` against the tables of the keys.

use super::document::{Document, code};
use shsa_core::diagnosis::JudgeOptions;
use shsa_core::knowledge::{CAUSE_PRIOR, Fact, Figure, Measure, PROPERTIES, Switching};
use shsa_model::keys::{ASKED, FUSION_INPUT, FUSION_OUTPUT, FUSION_STATE, Form, GIVEN, Holds, Key, SECTIONS};
use shsa_model::{load, read, write};

fn page() -> Document {
    Document::read("model.md")
}

/// The sections whose entries have keys.
fn keyed() -> impl Iterator<Item = (&'static str, &'static [Key])> {
    SECTIONS.into_iter().filter_map(|section| match section.holds {
        Holds::Entries(keys, _) | Holds::Mapping(keys) => Some((section.name, keys)),
        Holds::Version | Holds::Values(_) => None,
    })
}

#[test]
fn every_section_is_described() {
    page().section("Sections").names_exactly("key", SECTIONS.map(|section| section.name));
}

#[test]
fn every_key_is_described() {
    for (section, keys) in keyed() {
        page().section(&format!("`{section}`")).names_exactly("key", keys.iter().map(|key| key.name));
    }
}

#[test]
fn every_choice_is_described() {
    let mut checked = 0;
    for (section, keys) in keyed() {
        let rows = page().section(&format!("`{section}`")).rows("key");
        for key in keys {
            let Form::Choice(choices) = key.form else { continue };
            let row = rows.iter().find(|row| code(&row[0]) == [key.name]).unwrap();
            assert_eq!(code(&row[1]), choices(), "{section}, {}", key.name);
            checked += 1;
        }
    }
    assert_eq!(checked, 9);
}

/// The keys of what is nested in a section, and the head of their table.
const NESTED: [(&str, &[Key]); 3] = [
    ("key of a state", &FUSION_STATE),
    ("key of an input", &FUSION_INPUT),
    ("key of an output", &FUSION_OUTPUT),
];

#[test]
fn every_nested_key_is_described_and_stands_in_an_example() {
    let section = page().section("`fusion`");
    let examples = section.blocks("yaml").concat();
    for (head, keys) in NESTED {
        section.names_exactly(head, keys.iter().map(|key| key.name));
        for key in keys {
            assert!(examples.contains(&format!("{}:", key.name)), "no example of `{}`", key.name);
        }
    }
}

/// What is written again has been read.
#[test]
fn every_key_stands_in_an_example_and_is_read_from_it() {
    for (section, keys) in keyed() {
        let examples = page().section(&format!("`{section}`")).blocks("yaml");
        let mut written = String::new();
        for example in &examples {
            let draft = read(example, section).expect("the example is a model").draft;
            let model: serde_json::Value = serde_json::from_str(&write::json(&draft)).unwrap();
            written += &model[section].to_string();
        }
        for key in keys {
            assert!(
                written.contains(&format!("\"{}\":", key.name)),
                "no example of `{}` of {section}",
                key.name
            );
        }
    }
}

#[test]
fn every_example_is_a_model_without_a_problem() {
    let examples = page().blocks("yaml");
    assert!(examples.len() > 5);
    for example in examples {
        let report = load(&example, "docs/model.md").report.without_notes();
        assert!(report.diagnostics.is_empty(), "{example}\n{}", report.render(false));
    }
}

#[test]
fn every_fact_of_a_utility_is_described() {
    let names = Fact::OF_RELATIONS.iter().chain(&Fact::OF_SIGNALS).map(|(name, _)| *name);
    let names = names.chain(Figure::NAMES.iter().map(|(name, _)| *name));
    let section = page().section("`utility`");
    section.names_exactly("fact", names);
    for (name, figure) in Figure::NAMES {
        let row = section.rows("fact").into_iter().find(|row| code(&row[0]) == [name]).unwrap();
        let unknown =
            figure.unknown().map_or("must be given under `defaults`".to_owned(), |value| value.to_string());
        assert_eq!(row[3], unknown, "{name}");
    }
}

#[test]
fn every_property_is_described() {
    page().section("Properties").names_exactly("property", PROPERTIES);
}

/// The cell of a section with the default of a key.
fn without(section: &str, head: &str, name: &str) -> String {
    let rows = page().section(section).rows(head);
    let row = rows.into_iter().find(|row| code(&row[0]) == [name]).unwrap();
    row[2].clone()
}

#[track_caller]
fn says(cell: &str, number: &str) {
    let mut words = cell.split([' ', ':', ';', ',']);
    assert!(cell.starts_with(number) || words.any(|word| word == number), "`{cell}` does not say {number}");
}

#[test]
fn usual_values_are_those_of_the_code() {
    let usual = Switching::default();
    says(&without("`needs`", "key", "hold"), &format!("{} s", usual.hold.seconds()));
    says(&without("`needs`", "key", "probation"), &format!("{} s", usual.probation.seconds()));
    says(&without("`needs`", "key", "hysteresis"), &usual.hysteresis.to_string());
    says(&without("`signals`", "key", "shares"), &CAUSE_PRIOR.to_string());
    let judge = JudgeOptions::default();
    says(&without("Properties", "property", "prior"), &judge.prior.to_string());
    says(&without("Properties", "property", "prior"), &judge.relation_prior.to_string());
}

/// The keys of statements, and the words of evidence.
#[test]
fn every_word_of_contracts_is_described() {
    let section = page().section("`contracts`");
    let cells = |head: &str, column: usize| -> Vec<String> {
        let rows = section.rows(head);
        rows.iter().flat_map(|row| code(&row[column])).collect()
    };
    for (column, keys) in [(0, &GIVEN[..]), (1, &ASKED[..])] {
        let documented = cells("in `gives`", column);
        let documented: Vec<&str> = documented.iter().filter_map(|cell| cell.split(':').next()).collect();
        let mut expected: Vec<&str> = keys.iter().map(|key| key.name).collect();
        let mut documented: Vec<&str> = documented.into_iter().collect();
        documented.sort_unstable();
        expected.sort_unstable();
        assert_eq!(documented, expected);
    }
    let measures = Measure::NAMES.iter().map(|(name, _)| *name).chain(["told"]);
    section.names_exactly("measure", measures);
}
