//! The journal of a live run. A thread of its own writes it, so a slow or full disk delays nobody. Files have a largest size, and
//! the oldest ones are removed.
//!
//! `FOLDER/MODEL.jsonl` is the present file, `MODEL.1.jsonl` the previous one, `MODEL.2.jsonl` the one before. Each begins with
//! the names of the signals, and can be replayed alone.

mod kept;
mod missing;

pub(super) use missing::Missing;

use kept::Kept;
use missing::{lose, wait};
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::drive::Given;
use shsa_format::journal::JournalWriter;
use std::fs::{self, File};
use std::io::{self, Seek, SeekFrom, Write};
use std::mem;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Chunks that may wait for the disk: at most a turn's inputs each.
const WAITING: usize = 1_024;
/// The pause before the next attempt after the disk has refused.
pub(super) const PAUSE: Duration = Duration::from_secs(1);
/// How long the end of a run waits for the disk.
const END: Duration = Duration::from_secs(5);
/// A file that was begun after a refusal is worthless if the disk refuses again before it holds this part of its size. It is
/// replaced, not kept as an older file.
const WORTH: u64 = 64;

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
}

/// Inputs to be written to the disk.
struct Chunk {
    /// The head of a file.
    head: Arc<[u8]>,
    lines: Vec<u8>,
    inputs: u64,
}

impl Journal {
    /// Begins a new file; files of earlier runs become older files.
    ///
    /// # Errors
    /// When the folder cannot be made, or the file cannot be written.
    pub(super) fn begin(
        folder: &Path,
        model: &str,
        bounds: Bounds,
        knowledge: &KnowledgeBase,
    ) -> io::Result<Journal> {
        fs::create_dir_all(folder)?;
        let head = head(knowledge)?;
        let mut disk = Disk::new(folder, model, bounds);
        disk.begin(&head)?;
        let (chunks, taken) = sync_channel(WAITING);
        let (writing, written) = sync_channel(0);
        let missing = Arc::<Mutex<Missing>>::default();
        let described = missing.clone();
        thread::Builder::new().name("journal".into()).spawn(move || {
            disk.write_all(&taken, &described);
            drop(writing);
        })?;
        Ok(Journal { lines: lines(knowledge)?, inputs: 0, head, chunks: Some(chunks), written, missing })
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

    /// Hands the added inputs to the writing thread, without waiting.
    pub(super) fn hand_over(&mut self) {
        if self.inputs == 0 {
            return;
        }
        let lines = mem::take(self.lines.output_mut());
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

/// The files on the disk.
struct Disk {
    folder: PathBuf,
    model: String,
    bounds: Bounds,
    /// `None` while the disk refuses.
    file: Option<File>,
    size: u64,
    /// The number of inputs in the present file.
    inputs: u64,
    /// Whether the disk has refused the end of the present file, and of the previous one.
    is_cut: bool,
    was_cut: bool,
}

impl Disk {
    fn new(folder: &Path, model: &str, bounds: Bounds) -> Disk {
        let (folder, model) = (folder.to_owned(), model.to_owned());
        Disk { folder, model, bounds, file: None, size: 0, inputs: 0, is_cut: false, was_cut: false }
    }

    fn write_all(&mut self, chunks: &Receiver<Chunk>, missing: &Mutex<Missing>) {
        let mut kept = Kept::default();
        loop {
            match kept.next(chunks) {
                Ok(chunk) => kept.keep(chunk, missing),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if kept.again.is_none_or(|again| Instant::now() >= again) {
                self.write_kept(&mut kept, missing);
            }
        }
        self.write_kept(&mut kept, missing);
        kept.give_up(missing);
    }

    /// Writes the kept chunks until the disk refuses.
    fn write_kept(&mut self, kept: &mut Kept, missing: &Mutex<Missing>) {
        while let Some(chunk) = kept.chunks.front() {
            match self.write(chunk) {
                Ok(replaced) if replaced > 0 => lose(missing, replaced, "the disk refused again and again"),
                Ok(_) => {}
                Err(error) => {
                    kept.because = error.to_string();
                    kept.again = Some(Instant::now() + PAUSE);
                    wait(missing, Some(&kept.because));
                    return;
                }
            }
            kept.take();
        }
        if kept.again.take().is_some() {
            wait(missing, None);
        }
        if std::mem::take(&mut kept.has_hole) {
            // A file has no holes, so the next input begins another file.
            self.file = None;
            self.is_cut = true;
        }
    }

    /// Returns the number of inputs lost with a replaced file.
    fn write(&mut self, chunk: &Chunk) -> io::Result<u64> {
        let length = chunk.lines.len() as u64;
        let is_full = self.size + length > self.bounds.size;
        let Some(file) = self.file.as_mut().filter(|_| !is_full) else { return self.begin_with(chunk) };
        if let Err(error) = file.write_all(&chunk.lines) {
            // The file is cut back to its last whole line, and continues there when there is room again.
            let is_whole = file.set_len(self.size).is_ok() && file.seek(SeekFrom::Start(self.size)).is_ok();
            if !is_whole || !is_want_of_room(&error) {
                self.file = None;
                self.is_cut = true;
            }
            return Err(error);
        }
        self.size += length;
        self.inputs += chunk.inputs;
        Ok(0)
    }

    /// Begins a file without inputs.
    fn begin(&mut self, head: &Arc<[u8]>) -> io::Result<u64> {
        self.begin_with(&Chunk { head: head.clone(), lines: Vec::new(), inputs: 0 })
    }

    /// Begins another file with a chunk, and makes the present file an older one. No old file is removed before the new one is
    /// complete. Returns the number of inputs of a present file that was worthless and is replaced.
    fn begin_with(&mut self, chunk: &Chunk) -> io::Result<u64> {
        self.file = None;
        let beside = self.folder.join(format!("{}.jsonl.new", self.model));
        let file = written(&beside, chunk);
        let file = file.inspect_err(|_| drop(fs::remove_file(&beside)))?;
        let is_worthless = self.is_cut && self.was_cut && self.size < self.bounds.size / WORTH;
        if self.path(0).exists() && !is_worthless {
            for number in (0..self.bounds.older).rev() {
                rename_if_there(&self.path(number), &self.path(number + 1))?;
            }
        }
        fs::rename(&beside, self.path(0))?;
        let lost = if is_worthless { self.inputs } else { 0 };
        self.size = (chunk.head.len() + chunk.lines.len()) as u64;
        self.inputs = chunk.inputs;
        (self.is_cut, self.was_cut) = (false, self.is_cut);
        self.file = Some(file);
        Ok(lost)
    }

    fn path(&self, number: usize) -> PathBuf {
        let Disk { folder, model, .. } = self;
        match number {
            0 => folder.join(format!("{model}.jsonl")),
            number => folder.join(format!("{model}.{number}.jsonl")),
        }
    }
}

/// Whether the same file may have room again later.
fn is_want_of_room(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}

/// Writes a new file with a chunk.
fn written(path: &Path, chunk: &Chunk) -> io::Result<File> {
    let mut file = File::create(path)?;
    file.write_all(&chunk.head)?;
    file.write_all(&chunk.lines)?;
    Ok(file)
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
        shsa_model::load(MODEL, "test.yaml").knowledge
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("shsa-journal-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    fn disk(folder: &Path, older: usize) -> Disk {
        fs::create_dir_all(folder).unwrap();
        Disk::new(folder, "m", Bounds { size: 40, older })
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
        disk.begin(&(*b"head\n").into()).unwrap();
        disk.file = Some(File::open(disk.path(0)).unwrap());
        let (sender, taken) = sync_channel(4);
        let missing = Mutex::default();
        sender.send(chunk("refused\n")).unwrap();
        sender.send(chunk("kept\n")).unwrap();
        drop(sender);
        disk.write_all(&taken, &missing);
        assert_eq!(missing.lock().unwrap().inputs, 0);
        disk.write(&chunk("later\n")).unwrap();
        assert_eq!(fs::read_to_string(disk.path(0)).unwrap(), "head\nrefused\nkept\nlater\n");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn after_what_was_lost_another_file_begins() {
        let folder = folder("hole");
        let mut disk = Disk { bounds: Bounds { size: 64 << 10, older: 2 }, ..disk(&folder, 2) };
        disk.write(&chunk("before\n")).unwrap();
        let (mut kept, missing) = (Kept::default(), Mutex::default());
        kept.has_hole = true;
        disk.write_kept(&mut kept, &missing);
        disk.write(&chunk("after\n")).unwrap();
        let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
        assert_eq!((read("m.1.jsonl"), read("m.jsonl")), ("head\nbefore\n".into(), "head\nafter\n".into()));
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_disk_that_refuses_again_and_again_does_not_push_out_what_is_older() {
        let folder = folder("again");
        let mut disk = Disk { bounds: Bounds { size: 64 << 10, older: 2 }, ..disk(&folder, 2) };
        let mut lost = disk.write(&chunk("older\n")).unwrap();
        for number in 0..8 {
            // The disk refuses every second write.
            disk.file = Some(File::open(disk.path(0)).unwrap());
            disk.write(&chunk("refused\n")).unwrap_err();
            lost += disk.write(&chunk(&format!("{number}\n"))).unwrap();
        }
        let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
        assert_eq!((read("m.1.jsonl"), read("m.jsonl")), ("head\nolder\n".into(), "head\n7\n".into()));
        assert!(!folder.join("m.2.jsonl").exists() && !folder.join("m.jsonl.new").exists());
        assert_eq!(lost, 7);
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
        let live = shsa_model::live::Live::load(shsa_model::live::Written { name: "m", text: MODEL });
        let text = fs::read(&path).unwrap();
        let read = shsa_format::journal::read_journal(&text[..], live.unwrap().0).unwrap();
        assert_eq!((read.eras[0].inputs.len(), read.damage), (100, None));
        fs::remove_dir_all(folder).unwrap();
    }
}
