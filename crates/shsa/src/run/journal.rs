//! The journal of a live run: written by a thread of its own, so that a slow or full disk delays nobody; in files of bounded
//! size, the oldest of which make room.
//!
//! `FOLDER/MODEL.jsonl` is being written; `MODEL.1.jsonl` is the one before, `MODEL.2.jsonl` the one before that. Each begins
//! with the names of the signals and replays by itself.

use shsa_core::knowledge::KnowledgeBase;
use shsa_format::drive::Given;
use shsa_format::journal::JournalWriter;
use std::fs::{self, File};
use std::io::{self, Write};
use std::mem;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Chunks that may wait for the disk: at most a turn's inputs each.
const WAITING: usize = 1_024;
/// How long a disk that refuses is left alone.
const PAUSE: Duration = Duration::from_secs(1);

/// How much is kept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// The largest file, bytes.
    pub(super) size: u64,
    /// How many older files are kept.
    pub(super) older: usize,
}

/// What cannot be found in the journal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Missing {
    /// Inputs that were not written.
    pub(super) inputs: u64,
    /// Why not, as it was last.
    pub(super) because: String,
}

/// The journal of one model.
#[derive(Debug)]
pub(super) struct Journal {
    lines: JournalWriter<Vec<u8>>,
    inputs: u64,
    head: Arc<[u8]>,
    chunks: SyncSender<Chunk>,
    missing: Arc<Mutex<Missing>>,
}

/// Inputs on their way to the disk.
struct Chunk {
    /// What a file begins with.
    head: Arc<[u8]>,
    lines: Vec<u8>,
    inputs: u64,
}

impl Journal {
    /// Begins a new file; the ones of earlier runs become older ones.
    ///
    /// # Errors
    /// When the folder cannot be made, or the file not be written.
    pub(super) fn begin(
        folder: &Path,
        model: &str,
        bounds: Bounds,
        knowledge: &KnowledgeBase,
    ) -> io::Result<Journal> {
        fs::create_dir_all(folder)?;
        let head = head(knowledge)?;
        let mut disk =
            Disk { folder: folder.to_owned(), model: model.to_owned(), bounds, file: None, size: 0 };
        disk.begin(&head)?;
        let (chunks, taken) = sync_channel(WAITING);
        let missing = Arc::<Mutex<Missing>>::default();
        let told = missing.clone();
        thread::Builder::new().name("journal".into()).spawn(move || disk.write_all(&taken, &told))?;
        Ok(Journal { lines: lines(knowledge)?, inputs: 0, head, chunks, missing })
    }

    /// Adds an input.
    ///
    /// # Errors
    /// Never: memory takes it.
    pub(super) fn record(&mut self, given: Given<'_>) -> io::Result<()> {
        self.lines.record(given)?;
        self.inputs += 1;
        if let Given::Era(era) = given {
            self.head = head(&era.knowledge)?;
        }
        Ok(())
    }

    /// Hands to the disk what has been added since; does not wait for it.
    pub(super) fn hand_over(&mut self) {
        if self.inputs == 0 {
            return;
        }
        let lines = mem::take(self.lines.output_mut());
        let chunk = Chunk { head: self.head.clone(), lines, inputs: mem::take(&mut self.inputs) };
        if let Err(TrySendError::Full(chunk) | TrySendError::Disconnected(chunk)) =
            self.chunks.try_send(chunk)
        {
            lose(&self.missing, chunk.inputs, "the disk is too slow");
        }
    }

    /// What is not in the journal although it should be.
    pub(super) fn missing(&self) -> Missing {
        self.missing.lock().unwrap_or_else(PoisonError::into_inner).clone()
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

fn lose(missing: &Mutex<Missing>, inputs: u64, because: &str) {
    let mut missing = missing.lock().unwrap_or_else(PoisonError::into_inner);
    missing.inputs += inputs;
    because.clone_into(&mut missing.because);
}

/// The files.
struct Disk {
    folder: PathBuf,
    model: String,
    bounds: Bounds,
    /// `None` while the disk refuses.
    file: Option<File>,
    size: u64,
}

impl Disk {
    fn write_all(&mut self, chunks: &Receiver<Chunk>, missing: &Mutex<Missing>) {
        let mut again = Instant::now();
        for chunk in chunks {
            if self.file.is_none() && Instant::now() < again {
                lose(missing, chunk.inputs, "the disk refused just now");
                continue;
            }
            if let Err(error) = self.write(&chunk) {
                lose(missing, chunk.inputs, &error.to_string());
                // What was written of the chunk may end within a line: the next one begins a new file.
                self.file = None;
                again = Instant::now() + PAUSE;
            }
        }
    }

    fn write(&mut self, chunk: &Chunk) -> io::Result<()> {
        let length = chunk.lines.len() as u64;
        if self.file.is_none() || self.size + length > self.bounds.size {
            self.begin(&chunk.head)?;
        }
        let Some(file) = &mut self.file else { return Ok(()) };
        file.write_all(&chunk.lines)?;
        self.size += length;
        Ok(())
    }

    /// Makes the present file an older one, and begins another.
    fn begin(&mut self, head: &[u8]) -> io::Result<()> {
        self.file = None;
        if self.path(0).exists() {
            for number in (0..self.bounds.older).rev() {
                rename_if_there(&self.path(number), &self.path(number + 1))?;
            }
        }
        let mut file = File::create(self.path(0))?;
        file.write_all(head)?;
        self.size = head.len() as u64;
        self.file = Some(file);
        Ok(())
    }

    fn path(&self, number: usize) -> PathBuf {
        let Disk { folder, model, .. } = self;
        match number {
            0 => folder.join(format!("{model}.jsonl")),
            number => folder.join(format!("{model}.{number}.jsonl")),
        }
    }
}

fn rename_if_there(from: &Path, to: &Path) -> io::Result<()> {
    match fs::rename(from, to) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        renamed => renamed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::engine::Input;
    use shsa_core::time::Time;

    const MODEL: &str = "{shsa: 1, variables: {speed: {unit: m/s}}, signals: {gps: {variable: speed}}}";

    fn knowledge() -> KnowledgeBase {
        shsa_format::model::load(MODEL, "test.yaml").knowledge
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("shsa-journal-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    fn disk(folder: &Path, older: usize) -> Disk {
        fs::create_dir_all(folder).unwrap();
        let bounds = Bounds { size: 40, older };
        Disk { folder: folder.to_owned(), model: "m".into(), bounds, file: None, size: 0 }
    }

    fn chunk(lines: &str) -> Chunk {
        Chunk { head: (*b"head\n").into(), lines: lines.into(), inputs: 1 }
    }

    #[test]
    fn full_files_make_room_and_the_oldest_goes() {
        let folder = folder("rotation");
        let mut disk = disk(&folder, 2);
        for number in 0..8 {
            disk.write(&chunk(&format!("a line of 20 bytes {number}\n"))).unwrap();
        }
        let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
        assert_eq!(read("m.jsonl"), "head\na line of 20 bytes 7\n");
        assert_eq!(read("m.2.jsonl"), "head\na line of 20 bytes 5\n");
        assert!(!folder.join("m.3.jsonl").exists());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_disk_that_refuses_costs_only_what_it_refuses() {
        let folder = folder("refusal");
        let mut disk = disk(&folder, 2);
        disk.begin(b"head\n").unwrap();
        disk.file = Some(File::open(disk.path(0)).unwrap());
        let (sender, taken) = sync_channel(4);
        let missing = Mutex::default();
        sender.send(chunk("refused\n")).unwrap();
        sender.send(chunk("too early\n")).unwrap();
        drop(sender);
        disk.write_all(&taken, &missing);
        assert_eq!(missing.lock().unwrap().inputs, 2);
        disk.write(&chunk("later\n")).unwrap();
        assert_eq!(fs::read_to_string(disk.path(0)).unwrap(), "head\nlater\n");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_is_recorded_replays() {
        let folder = folder("whole");
        let bounds = Bounds { size: 1 << 20, older: 1 };
        let mut journal = Journal::begin(&folder, "m", bounds, &knowledge()).unwrap();
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
        let live = shsa_format::model::live::Live::load(shsa_format::model::live::Written {
            name: "m",
            text: MODEL,
        });
        let text = fs::read(&path).unwrap();
        let read = shsa_format::journal::read_journal(&text[..], live.unwrap().0).unwrap();
        assert_eq!((read.eras[0].inputs.len(), read.damage), (100, None));
        fs::remove_dir_all(folder).unwrap();
    }
}
