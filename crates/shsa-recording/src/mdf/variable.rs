//! Values of variable length (`VLSD`): a record has the place of its value among others, each behind its length.
//!
//! In a sorted file the values are data of their own (`SD`, plain, packed or in lists). In an unsorted one they are records of a
//! group of their own among all others; they count as if they stood one behind the other, without the numbers of the group.

use super::super::record::array;
use super::super::store::{Opened, nameless};
use super::block::Blocks;
use super::walk::Met;
use super::{DataGroup, data};
use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom, Write};

/// The most bytes that are kept in memory; further ones go to a temporary file.
const KEPT_MAX: usize = 1 << 24;

/// How much of that file is read at once, bytes.
const WINDOW: usize = 1 << 18;

/// The longest value, bytes.
const VALUE_MAX: u32 = 1 << 23;

/// Values one behind the other, each behind its length.
#[derive(Default)]
pub(super) struct Values {
    /// The last bytes, behind those in the file.
    kept: Vec<u8>,
    file: Option<Opened>,
    /// How many bytes are in the file.
    stored: u64,
    /// Bytes of the file, and their place.
    window: Vec<u8>,
    window_at: u64,
}

impl Values {
    /// Appends bytes.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.kept.extend_from_slice(bytes);
        if self.kept.len() > KEPT_MAX { self.store() } else { Ok(()) }
    }

    /// Moves the kept bytes to the file.
    fn store(&mut self) -> io::Result<()> {
        if self.file.is_none() {
            self.file = Some(nameless()?);
        }
        if let Some(file) = &mut self.file {
            file.write_all(&self.kept)?;
        }
        self.stored += self.kept.len() as u64;
        self.kept.clear();
        Ok(())
    }

    /// Ends the appending.
    fn finish(&mut self) -> io::Result<()> {
        if self.file.is_some() { self.store() } else { Ok(()) }
    }

    /// The value at a place; `None` where none begins there, or where it is not whole.
    pub(super) fn value(&mut self, at: u64) -> Option<&[u8]> {
        let length = self.bytes(at, 4).and_then(|bytes| array(bytes, 0)).map(u32::from_le_bytes)?;
        self.bytes(at.checked_add(4)?, Some(length).filter(|length| *length <= VALUE_MAX)? as usize)
    }

    fn bytes(&mut self, at: u64, length: usize) -> Option<&[u8]> {
        if self.file.is_none() {
            let at = usize::try_from(at).ok()?;
            return self.kept.get(at..at.checked_add(length)?);
        }
        let end = at.checked_add(length as u64).filter(|end| *end <= self.stored)?;
        if at < self.window_at || end > self.window_at + self.window.len() as u64 {
            self.load(at, length).ok()?;
        }
        let from = usize::try_from(at.checked_sub(self.window_at)?).ok()?;
        self.window.get(from..from.checked_add(length)?)
    }

    fn load(&mut self, at: u64, length: usize) -> io::Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        self.window.clear();
        self.window_at = at;
        file.seek(SeekFrom::Start(at))?;
        file.take(length.max(WINDOW) as u64).read_to_end(&mut self.window).map(|_| ())
    }
}

/// The values that the frames of a data group need, by the link of their channel.
#[derive(Default)]
pub(super) struct AllValues(BTreeMap<u64, Values>);

impl AllValues {
    /// Reads the values of frames; hands over what is lost of those with data of their own.
    pub(super) fn of(
        all: &DataGroup,
        blocks: &mut Blocks<'_>,
        is_finished: bool,
        lost: &mut dyn FnMut(u64, String),
    ) -> AllValues {
        let links: Vec<u64> =
            all.groups.values().filter_map(|group| group.frame.as_ref()?.variable).collect();
        let mut found: BTreeMap<u64, Values> = links.iter().map(|link| (*link, Values::default())).collect();
        let mut problem = None;
        for (link, values) in &mut found {
            if !all.places.contains_key(link) {
                data::pieces(blocks, *link, is_finished, &mut |piece| match piece {
                    Ok(bytes) => drop(values.append(bytes).map_err(|failure| problem = Some(failure))),
                    Err((at, problem)) => lost(at, problem),
                });
            }
        }
        let of_group: BTreeMap<u64, u64> =
            links.iter().filter_map(|link| Some((*all.places.get(link)?, *link))).collect();
        if !of_group.is_empty() {
            // What is lost between the records is told by whoever reads the others.
            all.layout.walk(all.data, blocks, is_finished, &mut |met| {
                if let Met::Record(id, bytes) = met
                    && let Some(values) = of_group.get(&id).and_then(|link| found.get_mut(link))
                    && let Err(failure) = values.append(bytes)
                {
                    problem = Some(failure);
                }
            });
        }
        for values in found.values_mut() {
            problem = values.finish().err().or(problem);
        }
        if let Some(problem) = problem {
            lost(all.data, format!("values of variable length cannot be stored: {problem}"));
        }
        AllValues(found)
    }

    /// The value at a place of those at a link.
    pub(super) fn value(&mut self, link: u64, at: u64) -> Option<&[u8]> {
        self.0.get_mut(&link)?.value(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(values: &mut Values) {
        assert_eq!(values.value(0), Some(&b"abc"[..]));
        assert_eq!(values.value(7), Some(&b""[..]));
        assert_eq!(values.value(11), Some(&b"de"[..]));
        for none in [1, 12, 17, u64::MAX] {
            assert_eq!(values.value(none), None, "{none}");
        }
    }

    #[test]
    fn values_are_found_in_memory_and_in_a_file() {
        let bytes = b"\x03\0\0\0abc\0\0\0\0\x02\0\0\0de";
        let mut values = Values::default();
        values.append(bytes).unwrap();
        check(&mut values);
        values.store().unwrap();
        check(&mut values);
    }
}
