//! The models and options of a run.

use crate::control::Token;
use crate::event_log::Printer;
use crate::explained::Explainer;
use crate::journal::JournalSeal;
use crate::recording::RunRecorder;
use crate::sandbox::SandboxOptions;
use shsa_core::engine;
use shsa_core::time::Span;
use shsa_format::wiring::{Form, Wiring};
use shsa_model::live::Live;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A model to run.
#[derive(Clone, Debug)]
pub struct Model {
    /// The model's name in the state, on the bus and in file names.
    pub name: String,
    /// The file that a reload reads; `None`: the model cannot be reloaded.
    pub path: Option<PathBuf>,
    /// The content of the model.
    pub live: Live,
}

impl Model {
    /// A model read from a file; its name is the file's name without folders and extension.
    #[must_use]
    pub fn of_file(path: &Path, live: Live) -> Model {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Model { name, path: Some(path.to_owned()), live }
    }
}

/// How a run behaves.
pub struct Options {
    /// The instance's name on the bus.
    pub name: String,
    /// The options and limits of the engines.
    pub engine: engine::Options,
    /// The form of the needs' values for which `wiring` sets none.
    pub form: Form,
    /// The settings of single needs: how each is published, how its source is silenced.
    pub wiring: Wiring,
    /// Substitutes in processes of their own.
    pub sandbox: SandboxOptions,
    /// The journal of every input; `None`: none is written.
    pub journal: Option<JournalOptions>,
    /// The recorders of runs, by the names of the models that they record; each works in a thread of its own.
    pub recorders: BTreeMap<String, Box<dyn RunRecorder>>,
    /// The folder of the state files `MODEL.json`; `None`: no state outlasts the process.
    pub state: Option<PathBuf>,
    /// The first part of the topics under which needs and verdicts are announced to Home Assistant, usually `homeassistant`; for a
    /// broker of MQTT. `None`: they are not announced.
    pub home_assistant: Option<String>,
    /// Whether to announce the models to other instances and to join theirs.
    pub join: bool,
    /// The token for orders over HTTP and the bus; `None`: no orders are accepted there.
    pub token: Option<Token>,
    /// The token for viewing over HTTP and the bus, except the health; `None`: everyone who can reach the run may view.
    pub view_token: Option<Token>,
    /// The duration of the run; `None`: unlimited.
    pub duration: Option<Span>,
    /// The printer of decisions, one a line; `None`: there is none.
    pub printer: Option<Printer>,
    /// Other instances to whose pages the live page leads: their names and addresses.
    pub other_pages: Vec<(String, String)>,
    /// What puts the evidence behind accusations into words, for the live page; `None`: the page does not show it.
    pub explainer: Option<Explainer>,
}

impl Default for Options {
    /// An instance with the name `shsa` that writes no files, joins no parts and takes orders from its own process only.
    fn default() -> Options {
        Options {
            name: "shsa".to_owned(),
            engine: engine::Options::default(),
            form: Form::Plain,
            wiring: Wiring::default(),
            sandbox: SandboxOptions::default(),
            journal: None,
            recorders: BTreeMap::new(),
            state: None,
            home_assistant: None,
            join: false,
            token: None,
            view_token: None,
            duration: None,
            printer: None,
            other_pages: Vec::new(),
            explainer: None,
        }
    }
}

/// The journal of every input: `FOLDER/MODEL.jsonl`, which can be replayed and explained.
#[derive(Clone, Debug)]
pub struct JournalOptions {
    /// The folder of the files.
    pub folder: PathBuf,
    /// The size at which another file is begun, bytes.
    pub size: u64,
    /// The number of older files that are kept.
    pub older: usize,
    /// How it shows that it was changed; off, its bytes are those of the inputs alone.
    pub seal: JournalSeal,
}
