//! Knowledge bases as YAML or JSON: the text becomes a tree, the tree a draft, and the core checks the draft.
//!
//! Engineers write models by hand, so a report ([`Report`]) has all problems at once, each with file, line, column and help, and an
//! unknown key is an error with the nearest known one. [`load`] does everything at once. [`mod@write`] makes text of drafts again, [`layout`]
//! formats a text, [`patch`] writes a change into it without touching its comments, [`live`] applies changes to a model that runs, and
//! [`schema`] describes the language for editors; [`keys`] is the table that all of them share.
//!
//! # Example
//!
//! ```
//! let text = "
//! shsa: 1
//! variables: { speed: { unit: m/s } }
//! signals:
//!   wheel: { variable: sped, rate: 10 Hz }
//! ";
//! let loaded = shsa_model::load(text, "car.yaml");
//! assert!(!loaded.report.ok());
//! let problems = loaded.report.render(false);
//! assert!(problems.contains("car.yaml:5:22"), "{problems}"); // the place of `sped`
//! ```

mod cursor;
mod cut;
mod json;
pub mod keys;
mod known;
pub mod lines;
pub mod reader;
mod report;
mod fusion;
mod specification;
pub mod shape;
pub mod tree;
pub mod schema;
pub mod write;

pub mod live;
pub mod layout;
pub mod patch;

pub use report::{Located, Report};

use json::Json;
use reader::Reader;
use shape::Model;
use shsa_core::knowledge::{Diagnostic, Draft, KnowledgeBase, Place, Severity, build, build_from};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use tree::{Node, Tree};

/// The largest model file in bytes; JSON of a million relations has about half of that.
pub const MAX_BYTES: usize = 256 << 20;
/// The largest YAML file in bytes; YAML takes longer and is kept as a tree.
pub const MAX_YAML_BYTES: usize = 64 << 20;
/// A broken text that is valid JSON up to this offset is not tried as YAML.
const SURELY_JSON: usize = 1 << 20;

/// The valid part of a model, and its problems.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The whole model when `report.ok()`; else its valid part.
    pub knowledge: KnowledgeBase,
    /// All problems, in file order.
    pub report: Report,
}

/// A model before its check.
#[derive(Clone, Debug)]
pub struct Source {
    /// The draft.
    pub draft: Draft,
    problems: Vec<Diagnostic>,
    rewritten: BTreeSet<u32>,
}

/// Reads and checks a model; `name` is the file name in the report.
///
/// Never fails: the report holds the problems. Time: linear in the text, except for sorting and names.
///
/// ```
/// use shsa_core::engine::{Engine, Input, Options, Output, Ticks};
/// use shsa_core::observation::{Observation, RawValue};
/// use shsa_core::time::Time;
/// use shsa_model::load;
///
/// let loaded = load("
/// shsa: 1
/// variables: { speed: { unit: m/s } }
/// signals: { wheel: { variable: speed, rate: 10 Hz, value_error: 0.1 } }
/// needs: { speed: { signal: healed_speed, max_age: 1 s } }
/// ", "car.yaml");
/// assert!(loaded.report.ok(), "{}", loaded.report.render(false));
///
/// let mut engine = Engine::new(loaded.knowledge, Options::default());
/// let (wheel, now) = (engine.knowledge().signal("wheel").unwrap(), Time::from_seconds(1.0));
/// engine.pass(Ticks::before(now));
/// let value = RawValue::Number(5.0);
/// engine.handle(Input::Observation(Observation { signal: wheel, stamp: now, received: now, value }));
/// engine.pass(Ticks::up_to(now));
/// let outputs: Vec<Output> = std::iter::from_fn(|| engine.poll()).collect();
/// assert!(outputs.iter().any(|output| matches!(output, Output::Publication(_))));
///
/// let wrong = load("shsa: 1\nsignals: { wheel: { variable: sped } }\n", "car.yaml");
/// assert!(!wrong.report.ok());
/// ```
#[must_use]
pub fn load(text: &str, name: &str) -> Loaded {
    match open(text, name) {
        Err(report) => Loaded { knowledge: KnowledgeBase::default(), report },
        Ok(opened) => opened.load(text, name),
    }
}

/// Reads a model without checking it.
///
/// # Errors
/// A text that is too large, broken or empty.
pub fn read(text: &str, name: &str) -> Result<Source, Report> {
    Ok(open(text, name)?.read())
}

/// A text that is JSON or YAML, before it is read as a model.
pub struct Opened<'t>(Content<'t>);

enum Content<'t> {
    /// JSON, whose pieces are read from the text when they are needed.
    Json(Node, Json<'t>),
    Yaml(Node, Tree),
}

/// Opens a text as JSON or YAML; [`load`] and [`read`] go on from there.
///
/// # Errors
/// A text that is too large, broken or empty.
pub fn open<'t>(text: &'t str, name: &str) -> Result<Opened<'t>, Report> {
    if text.len() > MAX_BYTES {
        let message = format!("a model has at most {} MiB", MAX_BYTES >> 20);
        return Err(Report::whole(name, message, "is this a model?"));
    }
    match open_json(text, name)? {
        Some((root, json)) => Ok(Opened(Content::Json(root, json))),
        None => open_yaml(text, name).map(|(root, tree)| Opened(Content::Yaml(root, tree))),
    }
}

fn open_yaml(text: &str, name: &str) -> Result<(Node, Tree), Report> {
    let refused = |message: String, help| Report::whole(name, message, help);
    if text.len() > MAX_YAML_BYTES {
        let message = format!("a model in YAML has at most {} MiB", MAX_YAML_BYTES >> 20);
        return Err(refused(message, "write it as JSON, whose keys stand in quotes"));
    }
    let mut tree = tree::read(text);
    let Some(root) = tree.root.take() else {
        if tree.problems.is_empty() {
            return Err(refused("the model is empty".to_owned(), "begin with `shsa: 1` and `variables:`"));
        }
        return Err(Report::locate(name, text, tree.problems, &tree.rewritten));
    };
    Ok((root, tree))
}

impl Opened<'_> {
    /// The value of the text. Mappings within that of a JSON text may be unread.
    #[must_use]
    pub fn root(&self) -> &Node {
        match &self.0 {
            Content::Json(root, _) | Content::Yaml(root, _) => root,
        }
    }

    /// The value of the text with all that is in it, and the problems of the text; `text` and `name` are those that were opened.
    ///
    /// # Errors
    /// A JSON text that is too large or broken as YAML.
    pub fn into_tree(self, text: &str, name: &str) -> Result<(Node, Tree), Report> {
        match self.0 {
            Content::Json(..) => open_yaml(text, name),
            Content::Yaml(root, tree) => Ok((root, tree)),
        }
    }

    /// Reads the text as a model and checks it; `text` and `name` are those that were opened.
    #[must_use]
    pub fn load(self, text: &str, name: &str) -> Loaded {
        let mut reader = Reader::default();
        let (knowledge, problems, rewritten) = match self.0 {
            Content::Json(root, mut json) => {
                let (knowledge, found) = build_from(&mut Model::new(&mut reader, &root, Some(&mut json)));
                let found = fusion::checked(&knowledge, found);
                (knowledge, [json.problems, reader.problems, found].concat(), json.rewritten)
            }
            Content::Yaml(root, tree) => {
                let (knowledge, found) = shape::build(&mut reader, &root);
                let found = fusion::checked(&knowledge, found);
                (knowledge, [tree.problems, reader.problems, found].concat(), tree.rewritten)
            }
        };
        Loaded { knowledge, report: Report::locate(name, text, problems, &rewritten) }
    }

    /// Reads the text as a model without checking it.
    #[must_use]
    pub fn read(self) -> Source {
        let mut reader = Reader::default();
        match self.0 {
            Content::Json(root, mut json) => {
                let draft = Draft::of(&mut Model::new(&mut reader, &root, Some(&mut json)));
                Source::new(draft, [json.problems, reader.problems].concat(), json.rewritten)
            }
            Content::Yaml(root, tree) => {
                let draft = shape::draft(&mut reader, &root);
                Source::new(draft, [tree.problems, reader.problems].concat(), tree.rewritten)
            }
        }
    }
}

/// Reads a text as JSON; `None` when the text may be YAML, which has braces and quotes, too.
fn open_json<'t>(text: &'t str, name: &str) -> Result<Option<(Node, Json<'t>)>, Report> {
    if !json::is_likely(text) {
        return Ok(None);
    }
    match json::read(text) {
        Ok(read) => Ok(Some(read)),
        Err(broken) if broken.at < SURELY_JSON && tree::read(text).root.is_some() => Ok(None),
        Err(broken) => {
            let at = Place { from: tree::offset(broken.at), to: tree::offset(broken.at) };
            let problems = vec![problem(at, &broken.message, broken.help)];
            Err(Report::locate(name, text, problems, &BTreeSet::new()))
        }
    }
}

impl Source {
    /// A draft of a text, with the problems of its reading; scalars that start at `rewritten` differ from the text and get no spans.
    #[must_use]
    pub fn new(draft: Draft, problems: Vec<Diagnostic>, rewritten: BTreeSet<u32>) -> Source {
        Source { draft, problems, rewritten }
    }

    /// Checks the draft; `text` and `name` are its source.
    #[must_use]
    pub fn build(self, text: &str, name: &str) -> Loaded {
        let (knowledge, found) = build(&self.draft);
        let found = fusion::checked(&knowledge, found);
        let problems = self.problems.into_iter().chain(found).collect();
        Loaded { knowledge, report: Report::locate(name, text, problems, &self.rewritten) }
    }
}

/// As [`load`] for a file; an unreadable file is an error in the report.
#[must_use]
pub fn load_file(path: &Path) -> Loaded {
    match read_text(path, "model") {
        Ok(text) => load(&text, &path.display().to_string()),
        Err(report) => Loaded { knowledge: KnowledgeBase::default(), report },
    }
}

/// The text of a file; `what` names its expected content.
///
/// # Errors
/// A file that cannot be read or is no text.
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
