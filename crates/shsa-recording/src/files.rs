//! The files of a recording: found in folders, identified by format, opened. Files that are compressed as a whole are
//! decompressed first.

use super::format::{self, HEAD, Row};
use super::near::NearReader;
use super::store::{self, nameless};
use super::topic::Input;
use super::unpack::{self, Packing};
use super::{Files, RecordingError, trial};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A file of a known format.
#[derive(Clone, Debug)]
pub(super) struct File {
    pub(super) path: PathBuf,
    pub(super) row: &'static Row,
}

/// How many first bytes of a packed file decide its format.
const PACKED_HEAD: u64 = 1 << 16;

/// The content of standard input, in a file without a name: it can be read only once, and some formats must be read twice.
static STANDARD_INPUT: OnceLock<store::Opened> = OnceLock::new();

/// The file of a path, from its beginning; `-` is standard input.
fn opened(path: &Path, files: &Files) -> io::Result<store::Opened> {
    if path != Path::new("-") {
        return files.open(path);
    }
    let held = match STANDARD_INPUT.get() {
        Some(held) => held,
        None => {
            let mut file = nameless()?;
            io::copy(&mut io::stdin().lock(), &mut file)?;
            STANDARD_INPUT.get_or_init(|| file)
        }
    };
    held.again()
}

/// The size of a file as it is stored, bytes; of what is no file, such as a pipe, the largest number.
pub(super) fn size(path: &Path, files: &Files) -> u64 {
    if path == Path::new("-") {
        return opened(path, files).and_then(|it| it.size()).unwrap_or(u64::MAX);
    }
    files.size(path)
}

/// The files to read; for a folder its files of known endings, part 2 before part 10.
///
/// # Errors
/// When a file cannot be opened, or its format is unknown.
pub(super) fn files_of(paths: &[PathBuf], from: &Files) -> Result<Vec<File>, RecordingError> {
    let mut files = Vec::new();
    for path in paths {
        let before = files.len();
        let found = if from.is_folder(path) { files_in(path, from)? } else { vec![path.clone()] };
        for file in found {
            let row = match format_of_file(&file, from) {
                // Notes among recordings, without a line that is of one.
                Err(RecordingError::NoLine { .. }) if from.is_folder(path) => continue,
                row => row?,
            };
            files.push(File { path: file, row });
        }
        if files.len() == before {
            return Err(RecordingError::EmptyFolder { folder: path.clone() });
        }
    }
    Ok(files)
}

fn files_in(folder: &Path, from: &Files) -> Result<Vec<PathBuf>, RecordingError> {
    let paths = from.within(folder).map_err(|reason| unreadable(folder, reason))?;
    let is_known = |path: &PathBuf| format::by_ending(&without_packing(path)).is_some();
    let mut files: Vec<_> = paths.into_iter().filter(is_known).collect();
    files.sort_by_key(|path| counted(&path.to_string_lossy()));
    if files.is_empty() {
        return Err(RecordingError::EmptyFolder { folder: folder.into() });
    }
    Ok(files)
}

/// A name in parts for sorting, with numbers by their value: `bag_10` after `bag_2`.
fn counted(name: &str) -> Vec<(String, Option<u64>)> {
    let mut parts = vec![(String::new(), None)];
    for character in name.chars() {
        let Some((text, number)) = parts.last_mut() else { break };
        match character.to_digit(10) {
            Some(digit) => {
                let before: u64 = number.unwrap_or(0);
                *number = Some(before.saturating_mul(10).saturating_add(u64::from(digit)));
            }
            None if number.is_some() => parts.push((character.to_string(), None)),
            None => text.push(character),
        }
    }
    // The whole name decides between `a1` and `a01`.
    parts.push((name.to_owned(), None));
    parts
}

/// The format of a file, by its first bytes and its name.
///
/// # Errors
/// As [`files_of`].
pub(super) fn format_of_file(file: &Path, files: &Files) -> Result<&'static Row, RecordingError> {
    let mut head = Vec::with_capacity(HEAD as usize);
    let mut read = || -> io::Result<Option<Packing>> {
        let mut opened = opened(file, files)?;
        opened.by_ref().take(HEAD).read_to_end(&mut head)?;
        let packing = Packing::of(&head);
        if packing.is_some() {
            opened.take(PACKED_HEAD - HEAD).read_to_end(&mut head)?;
        }
        Ok(packing)
    };
    let (name, head) = match read().map_err(|reason| unreadable(file, reason))? {
        Some(packing) => (without_packing(file), packing.head(&head, HEAD)),
        None => (file.to_owned(), head),
    };
    settled(file, &name, &head, || open(file, files).map(|opened| opened.input))
}

/// The format of a file with this name, apart from a packing, and these first bytes. Where only the ending speaks for it, a line of
/// the file is of the format.
///
/// # Errors
/// When the format is unknown, has to be converted, or is switched off, when no line can be read, and those of `open`.
pub(super) fn settled<I: Input>(
    file: &Path,
    name: &Path,
    head: &[u8],
    open: impl Fn() -> Result<I, RecordingError>,
) -> Result<&'static Row, RecordingError> {
    let row = format_of(name, head)?;
    match format::of_lines(name, head).as_slice() {
        formats @ [_, ..] if !head.is_empty() => trial::one_of(file, formats, open),
        _ => Ok(row),
    }
}

/// The format of a file with this name and these first bytes.
///
/// # Errors
/// When the format is unknown, has to be converted, or is switched off.
fn format_of(file: &Path, head: &[u8]) -> Result<&'static Row, RecordingError> {
    if let Some((what, how)) = format::conversion(head) {
        return Err(RecordingError::Convert { file: file.into(), what, how });
    }
    let row = format::format_of(file, head);
    let row = row.ok_or_else(|| RecordingError::UnknownFormat { file: file.into() })?;
    match row.feature {
        Some(feature) if !row.is_on => {
            Err(RecordingError::SwitchedOff { file: file.into(), name: row.name, feature })
        }
        _ => Ok(row),
    }
}

/// The name without the ending of a compression: `bag.db3` of `bag.db3.zstd`.
pub(super) fn without_packing(file: &Path) -> PathBuf {
    let ending = file.extension().unwrap_or_default().to_string_lossy();
    if Packing::of_ending(&ending).is_some() { file.with_extension("") } else { file.to_owned() }
}

/// The content of a file.
pub(super) struct Opened {
    pub(super) input: NearReader<store::Opened>,
    /// What is wrong with a compressed file of which only the beginning can be decompressed.
    pub(super) problem: Option<String>,
}

/// Opens a file. A compressed file is decompressed into a file without a name.
///
/// # Errors
/// When the file cannot be opened or decompressed.
pub(super) fn open(file: &Path, files: &Files) -> Result<Opened, RecordingError> {
    let open = || -> io::Result<(store::Opened, Option<String>)> {
        let mut opened = opened(file, files)?;
        let mut head = [0; 4];
        let length = opened.read(&mut head)?;
        io::Seek::rewind(&mut opened)?;
        match Packing::of(head.get(..length).unwrap_or_default()) {
            Some(packing) => unpack::file(opened, packing),
            None => Ok((opened, None)),
        }
    };
    let (opened, problem) = open().map_err(|reason| unreadable(file, reason))?;
    Ok(Opened { input: NearReader::new(opened), problem })
}

fn unreadable(file: &Path, reason: io::Error) -> RecordingError {
    RecordingError::Unreadable { file: file.into(), reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_are_counted() {
        let mut names = ["bag_10.db3", "bag_2.db3", "bag.db3", "bag_0.db3", "bag_1.db3", "a02", "a2"];
        names.sort_by_key(|name| counted(name));
        assert_eq!(names, ["a02", "a2", "bag.db3", "bag_0.db3", "bag_1.db3", "bag_2.db3", "bag_10.db3"]);
    }
}
