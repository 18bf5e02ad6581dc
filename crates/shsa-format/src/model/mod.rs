//! Knowledge bases as YAML or JSON: the text becomes a tree, the tree a draft, and the core checks the draft.
//!
//! Every problem is reported at once, with file, line, column and help. Files of the thesis's public programs (YAML
//! and Prolog) become drafts too; [`write`] makes text of drafts again.

pub(crate) mod lines;
pub(crate) mod reader;
mod report;
pub(crate) mod shape;
pub(crate) mod tree;
pub mod thesis;
pub mod write;

pub use report::{Located, Report};

use shsa_core::knowledge::{Diagnostic, Draft, KnowledgeBase, Place, Severity, build};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The largest model file in bytes.
pub const MAX_BYTES: usize = 64 << 20;

/// A model as far as it is right, and what is wrong with it.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// Complete when `report.ok()`; with errors it holds what was right.
    pub knowledge: KnowledgeBase,
    /// Every problem, in file order.
    pub report: Report,
}

/// How a model is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// YAML; JSON is a part of it.
    Yaml,
    /// The YAML of the thesis's public programs: `relations` or `graph`, and `properties`.
    Thesis,
    /// Their Prolog facts: `function/3`, `implementation/2`, `itomsOf/2`, `itomOf/2`.
    Prolog,
}

/// A model before it is checked, and what its text said that the draft does not.
#[derive(Clone, Debug)]
pub struct Source {
    /// What the text says.
    pub draft: Draft,
    /// How it is written.
    pub form: Form,
    /// How many things of another form did not come over; each is a warning.
    pub losses: usize,
    problems: Vec<Diagnostic>,
    rewritten: BTreeSet<u32>,
}

/// Reads and checks a model in any form; `name` is what the report calls the file.
///
/// Never fails: what is wrong stands in the report. Time: linear in the text but for sorting and names.
#[must_use]
pub fn load(text: &str, name: &str) -> Loaded {
    match read(text, name, None) {
        Ok(source) => source.build(text, name),
        Err(report) => Loaded { knowledge: KnowledgeBase::default(), report },
    }
}

/// Reads a model without checking it; `form` is found out when it is not given.
///
/// # Errors
/// A text that is too large, or holds nothing.
pub fn read(text: &str, name: &str, form: Option<Form>) -> Result<Source, Report> {
    let refused = |message: &str, help| Err(Report::whole(name, message.to_owned(), help));
    if text.len() > MAX_BYTES {
        return refused("a model has at most 64 MiB", "is this a model?");
    }
    if form == Some(Form::Prolog) || form.is_none() && thesis::is_prolog(text) {
        return Ok(Source::taken(thesis::from_prolog(text), Form::Prolog));
    }
    let tree = tree::read(text);
    let mut source = Source {
        draft: Draft::default(),
        form: Form::Yaml,
        losses: 0,
        problems: tree.problems,
        rewritten: tree.rewritten,
    };
    match &tree.root {
        Some(root) if form == Some(Form::Thesis) || form.is_none() && thesis::is_thesis(root) => {
            let taken = Source::taken(thesis::from_yaml(root), Form::Thesis);
            source.problems.extend(taken.problems);
            source.rewritten.extend(taken.rewritten);
            source = Source { problems: source.problems, rewritten: source.rewritten, ..taken };
        }
        Some(root) => {
            let mut reader = reader::Reader::default();
            source.draft = shape::draft(&mut reader, root);
            source.problems.extend(reader.problems);
        }
        None if source.problems.is_empty() => {
            return refused("the model is empty", "begin with `shsa: 1` and `variables:`");
        }
        None => {}
    }
    Ok(source)
}

impl Source {
    fn taken(taken: thesis::Taken, form: Form) -> Source {
        let thesis::Taken { draft, problems, rewritten } = taken;
        let losses = problems.iter().filter(|problem| problem.severity == Severity::Warning).count();
        Source { draft, form, losses, problems, rewritten }
    }

    /// Checks the draft; `text` and `name` are those that it was read from.
    #[must_use]
    pub fn build(self, text: &str, name: &str) -> Loaded {
        let (knowledge, found) = build(&self.draft);
        let problems = self.problems.into_iter().chain(found).collect();
        Loaded { knowledge, report: Report::locate(name, text, problems, &self.rewritten) }
    }
}

/// As [`load`] for a file; a file that cannot be read is an error in the report.
#[must_use]
pub fn load_file(path: &Path) -> Loaded {
    match read_text(path, "model") {
        Ok(text) => load(&text, &path.display().to_string()),
        Err(report) => Loaded { knowledge: KnowledgeBase::default(), report },
    }
}

/// The text of a file; `what` is what it should be.
///
/// # Errors
/// A file that cannot be read, or is no text.
pub fn read_text(path: &Path, what: &str) -> Result<String, Report> {
    let mut bytes = Vec::new();
    let limit = MAX_BYTES as u64 + 1;
    let refused = |message: String, help| Report::whole(&path.display().to_string(), message, help);
    if let Err(error) = File::open(path).and_then(|file| file.take(limit).read_to_end(&mut bytes)) {
        return Err(refused(
            format!("cannot read the {what}: {error}"),
            "give the path of a YAML or JSON file",
        ));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        refused(format!("the {what} is no text: byte {at} is not UTF-8"), "save it as UTF-8")
    })
}

pub(crate) fn problem(place: Place, message: &str, help: Option<&str>) -> Diagnostic {
    let (message, help) = (message.to_owned(), help.map(str::to_owned));
    Diagnostic { severity: Severity::Error, place, span: None, message, help }
}

#[cfg(test)]
mod tests;
