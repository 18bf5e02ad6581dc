//! What a run is built from.

use crate::control::Token;
use crate::event_log::Printer;
use crate::sandbox::SandboxOptions;
use shsa_core::engine;
use shsa_core::time::Span;
use shsa_format::model::live::Live;
use shsa_format::wiring::{Form, Wiring};
use std::path::{Path, PathBuf};

/// A knowledge base to be run.
#[derive(Clone, Debug)]
pub struct Model {
    /// What it is called in the state, on the bus and in file names.
    pub name: String,
    /// The file that it is read from again by order; `None`: it cannot be.
    pub path: Option<PathBuf>,
    /// What is known.
    pub live: Live,
}

impl Model {
    /// One that was read from a file, called as that without folders and extension.
    #[must_use]
    pub fn of_file(path: &Path, live: Live) -> Model {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Model { name, path: Some(path.to_owned()), live }
    }
}

/// How a run behaves.
pub struct Options {
    /// What the instance is called on the bus.
    pub name: String,
    /// What the engines may spend.
    pub engine: engine::Options,
    /// How the values of needs are written, where `wiring` does not say.
    pub form: Form,
    /// How single needs go out, and how their sources are silenced.
    pub wiring: Wiring,
    /// Substitutes in processes of their own.
    pub sandbox: SandboxOptions,
    /// Where every input is written; `None`: nowhere.
    pub journal: Option<JournalOptions>,
    /// The folder in which `MODEL.json` keeps what outlasts the process; `None`: nothing does.
    pub state: Option<PathBuf>,
    /// Whether the models are announced to other instances, and theirs joined.
    pub join: bool,
    /// The secret that orders over HTTP and the bus need; `None`: none are taken there.
    pub token: Option<Token>,
    /// The secret that looking needs over HTTP and the bus, but for the health; `None`: everyone who can reach it may.
    pub view_token: Option<Token>,
    /// After this time the run ends by itself; `None`: never.
    pub duration: Option<Span>,
    /// Where decisions are written, one a line; `None`: nowhere.
    pub printer: Option<Printer>,
}

impl Default for Options {
    /// An instance with the name `shsa` that writes no files, joins nobody and takes orders from its own process only.
    fn default() -> Options {
        Options {
            name: "shsa".to_owned(),
            engine: engine::Options::default(),
            form: Form::Plain,
            wiring: Wiring::default(),
            sandbox: SandboxOptions::default(),
            journal: None,
            state: None,
            join: false,
            token: None,
            view_token: None,
            duration: None,
            printer: None,
        }
    }
}

/// The journal of every input: `FOLDER/MODEL.jsonl`, which can be replayed and explained.
#[derive(Clone, Debug)]
pub struct JournalOptions {
    /// Where it is.
    pub folder: PathBuf,
    /// How large a file grows before another is begun, bytes.
    pub size: u64,
    /// How many older files are kept.
    pub older: usize,
}
