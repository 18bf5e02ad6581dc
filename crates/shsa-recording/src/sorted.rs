//! Samples of a file that are not in the order of their reception, sorted in bounded memory: runs are sorted, kept in a file
//! without a name, and merged (external merge sort). Time: `n log n` with the samples; on disk 32 bytes for each number.

use super::batch::{Batch, is_full};
use super::room::numbers;
use super::store::{Opened, nameless};
use super::{RawValue, RecordingError, Sample};
use shsa_core::time::Time;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender};

/// The numbers of a run, those of lists counted one by one: sorting it takes at most some 10 MB.
const RUN: usize = 1 << 17;

/// How many bytes of a run are read at once.
const BLOCK: u64 = 1 << 15;

/// The bytes of a stored sample before its numbers: the signal, the kind, the stamp, the reception.
const HEAD: usize = 24;

/// Receives samples and sends them on in the order of reception; those of the same time keep their order. Ends early where the
/// receiver has gone.
pub(super) fn sort(file: &Path, samples: &Receiver<Batch>, sorted: &SyncSender<Batch>) {
    let unsorted = |reason| RecordingError::Unsorted { file: file.into(), reason };
    let all = || -> Batch {
        let mut runs = Runs::default();
        for batch in samples {
            batch?.into_iter().try_for_each(|sample| runs.add(sample)).map_err(unsorted)?;
        }
        runs.merge(sorted).map_err(unsorted)
    };
    // Where the receiver has gone, neither the rest nor the error is needed.
    drop(sorted.send(all()));
}

/// Sorted runs of samples; the newest one is in memory.
#[derive(Default)]
struct Runs {
    file: Option<BufWriter<Opened>>,
    /// The ends of the stored runs in the file.
    ends: Vec<u64>,
    newest: Vec<Sample>,
    /// The numbers in the newest run.
    numbers: usize,
}

impl Runs {
    fn add(&mut self, sample: Sample) -> io::Result<()> {
        self.numbers += numbers(&sample.value);
        self.newest.push(sample);
        if self.numbers < RUN { Ok(()) } else { self.store() }
    }

    /// Sorts the newest run and stores it.
    fn store(&mut self) -> io::Result<()> {
        let mut file = match self.file.take() {
            Some(file) => file,
            None => BufWriter::new(nameless()?),
        };
        self.newest.sort_by_key(|sample| sample.received);
        let mut end = self.ends.last().copied().unwrap_or(0);
        let mut bytes = Vec::new();
        for sample in self.newest.drain(..) {
            bytes.clear();
            encode(&sample, &mut bytes);
            file.write_all(&bytes)?;
            end += bytes.len() as u64;
        }
        self.ends.push(end);
        self.numbers = 0;
        self.file = Some(file);
        Ok(())
    }

    /// Sends the samples of all runs in their order, and returns those that remain to be sent.
    fn merge(mut self, sorted: &SyncSender<Batch>) -> io::Result<Vec<Sample>> {
        self.newest.sort_by_key(|sample| sample.received);
        let Some(file) = self.file.take() else { return Ok(self.newest) };
        let mut file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
        let begins = [0].into_iter().chain(self.ends.iter().copied());
        let mut stored: Vec<Stored> = begins.zip(&self.ends).map(|(at, end)| Stored::new(at, *end)).collect();
        let mut newest = self.newest.into_iter();
        let mut next = |run: usize| match stored.get_mut(run) {
            Some(stored) => stored.next(&mut file),
            None => Ok(newest.next()),
        };
        let mut heads = BinaryHeap::new();
        for run in 0..=self.ends.len() {
            heads.extend(next(run)?.map(|sample| Reverse(Head { run, sample })));
        }
        let (mut batch, mut of_batch) = (Vec::new(), 0);
        while let Some(Reverse(Head { run, sample })) = heads.pop() {
            of_batch += numbers(&sample.value);
            batch.push(sample);
            heads.extend(next(run)?.map(|sample| Reverse(Head { run, sample })));
            if is_full(&batch, of_batch) {
                of_batch = 0;
                if sorted.send(Ok(std::mem::take(&mut batch))).is_err() {
                    break;
                }
            }
        }
        Ok(batch)
    }
}

/// The next sample of a run. Samples of the same time are in the order of their runs.
struct Head {
    run: usize,
    sample: Sample,
}

impl Head {
    fn key(&self) -> (Time, usize) {
        (self.sample.received, self.run)
    }
}

impl Ord for Head {
    fn cmp(&self, other: &Head) -> std::cmp::Ordering {
        self.key().cmp(&other.key())
    }
}

impl PartialOrd for Head {
    fn partial_cmp(&self, other: &Head) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Head {
    fn eq(&self, other: &Head) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Head {}

/// A run in the file.
struct Stored {
    /// The place of the next bytes to be read.
    at: u64,
    end: u64,
    block: Vec<u8>,
    /// The number of passed bytes of the block.
    passed: usize,
}

impl Stored {
    fn new(at: u64, end: u64) -> Stored {
        Stored { at, end, block: Vec::new(), passed: 0 }
    }

    fn next(&mut self, file: &mut Opened) -> io::Result<Option<Sample>> {
        if self.passed == self.block.len() && self.at == self.end {
            return Ok(None);
        }
        self.ahead(HEAD, file)?;
        let length = HEAD + 8 * stored_numbers(self.rest());
        self.ahead(length, file)?;
        let sample = decode(self.rest());
        self.passed += length;
        sample.map(Some).ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }

    fn rest(&self) -> &[u8] {
        self.block.get(self.passed..).unwrap_or_default()
    }

    /// Makes so many bytes available, fewer only at the end of the run.
    fn ahead(&mut self, length: usize, file: &mut Opened) -> io::Result<()> {
        if self.rest().len() >= length {
            return Ok(());
        }
        self.block.drain(..self.passed);
        self.passed = 0;
        let missing = (length - self.block.len()) as u64;
        let most = (self.end - self.at).min(BLOCK.max(missing));
        file.seek(SeekFrom::Start(self.at))?;
        self.at += Read::take(file, most).read_to_end(&mut self.block)? as u64;
        Ok(())
    }
}

fn encode(sample: &Sample, bytes: &mut Vec<u8>) {
    let (kind, values): (u32, &[f64]) = match &sample.value {
        RawValue::Number(number) => (0, &[*number]),
        RawValue::Interval { lo, hi } => (1, &[*lo, *hi]),
        RawValue::Vector(list) => (2 + u32::try_from(list.len()).unwrap_or(0), list),
    };
    bytes.extend(u32::try_from(sample.wanted).unwrap_or(u32::MAX).to_le_bytes());
    bytes.extend(kind.to_le_bytes());
    bytes.extend(sample.time.0.to_le_bytes());
    bytes.extend(sample.received.0.to_le_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
}

fn kind(stored: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(*stored.get(4..)?.first_chunk()?))
}

/// How many numbers a stored sample has.
fn stored_numbers(stored: &[u8]) -> usize {
    match kind(stored) {
        None => 0,
        Some(kind @ 0..=1) => kind as usize + 1,
        Some(kind) => kind as usize - 2,
    }
}

fn decode(stored: &[u8]) -> Option<Sample> {
    let eight = |at: usize| stored.get(at..)?.first_chunk::<8>().copied();
    let time = |at: usize| Some(Time(i64::from_le_bytes(eight(at)?)));
    let number = |at: usize| Some(f64::from_le_bytes(eight(HEAD + 8 * at)?));
    let value = match kind(stored)? {
        0 => RawValue::Number(number(0)?),
        1 => RawValue::Interval { lo: number(0)?, hi: number(1)? },
        _ => RawValue::Vector((0..stored_numbers(stored)).map(number).collect::<Option<_>>()?),
    };
    let wanted = u32::from_le_bytes(*stored.first_chunk()?) as usize;
    Some(Sample { wanted, time: time(8)?, received: time(16)?, value })
}
