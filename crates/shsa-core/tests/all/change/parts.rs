//! Parts of a model: taken out with all that they need, and joined without contradiction.

use super::drafts::{need, properties, relation, signal, structure, text, two_systems, variable};
use proptest::prelude::*;
use shsa_core::knowledge::{
    Bounds, Draft, Place, Severity, Text, UtilityDraft, VariableDraft, build, join, part,
};

/// Two systems, partly connected by a function, constants and a derived signal.
fn whole() -> Draft {
    let mut draft = two_systems();
    draft.constants =
        vec![(text("limit"), Bounds::One(text("30 m/s"))), (text("unused_by_speed"), Bounds::One(text("1")))];
    draft.functions = vec![(text("capped(x)"), text("min(x, limit)")), (text("twice(x)"), text("2 * x"))];
    draft.variables.push(variable("safe", "m/s", ""));
    draft.relations.push(relation("capping", "safe = capped(speed)", "safe", ""));
    draft.relations.push(structure("guess", &["speed"], &["climb"]));
    let mut filtered = signal("filtered", "speed", "10 Hz", "0.5");
    filtered.derived_from = vec![text("gnss")];
    draft.signals.push(filtered);
    draft
}

fn names(draft: &Draft) -> [Vec<&str>; 6] {
    [
        draft.variables.iter().map(|it| it.name.text.as_str()).collect(),
        draft.constants.iter().map(|it| it.0.text.as_str()).collect(),
        draft.functions.iter().map(|it| it.0.text.as_str()).collect(),
        draft.relations.iter().map(|it| it.name.text.as_str()).collect(),
        draft.signals.iter().map(|it| it.name.text.as_str()).collect(),
        draft.needs.iter().map(|it| it.variable.text.as_str()).collect(),
    ]
}

fn has_errors(draft: &Draft) -> bool {
    build(draft).1.iter().any(|found| found.severity == Severity::Error)
}

#[test]
fn a_part_brings_all_that_it_needs() {
    let draft = whole();
    let balloon = part(&draft, &["height", "climb", "gain", "climbing", "gaining"]).unwrap();
    let expected: [&[&str]; 6] = [
        &["height", "climb", "gain"],
        &[],
        &[],
        &["climbing", "gaining"],
        &["barometer", "lidar", "vario"],
        &["height", "climb", "gain"],
    ];
    assert_eq!(names(&balloon), expected);
    assert!(!has_errors(&balloon));
    let capped = part(&draft, &["capping", "filtered"]).unwrap();
    let expected: [&[&str]; 6] =
        [&["speed", "safe"], &["limit"], &["capped(x)"], &["capping"], &["gnss", "filtered"], &[]];
    assert_eq!(names(&capped), expected);
    assert!(!has_errors(&capped));
    assert_eq!(part(&draft, &["spede", "height", "lidr"]).unwrap_err(), ["lidr", "spede"]);
}

proptest! {
    #[test]
    fn parts_that_cover_a_model_join_to_it(choice in prop::collection::vec(0..3_usize, 40)) {
        let draft = whole();
        let all: Vec<String> = names(&draft)
            .concat()
            .into_iter()
            .map(|name| name.split('(').next().unwrap_or_default().to_owned())
            .collect();
        let of = |number| {
            let chosen = all.iter().zip(&choice).filter(|(_, part)| **part == number);
            part(&draft, &chosen.map(|(name, _)| name.as_str()).collect::<Vec<_>>()).unwrap()
        };
        let parts = [of(0), of(1), of(2)];
        for one in &parts {
            prop_assert!(build(one).1.iter().all(|found| {
                found.severity == Severity::Warning || found.message.starts_with("nothing can provide")
            }), "{:?}", build(one).1);
        }
        let joint = join(&parts).unwrap();
        let sorted = |draft: &Draft| {
            let mut all = names(draft).map(|mut names| {
                names.sort_unstable();
                names.into_iter().map(str::to_owned).collect::<Vec<_>>()
            });
            all.sort();
            all
        };
        prop_assert_eq!(sorted(&joint), sorted(&draft));
        prop_assert!(!has_errors(&joint));
    }
}

#[test]
fn a_whole_joined_with_itself_is_itself() {
    let draft = whole();
    assert_eq!(format!("{:?}", join(&[draft.clone(), draft.clone()]).unwrap()), format!("{draft:?}"));
}

#[test]
fn a_variable_may_be_described_in_pieces() {
    let ranged = VariableDraft {
        name: text("speed"),
        range: Some((text("0"), text("40"))),
        ..VariableDraft::default()
    };
    let one = Draft { variables: vec![variable("speed", "m/s", "")], ..Draft::default() };
    let other = Draft { variables: vec![ranged], ..Draft::default() };
    let joint = join(&[one, other]).unwrap();
    assert!(matches!(joint.variables.as_slice(), [speed] if speed.unit.is_some() && speed.range.is_some()));
}

#[track_caller]
fn check(one: Draft, other: Draft, expected: &[&str]) {
    let found = join(&[one, other]).map(|_| ()).unwrap_err();
    let found: Vec<&str> = found.iter().map(|found| found.message.as_str()).collect();
    assert_eq!(found, expected);
}

#[test]
fn contradictions_name_what_is_different() {
    let with = |change: fn(&mut Draft)| {
        let mut draft = whole();
        change(&mut draft);
        draft
    };
    check(
        whole(),
        with(|draft| draft.variables[0] = variable("speed", "km/h", "5 m/s^2")),
        &[
            "two parts describe variable `speed` differently: unit: `m/s` and `km/h`; max_rate: `6 m/s^2` and `5 m/s^2`",
        ],
    );
    check(
        whole(),
        with(|draft| {
            draft.constants[0].1 = Bounds::One(text("31 m/s"));
            draft.functions[1].1 = text("3 * x");
        }),
        &[
            "two parts describe constant `limit` differently: value: `30 m/s` and `31 m/s`",
            "two parts describe function `twice(x)` differently: formula: `2 * x` and `3 * x`",
        ],
    );
    check(
        whole(),
        with(|draft| {
            draft.relations[1] = relation("gaining", "gain = integral(climb) + 1 m", "gain", "0.1 m");
            draft.signals[2].properties = properties(&[("accuracy", "0.5")]);
            draft.needs[0] = need("speed", "1 s");
        }),
        &[
            "two parts describe relation `gaining` differently: equation: `gain = integral(climb)` and `gain = integral(climb) + 1 m`",
            "two parts describe signal `gnss` differently: properties: nothing and `accuracy: 0.5`",
            "two parts describe need `speed` differently: max_age: `300 ms` and `1 s`",
        ],
    );
    let (mut one, mut other) = (whole(), whole());
    one.utility = Some(UtilityDraft::Named(text("norm")));
    other.utility = Some(UtilityDraft::Named(text("cost")));
    check(one, other, &["two parts rate differently: utility: `norm` and `cost`"]);
}

#[test]
fn the_way_of_writing_makes_no_difference() {
    let mut other = whole();
    other.variables[0] = variable("speed", "m s^-1", "6.0 m/s^2");
    other.relations[1] = relation("gaining", "gain=integral( climb )", "gain", "10 cm");
    other.signals[0].rate = Some(text("1500 1/min"));
    other.needs[0].max_age = Some(text("0.3 s"));
    assert!(join(&[whole(), other]).is_ok());
}

#[test]
fn both_places_are_reported() {
    let at = |draft: &mut Draft, from| {
        draft.variables[0].name = Text { text: "speed".to_owned(), place: Place { from, to: from + 5 } };
    };
    let (mut one, mut other) = (whole(), whole());
    at(&mut one, 10);
    at(&mut other, 1_000);
    other.variables[0].unit = Some(text("kg"));
    let found = join(&[one, other]).unwrap_err();
    assert_eq!((found[0].earlier.from, found[0].place.from), (10, 1_000));
}
