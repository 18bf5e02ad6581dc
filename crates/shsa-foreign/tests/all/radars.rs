//! The public radars of the thesis beside the story of the same relations.

use shsa_core::knowledge::KnowledgeBase;
use shsa_format::story;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::Path;

/// The relations without the direction behind their names, each with the variables that it reads or produces; constants, which a file of the
/// thesis gives to every relation, left out.
fn structure(knowledge: &KnowledgeBase) -> BTreeMap<String, BTreeSet<String>> {
    let mut structure: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for relation in knowledge.relations().iter() {
        let family = relation.name.trim_end_matches("_x").trim_end_matches("_y").to_owned();
        let variables = relation.inputs.iter().chain(&relation.outputs);
        let names =
            variables.map(|&id| &knowledge.variables()[id]).filter(|variable| variable.constant.is_none());
        structure.entry(family).or_default().extend(names.map(|variable| variable.name.clone()));
    }
    structure
}

/// The public file cannot run alone: its condition is a function in a second file, of Python, which is never executed. All but that is
/// taken over, and the story has the same relations over the same variables.
#[test]
fn the_public_radars_are_those_of_the_story() {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/knowledge/radar-tracking.yaml");
    let Ok(text) = std::fs::read_to_string(&path) else {
        let _ = writeln!(std::io::stderr(), "SKIPPED: the public radar-tracking.yaml is absent");
        return;
    };
    let public = shsa_foreign::load(&text, "radar-tracking.yaml");
    assert!(public.report.ok(), "{}", public.report.render(false));
    let told = public.report.render(false);
    assert!(told.contains("other files of Python are not read") && told.contains("structure only"), "{told}");
    let stories = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../stories");
    let story =
        story::load_file(&stories.join("04-a-track-in-the-field-of-view.yaml")).story.expect("a story");
    assert_eq!(structure(&public.knowledge), structure(&story.knowledge));
}
