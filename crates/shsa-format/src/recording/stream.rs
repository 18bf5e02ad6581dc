//! Recordings too long for the memory: surveyed in one pass, then read again sample by sample.
//!
//! A thread for each file reads ahead by a bounded number of samples; the files are merged by reception. The samples are
//! those of [`super::read`], in its order, for recordings whose files are each in the order of reception.

use super::clock::LEAP;
use super::files::{File, files_of};
use super::gathered::{Batch, Destination, Gathered};
use super::{ReadOptions, Recording, RecordingError, Sample, Wanted, read_all, understand};
use shsa_core::time::Time;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::{thread, vec};

/// The most files that are read side by side.
const MOST_FILES: usize = 32;

/// How many batches a reader may be ahead of the consumer.
const BATCHES_AHEAD: usize = 2;

/// The content of a recording, without its samples.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The results of [`super::read`] except those about sessions; `samples` and `sessions` are empty.
    pub recording: Recording,
    /// The number of samples.
    pub count: usize,
    /// The earliest and the latest reception.
    pub span: Option<(Time, Time)>,
    /// Whether [`stream`] gives the samples in the order in which [`super::read`] does: there is one session, and no clock was
    /// set in it.
    pub can_stream: bool,
    /// For each file the signals whose stamps are unusable.
    unstamped: Vec<BTreeSet<usize>>,
}

/// Surveys recordings without keeping a sample.
///
/// # Errors
/// As [`super::read`]. Time grows with the files; memory does not.
pub fn survey(paths: &[PathBuf], wanted: &[Wanted], options: &ReadOptions) -> Result<Survey, RecordingError> {
    let mut wants = understand(wanted)?;
    let files = files_of(paths)?;
    let gathered = Gathered::new(&wants, Destination::Surveyed(Surveyed::default()));
    let gathered = read_all(&files, files.len() == 1, &mut wants, options, gathered)?;
    let (surveyed, unstamped) = (gathered.surveyed(), gathered.unstamped().to_vec());
    let (recording, is_one_session) = gathered.finish(&wants);
    Ok(Survey {
        recording,
        count: surveyed.count,
        span: surveyed.span,
        unstamped,
        can_stream: is_one_session && !surveyed.is_mixed && files.len() <= MOST_FILES,
    })
}

/// The order of samples that are not kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Surveyed {
    /// The number of samples.
    pub(super) count: usize,
    /// The earliest and the latest reception.
    pub(super) span: Option<(Time, Time)>,
    /// Whether a file has a sample that was received before the one above it, or so long after it that its clock may have been
    /// set.
    pub(super) is_mixed: bool,
    /// The last reception in the current file.
    last: Option<Time>,
}

impl Surveyed {
    /// Begins another file.
    pub(super) fn begin(&mut self) {
        self.last = None;
    }

    /// Adds a reception.
    pub(super) fn see(&mut self, received: Time) {
        self.count += 1;
        self.is_mixed |= self.last.is_some_and(|last| received < last || received - last > LEAP);
        self.last = Some(received);
        let (from, to) = self.span.unwrap_or((received, received));
        self.span = Some((from.min(received), to.max(received)));
    }
}

/// Reads the samples of surveyed recordings while they are consumed.
///
/// # Errors
/// When a source is malformed, or a file cannot be opened; later errors are among the samples. Memory: some thousands of samples
/// for each file.
pub fn stream(
    paths: &[PathBuf],
    wanted: &[Wanted],
    options: &ReadOptions,
    survey: &Survey,
) -> Result<Stream, RecordingError> {
    understand(wanted)?;
    let files = files_of(paths)?;
    let is_alone = files.len() == 1;
    let start = |(at, file): (usize, &File)| {
        let (sender, batches) = sync_channel(BATCHES_AHEAD);
        let reader = Reader {
            file: [file.clone()],
            is_alone,
            wanted: wanted.to_vec(),
            options: options.clone(),
            unstamped: survey.unstamped.get(at).cloned().unwrap_or_default(),
        };
        thread::spawn(move || reader.run(&sender));
        Head { batches, batch: Vec::new().into_iter(), next: None }
    };
    let mut heads: Vec<Head> = files.iter().enumerate().map(start).collect();
    heads.iter_mut().for_each(Head::advance);
    Ok(Stream { heads })
}

/// The arguments of a thread that reads one file.
struct Reader {
    file: [File; 1],
    is_alone: bool,
    wanted: Vec<Wanted>,
    options: ReadOptions,
    unstamped: BTreeSet<usize>,
}

impl Reader {
    fn run(&self, sender: &SyncSender<Batch>) {
        let read = || {
            let mut wants = understand(&self.wanted)?;
            let gathered = Gathered::new(&wants, Destination::Sent(sender.clone()));
            let gathered = gathered.without_stamps(self.unstamped.clone());
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
    batches: Receiver<Batch>,
    batch: vec::IntoIter<Sample>,
    next: Option<Result<Sample, RecordingError>>,
}

impl Head {
    /// Goes to the next sample; there is none at the end of the file.
    fn advance(&mut self) {
        while self.batch.len() == 0 {
            match self.batches.recv() {
                Ok(Ok(batch)) => self.batch = batch.into_iter(),
                Ok(Err(error)) => return self.next = Some(Err(error)),
                Err(_) => break,
            }
        }
        self.next = self.batch.next().map(Ok);
    }

    /// The reception of the next sample; an error goes before all samples.
    fn time(&self) -> Option<Time> {
        self.next.as_ref().map(|next| next.as_ref().map_or(Time::MIN, |sample| sample.received))
    }
}

/// Samples in the order of reception; ties keep the order of the files.
pub struct Stream {
    heads: Vec<Head>,
}

impl Iterator for Stream {
    type Item = Result<Sample, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let times = self.heads.iter().enumerate().filter_map(|(at, head)| Some((head.time()?, at)));
        let (_, earliest) = times.min()?;
        let head = self.heads.get_mut(earliest)?;
        let next = head.next.take();
        head.advance();
        next
    }
}
