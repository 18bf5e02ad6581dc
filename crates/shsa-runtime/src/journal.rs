//! The journal of a live run. A thread of its own writes it, so a slow or full disk delays nobody. Files have a largest size, and
//! the oldest ones are removed.
//!
//! `FOLDER/MODEL.jsonl` is the present file, `MODEL.1.jsonl` the previous one, `MODEL.2.jsonl` the one before. Each begins with
//! the names of the signals, and can be replayed alone.

mod missing;
mod key;
mod sealer;
mod kept;
mod disk;

pub use key::{PublicKey, SigningKey};
pub(super) use missing::Missing;
pub use sealer::JournalSeal;

use crate::options::JournalOptions;
use disk::Disk;
use missing::{lose, wait};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;
use shsa_format::drive::Given;
use shsa_format::journal::JournalWriter;
use std::io;
use std::mem;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// Chunks that may wait for the disk: at most a turn's inputs each.
const WAITING: usize = 1_024;
/// The pause before the next attempt after the disk has refused.
pub(super) const PAUSE: Duration = Duration::from_secs(1);
/// How long the end of a run waits for the disk.
const END: Duration = Duration::from_secs(5);

/// The bounds of the journal's size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// The largest file, bytes.
    pub(super) size: u64,
    /// How many older files are kept.
    pub(super) older: usize,
}

/// The journal of one model.
#[derive(Debug)]
pub(super) struct Journal {
    lines: JournalWriter<Vec<u8>>,
    inputs: u64,
    head: Arc<[u8]>,
    /// `None` while the journal is being closed.
    chunks: Option<SyncSender<Chunk>>,
    /// Closed when all chunks are written.
    written: Receiver<()>,
    missing: Arc<Mutex<Missing>>,
    is_sealed: bool,
}

/// Inputs to be written to the disk.
struct Chunk {
    /// The head of a file.
    head: Arc<[u8]>,
    lines: Vec<u8>,
    inputs: u64,
}

impl Journal {
    /// Begins a new file; files of earlier runs become older files. While the disk refuses, as a full or read-only one does, inputs
    /// wait in memory.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(super) fn begin(
        options: &JournalOptions,
        model: &str,
        knowledge: &KnowledgeBase,
    ) -> io::Result<Journal> {
        let head = head(knowledge)?;
        let JournalOptions { folder, size, older, seal } = options;
        let mut disk = Disk::new(folder, model, Bounds { size: *size, older: *older }, seal.clone());
        let refused = disk.begin(&head).err();
        let (chunks, taken) = sync_channel(WAITING);
        let (writing, written) = sync_channel(0);
        let missing = Arc::<Mutex<Missing>>::default();
        wait(&missing, refused.map(|error| error.to_string()).as_deref());
        let described = missing.clone();
        thread::Builder::new().name("journal".into()).spawn(move || {
            disk.write_all(&taken, &described);
            drop(writing);
        })?;
        let (lines, is_sealed) = (lines(knowledge)?, !matches!(seal, JournalSeal::Off));
        Ok(Journal { lines, inputs: 0, head, chunks: Some(chunks), written, missing, is_sealed })
    }

    /// Adds an input.
    ///
    /// # Errors
    /// Never: it writes to memory.
    pub(super) fn record(&mut self, given: Given<'_>) -> io::Result<()> {
        self.lines.record(given)?;
        self.inputs += 1;
        if let Given::Era(era) = given {
            self.head = head(&era.knowledge)?;
        }
        Ok(())
    }

    /// Adds who has given an order, where the journal is sealed.
    pub(super) fn ordered(&mut self, time: Time, by: &str, done: &str) {
        if self.is_sealed {
            // Writing to memory never fails.
            let _ = self.lines.ordered(time, by, done);
        }
    }

    /// Hands the added lines to the writing thread, without waiting.
    pub(super) fn hand_over(&mut self) {
        let lines = mem::take(self.lines.output_mut());
        if lines.is_empty() {
            return;
        }
        let chunk = Chunk { head: self.head.clone(), lines, inputs: mem::take(&mut self.inputs) };
        let Some(chunks) = &self.chunks else { return };
        if let Err(TrySendError::Full(chunk) | TrySendError::Disconnected(chunk)) = chunks.try_send(chunk) {
            lose(&self.missing, chunk.inputs, "the disk is too slow");
        }
    }

    /// The inputs that are missing in the journal.
    pub(super) fn missing(&self) -> Missing {
        self.missing.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Waits until everything is written, unless the disk takes too long.
impl Drop for Journal {
    fn drop(&mut self) {
        self.hand_over();
        self.chunks = None;
        let _closed_or_late = self.written.recv_timeout(END);
    }
}

fn lines(knowledge: &KnowledgeBase) -> io::Result<JournalWriter<Vec<u8>>> {
    let mut writer = JournalWriter::new(Vec::new(), knowledge)?;
    writer.output_mut().clear();
    Ok(writer)
}

fn head(knowledge: &KnowledgeBase) -> io::Result<Arc<[u8]>> {
    Ok(mem::take(JournalWriter::new(Vec::new(), knowledge)?.output_mut()).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::engine::Input;
    use std::fs;
    use std::path::{Path, PathBuf};

    const MODEL: &str = "{shsa: 1, variables: {speed: {unit: m/s}}, signals: {gps: {variable: speed}}}";

    fn knowledge() -> KnowledgeBase {
        shsa_model::load(MODEL, "test.yaml").knowledge
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("shsa-journal-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    fn options(folder: &Path, seal: JournalSeal) -> JournalOptions {
        JournalOptions { folder: folder.to_owned(), size: 1 << 20, older: 1, seal }
    }

    #[test]
    fn a_disk_that_refuses_from_the_beginning_gets_all_later() {
        let folder = folder("late");
        fs::create_dir_all(&folder).unwrap();
        // Nothing can be in a folder whose name is that of a file.
        let place = folder.join("place");
        fs::write(&place, "").unwrap();
        let mut journal = Journal::begin(&options(&place, JournalSeal::Off), "m", &knowledge()).unwrap();
        assert!(journal.missing().waits && !journal.missing().because.is_empty());
        journal.record(Given::Input(&Input::Tick(Time(1)))).unwrap();
        journal.hand_over();
        fs::remove_file(&place).unwrap();
        let written = (0..500).any(|_| {
            thread::sleep(Duration::from_millis(10));
            fs::read_to_string(place.join("m.jsonl")).is_ok_and(|text| text.lines().count() == 2)
        });
        assert!(written, "{:?}", journal.missing());
        drop(journal);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_is_recorded_replays() {
        let folder = folder("whole");
        let mut journal = Journal::begin(&options(&folder, JournalSeal::Off), "m", &knowledge()).unwrap();
        for tick in 0..100 {
            journal.record(Given::Input(&Input::Tick(Time(tick)))).unwrap();
            journal.hand_over();
        }
        let path = folder.join("m.jsonl");
        let complete = |text: &str| text.lines().count() == 101 && text.ends_with('\n');
        let written = (0..500).any(|_| {
            thread::sleep(Duration::from_millis(10));
            complete(&fs::read_to_string(&path).unwrap())
        });
        assert!(written, "{:?}", journal.missing());
        let live = shsa_model::live::Live::load(shsa_model::live::Written { name: "m", text: MODEL });
        let text = fs::read(&path).unwrap();
        let read = shsa_format::journal::read_journal(&text[..], live.unwrap().0).unwrap();
        assert_eq!((read.eras[0].inputs.len(), read.damage), (100, None));
        fs::remove_dir_all(folder).unwrap();
    }
}
