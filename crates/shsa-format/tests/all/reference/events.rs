//! `docs/events.md` against the kinds of the core; the stories that it names show what it describes.

use super::document::{Document, code};
use shsa_core::engine::{Event, EventKind, Quality};
use shsa_core::monitor::{Absence, Symptom};
use shsa_core::reason::{Joint, Kind, Reason};
use shsa_core::trust::Verdict;
use shsa_format::{event, story, words};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

fn page() -> Document {
    Document::read("events.md")
}

/// The path in a link such as `[02](../stories/02.yaml)`.
fn linked(cell: &str) -> String {
    let path = cell.split_once("](../").and_then(|(_, rest)| rest.strip_suffix(')'));
    path.unwrap_or_else(|| panic!("no link to a story in {cell}")).to_owned()
}

/// The events of stories, each reported once.
#[derive(Default)]
struct Stories(BTreeMap<String, Vec<Event>>);

impl Stories {
    fn of(&mut self, path: &str) -> &[Event] {
        self.0.entry(path.to_owned()).or_insert_with(|| {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
            let story = story::load_file(&file).story.unwrap_or_else(|| panic!("{path} is no story"));
            let run = story.run().run;
            run.events.into_iter().chain(run.outliers).collect()
        })
    }
}

#[test]
fn every_kind_is_described_and_shown_by_its_story() {
    let section = page().section("Kinds");
    section.names_exactly("kind", EventKind::ALL.map(EventKind::name));
    let mut stories = Stories::default();
    for row in section.rows("kind") {
        let (kind, story) = (code(&row[0]).remove(0), linked(&row[3]));
        assert!(stories.of(&story).iter().any(|event| event.kind.name() == kind), "no `{kind}` in {story}");
    }
}

#[test]
fn every_symptom_is_described_and_shown_by_its_story() {
    let section = page().section("Symptoms");
    section.names_exactly("symptom", Symptom::ALL.map(Symptom::name));
    let mut stories = Stories::default();
    for row in section.rows("symptom") {
        let (symptom, story) = (code(&row[0]).remove(0), linked(&row[3]));
        let is_seen = |event: &Event| event.symptom.is_some_and(|seen| seen.name() == symptom);
        assert!(stories.of(&story).iter().any(is_seen), "no `{symptom}` in {story}");
    }
}

#[test]
fn every_quality_is_described() {
    page().section("Qualities").names_exactly("quality", Quality::ALL.map(Quality::name));
}

#[test]
fn verdicts() {
    let absences = [None, Some(Absence::Silent), Some(Absence::Invalid), Some(Absence::OutOfRange)];
    let believed = [Verdict::Unknown, Verdict::Healthy, Verdict::Suspect, Verdict::Failed];
    let all = absences.iter().flat_map(|absence| believed.map(|it| event::verdict(*absence, it)));
    page().section("Verdicts").names_exactly("verdict", all.collect::<BTreeSet<_>>());
}

#[test]
fn every_reason_is_described_with_its_words_and_arguments() {
    let section = page().section("Reasons");
    section.names_exactly("code", Reason::ALL.iter().map(|described| described.code));
    for row in section.rows("code") {
        let code = code(&row[0]).remove(0);
        let described = Reason::ALL.iter().find(|described| described.code == code).unwrap();
        let argument = |(name, kind): &(&str, Kind)| format!("`{name}` ({})", kind.name());
        let arguments = described.arguments.iter().map(argument).collect::<Vec<_>>().join(", ");
        assert_eq!(row[1..], [words::sentence(&code).unwrap().to_owned(), arguments], "`{code}`");
    }
}

#[test]
fn every_joint_and_every_kind_of_argument_is_described() {
    let section = page().section("Reasons");
    section.names_exactly("joint", Joint::ALL.map(Joint::name));
    section.names_exactly("argument", Kind::ALL.iter().map(|kind| kind.name()));
    for row in section.rows("joint") {
        let name = code(&row[0]).remove(0);
        let joint = Joint::ALL.into_iter().find(|joint| joint.name() == name).unwrap();
        assert_eq!(code(&row[2]), [words::between(joint)], "`{name}`");
    }
}
