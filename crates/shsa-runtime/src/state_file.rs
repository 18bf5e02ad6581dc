//! The state that outlasts the process, in `FOLDER/MODEL.json`. It is written to another file which then replaces it, so the file
//! is whole whenever the process or the machine ends.

use super::journal::{Missing, PAUSE};
use crate::error::{Context, RuntimeError, unfit};
use shsa_core::engine::Snapshot;
use shsa_format::state::{read_state, write_state};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;
use std::time::Instant;

/// The state file of one model.
#[derive(Debug)]
pub(super) struct StateFile {
    path: PathBuf,
    /// Asks another thread to synchronise the file to the disk, which takes long; nobody waits for it.
    sync: SyncSender<()>,
    missing: Missing,
    /// The time of the next attempt after a refusal.
    again: Option<Instant>,
}

impl StateFile {
    /// Opens the state file of a model, and reads its state.
    ///
    /// # Errors
    /// When the folder cannot be made, or the present state cannot be read.
    pub(super) fn open(folder: &Path, model: &str) -> Result<(StateFile, Option<Snapshot>), RuntimeError> {
        fs::create_dir_all(folder).with_context(|| format!("making the folder {}", folder.display()))?;
        let path = folder.join(format!("{model}.json"));
        let snapshot = match fs::read_to_string(&path) {
            Ok(text) => Some(read_state(&text).map_err(|error| {
                unfit(format!("{}: {error}; move it away to begin without", path.display()))
            })?),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(unfit(format!("reading {}: {error}", path.display()))),
        };
        let (sync, asked) = sync_channel(1);
        let synced = path.clone();
        thread::Builder::new().name("state".into()).spawn(move || {
            // A power failure may lose what was not synchronised; the end of the process loses nothing.
            asked.iter().for_each(|()| drop(File::open(&synced).and_then(|file| file.sync_all())));
        })?;
        Ok((StateFile { path, sync, missing: Missing::default(), again: None }, snapshot))
    }

    /// Replaces the saved state. A failure is counted, and the next attempt is due after a pause.
    pub(super) fn save(&mut self, snapshot: &Snapshot) {
        match self.replace(&write_state(snapshot)) {
            Ok(()) => {
                self.again = None;
                // A waiting request covers this state, too.
                let _ = self.sync.try_send(());
            }
            Err(error) => {
                self.missing.inputs += u64::from(self.again.is_none());
                self.missing.because = error.to_string();
                self.again = Some(Instant::now() + PAUSE);
            }
        }
    }

    /// Whether the next attempt is due.
    pub(super) fn is_due(&self) -> bool {
        self.again.is_some_and(|again| again <= Instant::now())
    }

    /// How often the disk began to refuse the state, and the last reason.
    pub(super) fn missing(&self) -> &Missing {
        &self.missing
    }

    fn replace(&self, text: &str) -> io::Result<()> {
        let beside = self.path.with_extension("json.new");
        let written = File::create(&beside).and_then(|mut file| file.write_all(text.as_bytes()));
        let replaced = written.and_then(|()| fs::rename(&beside, &self.path));
        replaced.inspect_err(|_| drop(fs::remove_file(&beside)))
    }
}
