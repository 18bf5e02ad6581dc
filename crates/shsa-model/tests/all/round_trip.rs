//! Written drafts load to the same drafts, as YAML and JSON.

mod contracts;

use contracts::contract;
use proptest::prelude::*;
use shsa_core::knowledge::{
    BodyDraft, Bounds, ContractDraft, Draft, NeedDraft, RelationDraft, SignalDraft, SourceParts, Text,
    UtilityDraft, VariableDraft,
};
use shsa_message::source::parts;
use shsa_model::{load, read, write};
use std::fs;
use std::path::PathBuf;

fn models() -> Vec<(String, String)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let yaml = files.filter(|path| path.extension().is_some_and(|ending| ending == "yaml"));
    yaml.map(|path| (path.display().to_string(), fs::read_to_string(&path).unwrap())).collect()
}

/// A draft as text without the places.
fn shown(draft: &Draft) -> String {
    let text = format!("{draft:?}");
    let mut parts = text.split("place: Place {");
    let first = parts.next().unwrap_or("").to_owned();
    first + &parts.map(|part| part.split_once('}').unwrap().1).collect::<String>()
}

#[track_caller]
fn check_draft(draft: &Draft) {
    for text in [write::yaml(draft), write::json(draft)] {
        let again = read(&text, "again").unwrap();
        let (expected, found) = (shown(draft), shown(&again.draft));
        let same = expected.bytes().zip(found.bytes()).take_while(|(one, other)| one == other).count();
        let from = |text: &str| text.chars().skip(same.saturating_sub(60)).take(160).collect::<String>();
        assert!(
            expected == found,
            "expected: {}\nfound: {}\nwritten:\n{text}",
            from(&expected),
            from(&found)
        );
    }
}

#[track_caller]
fn check_model(name: &str, text: &str) {
    let draft = read(text, name).unwrap().draft;
    check_draft(&draft);
    let expected = load(text, name);
    assert!(expected.report.ok(), "{name}: {}", expected.report.render(false));
    for written in [write::yaml(&draft), write::json(&draft)] {
        let found = load(&written, name);
        assert_eq!(format!("{:?}", found.knowledge), format!("{:?}", expected.knowledge), "{name}");
    }
    serde_json::from_str::<serde_json::Value>(&write::json(&draft)).unwrap();
}

#[test]
fn every_model_loads_to_the_same_again() {
    let models = models();
    assert!(models.len() >= 5);
    models.iter().for_each(|(name, text)| check_model(name, text));
}

const EVERYTHING: &str = include_str!("everything.yaml");

#[test]
fn everything_loads_to_the_same_again() {
    check_model("everything", EVERYTHING);
    check_model("named utility", &EVERYTHING.replace(EVERYTHING.lines().last().unwrap(), "utility: norm"));
}

fn text() -> impl Strategy<Value = Text> {
    let word = prop_oneof![
        "[a-z_/][a-z0-9_/.]{0,6}",
        "-?[0-9]{1,3}(\\.[0-9]{1,3})?(e-?[0-9])?( (m|s|%|ms))?",
        "[ -~äß°\n\t\u{85}\u{2028}\u{feff}\u{1F600}]{1,8}",
        "(null|~|true|---|\\.\\.\\.|- a|\\? b|: c|#d|&e|\\*f|!g|\\||>|%h|@i|`j|'k|\"l)",
    ];
    let word = word.prop_map(|text| Text { text: text.trim().to_owned(), ..Text::default() });
    // an empty text cannot be told from an absent one
    word.prop_filter("a word", |text| !text.text.is_empty())
}

fn names(count: usize) -> impl Strategy<Value = Vec<Text>> {
    prop::collection::btree_map(text().prop_map(|text| text.text), Just(()), 0..count)
        .prop_map(|names| names.into_keys().map(|text| Text { text, ..Text::default() }).collect())
}

fn properties() -> impl Strategy<Value = Vec<(Text, Text)>> {
    names(3).prop_flat_map(|names| {
        let count = names.len();
        (Just(names), prop::collection::vec(text(), count))
            .prop_map(|(names, values)| names.into_iter().zip(values).collect())
    })
}

fn bounds() -> impl Strategy<Value = Bounds> {
    prop_oneof![text().prop_map(Bounds::One), (text(), text()).prop_map(|(lo, hi)| Bounds::Two(lo, hi))]
}

fn variable() -> impl Strategy<Value = VariableDraft> {
    let limits = (some((text(), text())), some(text()), some(text()));
    let parts = (some(text()), some(text()), limits, properties());
    parts.prop_map(|(unit, shape, (range, max_rate, wraps), properties)| VariableDraft {
        name: Text::default(),
        unit,
        shape,
        range,
        max_rate,
        wraps,
        properties,
    })
}

fn some<S: Strategy>(of: S) -> impl Strategy<Value = Option<S::Value>> {
    prop::option::of(of)
}

fn relation() -> impl Strategy<Value = RelationDraft> {
    let structure = (prop::collection::vec(text(), 1..3), prop::collection::vec(text(), 0..3));
    let body = prop_oneof![
        text().prop_map(BodyDraft::Equation),
        structure.prop_map(|(outputs, inputs)| BodyDraft::Structure { outputs, inputs }),
    ];
    let names = || prop::collection::vec(text(), 0..3);
    let parts = (body, some(names()), some(text()), some(bounds()), names(), properties());
    parts.prop_map(|(body, directions, condition, error, learn, properties)| RelationDraft {
        name: Text::default(),
        body,
        directions,
        condition,
        error,
        learn,
        properties,
    })
}

fn signal() -> impl Strategy<Value = SignalDraft> {
    let first = (some(text()), some(text()), some(text()), some(text()), some(bounds()));
    let second =
        (some(bounds()), some(text()), some(text()), prop::collection::vec(text(), 0..3), properties());
    let names = prop::collection::vec(text().prop_map(|name| (name, None)), 0..3);
    let priors = properties()
        .prop_map(|all| all.into_iter().map(|(name, prior)| (name, Some(prior))).collect::<Vec<_>>());
    let ranges = (some((text(), text())), some((text(), text())));
    let errors = (some(text()), some(text()));
    let limits = (ranges, some(text()), some(text()), some(text()), errors, some(text()));
    let scaling =
        ((some(text()), some(text())), some(text()), some(text()), some(text()), some(text()), some(text()));
    (first, second, prop_oneof![names, priors], limits, scaling).prop_map(
        |(
            (variable, source, unit, rate, value_error),
            (time_error, delay, timeout, derived_from, properties),
            shares,
            ((range, saturates), max_rate, max_delay, mean_over, (noise, change_error), frozen_after),
            ((scale, counter), offset, hold, rests_at, rests_for, access),
        )| {
            let name = Text::default();
            SignalDraft {
                name,
                variable,
                source,
                source_parts: SourceParts::default(),
                unit,
                scale,
                offset,
                rate,
                value_error,
                noise,
                change_error,
                time_error,
                delay,
                mean_over,
                timeout,
                range,
                saturates,
                max_rate,
                max_delay,
                frozen_after,
                counter,
                rests_at,
                rests_for,
                hold,
                access,
                derived_from,
                shares,
                properties,
            }
        },
    )
}

fn need() -> impl Strategy<Value = NeedDraft> {
    let first = (some(text()), some(text()), some(text()), some(text()));
    let second = (some(text()), some(text()), some(text()), some(text()));
    let third = (some(text()), some(text()), some(text()));
    (first, second, third).prop_map(
        |(
            (signal, max_age, max_width, integrity),
            (hold, probation, blend, hysteresis),
            (isolation, min_rate, when_unsure),
        )| {
            let variable = Text::default();
            NeedDraft {
                variable,
                signal,
                max_age,
                max_width,
                integrity,
                hold,
                probation,
                blend,
                hysteresis,
                isolation,
                min_rate,
                when_unsure,
            }
        },
    )
}

fn utility() -> impl Strategy<Value = Option<UtilityDraft>> {
    let at = Text::default();
    let own = (some(text()), some(text()), some(text()), some(text()), properties()).prop_map(
        move |(aggregate, relation, signal, way, defaults)| UtilityDraft::Own {
            at: at.clone(),
            aggregate,
            relation,
            signal,
            way,
            defaults,
        },
    );
    some(prop_oneof![text().prop_map(UtilityDraft::Named), own])
}

/// Some, each with a name of its own.
fn named<T: std::fmt::Debug + Clone>(
    of: impl Strategy<Value = T>,
    name: fn(&mut T, Text),
) -> impl Strategy<Value = Vec<T>> {
    let many = prop::collection::vec(of, 4);
    (names(4), many).prop_map(move |(names, items)| {
        names
            .into_iter()
            .zip(items)
            .map(|(text, mut item)| {
                name(&mut item, text);
                item
            })
            .collect()
    })
}

fn draft() -> impl Strategy<Value = Draft> {
    let pairs = named((Just(Text::default()), bounds()), |(name, _), text| *name = text);
    let functions = named((Just(Text::default()), text()), |(name, _), text| *name = text);
    let parts = (
        named(variable(), |variable, text| variable.name = text),
        pairs,
        functions,
        named(relation(), |relation, text| relation.name = text),
        named(signal(), |signal, text| {
            let source = signal.source.as_ref().map(|source| source.text.as_str());
            signal.source_parts = parts(&text.text, source);
            signal.name = text;
        }),
        named(need(), |need, text| need.variable = text),
        named(contract(), |contract, text| contract.name = text),
        utility(),
    );
    parts.prop_map(|(variables, constants, functions, relations, signals, needs, contracts, utility)| Draft {
        variables,
        constants,
        functions,
        relations,
        signals,
        fusions: Vec::new(),
        needs,
        platform: contracts.iter().cloned().map(|it| ContractDraft { policy: None, ..it }).collect(),
        contracts,
        utility,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn any_draft_is_read_as_it_was_written(draft in draft()) {
        check_draft(&draft);
    }
}
