//! What must outlast the process, in `FOLDER/MODEL.json`: written beside and then moved into its place, so that it is whole
//! whenever the process or the machine ends.

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

/// The state of one model on the disk.
#[derive(Debug)]
pub(super) struct StateFile {
    path: PathBuf,
    /// Asks for what was written to reach the disk itself; that takes long, and nobody waits for it.
    sync: SyncSender<()>,
    missing: Missing,
    /// When to try again what the disk has refused.
    again: Option<Instant>,
}

impl StateFile {
    /// The state file of a model, and what was in it.
    ///
    /// # Errors
    /// When the folder cannot be made, or there is a state that cannot be read.
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
            // A power failure may cost what could not be synchronised; a lost process costs nothing.
            asked.iter().for_each(|()| drop(File::open(&synced).and_then(|file| file.sync_all())));
        })?;
        Ok((StateFile { path, sync, missing: Missing::default(), again: None }, snapshot))
    }

    /// Takes the place of what was saved before. What cannot be saved is counted, and due again after a while.
    pub(super) fn save(&mut self, snapshot: &Snapshot) {
        match self.replace(&write_state(snapshot)) {
            Ok(()) => {
                self.again = None;
                // One that waits will see this one, too.
                let _ = self.sync.try_send(());
            }
            Err(error) => {
                self.missing.inputs += u64::from(self.again.is_none());
                self.missing.because = error.to_string();
                self.again = Some(Instant::now() + PAUSE);
            }
        }
    }

    /// Whether it is time to try again what could not be saved.
    pub(super) fn is_due(&self) -> bool {
        self.again.is_some_and(|again| again <= Instant::now())
    }

    /// How often the disk began to refuse the state, and why the last time.
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
