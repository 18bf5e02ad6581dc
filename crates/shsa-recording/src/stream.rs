//! Recordings too long for the memory: surveyed in one pass, then read again sample by sample.
//!
//! A thread for each file reads ahead by a bounded number of samples; a file that is not in the order of reception is sorted on disk;
//! the files are merged by reception. The samples are those of [`super::read`], in its order. Where a clock may have been set within
//! a file, the times of all of its samples decide: they are gathered on disk by a further pass.

use super::batch::Batch;
use super::clock::{Division, Suspicion};
use super::files::{File, files_of};
use super::gathered::{Destination, Gathered};
use super::session::Piece;
use super::{ReadOptions, Recording, RecordingError, Sample, Wanted, dates, read_all, sorted, understand};
use shsa_core::time::Time;
use shsa_message::moment::DateOrder;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::{thread, vec};

/// The most files that are read side by side.
const MOST_FILES: usize = 32;

/// Whether a file can be read while its samples are consumed.
const HAS_THREADS: bool = !cfg!(target_family = "wasm");

/// How many batches a reader may be ahead of the consumer.
const BATCHES_AHEAD: usize = 2;

/// The content of a recording, without its samples.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The result of [`super::read`], without its samples.
    pub recording: Recording,
    /// The number of samples.
    pub count: usize,
    /// The earliest and the latest reception.
    pub span: Option<(Time, Time)>,
    /// Whether [`stream`] gives the samples as [`super::read`] does: at most 32 files are of the same time, and there are threads,
    /// which WebAssembly lacks.
    pub can_stream: bool,
    /// The order of the dates of all files.
    date_order: Option<DateOrder>,
    /// The files of each session.
    parts: Vec<Vec<Part>>,
}

/// A file of a session.
#[derive(Clone, Debug)]
struct Part {
    /// The number of the file.
    file: usize,
    /// Where the clock of the file was set, and which pieces of it are of the session.
    division: Option<Arc<Division>>,
    pieces: BTreeSet<usize>,
    /// The first and the last reception.
    span: (Time, Time),
    /// Whether its samples are not in the order of their reception.
    is_mixed: bool,
    /// The signals whose stamps are unusable.
    unstamped: BTreeSet<usize>,
}

/// Surveys recordings without keeping a sample.
///
/// # Errors
/// As [`super::read`]. Time grows with the files; memory does not.
pub fn survey(paths: &[PathBuf], wanted: &[Wanted], options: &ReadOptions) -> Result<Survey, RecordingError> {
    let mut wants = understand(wanted)?;
    let files = files_of(paths, &options.files)?;
    let gathered = Gathered::new(&wants, Destination::Surveyed(Surveyed::default()));
    let options = dates::decided(options, &files)?;
    let mut gathered = read_all(&files, files.len() == 1, &mut wants, &options, gathered)?;
    let mixed = gathered.surveyed().map(|surveyed| surveyed.mixed.clone()).unwrap_or_default();
    let (unstamped, divisions) = (gathered.unstamped().to_vec(), gathered.divisions().to_vec());
    let (recording, sessions) = gathered.finish(&wants);
    let part = |piece: &Piece| Part {
        file: piece.file,
        division: divisions.get(piece.file).cloned().flatten(),
        pieces: piece.parts.clone(),
        span: piece.span(),
        is_mixed: mixed.contains(&piece.file),
        unstamped: unstamped.get(piece.file).cloned().unwrap_or_default(),
    };
    let parts: Vec<Vec<Part>> = sessions.iter().map(|pieces| pieces.iter().map(part).collect()).collect();
    let is_open = |part: &Part, at: Time| part.span.0 <= at && at <= part.span.1;
    let side_by_side = |parts: &[Part], at: Time| parts.iter().filter(|part| is_open(part, at)).count();
    let is_narrow =
        |parts: &Vec<Part>| parts.iter().all(|part| side_by_side(parts, part.span.0) <= MOST_FILES);
    let spans = || recording.sessions.iter().map(|session| session.span);
    Ok(Survey {
        count: recording.sessions.iter().map(|session| session.samples.len()).sum(),
        span: spans().map(|span| span.0).min().zip(spans().map(|span| span.1).max()),
        can_stream: HAS_THREADS && parts.iter().all(is_narrow),
        recording,
        date_order: options.date_order,
        parts,
    })
}

/// The order of samples that are not kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Surveyed {
    /// The numbers of the files with a sample that was received before the one above it.
    mixed: BTreeSet<usize>,
    /// The number of files that have begun.
    begun: usize,
    /// The last reception in the current file.
    last: Option<Time>,
    suspicion: Suspicion,
}

impl Surveyed {
    /// Begins another file.
    pub(super) fn begin(&mut self) {
        self.begun += 1;
        self.last = None;
        self.suspicion = Suspicion::default();
    }

    /// Whether the clock of the current file may have been set, by the times of a signal.
    pub(super) fn may_be_set(&mut self) -> bool {
        !self.suspicion.signals.is_empty()
    }

    /// Adds a reception of a signal.
    pub(super) fn see(&mut self, wanted: usize, received: Time) {
        if self.last.is_some_and(|last| received < last) {
            self.mixed.insert(self.begun - 1);
        }
        self.last = Some(received);
        self.suspicion.see(wanted, received);
    }
}

/// Reads the samples of one session of surveyed recordings while they are consumed; sessions are counted from 0.
///
/// # Errors
/// When a source is malformed, or a file cannot be opened; later errors are among the samples. Memory: some ten thousand numbers
/// for each file of the same time, and 10 MB for one that is not in the order of reception; such a file is sorted on disk.
pub fn stream(
    paths: &[PathBuf],
    wanted: &[Wanted],
    options: &ReadOptions,
    survey: &Survey,
    session: usize,
) -> Result<Stream, RecordingError> {
    understand(wanted)?;
    let files = files_of(paths, &options.files)?;
    let is_alone = files.len() == 1;
    let reader = |(rank, part): (usize, &Part)| {
        let file = [files.get(part.file)?.clone()];
        let options = ReadOptions { date_order: survey.date_order, ..options.clone() };
        let wanted = wanted.to_vec();
        Some((rank, Reader { file, is_alone, wanted, options, part: part.clone() }))
    };
    let parts = survey.parts.get(session).map_or(&[][..], Vec::as_slice);
    let mut waiting: Vec<(usize, Reader)> = parts.iter().enumerate().filter_map(reader).collect();
    waiting.sort_by_key(|(rank, reader)| std::cmp::Reverse((reader.part.span.0, *rank)));
    Ok(Stream { waiting, heads: Vec::new() })
}

/// The arguments of a thread that reads one file.
struct Reader {
    file: [File; 1],
    is_alone: bool,
    wanted: Vec<Wanted>,
    options: ReadOptions,
    part: Part,
}

impl Reader {
    /// Begins to read the file.
    fn start(self) -> Receiver<Batch> {
        let (sender, batches) = sync_channel(BATCHES_AHEAD);
        let (is_mixed, path) = (self.part.is_mixed, self.file.first().map(|file| file.path.clone()));
        thread::spawn(move || self.run(&sender));
        let Some(path) = path.filter(|_| is_mixed) else { return batches };
        let (sender, sorted) = sync_channel(BATCHES_AHEAD);
        thread::spawn(move || sorted::sort(&path, &batches, &sender));
        sorted
    }

    fn run(&self, sender: &SyncSender<Batch>) {
        let read = || {
            let mut wants = understand(&self.wanted)?;
            let gathered = Gathered::new(&wants, Destination::Sent(sender.clone()));
            let Part { unstamped, division, pieces, .. } = &self.part;
            let gathered = gathered.without_stamps(unstamped.clone());
            let gathered = gathered.of_pieces(division.clone(), pieces.clone());
            read_all(&self.file, self.is_alone, &mut wants, &self.options, gathered)
        };
        // When the consumer has gone, neither the rest nor the error is needed.
        match read() {
            Ok(mut gathered) => gathered.send(),
            Err(error) => drop(sender.send(Err(error))),
        }
    }
}

/// The samples of one file, in their order.
struct Head {
    /// The rank of the file in its session.
    rank: usize,
    batches: Receiver<Batch>,
    batch: vec::IntoIter<Sample>,
    next: Result<Sample, RecordingError>,
}

impl Head {
    /// Waits for the first sample; `None`: there is none.
    fn of(rank: usize, batches: Receiver<Batch>) -> Option<Head> {
        let mut batch = Vec::new().into_iter();
        let next = next(&batches, &mut batch)?;
        Some(Head { rank, batches, batch, next })
    }

    /// The reception of the next sample, and the rank of the file; an error goes before all samples.
    fn key(&self) -> (Time, usize) {
        (self.next.as_ref().map_or(Time::MIN, |sample| sample.received), self.rank)
    }
}

/// The next sample of a batch, or of the next batch; `None` at the end.
fn next(
    batches: &Receiver<Batch>,
    batch: &mut vec::IntoIter<Sample>,
) -> Option<Result<Sample, RecordingError>> {
    while batch.len() == 0 {
        match batches.recv() {
            Ok(Ok(more)) => *batch = more.into_iter(),
            Ok(Err(error)) => return Some(Err(error)),
            Err(_) => return None,
        }
    }
    batch.next().map(Ok)
}

/// Samples in the order of reception; ties keep the order of the files.
pub struct Stream {
    /// The files that have not begun, with their ranks; the earliest is the last.
    waiting: Vec<(usize, Reader)>,
    heads: Vec<Head>,
}

impl Stream {
    /// The place of the earliest head.
    fn earliest(&self) -> Option<usize> {
        (0..self.heads.len()).min_by_key(|at| self.heads.get(*at).map(Head::key))
    }

    /// Begins the files whose first sample may be the next one.
    fn begin(&mut self) {
        loop {
            let next = self.heads.iter().map(|head| head.key().0).min();
            let is_due =
                |(_, reader): &mut (usize, Reader)| next.is_none_or(|next| reader.part.span.0 <= next);
            let Some((rank, reader)) = self.waiting.pop_if(is_due) else { return };
            self.heads.extend(Head::of(rank, reader.start()));
        }
    }
}

impl Iterator for Stream {
    type Item = Result<Sample, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if !self.waiting.is_empty() {
            self.begin();
        }
        let earliest = self.earliest()?;
        let head = self.heads.get_mut(earliest)?;
        Some(match next(&head.batches, &mut head.batch) {
            Some(following) => std::mem::replace(&mut head.next, following),
            None => self.heads.remove(earliest).next,
        })
    }
}
