//! The state that outlasts the process, in `FOLDER/MODEL.json`. It is written to another file which then replaces it, so the file
//! is whole whenever the process ends. After a power failure it may not be: `MODEL.before.json` is the last one that was synchronised
//! to the disk, and is read instead.

use super::journal::{Missing, PAUSE};
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

/// The state of an earlier run.
#[derive(Debug, Default)]
pub(super) struct Earlier {
    /// `None`: there is none, or it cannot be read.
    pub(super) snapshot: Option<Snapshot>,
    /// Why the last state was not read, and what is used instead.
    pub(super) degraded: Option<String>,
}

impl StateFile {
    /// Opens the state file of a model, and reads its state. A file that cannot be read is kept under another name.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(super) fn open(folder: &Path, model: &str) -> io::Result<(StateFile, Earlier)> {
        let path = folder.join(format!("{model}.json"));
        let earlier = match read(&path) {
            Ok(snapshot) => Earlier { snapshot, degraded: None },
            Err(why) => earlier(&path, &why),
        };
        let (sync, asked) = sync_channel(1);
        let synced = path.clone();
        thread::Builder::new().name("state".into()).spawn(move || {
            // A power failure may lose what was not synchronised; the end of the process loses nothing.
            asked.iter().for_each(|()| drop(synchronise(&synced)));
        })?;
        Ok((StateFile { path, sync, missing: Missing::default(), again: None }, earlier))
    }

    /// Replaces the saved state. A failure is counted, and the next attempt is due after a pause.
    pub(super) fn save(&mut self, snapshot: &Snapshot) {
        match self.replace(&write_state(snapshot)) {
            Ok(()) => {
                (self.again, self.missing.waits) = (None, false);
                // A waiting request covers this state, too.
                let _ = self.sync.try_send(());
            }
            Err(error) => {
                self.missing.inputs += u64::from(self.again.is_none());
                (self.missing.because, self.missing.waits) = (error.to_string(), true);
                self.again = Some(Instant::now() + PAUSE);
            }
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file was removed.
    pub(super) fn has_vanished(&self) -> bool {
        self.again.is_none() && !self.path.exists()
    }

    /// Whether the next attempt is due.
    pub(super) fn is_due(&self) -> bool {
        self.again.is_some_and(|again| again <= Instant::now())
    }

    /// How often the disk began to refuse the state, and the last reason.
    pub(super) fn missing(&self) -> &Missing {
        &self.missing
    }

    /// Why the present state is not saved.
    pub(super) fn unsaved(&self) -> Option<&Missing> {
        Some(&self.missing).filter(|missing| missing.waits)
    }

    fn replace(&self, text: &str) -> io::Result<()> {
        self.path.parent().map_or(Ok(()), fs::create_dir_all)?;
        let beside = self.path.with_extension("json.new");
        let written = File::create(&beside).and_then(|mut file| file.write_all(text.as_bytes()));
        let replaced = written.and_then(|()| fs::rename(&beside, &self.path));
        replaced.inspect_err(|_| drop(fs::remove_file(&beside)))
    }
}

/// The state in a file; `None` if there is no file.
fn read(path: &Path) -> Result<Option<Snapshot>, String> {
    use io::ErrorKind::{NotADirectory, NotFound};
    match fs::read_to_string(path) {
        Ok(text) => read_state(&text).map(Some).map_err(|error| error.to_string()),
        Err(error) if matches!(error.kind(), NotFound | NotADirectory) => Ok(None),
        Err(error) => Err(error.to_string()),
    }
}

/// What is used instead of a file that cannot be read.
fn earlier(path: &Path, why: &str) -> Earlier {
    let (aside, before) = (path.with_extension("broken.json"), path.with_extension("before.json"));
    let kept = if fs::rename(path, &aside).is_ok() { &*aside } else { path };
    let snapshot = read(&before).ok().flatten();
    let instead = match &snapshot {
        Some(_) => format!("the state before it is used, {}", before.display()),
        None => "this run begins without a state".to_owned(),
    };
    let degraded =
        format!("{}: {why}; {instead}; what cannot be read is kept as {}", path.display(), kept.display());
    Earlier { snapshot, degraded: Some(degraded) }
}

/// Synchronises the state to the disk, and then keeps a copy of it.
fn synchronise(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()?;
    let (copy, before) = (path.with_extension("before.new"), path.with_extension("before.json"));
    let copied = fs::copy(path, &copy).and_then(|_| File::open(&copy)?.sync_all());
    copied.and_then(|()| fs::rename(&copy, before)).inspect_err(|_| drop(fs::remove_file(&copy)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_read_is_kept_and_the_one_before_is_used() {
        let folder = std::env::temp_dir().join(format!("shsa-state-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        let [path, before, broken] =
            ["m.json", "m.before.json", "m.broken.json"].map(|name| folder.join(name));
        let (file, earlier) = StateFile::open(&folder, "m").unwrap();
        assert!(earlier.snapshot.is_none() && earlier.degraded.is_none());
        // `save` would let another thread copy what stands in the file later.
        file.replace(&write_state(&Snapshot::default())).unwrap();
        synchronise(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), fs::read(&before).unwrap());
        for (text, has_before) in [("", true), ("{", true), ("[7]", false)] {
            fs::write(&path, text).unwrap();
            if !has_before {
                fs::write(&before, "no state").unwrap();
            }
            let (_, earlier) = StateFile::open(&folder, "m").unwrap();
            assert_eq!(earlier.snapshot.is_some(), has_before, "{text}");
            let degraded = earlier.degraded.unwrap();
            let instead = if has_before { "the state before it is used" } else { "begins without a state" };
            assert!(degraded.contains(instead), "{degraded}");
            assert!(!path.exists() && fs::read_to_string(&broken).unwrap() == text, "{degraded}");
        }
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_told_and_tried_again() {
        let place = std::env::temp_dir().join(format!("shsa-no-folder-{}", std::process::id()));
        fs::write(&place, "").unwrap();
        let (mut file, earlier) = StateFile::open(&place, "m").unwrap();
        assert!(earlier.snapshot.is_none());
        file.save(&Snapshot::default());
        assert!(file.missing().waits && file.missing().inputs == 1, "{:?}", file.missing());
        fs::remove_file(&place).unwrap();
        file.save(&Snapshot::default());
        assert!(!file.missing().waits && place.join("m.json").exists());
        fs::remove_dir_all(place).unwrap();
    }
}
