//! Edits of a model compared with the simplest implementation: lists of names, and the final draft built at once.

use super::drafts::{need, properties, relation, remove, signal, structure, text, two_systems, variable};
use proptest::prelude::*;
use shsa_core::knowledge::{
    Bounds, Draft, Edit, Element, KnowledgeBase, Model, NeedDraft, RelationDraft, Section, Severity,
    SignalDraft, VariableDraft, build,
};

/// A model as lists of names and entries, in file order.
#[derive(Clone, Debug, Default)]
struct Lists {
    variables: Vec<(String, VariableDraft)>,
    constants: Vec<(String, (String, String))>,
    functions: Vec<(String, (String, String))>,
    relations: Vec<(String, RelationDraft)>,
    signals: Vec<(String, SignalDraft)>,
    needs: Vec<(String, NeedDraft)>,
}

fn put<T>(list: &mut Vec<(String, T)>, name: &str, entry: T) {
    match list.iter().position(|(known, _)| known == name) {
        Some(at) => list[at].1 = entry,
        None => list.push((name.to_owned(), entry)),
    }
}

/// Removes an entry; returns whether it was there.
fn take<T>(list: &mut Vec<(String, T)>, name: &str) -> bool {
    let at = list.iter().position(|(known, _)| known == name);
    at.map(|at| list.remove(at)).is_some()
}

impl Lists {
    /// Makes an edit; returns whether all its names are known.
    fn edit(&mut self, edit: &Edit) -> bool {
        match edit {
            Edit::Variable(draft) => put(&mut self.variables, &draft.name.text, draft.clone()),
            Edit::Constant(name, Bounds::One(value)) => {
                put(&mut self.constants, &name.text, (name.text.clone(), value.text.clone()));
            }
            Edit::Function(head, body) => {
                let name = head.text.split('(').next().unwrap_or_default();
                put(&mut self.functions, name, (head.text.clone(), body.text.clone()));
            }
            Edit::Relation(draft) => put(&mut self.relations, &draft.name.text, draft.clone()),
            Edit::Signal(draft) => put(&mut self.signals, &draft.name.text, draft.clone()),
            Edit::Needs(drafts) => {
                drafts.iter().for_each(|draft| put(&mut self.needs, &draft.variable.text, draft.clone()));
            }
            Edit::Need(draft) => put(&mut self.needs, &draft.variable.text, draft.clone()),
            Edit::Remove(section, name) => return self.remove(*section, &name.text),
            Edit::Property { element, name, value, .. } => {
                let Some((_, signal)) = self.signals.iter_mut().find(|(known, _)| *known == element.text)
                else {
                    return false;
                };
                let before = signal.properties.len();
                let place = signal.properties.iter().position(|(known, _)| known.text == name.text);
                match (place, value) {
                    (Some(at), Some(value)) => signal.properties[at].1 = value.clone(),
                    (None, Some(value)) => signal.properties.push((name.clone(), value.clone())),
                    _ => signal.properties.retain(|(known, _)| known.text != name.text),
                }
                return value.is_some() || signal.properties.len() < before;
            }
            _ => {}
        }
        true
    }

    fn remove(&mut self, section: Section, name: &str) -> bool {
        match section {
            Section::Variables => take(&mut self.variables, name),
            Section::Constants => take(&mut self.constants, name),
            Section::Functions => take(&mut self.functions, name),
            Section::Relations => take(&mut self.relations, name),
            Section::Signals => take(&mut self.signals, name),
            // This test adds no fusions.
            Section::Fusions => false,
            Section::Needs => take(&mut self.needs, name),
            Section::Platform | Section::Contracts => false,
        }
    }

    fn draft(&self) -> Draft {
        let pair = |(_, (name, value)): &(String, (String, String))| (text(name), text(value));
        let constants = self.constants.iter().map(pair).map(|(name, value)| (name, Bounds::One(value)));
        Draft {
            variables: self.variables.iter().map(|(_, draft)| draft.clone()).collect(),
            constants: constants.collect(),
            functions: self.functions.iter().map(pair).collect(),
            relations: self.relations.iter().map(|(_, draft)| draft.clone()).collect(),
            signals: self.signals.iter().map(|(_, draft)| draft.clone()).collect(),
            fusions: Vec::new(),
            needs: self.needs.iter().map(|(_, draft)| draft.clone()).collect(),
            ..Draft::default()
        }
    }
}

/// The contents of a knowledge base without its version.
fn reported(knowledge: &KnowledgeBase) -> String {
    let variables = knowledge.variables().ids();
    let edges: Vec<_> =
        variables.map(|variable| (knowledge.producers(variable), knowledge.carriers(variable))).collect();
    let available: Vec<bool> =
        knowledge.signals().ids().map(|signal| knowledge.is_available(signal)).collect();
    format!(
        "{:?}\n{:?}\n{:?}\n{:?}\n{:?}\n{edges:?}\n{available:?}",
        knowledge.variables(),
        knowledge.relations(),
        knowledge.signals(),
        knowledge.needs(),
        knowledge.utility()
    )
}

fn named(prefix: &'static str, count: usize) -> impl Strategy<Value = String> {
    (0..count).prop_map(move |number| format!("{prefix}{number}"))
}

/// Edits over few names, so that they interact; most are valid.
fn edit() -> impl Strategy<Value = Edit> {
    let variables = || named("v", 4);
    let section = prop::sample::select(vec![
        (Section::Variables, "v"),
        (Section::Constants, "c"),
        (Section::Functions, "f"),
        (Section::Relations, "r"),
        (Section::Signals, "s"),
        (Section::Needs, "v"),
    ]);
    let equations =
        prop::sample::select(vec!["v0 = 2 * v1", "v1 = v2 + v3", "v3 = c0 * v0", "v2 = f0(v1)", "v0 = "]);
    let accuracy = prop::sample::select(vec!["0.5", "1", "0.125", "7", "two"]);
    prop_oneof![
        3 => variables().prop_map(|name| Edit::Variable(variable(&name, "1", ""))),
        1 => (named("c", 2), 1..9_u32).prop_map(|(name, value)| Edit::Constant(text(&name), Bounds::One(text(&value.to_string())))),
        1 => (named("f", 2), 1..9_u32).prop_map(|(name, value)| Edit::Function(text(&format!("{name}(x)")), text(&format!("{value} * x")))),
        2 => (named("r", 4), equations).prop_map(|(name, equation)| Edit::Relation(relation(&name, equation, "", ""))),
        2 => (named("r", 4), variables(), variables()).prop_map(|(name, output, input)| Edit::Relation(structure(&name, &[&output], &[&input]))),
        4 => (named("s", 4), variables()).prop_map(|(name, variable)| Edit::Signal(signal(&name, &variable, "10 Hz", "0.1"))),
        1 => variables().prop_map(|name| Edit::Need(need(&name, "1 s"))),
        2 => (section, 0..4).prop_map(|((section, prefix), number)| remove(section, &format!("{prefix}{number}"))),
        2 => (named("s", 4), prop::option::of(accuracy)).prop_map(|(signal, value)| Edit::Property {
            section: Section::Signals,
            element: text(&signal),
            name: text("accuracy"),
            value: value.map(text),
        }),
    ]
}

fn has_errors(draft: &Draft) -> bool {
    build(draft).1.iter().any(|found| found.severity == Severity::Error)
}

proptest! {
    #[test]
    fn edits_one_after_another_give_what_the_final_draft_gives(
        batches in prop::collection::vec(prop::collection::vec(edit(), 1..6), 1..30)
    ) {
        let (mut model, mut lists, mut version) = (Model::default(), Lists::default(), 0);
        for batch in &batches {
            let (before, mut next) = (format!("{model:?}"), lists.clone());
            let unknown = batch.iter().filter(|edit| !next.edit(edit)).count();
            let result = model.edit(batch);
            prop_assert_eq!(result.is_ok(), unknown == 0 && !has_errors(&next.draft()), "{:?}: {:?}", batch, result);
            match result {
                Ok(_) => {
                    lists = next;
                    prop_assert!(model.knowledge().version() > version);
                    version = model.knowledge().version();
                }
                Err(found) => {
                    prop_assert!(found.iter().any(|found| found.severity == Severity::Error));
                    prop_assert_eq!(&format!("{model:?}"), &before);
                }
            }
        }
        let (at_once, _) = build(&lists.draft());
        prop_assert_eq!(reported(model.knowledge()), reported(&at_once));
        prop_assert_eq!(format!("{:?}", model.draft()), format!("{:?}", lists.draft()));
    }

    #[test]
    fn a_property_that_is_set_is_as_one_that_is_written(values in prop::collection::vec((0..3_usize, 0..6_usize, prop::option::of(-1.0..3.0)), 1..40)) {
        let (mut model, _) = Model::new(two_systems()).unwrap();
        for (name, number, value) in values {
            let name = ["accuracy", "cost", "prior"][name];
            let element = match number {
                0 => Element::Variable(model.knowledge().variable("height").unwrap()),
                1 => Element::Relation(model.knowledge().relations().ids().next().unwrap()),
                _ => Element::Signal(model.knowledge().signals().ids().nth(number - 2).unwrap()),
            };
            let before = (format!("{model:?}"), model.knowledge().version());
            match model.set_property(element, name, value) {
                Err(_) => prop_assert_eq!(&format!("{model:?}"), &before.0),
                Ok(()) => prop_assert!(model.knowledge().version() >= before.1),
            }
        }
        let (built, found) = build(model.draft());
        prop_assert!(found.is_empty(), "{:?}", found);
        prop_assert_eq!(reported(model.knowledge()), reported(&built));
    }
}

#[track_caller]
fn check_wrong(edits: &[Edit], expected: &[(&str, Option<&str>)]) {
    let (mut model, _) = Model::new(two_systems()).unwrap();
    let before = format!("{model:?}");
    let found = model.edit(edits).unwrap_err();
    let found: Vec<_> = found.iter().map(|found| (found.message.as_str(), found.help.as_deref())).collect();
    assert_eq!(found, expected);
    assert_eq!(format!("{model:?}"), before);
}

#[test]
fn every_problem_of_all_edits_is_reported() {
    check_wrong(
        &[remove(Section::Relations, "climing"), remove(Section::Signals, "/x")],
        &[
            ("there is no relation `climing` to change", Some("did you mean `climbing`?")),
            ("there is no signal `/x` to change", None),
        ],
    );
    // Elements that still name the removed one are reported as in a file.
    check_wrong(
        &[remove(Section::Variables, "gain")],
        &[
            ("there is no variable `gain`", Some("declare it under `variables`")),
            ("there is no variable `gain`", Some("declare it under `variables`")),
            ("`gain` is not defined", None),
        ],
    );
    check_wrong(
        &[Edit::Available(text("gns"), false)],
        &[("there is no signal `gns`", Some("did you mean `gnss`?"))],
    );
    let property = |section, element: &str, value: Option<&str>| Edit::Property {
        section,
        element: text(element),
        name: text("accuracy"),
        value: value.map(text),
    };
    check_wrong(
        &[property(Section::Needs, "speed", Some("1")), property(Section::Signals, "gnss", None)],
        &[("there is no property `accuracy` to remove", None), ("a need has no properties", None)],
    );
    check_wrong(
        &[property(Section::Signals, "gnss", Some("2"))],
        &[("`accuracy: 2` makes no sense", Some("an accuracy lies between 0 and 1"))],
    );
}

#[test]
fn what_is_replaced_keeps_its_place_and_its_availability() {
    let (mut model, _) = Model::new(two_systems()).unwrap();
    let names = |model: &Model| {
        let signals = model.knowledge().signals();
        signals
            .enumerate()
            .map(|(id, signal)| (signal.name.clone(), model.knowledge().is_available(id)))
            .collect::<Vec<_>>()
    };
    let gnss = model.knowledge().signal("gnss").unwrap();
    model.set_available(gnss, false);
    let before = names(&model);
    let accurate = SignalDraft {
        properties: properties(&[("accuracy", "0.9")]),
        ..signal("gnss", "speed", "5 Hz", "1")
    };
    model.edit(&[Edit::Signal(accurate)]).unwrap();
    assert_eq!(names(&model), before);
    model.edit(&[remove(Section::Signals, "wheel_1"), Edit::Available(text("gnss"), true)]).unwrap();
    assert_eq!(names(&model), before.into_iter().skip(1).map(|(name, _)| (name, true)).collect::<Vec<_>>());
    let mut other = two_systems();
    other.signals.reverse();
    let version = model.knowledge().version();
    let vario = model.knowledge().signal("vario").unwrap();
    model.set_available(vario, false);
    model.replace(other).unwrap();
    assert!(model.knowledge().version() > version);
    assert_eq!(
        names(&model).iter().filter(|(_, available)| !available).collect::<Vec<_>>(),
        [&("vario".to_owned(), false)]
    );
}

#[test]
fn a_broken_model_is_none() {
    let draft = Draft { relations: vec![relation("r", "x = 2", "", "")], ..Draft::default() };
    assert!(Model::new(draft.clone()).is_err());
    let (mut model, _) = Model::new(two_systems()).unwrap();
    let before = format!("{model:?}");
    assert!(model.replace(draft).is_err());
    assert_eq!(format!("{model:?}"), before);
}
