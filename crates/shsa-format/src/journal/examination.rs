//! Whether a sealed journal is as it was written, over all of its files.

use super::FORMAT;
use super::line::Head;
use super::seal::{Seal, bytes, follows, opened};
use serde::de::IgnoredAny;
use std::io::{self, BufRead};

/// What a signature's record has before and after its digits.
const SIGNATURE: (&[u8], &[u8]) = (b"{\"signature\":\"", b"\"");

/// Whether signed bytes have this signature.
pub type Check<'a> = &'a dyn Fn(&[u8], &[u8; 64]) -> bool;

/// Where a record begins in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The line, counted from 1.
    pub line: usize,
    /// The bytes before it.
    pub offset: u64,
}

/// Why a record is not as it was written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// No seal is at its end.
    #[error(
        "no sealed record: a journal is sealed while it is written, by `shsa run --journal FOLDER --journal-seal`"
    )]
    Unsealed,
    /// It is sealed, and begins no journal.
    #[error("a journal begins with another line: {0}")]
    NoHead(String),
    /// Its seal is not that of its bytes after the record before it.
    #[error("the record is not as it was written, or records before it were removed")]
    Changed,
    /// The same, and the next one follows the one before.
    #[error("the record was inserted or moved: the next one follows the one before it")]
    Inserted,
    /// No given key has made the signature.
    #[error("the signature is of no given key")]
    Signature,
    /// The next file goes on after another record.
    #[error("the next file goes on after another record: records at the end of this one were removed")]
    Shortened,
    /// Files before this one are not there.
    #[error("before this file comes number {0} of the journal, which is not given")]
    Missing(u64),
    /// Another file has the same number.
    #[error("another file is number {0} as well: the files are of several journals, or one is a copy")]
    Twice(u64),
}

/// What was found in one file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Examined {
    /// Its number in the journal; `None`: its first line is not as it was written, or was cut off.
    pub number: Option<u64>,
    /// The records that are as they were written, the first line and signatures included.
    pub records: u64,
    /// The first record that is not.
    pub damage: Option<(Place, Problem)>,
    /// The last record, if it was cut off, as by a power cut.
    pub cut: Option<Place>,
    /// The records up to the last signature of a given key.
    pub signed: u64,
    after: Option<Seal>,
    end: Seal,
    /// The bytes of the records.
    length: u64,
}

/// Examines a file. Without `check`, signatures are not looked at.
///
/// # Errors
/// Errors of the input.
pub fn examine(mut input: impl BufRead, check: Option<Check<'_>>) -> io::Result<Examined> {
    let (mut found, mut line, mut place) = (Examined::default(), Vec::new(), Place { line: 1, offset: 0 });
    loop {
        line.clear();
        place.offset += input.read_until(b'\n', &mut line)? as u64;
        let begin = Place { offset: place.offset - line.len() as u64, ..place };
        let Some(record) = line.strip_suffix(b"\n") else {
            match is_cut(&line) {
                true if line.is_empty() && found.records > 0 => {}
                true => found.cut = Some(begin),
                false => found.damage = Some((begin, Problem::Changed)),
            }
            return Ok(found);
        };
        let before = found.end;
        if let Err(problem) = found.take(record, check) {
            let mut next = Vec::new();
            input.read_until(b'\n', &mut next)?;
            let is_next =
                |record| opened(record).is_some_and(|(content, seal)| follows(before, content, seal));
            let is_foreign = found.records > 0 && next.strip_suffix(b"\n").is_some_and(is_next);
            found.damage = Some((begin, if is_foreign { Problem::Inserted } else { problem }));
            return Ok(found);
        }
        place.line += 1;
    }
}

impl Examined {
    /// Takes the next record.
    fn take(&mut self, record: &[u8], check: Option<Check<'_>>) -> Result<(), Problem> {
        let (content, seal) = opened(record).ok_or(Problem::Unsealed)?;
        if self.records == 0 {
            (self.number, self.after) = head(record)?;
            self.end = self.after.unwrap_or_default();
        }
        if !follows(self.end, content, seal) {
            return Err(Problem::Changed);
        }
        let is_signature = match (signature(content), check) {
            (Some(signature), Some(check)) if !check(&self.end.signed(), &signature) => {
                return Err(Problem::Signature);
            }
            (signature, check) => signature.is_some() && check.is_some(),
        };
        self.end = seal;
        self.records += 1;
        self.length += record.len() as u64 + 1;
        if is_signature {
            self.signed = self.records;
        }
        Ok(())
    }
}

/// The number of a file and the seal after which it comes, by its first line.
fn head(record: &[u8]) -> Result<(Option<u64>, Option<Seal>), Problem> {
    let no_head = |because: String| Problem::NoHead(because);
    let head: Head = serde_json::from_slice(record).map_err(|error| no_head(error.to_string()))?;
    let number = head.file.filter(|_| head.journal == FORMAT);
    let number = number.ok_or_else(|| no_head("it has no number `file`".to_owned()))?;
    let after = head.after.map(|digits| Seal::parse(digits.as_bytes()));
    let after = after.map(|seal| seal.ok_or_else(|| no_head("`after` is no seal".to_owned())));
    Ok((Some(number), after.transpose()?))
}

/// The signature in a record that is one.
fn signature(content: &[u8]) -> Option<[u8; 64]> {
    bytes(content.strip_prefix(SIGNATURE.0)?.strip_suffix(SIGNATURE.1)?)
}

/// Whether what comes after the last end of a line may be the begin of a record. A file system may fill it up with zeros.
fn is_cut(rest: &[u8]) -> bool {
    let end = rest.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    let (written, _zeros) = rest.split_at(end);
    serde_json::from_slice::<IgnoredAny>(written).map_or_else(|error| error.is_eof(), |_| end == rest.len())
}

/// What was found in the files of a journal together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// The files in the order of their numbers, as places in what was given.
    pub order: Vec<usize>,
    /// The first record that is not as it was written: its file, its place, and why.
    pub finding: Option<(usize, Place, Problem)>,
    /// Records that were cut off: their file and place.
    pub cuts: Vec<(usize, Place)>,
    /// The records that are as they were written, up to the finding.
    pub records: u64,
    /// Those of them that come after the last signature of a given key.
    pub unsigned: u64,
    /// The seal of the last of them.
    pub end: Seal,
}

/// Puts the examined files of a journal in their order, and looks at how they follow each other.
#[must_use]
pub fn verify(files: &[Examined]) -> Verification {
    let mut found = Verification { order: (0..files.len()).collect(), ..Verification::default() };
    // A file without a number comes first: nothing can be said of what would follow it.
    found.order.sort_by_key(|at| files.get(*at).and_then(|file| file.number));
    let mut before: Option<(usize, &Examined)> = None;
    for at in found.order.clone() {
        let Some(file) = files.get(at) else { continue };
        found.cuts.extend(file.cut.map(|place| (at, place)));
        found.finding = before.and_then(|(place, before)| link(place, before, at, file));
        if found.finding.is_some() {
            return found;
        }
        found.records += file.records;
        found.unsigned = if file.signed > 0 { 0 } else { found.unsigned } + (file.records - file.signed);
        if file.records > 0 {
            found.end = file.end;
        }
        found.finding = file.damage.clone().map(|(place, problem)| (at, place, problem));
        if found.finding.is_some() {
            return found;
        }
        before = file.number.map(|_| (at, file)).or(before);
    }
    found
}

/// Why a file does not come next after another.
fn link(place: usize, before: &Examined, at: usize, file: &Examined) -> Option<(usize, Place, Problem)> {
    let first = Place { line: 1, offset: 0 };
    let number = file.number?;
    let expected = before.number?.saturating_add(1);
    if number < expected {
        return Some((at, first, Problem::Twice(number)));
    }
    if number > expected {
        return Some((at, first, Problem::Missing(number - 1)));
    }
    let line = usize::try_from(before.records).unwrap_or(usize::MAX);
    let end = Place { line, offset: before.length };
    (file.after != Some(before.end)).then_some((place, end, Problem::Shortened))
}
