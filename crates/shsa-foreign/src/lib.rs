//! Models and certificates in the forms of other programs: each becomes a draft, or certificates, of ours.
//!
//! [`thesis`] reads and writes the files of the thesis's public programs (YAML and Prolog) and ontologies; [`conserts`] reads
//! certificates of conserts-rs and safeTbox. [`load`] takes a model in any form, ours included, and detects the form. Elements that our
//! language cannot express are reported with their places, never dropped silently.
//!
//! # Example
//!
//! A relation with two variables, as facts of Prolog:
//!
//! ```
//! let facts = "
//! function(steering, r1, [yaw_rate, speed]).
//! itomsOf(yaw_rate, ['/imu/yaw_rate']).
//! itomsOf(speed, ['/wheel/speed']).
//! ";
//! let loaded = shsa_foreign::load(facts, "drivetrain.pl");
//! assert!(loaded.report.ok(), "{}", loaded.report.render(false));
//! assert!(loaded.knowledge.variable("steering").is_some());
//! ```

pub mod thesis;
pub mod conserts;

use shsa_core::knowledge::{Draft, KnowledgeBase, Severity};
use shsa_model::{Loaded, MAX_BYTES, Opened, Report, read_text};
use std::path::Path;

/// The form of the text of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Ours: YAML, which includes JSON.
    Yaml,
    /// The YAML of the thesis's public programs: `relations` or `graph`, and `properties`.
    Thesis,
    /// The Prolog facts of these programs: `function/3`, `implementation/2`, `itomsOf/2`, `itomOf/2`.
    Prolog,
    /// An ontology of the vocabularies SOSA and SSN in Turtle, with the feature `ontology`.
    Turtle,
}

/// A model in any form before its check, and the parts of its text that the draft lacks.
#[derive(Clone, Debug)]
pub struct Source {
    /// The form of the text.
    pub form: Form,
    /// The number of elements of another form that were not converted; each has a warning.
    pub losses: usize,
    source: shsa_model::Source,
}

/// As [`shsa_model::load`], for a model in any form.
#[must_use]
pub fn load(text: &str, name: &str) -> Loaded {
    match open(text, name, None) {
        Err(report) => Loaded { knowledge: KnowledgeBase::default(), report },
        Ok(Read::Own(opened)) => opened.load(text, name),
        Ok(Read::Other(source)) => source.build(text, name),
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

/// Reads a model without checking it; a missing `form` is detected.
///
/// # Errors
/// A text that is too large, broken or empty.
pub fn read(text: &str, name: &str, form: Option<Form>) -> Result<Source, Report> {
    Ok(match open(text, name, form)? {
        Read::Own(opened) => Source { form: Form::Yaml, losses: 0, source: opened.read() },
        Read::Other(source) => *source,
    })
}

/// A text of a known form.
enum Read<'t> {
    Own(Opened<'t>),
    Other(Box<Source>),
}

fn open<'t>(text: &'t str, name: &str, form: Option<Form>) -> Result<Read<'t>, Report> {
    let is_readable = text.len() <= MAX_BYTES;
    let is_of = |known: Form, looks: fn(&str) -> bool| form == Some(known) || form.is_none() && looks(text);
    if is_readable && is_of(Form::Prolog, thesis::is_prolog) {
        return Ok(Read::Other(Box::new(Source::taken(thesis::from_prolog(text), Form::Prolog))));
    }
    if is_readable && is_of(Form::Turtle, thesis::is_turtle) {
        #[cfg(feature = "ontology")]
        return Ok(Read::Other(Box::new(Source::taken(thesis::from_ontology(text), Form::Turtle))));
        #[cfg(not(feature = "ontology"))]
        return Err(Report::whole(
            name,
            "this is an ontology in Turtle".to_owned(),
            "build with the feature `ontology`",
        ));
    }
    let opened = shsa_model::open(text, name)?;
    if form != Some(Form::Thesis) && (form.is_some() || !thesis::is_thesis(opened.root())) {
        return Ok(Read::Own(opened));
    }
    let (root, tree) = opened.into_tree(text, name)?;
    let mut taken = thesis::from_yaml(&root);
    taken.problems = [tree.problems, taken.problems].concat();
    taken.rewritten.extend(tree.rewritten);
    Ok(Read::Other(Box::new(Source::taken(taken, Form::Thesis))))
}

impl Source {
    fn taken(taken: thesis::Taken, form: Form) -> Source {
        let thesis::Taken { draft, problems, rewritten } = taken;
        let losses = problems.iter().filter(|problem| problem.severity == Severity::Warning).count();
        Source { form, losses, source: shsa_model::Source::new(draft, problems, rewritten) }
    }

    /// The draft.
    #[must_use]
    pub fn draft(&self) -> &Draft {
        &self.source.draft
    }

    /// Checks the draft; `text` and `name` are its source.
    #[must_use]
    pub fn build(self, text: &str, name: &str) -> Loaded {
        self.source.build(text, name)
    }
}
