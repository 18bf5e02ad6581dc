//! The files of a journal on the disk, which may refuse to be written.

use super::kept::Kept;
use super::missing::{Missing, lose, wait};
use super::sealer::{JournalSeal, Sealer};
use super::{Bounds, Chunk, PAUSE};
use std::fs::{self, File};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// A file that was begun after a refusal is worthless if the disk refuses again before it holds this part of its size. It is
/// replaced, not kept as an older file.
const WORTH: u64 = 64;

/// The files on the disk.
pub(super) struct Disk {
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
    sealer: Sealer,
}

impl Disk {
    pub(super) fn new(folder: &Path, model: &str, bounds: Bounds, seal: JournalSeal) -> Disk {
        let (folder, model, sealer) = (folder.to_owned(), model.to_owned(), Sealer::new(seal));
        Disk { folder, model, bounds, file: None, size: 0, inputs: 0, is_cut: false, was_cut: false, sealer }
    }

    pub(super) fn write_all(&mut self, chunks: &Receiver<Chunk>, missing: &Mutex<Missing>) {
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
        self.sign();
    }

    /// Writes the kept chunks until the disk refuses.
    fn write_kept(&mut self, kept: &mut Kept, missing: &Mutex<Missing>) {
        if self.has_vanished() {
            lose(missing, self.inputs, "its file was removed, and another one is begun");
            self.file = None;
        }
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
        kept.again = None;
        wait(missing, None);
        if std::mem::take(&mut kept.has_hole) {
            // A file has no holes, so the next input begins another file.
            self.file = None;
            self.is_cut = true;
        }
    }

    /// Returns the number of inputs lost with a replaced file.
    pub(super) fn write(&mut self, chunk: &Chunk) -> io::Result<u64> {
        let (lines, sealed) = self.sealer.lines(&chunk.lines);
        let length = lines.len() as u64;
        let is_full = self.size + length > self.bounds.size;
        let Some(file) = self.file.as_mut().filter(|_| !is_full) else { return self.begin_with(chunk) };
        if let Err(error) = file.write_all(&lines) {
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
        self.sealer.wrote(sealed);
        Ok(0)
    }

    /// Ends the present file with a signature. Where the disk refuses it, that of a later file counts for this one as well.
    fn sign(&mut self) {
        let (Some(file), Some((line, sealed))) = (self.file.as_mut(), self.sealer.signature()) else {
            return;
        };
        match file.write_all(&line) {
            Ok(()) => {
                self.size += line.len() as u64;
                self.sealer.wrote(sealed);
            }
            Err(_) => drop(file.set_len(self.size)),
        }
    }

    /// Whether the present file is no longer in its place: what is written to it is lost.
    fn has_vanished(&self) -> bool {
        let Some(file) = &self.file else { return false };
        !fs::metadata(self.path(0)).is_ok_and(|there| is_same(&there, file))
    }

    /// Begins a file without inputs.
    pub(super) fn begin(&mut self, head: &Arc<[u8]>) -> io::Result<u64> {
        self.begin_with(&Chunk { head: head.clone(), lines: Vec::new(), inputs: 0 })
    }

    /// Begins another file with a chunk, and makes the present file an older one. No old file is removed before the new one is
    /// complete. Returns the number of inputs of a present file that was worthless and is replaced.
    fn begin_with(&mut self, chunk: &Chunk) -> io::Result<u64> {
        self.sign();
        self.file = None;
        fs::create_dir_all(&self.folder)?;
        let paths: Vec<_> = (0..=self.bounds.older).map(|number| self.path(number)).collect();
        self.sealer.resume(paths.into_iter())?;
        let is_worthless = self.is_cut && self.was_cut && self.size < self.bounds.size / WORTH;
        let (head, sealed) = self.sealer.head(&chunk.head, is_worthless);
        let (lines, sealed) = self.sealer.lines_after(sealed, &chunk.lines);
        let beside = self.folder.join(format!("{}.jsonl.new", self.model));
        let file = written(&beside, &[&head, &lines]);
        let file = file.inspect_err(|_| drop(fs::remove_file(&beside)))?;
        if self.path(0).exists() && !is_worthless {
            for number in (0..self.bounds.older).rev() {
                rename_if_there(&self.path(number), &self.path(number + 1))?;
            }
        }
        fs::rename(&beside, self.path(0))?;
        let lost = if is_worthless { self.inputs } else { 0 };
        self.size = (head.len() + lines.len()) as u64;
        self.inputs = chunk.inputs;
        (self.is_cut, self.was_cut) = (false, self.is_cut);
        self.file = Some(file);
        self.sealer.wrote(sealed);
        Ok(lost)
    }

    /// The disk refuses the next write, and has to begin another file.
    #[cfg(test)]
    pub(super) fn refuse(&mut self) {
        self.file = File::open(self.path(0)).ok();
    }

    fn path(&self, number: usize) -> PathBuf {
        let Disk { folder, model, .. } = self;
        match number {
            0 => folder.join(format!("{model}.jsonl")),
            number => folder.join(format!("{model}.{number}.jsonl")),
        }
    }
}

/// Whether a file in a folder is an open one, as far as the system tells.
fn is_same(there: &fs::Metadata, file: &File) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        file.metadata().is_ok_and(|open| (open.dev(), open.ino()) == (there.dev(), there.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = (there, file);
        true
    }
}

/// Whether the same file may have room again later.
fn is_want_of_room(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}

/// Writes a new file.
fn written(path: &Path, parts: &[&[u8]]) -> io::Result<File> {
    let mut file = File::create(path)?;
    parts.iter().try_for_each(|part| file.write_all(part))?;
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
    use std::sync::mpsc::sync_channel;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("shsa-journal-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    fn disk(folder: &Path, older: usize) -> Disk {
        fs::create_dir_all(folder).unwrap();
        Disk::new(folder, "m", Bounds { size: 40, older }, JournalSeal::Off)
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
        disk.refuse();
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
            disk.refuse();
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
    fn a_file_that_is_removed_is_made_anew() {
        let folder = folder("removed");
        let mut disk = Disk { bounds: Bounds { size: 64 << 10, older: 2 }, ..disk(&folder, 2) };
        let (mut kept, missing) = (Kept::default(), Mutex::default());
        for lines in ["before\n", "after\n", "later\n"] {
            kept.keep(chunk(lines), &missing);
            disk.write_kept(&mut kept, &missing);
            if lines == "before\n" {
                fs::remove_dir_all(&folder).unwrap();
            }
        }
        assert_eq!(fs::read_to_string(disk.path(0)).unwrap(), "head\nafter\nlater\n");
        let missing = missing.into_inner().unwrap();
        assert_eq!((missing.inputs, missing.waits), (1, false));
        assert!(missing.because.contains("removed") && !disk.path(1).exists());
        fs::remove_dir_all(folder).unwrap();
    }
}
