//! Knowledge bases as YAML or JSON: the text becomes a tree, the tree a draft, and the core checks the draft.
//!
//! Every problem is reported at once, with file, line, column and help.

mod cursor;
mod json;
pub(crate) mod lines;
pub(crate) mod reader;
mod report;
pub(crate) mod shape;
pub(crate) mod tree;

pub mod live;

pub use report::{Located, Report};

use reader::Reader;
use shape::Model;
use shsa_core::knowledge::{Diagnostic, KnowledgeBase, Place, Severity, build_from};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The largest model file in bytes: JSON of a million relations has about half of that.
pub const MAX_BYTES: usize = 256 << 20;
/// The largest YAML file in bytes: YAML takes longer and is kept as a tree.
pub(crate) const MAX_YAML_BYTES: usize = 64 << 20;
/// A text that is JSON up to here is not tried as YAML when it is broken behind.
const SURELY_JSON: usize = 1 << 20;

/// A model as far as it is right, and what is wrong with it.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// Complete when `report.ok()`; with errors it holds what was right.
    pub knowledge: KnowledgeBase,
    /// Every problem, in file order.
    pub report: Report,
}

/// Reads and checks a model; `name` is what the report calls the file.
///
/// Never fails: what is wrong stands in the report. Time: linear in the text but for sorting and names.
#[must_use]
pub fn load(text: &str, name: &str) -> Loaded {
    if text.len() > MAX_BYTES {
        return refused(name, format!("a model has at most {} MiB", MAX_BYTES >> 20), "is this a model?");
    }
    if !json::is_likely(text) {
        return load_yaml(text, name);
    }
    match json::read(text) {
        Ok((root, mut json)) => {
            let mut reader = Reader::default();
            let (knowledge, found) = build_from(&mut Model::new(&mut reader, &root, Some(&mut json)));
            let problems = [json.problems, reader.problems, found].concat();
            Loaded { knowledge, report: Report::locate(name, text, problems, &json.rewritten) }
        }
        Err(broken) => {
            // YAML has braces and quotes, too.
            if broken.at < SURELY_JSON && tree::read(text).root.is_some() {
                return load_yaml(text, name);
            }
            let at = Place { from: tree::offset(broken.at), to: tree::offset(broken.at) };
            let problems = vec![problem(at, &broken.message, broken.help)];
            let report = Report::locate(name, text, problems, &BTreeSet::new());
            Loaded { knowledge: KnowledgeBase::default(), report }
        }
    }
}

fn load_yaml(text: &str, name: &str) -> Loaded {
    if text.len() > MAX_YAML_BYTES {
        let message = format!("a model in YAML has at most {} MiB", MAX_YAML_BYTES >> 20);
        return refused(name, message, "write it as JSON, whose keys stand in quotes");
    }
    let tree = tree::read(text);
    let Some(root) = &tree.root else {
        if tree.problems.is_empty() {
            return refused(name, "the model is empty".to_owned(), "begin with `shsa: 1` and `variables:`");
        }
        let report = Report::locate(name, text, tree.problems, &tree.rewritten);
        return Loaded { knowledge: KnowledgeBase::default(), report };
    };
    let mut reader = Reader::default();
    let (knowledge, found) = build_from(&mut Model::new(&mut reader, root, None));
    let problems = [tree.problems, reader.problems, found].concat();
    Loaded { knowledge, report: Report::locate(name, text, problems, &tree.rewritten) }
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

fn refused(name: &str, message: String, help: &str) -> Loaded {
    Loaded { knowledge: KnowledgeBase::default(), report: Report::whole(name, message, help) }
}

pub(crate) fn problem(place: Place, message: &str, help: Option<&str>) -> Diagnostic {
    let (message, help) = (message.to_owned(), help.map(str::to_owned));
    Diagnostic { severity: Severity::Error, place, span: None, message, help }
}

#[cfg(test)]
mod tests;
