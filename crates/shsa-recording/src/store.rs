//! Where the bytes of files are: on the disk, or given by the caller. What is unpacked or sorted goes to temporary files, in memory
//! where a program has no disk, as in a browser.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The bytes of a file, which are asked for in pieces.
pub trait Bytes: Send + Sync {
    /// The number of bytes.
    fn size(&self) -> u64;

    /// Reads bytes from this place on, as many as fit; returns how many, 0 at the end.
    ///
    /// # Errors
    /// When they cannot be read.
    fn read_at(&self, at: u64, into: &mut [u8]) -> io::Result<usize>;
}

impl Bytes for Vec<u8> {
    fn size(&self) -> u64 {
        self.len() as u64
    }

    fn read_at(&self, at: u64, into: &mut [u8]) -> io::Result<usize> {
        let from = usize::try_from(at).unwrap_or(usize::MAX).min(self.len());
        let rest = self.get(from..).unwrap_or_default();
        let count = rest.len().min(into.len());
        into.iter_mut().zip(rest).for_each(|(into, byte)| *into = *byte);
        Ok(count)
    }
}

/// Where the files are that paths lead to.
#[derive(Clone, Default)]
pub enum Files {
    /// On the disk.
    #[default]
    Disk,
    /// Given by the caller, by their names.
    Given(Arc<BTreeMap<PathBuf, Arc<dyn Bytes>>>),
}

impl Files {
    /// Files with these names and contents.
    #[must_use]
    pub fn given(files: impl IntoIterator<Item = (PathBuf, Arc<dyn Bytes>)>) -> Files {
        Files::Given(Arc::new(files.into_iter().collect()))
    }

    /// Opens a file.
    ///
    /// # Errors
    /// When there is no such file, or it cannot be read.
    pub(crate) fn open(&self, path: &Path) -> io::Result<Opened> {
        match self {
            Files::Disk => fs::File::open(path).map(Opened::Disk),
            Files::Given(files) => {
                let bytes = files.get(path).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))?.clone();
                Ok(Opened::Given { bytes, at: 0 })
            }
        }
    }

    /// Whether a path is that of a folder.
    pub(crate) fn is_folder(&self, path: &Path) -> bool {
        match self {
            Files::Disk => path.is_dir(),
            Files::Given(files) => files.keys().any(|file| file.parent() == Some(path)),
        }
    }

    /// The files in a folder, without those of its folders.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub(crate) fn within(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        match self {
            Files::Disk => {
                let entries = folder.read_dir()?.collect::<io::Result<Vec<_>>>()?;
                Ok(entries.into_iter().map(|entry| entry.path()).filter(|path| path.is_file()).collect())
            }
            Files::Given(files) => {
                Ok(files.keys().filter(|file| file.parent() == Some(folder)).cloned().collect())
            }
        }
    }

    /// The size of a file, bytes; of what is no file, such as a pipe, the largest number.
    pub(crate) fn size(&self, path: &Path) -> u64 {
        match self {
            Files::Disk => {
                let about = fs::metadata(path).ok().filter(fs::Metadata::is_file);
                about.map_or(u64::MAX, |about| about.len())
            }
            Files::Given(files) => files.get(path).map_or(u64::MAX, |bytes| bytes.size()),
        }
    }
}

impl fmt::Debug for Files {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Files::Disk => f.write_str("Disk"),
            Files::Given(files) => f.debug_set().entries(files.keys()).finish(),
        }
    }
}

/// Given files are equal where they are the same ones.
impl PartialEq for Files {
    fn eq(&self, other: &Files) -> bool {
        match (self, other) {
            (Files::Disk, Files::Disk) => true,
            (Files::Given(one), Files::Given(other)) => Arc::ptr_eq(one, other),
            _ => false,
        }
    }
}

impl Eq for Files {}

/// An open file.
pub(crate) enum Opened {
    Disk(fs::File),
    Given {
        bytes: Arc<dyn Bytes>,
        at: u64,
    },
    #[cfg_attr(not(target_family = "wasm"), allow(dead_code, reason = "there is a disk"))]
    Memory(io::Cursor<Vec<u8>>),
}

impl Opened {
    /// The number of bytes.
    pub(crate) fn size(&self) -> io::Result<u64> {
        match self {
            Opened::Disk(file) => Ok(file.metadata()?.len()),
            Opened::Given { bytes, .. } => Ok(bytes.size()),
            Opened::Memory(memory) => Ok(memory.get_ref().len() as u64),
        }
    }

    /// The same file from its beginning.
    pub(crate) fn again(&self) -> io::Result<Opened> {
        let mut again = match self {
            Opened::Disk(file) => Opened::Disk(file.try_clone()?),
            Opened::Given { bytes, .. } => Opened::Given { bytes: bytes.clone(), at: 0 },
            Opened::Memory(memory) => Opened::Memory(memory.clone()),
        };
        again.rewind()?;
        Ok(again)
    }
}

impl Read for Opened {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self {
            Opened::Disk(file) => file.read(into),
            Opened::Given { bytes, at } => {
                let count = bytes.read_at(*at, into)?;
                *at += count as u64;
                Ok(count)
            }
            Opened::Memory(memory) => memory.read(into),
        }
    }
}

impl Seek for Opened {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let (bytes, at) = match self {
            Opened::Disk(file) => return file.seek(to),
            Opened::Memory(memory) => return memory.seek(to),
            Opened::Given { bytes, at } => (bytes, at),
        };
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::Current(by) => at.checked_add_signed(by),
            SeekFrom::End(by) => bytes.size().checked_add_signed(by),
        };
        *at = place.ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
        Ok(*at)
    }
}

impl Write for Opened {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Opened::Disk(file) => file.write(bytes),
            Opened::Given { .. } => Err(io::ErrorKind::Unsupported.into()),
            Opened::Memory(memory) => memory.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        if let Opened::Disk(file) = self { file.flush() } else { Ok(()) }
    }
}

/// A temporary file without a name.
///
/// # Errors
/// When the file cannot be created.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn nameless() -> io::Result<Opened> {
    use std::sync::atomic::{AtomicU32, Ordering};
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let name = format!("shsa-unpacked-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let path = std::env::temp_dir().join(name);
    let file = fs::File::options().read(true).write(true).create_new(true).open(&path)?;
    // Where an open file cannot be removed, it stays until the folder is cleaned up.
    drop(fs::remove_file(&path));
    Ok(Opened::Disk(file))
}

/// A temporary file in memory: there is no disk.
///
/// # Errors
/// None.
#[cfg(target_family = "wasm")]
pub(crate) fn nameless() -> io::Result<Opened> {
    Ok(Opened::Memory(io::Cursor::default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn given_bytes_are_read_as_a_file_is() {
        let path = Path::new("a.csv");
        let files = Files::given([(path.to_owned(), Arc::new(b"0123456789".to_vec()) as Arc<dyn Bytes>)]);
        assert_eq!((files.size(path), files.size(Path::new("b.csv"))), (10, u64::MAX));
        assert_eq!(files.open(Path::new("b.csv")).err().unwrap().kind(), io::ErrorKind::NotFound);
        let mut opened = files.open(path).unwrap();
        let mut three = [0; 3];
        let mut at = |to| {
            let place = opened.seek(to).unwrap();
            let count = opened.read(&mut three).unwrap();
            (place, three[..count].to_vec())
        };
        assert_eq!(at(SeekFrom::Start(8)), (8, b"89".to_vec()));
        assert_eq!(at(SeekFrom::End(-10)), (0, b"012".to_vec()));
        assert_eq!(at(SeekFrom::Current(1)), (4, b"456".to_vec()));
        assert_eq!(at(SeekFrom::Start(99)), (99, Vec::new()));
        assert!(opened.seek(SeekFrom::Current(-1_000)).is_err() && opened.write(b"x").is_err());
    }
}
