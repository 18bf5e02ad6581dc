//! A model in use with the texts that it was read from. Further texts change it, and every problem is reported with its file and
//! line.
//!
//! A text with the key `shsa` is a whole model and replaces the old one. Any other text is a change: its entries are added, or
//! replace those of the same name, and `null` removes. `available: { /gnss: false }` withdraws a signal, and `properties: {
//! signals: { /gnss: { accuracy: 0.5 } } }` sets a property without a new definition of the signal.

mod texts;

use shsa_core::knowledge::{
    self, Diagnostic, Draft, Edit, KnowledgeBase, Model, NeedDraft, Place, Section, Severity, Text,
};
use std::collections::BTreeSet;

use super::fusion;
use super::reader::Reader;
use super::report::Report;
use super::tree::{self, Node, Value};
use super::{MAX_YAML_BYTES, shape};
use texts::Texts;

/// The sections of a model whose entries a change may remove.
const SECTIONS: [(&str, Section); 9] = [
    ("variables", Section::Variables),
    ("constants", Section::Constants),
    ("functions", Section::Functions),
    ("relations", Section::Relations),
    ("signals", Section::Signals),
    ("fusion", Section::Fusions),
    ("needs", Section::Needs),
    ("platform", Section::Platform),
    ("contracts", Section::Contracts),
];

/// Of these sections, those whose elements have properties.
const WITH_PROPERTIES: [(&str, Section); 3] =
    [("variables", Section::Variables), ("relations", Section::Relations), ("signals", Section::Signals)];

/// A model that can be changed.
#[derive(Clone, Debug)]
pub struct Live {
    model: Model,
    texts: Texts,
}

/// The text of a model, or of a change of a model.
#[derive(Clone, Copy, Debug)]
pub struct Written<'t> {
    /// The name in reports: the path of the file.
    pub name: &'t str,
    /// YAML or JSON.
    pub text: &'t str,
}

impl Live {
    /// Reads and checks a model; returns its warnings, too.
    ///
    /// # Errors
    /// All problems of the text.
    pub fn load(written: Written<'_>) -> Result<(Live, Report), Report> {
        let read = read(written, 0)?;
        let texts = Texts::default().with(written, &read, 0);
        match Model::new(read.draft) {
            Ok((model, found)) if read.is_right => {
                let report = texts.report(0, read.problems, fusion::checked(model.knowledge(), found));
                if report.ok() { Ok((Live { model, texts }, report)) } else { Err(report) }
            }
            Ok((_, found)) | Err(found) => Err(texts.report(0, read.problems, found)),
        }
    }

    /// The present knowledge base.
    #[must_use]
    pub fn knowledge(&self) -> &KnowledgeBase {
        self.model.knowledge()
    }

    /// The present draft.
    #[must_use]
    pub fn draft(&self) -> &Draft {
        self.model.draft()
    }

    /// Applies a change, or replaces the whole model; returns the warnings about the new model.
    ///
    /// # Errors
    /// All problems of the text or of the new model; the model is unchanged then.
    pub fn change(&mut self, written: Written<'_>) -> Result<Report, Report> {
        let base = self.texts.room(written.text.len());
        let read = read(written, base)?;
        let mut texts = self.texts.clone().with(written, &read, base);
        let mut model = self.model.clone();
        let changed = match read.is_whole {
            true => model.replace(read.draft),
            false => model.edit(&[edits_of(read.draft), read.edits].concat()),
        };
        match changed {
            Ok(found) if read.is_right => {
                let report = texts.report(base, read.problems, fusion::checked(model.knowledge(), found));
                if !report.ok() {
                    return Err(report);
                }
                texts.forget(model.draft());
                *self = Live { model, texts };
                Ok(report)
            }
            Ok(found) | Err(found) => Err(texts.report(base, read.problems, found)),
        }
    }
}

/// Joins the models of several files.
///
/// # Errors
/// The problems of each file, contradictions between the files, and the problems of the whole.
pub fn join(parts: &[Written<'_>]) -> Result<(Live, Report), Report> {
    let mut texts = Texts::default();
    let mut drafts = Vec::new();
    let (mut report, mut is_right) = (Report::default(), true);
    for part in parts {
        let base = texts.room(part.text.len());
        let read = read(*part, base)?;
        texts = texts.with(*part, &read, base);
        is_right &= read.is_right;
        report.diagnostics.extend(texts.report(base, read.problems, Vec::new()).diagnostics);
        drafts.push(read.draft);
    }
    let joint = knowledge::join(&drafts).map_err(|found| {
        let contradictions = found.iter().map(|found| texts.contradiction(found)).collect();
        Report {
            diagnostics: [std::mem::take(&mut report.diagnostics), texts.locate(contradictions).diagnostics]
                .concat(),
        }
    })?;
    let built = Model::new(joint);
    let found = match &built {
        Ok((model, found)) => fusion::checked(model.knowledge(), found.clone()),
        Err(found) => found.clone(),
    };
    report.diagnostics.extend(texts.locate(found).diagnostics);
    match built {
        Ok((model, _)) if is_right && report.ok() => Ok((Live { model, texts }, report)),
        _ => Err(report),
    }
}

/// The edits of a change that is part of another file, such as a story.
pub fn edits(reader: &mut Reader, node: Node) -> Vec<Edit> {
    let (node, edits) = split(reader, node, 0);
    [edits_of(shape::draft(reader, &node)), edits].concat()
}

/// The content of a text.
struct Read {
    /// A whole model, or the entries to add or replace.
    draft: Draft,
    is_whole: bool,
    /// Removals, withdrawals and changed properties.
    edits: Vec<Edit>,
    /// The problems of the shape, at places of the text itself.
    problems: Vec<Diagnostic>,
    is_right: bool,
    rewritten: BTreeSet<u32>,
}

/// Reads a text whose places begin at `base`.
fn read(written: Written<'_>, base: u32) -> Result<Read, Report> {
    let refused = |message: &str, help| Report::whole(written.name, message.to_owned(), help);
    if written.text.len() > MAX_YAML_BYTES {
        return Err(refused("a model has at most 64 MiB", "is this a model?"));
    }
    let tree = tree::read(written.text);
    let Some(root) = tree.root else {
        if tree.problems.is_empty() {
            return Err(refused(
                "there is nothing in it",
                "write `shsa: 1` and a model, or what changes in it",
            ));
        }
        return Err(Report::locate(written.name, written.text, tree.problems, &tree.rewritten));
    };
    let mut reader = Reader::default();
    let has_version =
        matches!(&root.value, Value::Map(entries) if entries.iter().any(|(name, _)| name.text == "shsa"));
    let (root, edits) = if has_version { (root, Vec::new()) } else { split(&mut reader, root, base) };
    let draft = shape::draft(&mut reader, &root).moved(base);
    let problems = [tree.problems, reader.problems].concat();
    let is_right = problems.iter().all(|problem| problem.severity != Severity::Error);
    Ok(Read { draft, is_whole: has_version, edits, problems, is_right, rewritten: tree.rewritten })
}

/// Takes the sections that only changes have out of a change, and makes a model of the rest.
fn split(reader: &mut Reader, root: Node, base: u32) -> (Node, Vec<Edit>) {
    let Value::Map(entries) = root.value else { return (root, Vec::new()) };
    let moved = |text: &Text| {
        let Place { from, to } = text.place;
        Text { place: Place { from: from.saturating_add(base), to: to.saturating_add(base) }, ..text.clone() }
    };
    let version = Text { text: "shsa".to_owned(), place: root.place };
    let one =
        Node { place: root.place, value: Value::Scalar(Text { text: "1".to_owned(), place: root.place }) };
    let (mut kept, mut edits) = (vec![(version, one)], Vec::new());
    for (key, node) in entries {
        match key.text.as_str() {
            "available" => edits.extend(available(reader, &node, &moved)),
            "properties" => edits.extend(properties(reader, &node, &moved)),
            "utility" if matches!(node.value, Value::Null) => edits.push(Edit::Utility(None)),
            name => {
                let sections = sections_of(name);
                kept.push(match node.value {
                    Value::Map(entries) if !sections.is_empty() => {
                        let (removed, put): (Vec<_>, Vec<_>) =
                            entries.into_iter().partition(|(_, node)| matches!(node.value, Value::Null));
                        for (name, _) in &removed {
                            edits.extend(sections.iter().map(|section| Edit::Remove(*section, moved(name))));
                        }
                        (key, Node { place: node.place, value: Value::Map(put) })
                    }
                    value => (key, Node { place: node.place, value }),
                });
            }
        }
    }
    (Node { place: root.place, value: Value::Map(kept) }, edits)
}

/// Where the entries of a section of the text are in the model: a specification is a relation, and the variable of its verdict.
fn sections_of(name: &str) -> Vec<Section> {
    if name == "specifications" {
        return vec![Section::Relations, Section::Variables];
    }
    SECTIONS.iter().filter(|(known, _)| *known == name).map(|(_, section)| *section).collect()
}

/// Reads `{ /gnss: false }`.
fn available(reader: &mut Reader, node: &Node, moved: &impl Fn(&Text) -> Text) -> Vec<Edit> {
    let entries = reader.entries(node, "signals with `true` or `false`", "/gnss: false");
    let mut edits = Vec::new();
    for (name, node) in entries {
        match &node.value {
            Value::Scalar(text) if text.text == "true" => edits.push(Edit::Available(moved(name), true)),
            Value::Scalar(text) if text.text == "false" => edits.push(Edit::Available(moved(name), false)),
            _ => reader.wrong(node, "a signal is available or not", "write `true` or `false`"),
        }
    }
    edits
}

/// Reads `{ signals: { /gnss: { accuracy: 0.5, prior: null } } }`.
fn properties(reader: &mut Reader, node: &Node, moved: &impl Fn(&Text) -> Text) -> Vec<Edit> {
    let example = "properties: { signals: { /gnss: { accuracy: 0.5 } } }";
    let known = WITH_PROPERTIES.map(|(name, _)| name);
    let fields = reader.fields(node, "what has properties", &known, example);
    let mut edits = Vec::new();
    for (key, section) in WITH_PROPERTIES {
        let elements =
            fields.get(key).map_or(&[][..], |node| reader.entries(node, "names", "/gnss: { accuracy: 0.5 }"));
        for (element, node) in elements {
            for (name, node) in reader.entries(node, "named numbers", "{ accuracy: 0.5 }") {
                let (element, name) = (moved(element), moved(name));
                let value = match &node.value {
                    Value::Null => None,
                    _ => match reader.text(node, "a number", "accuracy: 0.5") {
                        Some(value) => Some(moved(&value)),
                        None => continue,
                    },
                };
                edits.push(Edit::Property { section, element, name, value });
            }
        }
    }
    edits
}

/// All entries of a draft as edits that add or replace.
fn edits_of(draft: Draft) -> Vec<Edit> {
    let Draft {
        variables,
        constants,
        functions,
        relations,
        signals,
        fusions,
        needs,
        platform,
        contracts,
        utility,
    } = draft;
    let variables = variables.into_iter().map(Edit::Variable);
    let constants = constants.into_iter().map(|(name, bounds)| Edit::Constant(name, bounds));
    let functions = functions.into_iter().map(|(head, body)| Edit::Function(head, body));
    let relations = relations.into_iter().map(Edit::Relation);
    let signals = signals.into_iter().map(Edit::Signal);
    let fusions = fusions.into_iter().map(Edit::Fusion);
    let mut by_variable: Vec<Vec<NeedDraft>> = Vec::new();
    for need in needs {
        let same = |known: &&mut Vec<NeedDraft>| known[0].variable.text == need.variable.text;
        match by_variable.iter_mut().find(same) {
            Some(known) => known.push(need),
            None => by_variable.push(vec![need]),
        }
    }
    let needs = by_variable.into_iter().map(Edit::Needs);
    let utility = utility.map(|utility| Edit::Utility(Some(utility)));
    variables
        .chain(constants)
        .chain(functions)
        .chain(relations)
        .chain(signals)
        .chain(fusions)
        .chain(needs)
        .chain(platform.into_iter().map(Edit::Platform))
        .chain(contracts.into_iter().map(Edit::Contract))
        .chain(utility)
        .collect()
}
