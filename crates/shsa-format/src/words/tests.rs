//! Every code has a sentence that names all of its arguments, and a reason is read back from what is written of it.

use super::*;
use shsa_core::engine::{Order, Subject};
use shsa_core::reason::{Clause, Kind};
use std::collections::BTreeSet;

/// An argument of a kind; no two of one number are alike, nor part of each other.
fn sample(kind: Kind, number: usize) -> Argument {
    let name = |part: &str| format!("<{part}{number}>");
    let unit = Some(name("unit"));
    let value = 2.0 + number as f64;
    let candidate = |part: &str| Candidate {
        source: name(part),
        utility: value,
        proof: Some(Proof {
            agreement: Some(0.5),
            error: Some(Amount { value, unit: Some(name("unit")) }),
            availability: None,
        }),
    };
    match kind {
        Kind::Name => Argument::Name(name("name")),
        Kind::Names => Argument::Names(vec![name("first"), name("second")]),
        Kind::Span => Argument::Span(Span((number as i64 + 2) * 1_000_000_000)),
        Kind::Count => Argument::Count(number as u64 + 7),
        Kind::Number => Argument::Number(value + 0.25),
        Kind::Probability => Argument::Probability(Probability(0.125 * (number as f64 + 1.0))),
        Kind::Range => Argument::Range(Range { lo: -value, hi: value, unit }),
        Kind::Amount => Argument::Amount(Amount { value, unit }),
        Kind::Subject => Argument::Subject(Subject::Relation(name("relation"))),
        Kind::Subjects => {
            Argument::Subjects(vec![Subject::Signal(name("signal")), Subject::Cause(name("cause"))])
        }
        Kind::Order => Argument::Order(Order::Release(name("need"))),
        Kind::Orders => Argument::Orders(vec![Order::Release(name("need")), Order::Release(name("other"))]),
        Kind::ServedBy => Argument::ServedBy(ServedBy::Hull(vec![name("one"), name("two")])),
        Kind::Candidate => Argument::Candidate(candidate("source")),
        Kind::Candidates => Argument::Candidates(vec![candidate("source"), candidate("other")]),
    }
}

/// A reason of every code, with other arguments for each number.
pub(crate) fn all(number: usize) -> impl Iterator<Item = Reason> {
    Reason::ALL.iter().map(move |described| {
        let mut count = number * 10;
        let reason = Reason::read(described.code, |_, kind| {
            count += 1;
            Some(sample(kind, count))
        });
        reason.unwrap_or_else(|| panic!("`{}` is not read", described.code))
    })
}

#[test]
fn codes_are_unique_and_have_one_sentence_each_in_the_same_order() {
    let codes: Vec<&str> = Reason::ALL.iter().map(|described| described.code).collect();
    let sentences: Vec<&str> = SENTENCES.iter().map(|(code, _)| *code).collect();
    assert_eq!(codes.iter().collect::<BTreeSet<_>>().len(), codes.len(), "a code is there twice");
    assert_eq!(codes, sentences);
    let is_plain = |code: &&&str| code.chars().all(|it| it.is_ascii_lowercase() || it == '-');
    assert_eq!(codes.iter().filter(is_plain).count(), codes.len(), "codes are of small letters and `-`");
}

#[test]
fn every_sentence_names_all_arguments_of_its_code_and_nothing_else() {
    for described in Reason::ALL {
        let sentence = sentence(described.code).unwrap_or_default();
        let places =
            sentence.split('{').skip(1).map(|part| part.split(['}', ':']).next().unwrap_or_default());
        let known = described.arguments.iter().map(|(name, _)| *name);
        assert_eq!(
            places.collect::<BTreeSet<_>>(),
            known.collect::<BTreeSet<_>>(),
            "{}: {sentence}",
            described.code
        );
    }
}

#[test]
fn the_words_of_a_reason_show_each_of_its_arguments() {
    for reason in all(0) {
        let text = super::reason(&reason);
        assert!(!text.contains(['{', '}']), "{text}");
        for (name, argument) in reason.arguments() {
            let shown = shown(&argument, "");
            assert!(text.contains(&shown), "{}: `{name}`, {shown}, is not in `{text}`", reason.code());
        }
    }
}

#[test]
fn a_reason_is_its_code_and_its_arguments() {
    for (one, other) in all(0).zip(all(1)) {
        let arguments = one.arguments();
        let given = |name: &'static str, kind: Kind| {
            let found =
                arguments.iter().find(|(known, _)| *known == name).map(|(_, argument)| argument.clone());
            assert_eq!(found.as_ref().map(std::mem::discriminant), {
                Some(std::mem::discriminant(&sample(kind, 0)))
            });
            found
        };
        assert_eq!(Reason::read(one.code(), given), Some(one.clone()));
        assert_eq!(one == other, arguments.is_empty(), "{one:?} {other:?}");
        let without = Reason::read(one.code(), |_, _| None);
        assert_eq!(without.is_some(), arguments.is_empty(), "{one:?} is read without its arguments");
        let of_another_kind = |_, kind| match kind {
            Kind::Count => Some(Argument::Number(1.0)),
            _ => Some(Argument::Count(1)),
        };
        assert_eq!(Reason::read(one.code(), of_another_kind).is_some(), arguments.is_empty(), "{one:?}");
    }
    assert_eq!(Reason::read("no-such-code", |_, kind| Some(sample(kind, 0))), None);
}

#[test]
fn reasons_are_joined_by_how_they_follow_each_other() {
    let clause = |joint| Clause { joint, reason: Reason::Infinite };
    let because: Reasons = Joint::ALL.into_iter().map(clause).collect();
    assert_eq!(reasons(&because), "infinite: infinite, and infinite, infinite infinite");
    let twice =
        Reasons::from(Reason::Cleared).then(Joint::And, because.clone()).then(Joint::Next, Reason::Undecided);
    let joints: Vec<Joint> = twice.clauses().iter().map(|clause| clause.joint).collect();
    let expected =
        [Joint::Next, Joint::And, Joint::Namely, Joint::And, Joint::Also, Joint::With, Joint::Next];
    assert_eq!(joints, expected);
    assert_eq!(reasons(&Reasons::default()), "");
    assert_eq!(reasons(&Reasons::default().then(Joint::And, Reason::Undecided)), reason(&Reason::Undecided));
}

#[test]
fn quantities() {
    #[track_caller]
    fn check(argument: Argument, manner: &str, expected: &str) {
        assert_eq!(shown(&argument, manner), expected);
    }
    let names = |count: usize| (1..=count).map(|number| format!("s{number}")).collect::<Vec<_>>();
    let amount = |value: f64, unit: &str| {
        Argument::Amount(Amount { value, unit: (!unit.is_empty()).then(|| unit.to_owned()) })
    };
    check(Argument::Names(names(3)), "few", "s1, s2, s3");
    check(Argument::Names(names(5)), "few", "s1, s2, s3 and 2 more");
    check(Argument::Names(names(5)), "", "s1, s2, s3, s4, s5");
    check(Argument::Count(1), "times", "once");
    check(Argument::Count(3), "times", "3 times");
    check(Argument::Span(Span(-20_000_000)), "", "-20 ms");
    check(Argument::Span(Span(99_900_000_000)), "", "99.9 s");
    check(Argument::Span(Span(100_000_000_000)), "", "100 s");
    check(Argument::Probability(Probability(1.0)), "", "above 0.999");
    check(Argument::Probability(Probability(0.0123)), "", "0.012");
    check(Argument::Probability(Probability(0.5)), "", "0.50");
    check(amount(0.0, ""), "", "0");
    check(amount(0.001_234_56, "m"), "", "0.001235 m");
    check(amount(-12.345, "m/s"), "", "-12.35 m/s");
    check(amount(123_456.7, "Pa"), "", "123457 Pa");
    check(amount(1.5e12, "Hz"), "", "1.500e12 Hz");
    let range = Range { lo: 1.0, hi: 2.5, unit: None };
    check(Argument::Range(range), "", "1.000..2.500");
    let agreeing = ServedBy::Agreeing { count: 2, ways: names(3) };
    check(Argument::ServedBy(agreeing), "", "what 2 of 3 hold possible: s1; s2; s3");
    check(Argument::ServedBy(ServedBy::LastTrusted), "", "the last trusted value");
    let candidate = Candidate { source: "/a by r".to_owned(), utility: 0.9, proof: None };
    check(Argument::Candidate(candidate.clone()), "", "/a by r (utility 0.900)");
    let unproven = Candidate { proof: Some(Proof::default()), ..candidate };
    check(Argument::Candidate(unproven.clone()), "", "/a by r (utility 0.900, not proven)");
    let seen = Proof { agreement: None, error: None, availability: Some(0.25) };
    let seen = Candidate { proof: Some(seen), ..unproven };
    let expected = "/a by r (utility 0.900, agreed in an unknown share, there 25.0 % of the time)";
    check(Argument::Candidate(seen), "", expected);
}
