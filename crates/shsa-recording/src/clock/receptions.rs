//! When the samples of a file were received: of samples that are kept, or on disk, so that a file of any length is split.

use crate::Sample;
use crate::store::{Opened, nameless};
use shsa_core::time::Time;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::io::{self, Read, Seek, SeekFrom, Write};

/// The receptions of all samples of a file, in the order of the file.
pub(crate) trait Receptions {
    /// Those of one signal.
    type Signal: Signal;
    /// The number of samples.
    fn count(&self) -> usize;
    /// The signal and the reception of a sample.
    fn at(&self, place: usize) -> Option<(usize, Time)>;
    /// The samples of a signal, without some.
    fn signal(&self, wanted: usize, but: &BTreeSet<usize>) -> Self::Signal;

    /// Passes over all samples: their places, signals and receptions.
    fn each(&self, mut see: impl FnMut(usize, usize, Time)) {
        for place in 0..self.count() {
            let Some((wanted, received)) = self.at(place) else { return };
            see(place, wanted, received);
        }
    }
}

/// The samples of one signal, in the order of the file.
pub(crate) trait Signal {
    /// The number of samples.
    fn count(&self) -> usize;
    /// When a sample was received.
    fn time(&self, at: usize) -> Option<Time>;
    /// The place of a sample among those of all signals.
    fn place(&self, at: usize) -> Option<usize>;
}

impl Receptions for [Sample] {
    type Signal = Vec<(usize, Time)>;

    fn count(&self) -> usize {
        self.len()
    }

    fn at(&self, place: usize) -> Option<(usize, Time)> {
        self.get(place).map(|sample| (sample.wanted, sample.received))
    }

    fn signal(&self, wanted: usize, but: &BTreeSet<usize>) -> Vec<(usize, Time)> {
        let own = self.iter().enumerate().filter(|(_, sample)| sample.wanted == wanted);
        own.filter(|(place, _)| !but.contains(place))
            .map(|(place, sample)| (place, sample.received))
            .collect()
    }
}

impl Signal for Vec<(usize, Time)> {
    fn count(&self) -> usize {
        self.len()
    }

    fn time(&self, at: usize) -> Option<Time> {
        self.get(at).map(|(_, time)| *time)
    }

    fn place(&self, at: usize) -> Option<usize> {
        self.get(at).map(|(place, _)| *place)
    }
}

/// The bytes of an entry: a number, and a time.
const ENTRY: usize = 16;

/// How many entries are read at once.
const BLOCK: usize = 1 << 13;

/// How many blocks are kept: two places are compared at a time.
const BLOCKS: usize = 4;

/// Numbers with times in a file without a name.
pub(crate) struct Stored {
    file: RefCell<Opened>,
    count: usize,
    /// The newest entries, which are not yet in the file.
    newest: Vec<u8>,
    /// The blocks that were read last, with their numbers; the latest is the last.
    blocks: RefCell<Vec<(usize, Vec<u8>)>>,
    failure: RefCell<Option<io::Error>>,
}

impl Stored {
    /// An empty list.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub(crate) fn new() -> io::Result<Stored> {
        let (file, blocks, failure) = (RefCell::new(nameless()?), RefCell::default(), RefCell::default());
        Ok(Stored { file, count: 0, newest: Vec::with_capacity(BLOCK * ENTRY), blocks, failure })
    }

    /// Adds an entry.
    pub(crate) fn push(&mut self, number: usize, time: Time) {
        self.newest.extend((number as u64).to_le_bytes());
        self.newest.extend(time.0.to_le_bytes());
        self.count += 1;
        if self.newest.len() == BLOCK * ENTRY {
            let mut file = self.file.borrow_mut();
            if let Err(failure) = file.seek(SeekFrom::End(0)).and_then(|_| file.write_all(&self.newest)) {
                self.failure.borrow_mut().get_or_insert(failure);
            }
            self.newest.clear();
        }
    }

    /// The first failure of the disk, after which entries are missing.
    pub(crate) fn failure(&self) -> Option<io::Error> {
        self.failure.borrow_mut().take()
    }

    fn entry(&self, at: usize) -> Option<(usize, Time)> {
        let (block, within) = (at / BLOCK, at % BLOCK * ENTRY);
        if block == self.count / BLOCK {
            return entry(self.newest.get(within..)?);
        }
        let mut blocks = self.blocks.borrow_mut();
        if let Some((_, bytes)) = blocks.iter().rev().find(|(number, _)| *number == block) {
            return entry(bytes.get(within..)?);
        }
        if blocks.len() == BLOCKS {
            blocks.remove(0);
        }
        match self.read(block) {
            Ok(bytes) => {
                let found = bytes.get(within..).and_then(entry);
                blocks.push((block, bytes));
                found
            }
            Err(failure) => {
                self.failure.borrow_mut().get_or_insert(failure);
                None
            }
        }
    }

    fn read(&self, block: usize) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; BLOCK * ENTRY];
        let mut file = self.file.borrow_mut();
        file.seek(SeekFrom::Start((block * bytes.len()) as u64))?;
        file.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

fn entry(bytes: &[u8]) -> Option<(usize, Time)> {
    let number = u64::from_le_bytes(*bytes.first_chunk()?);
    let time = i64::from_le_bytes(*bytes.get(8..)?.first_chunk()?);
    Some((usize::try_from(number).ok()?, Time(time)))
}

impl Receptions for Stored {
    type Signal = StoredSignal;

    fn count(&self) -> usize {
        self.count
    }

    fn at(&self, place: usize) -> Option<(usize, Time)> {
        self.entry(place)
    }

    fn signal(&self, wanted: usize, but: &BTreeSet<usize>) -> StoredSignal {
        let mut own = match Stored::new() {
            Ok(own) => own,
            Err(failure) => {
                self.failure.borrow_mut().get_or_insert(failure);
                return StoredSignal(None);
            }
        };
        self.each(|place, of, received| {
            if of == wanted && !but.contains(&place) {
                own.push(place, received);
            }
        });
        if let Some(failure) = own.failure() {
            self.failure.borrow_mut().get_or_insert(failure);
        }
        StoredSignal(Some(own))
    }
}

/// The places and receptions of a signal on disk; nothing where the disk has failed.
pub(crate) struct StoredSignal(Option<Stored>);

impl StoredSignal {
    fn entry(&self, at: usize) -> Option<(usize, Time)> {
        self.0.as_ref()?.entry(at)
    }
}

impl Signal for StoredSignal {
    fn count(&self) -> usize {
        self.0.as_ref().map_or(0, |own| own.count)
    }

    fn time(&self, at: usize) -> Option<Time> {
        self.entry(at).map(|(_, time)| time)
    }

    fn place(&self, at: usize) -> Option<usize> {
        self.entry(at).map(|(place, _)| place)
    }
}
