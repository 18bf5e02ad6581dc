//! Seals what is written to the files of a journal.

use super::key::SigningKey;
use shsa_format::journal::seal::{self, Seal};
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufReader};
use std::path::PathBuf;

/// How a journal shows that it was changed.
#[derive(Clone, Debug, Default)]
pub enum JournalSeal {
    /// It does not.
    #[default]
    Off,
    /// Each record carries the hash of the one before.
    Chained,
    /// The same, and each file ends with a signature.
    Signed(SigningKey),
}

/// How far a journal is sealed.
#[derive(Clone, Copy, Default)]
pub(super) struct Sealed {
    /// The number of the present file; 0: there is none.
    number: u64,
    /// The seal before the present file, and the last one.
    before: Option<Seal>,
    end: Option<Seal>,
}

/// Seals records. What it has sealed counts when it is written.
pub(super) struct Sealer {
    seal: JournalSeal,
    /// What is written; `None`: the files of earlier runs were not read yet.
    written: Option<Sealed>,
}

impl Sealer {
    pub(super) fn new(seal: JournalSeal) -> Sealer {
        Sealer { seal, written: None }
    }

    /// Goes on after the first of these files that is sealed: those of earlier runs, the newest first. A power cut may have left an empty
    /// one.
    ///
    /// # Errors
    /// When a file that is there cannot be read.
    pub(super) fn resume(&mut self, files: impl Iterator<Item = PathBuf>) -> io::Result<()> {
        if self.is_off() || self.written.is_some() {
            return Ok(());
        }
        let mut sealed = None;
        for file in files.filter(|file| file.exists()) {
            sealed = seal::end(BufReader::new(File::open(file)?))?;
            if sealed.is_some() {
                break;
            }
        }
        let sealed = sealed.map(|(number, end)| Sealed { number, before: None, end: Some(end) });
        self.written = Some(sealed.unwrap_or_default());
        Ok(())
    }

    /// The first line of another file, or of one that takes the place of the present one.
    pub(super) fn head<'a>(&self, head: &'a [u8], replaces: bool) -> (Cow<'a, [u8]>, Sealed) {
        let Sealed { number, before, end } = self.written.unwrap_or_default();
        let (number, before) = if replaces { (number, before) } else { (number + 1, end) };
        if self.is_off() {
            return (Cow::Borrowed(head), Sealed::default());
        }
        let mut sealed = Vec::new();
        let end = Seal::write_head(before, number, head, &mut sealed);
        (Cow::Owned(sealed), Sealed { number, before, end: Some(end) })
    }

    /// Lines that come next.
    pub(super) fn lines<'a>(&self, lines: &'a [u8]) -> (Cow<'a, [u8]>, Sealed) {
        self.lines_after(self.written.unwrap_or_default(), lines)
    }

    /// Lines that come after others.
    pub(super) fn lines_after<'a>(&self, before: Sealed, lines: &'a [u8]) -> (Cow<'a, [u8]>, Sealed) {
        if self.is_off() {
            return (Cow::Borrowed(lines), before);
        }
        let mut sealed = Vec::new();
        let end = before.end.unwrap_or_default().write(lines, &mut sealed);
        (Cow::Owned(sealed), Sealed { end: Some(end), ..before })
    }

    /// A signature of all that is written.
    pub(super) fn signature(&self) -> Option<(Vec<u8>, Sealed)> {
        let (JournalSeal::Signed(key), Some(before)) = (&self.seal, self.written) else { return None };
        let (end, mut line) = (before.end?, Vec::new());
        let end = end.write_signature(&key.sign(&end.signed())?, &mut line);
        Some((line, Sealed { end: Some(end), ..before }))
    }

    /// All that was sealed up to there is written.
    pub(super) fn wrote(&mut self, sealed: Sealed) {
        self.written = Some(sealed);
    }

    pub(super) fn is_off(&self) -> bool {
        matches!(self.seal, JournalSeal::Off)
    }
}

#[cfg(test)]
mod tests {
    use super::super::disk::Disk;
    use super::super::{Bounds, Chunk, PublicKey};
    use super::*;
    use shsa_format::journal::examination::{Verification, examine, verify};
    use std::fs::{self, OpenOptions};
    use std::io::Write;
    use std::path::Path;
    use std::sync::Mutex;
    use std::sync::mpsc::sync_channel;

    /// A pair that openssl has made for this test, and the public key of another one.
    const PRIVATE: &str = "MC4CAQAwBQYDK2VwBCIEIDSFeDzv2z9n/o7K4eOkuUtZ49B62zSzYLl597Av+Q0r";
    const PUBLIC: &str = "MCowBQYDK2VwAyEA70osIIlOUnS4EqRhfN86vBHQluc57tA9IdvTz6iAGTg=";
    const OTHER: &str = "MCowBQYDK2VwAyEAIM2RoUpDyG6Xq4vH1APhTATMUEbihpxQtyUV8LyIWlI=";
    const HEAD: &[u8] = b"{\"journal\":\"shsa-journal-1\",\"signals\":[]}\n";

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("shsa-sealer-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    fn pem(folder: &Path, kind: &str, key: &str) -> PathBuf {
        let path = folder.join(format!("{kind}.pem"));
        fs::write(&path, format!("-----BEGIN {kind} KEY-----\n{key}\n-----END {kind} KEY-----\n")).unwrap();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        }
        path
    }

    fn key(folder: &Path) -> JournalSeal {
        JournalSeal::Signed(SigningKey::read(&pem(folder, "PRIVATE", PRIVATE)).unwrap())
    }

    fn public(folder: &Path, key: &str) -> PublicKey {
        PublicKey::read(&pem(folder, "PUBLIC", key)).unwrap()
    }

    fn chunk(number: usize) -> Chunk {
        let lines = format!("{{\"tick_ns\":{number}}}\n{{\"tick_ns\":{number}}}\n");
        Chunk { head: HEAD.into(), lines: lines.into(), inputs: 2 }
    }

    /// A run that writes this many chunks and ends as it should.
    fn run(folder: &Path, seal: &JournalSeal, bounds: Bounds, chunks: usize) {
        let mut disk = Disk::new(folder, "m", bounds, seal.clone());
        disk.begin(&HEAD.into()).unwrap();
        let (sender, taken) = sync_channel(chunks);
        (0..chunks).for_each(|number| sender.send(chunk(number)).unwrap());
        drop(sender);
        disk.write_all(&taken, &Mutex::default());
    }

    fn verified(folder: &Path, key: Option<PublicKey>) -> Verification {
        let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.retain(|file| file.extension().is_some_and(|it| it == "jsonl"));
        let check =
            |bytes: &[u8], signature: &[u8; 64]| key.is_some_and(|key| key.verifies(bytes, signature));
        let examined = files.iter().map(|file| {
            let file = BufReader::new(File::open(file).unwrap());
            examine(file, key.is_some().then_some(&check)).unwrap()
        });
        verify(&examined.collect::<Vec<_>>())
    }

    #[test]
    fn the_files_of_all_runs_are_one_signed_journal() {
        for (size, older) in [(1, 3), (700, 2), (1 << 20, 7)] {
            let folder = folder("runs");
            let (seal, bounds) = (key(&folder), Bounds { size, older });
            for chunks in [0, 9, 3] {
                run(&folder, &seal, bounds, chunks);
                let found = verified(&folder, Some(public(&folder, PUBLIC)));
                assert_eq!(
                    (found.finding, found.cuts, found.unsigned),
                    (None, vec![], 0),
                    "{size}, {chunks}"
                );
            }
            assert!(verified(&folder, Some(public(&folder, OTHER))).finding.is_some());
            fs::remove_dir_all(folder).unwrap();
        }
    }

    /// What happens to a journal on a disk.
    #[derive(Clone, Copy, Debug)]
    enum Mishap {
        None,
        Refusal,
        Restart,
        PowerCut,
        /// The file was not written to the disk at all.
        Emptied,
    }

    fn suffer(disk: &mut Disk, mishap: Mishap, folder: &Path, bounds: Bounds) {
        let present = folder.join("m.jsonl");
        match mishap {
            Mishap::None => {}
            Mishap::Refusal => {
                disk.refuse();
                // A full file is replaced without being written to.
                let _refused_or_replaced = disk.write(&chunk(7));
            }
            Mishap::PowerCut | Mishap::Emptied | Mishap::Restart => {
                if matches!(mishap, Mishap::PowerCut) {
                    let mut file = OpenOptions::new().append(true).open(&present).unwrap();
                    file.write_all(b"{\"tick_ns\":12,\"se").unwrap();
                }
                if matches!(mishap, Mishap::Emptied) {
                    fs::write(&present, "").unwrap();
                }
                *disk = Disk::new(folder, "m", bounds, JournalSeal::Chained);
                disk.begin(&HEAD.into()).unwrap();
            }
        }
    }

    #[test]
    fn whatever_befalls_the_disk_the_journal_is_as_it_was_written() {
        let all = [Mishap::None, Mishap::Refusal, Mishap::Restart, Mishap::PowerCut, Mishap::Emptied];
        for sequence in 0..all.len().pow(4) {
            let folder = folder("mishaps");
            let bounds = Bounds { size: 900, older: 20 };
            let mut disk = Disk::new(&folder, "m", bounds, JournalSeal::Chained);
            disk.begin(&HEAD.into()).unwrap();
            let mishaps = [0, 1, 2, 3].map(|at| all[sequence / all.len().pow(at) % all.len()]);
            for (number, mishap) in mishaps.into_iter().enumerate() {
                suffer(&mut disk, mishap, &folder, bounds);
                disk.write(&chunk(number)).unwrap();
            }
            let found = verified(&folder, None);
            let cuts = mishaps.iter().filter(|it| matches!(it, Mishap::PowerCut | Mishap::Emptied)).count();
            assert_eq!((found.finding, found.cuts.len()), (None, cuts), "{mishaps:?}");
            fs::remove_dir_all(folder).unwrap();
        }
    }

    #[test]
    fn a_file_that_is_no_key_says_how_to_make_one() {
        let folder = folder("keys");
        let no_key = pem(&folder, "PRIVATE", PUBLIC);
        let refused = SigningKey::read(&no_key).unwrap_err().to_string();
        assert!(refused.contains("openssl genpkey -algorithm ed25519"), "{refused}");
        let refused = PublicKey::read(&no_key).unwrap_err().to_string();
        assert!(refused.contains("-pubout"), "{refused}");
        fs::remove_dir_all(folder).unwrap();
    }
}
