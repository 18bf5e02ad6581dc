//! The results of the readers: samples, counts and warnings of all files, and the final order.

mod end;
mod rows;

pub(super) use rows::Numbers;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;

use shsa_core::time::Time;

use super::batch::{BATCH, Batch, is_full};
use super::clock::{Division, Stored, divide};
use super::cut::Stretch;
use super::room::{Room, numbers};
use super::session::{Group, Piece, Session, groups};
use super::stamps::Stamps;
use super::stream::Surveyed;
use super::{Found, Place, RawValue, Recording, Sample, Want, Warning, names};

/// The use of the samples.
pub(super) enum Destination {
    /// All samples are kept.
    Kept,
    /// Only the order of the samples is examined.
    Surveyed(Surveyed),
    /// Only the times of reception are kept, on disk.
    Timed(Stored),
    /// They go to another thread.
    Sent(SyncSender<Batch>),
}

/// A recording under construction.
pub(super) struct Gathered {
    recording: Recording,
    destination: Destination,
    streams: Vec<Stream>,
    file: PathBuf,
    /// The number of files that are done.
    files: usize,
    /// The pieces of earlier files; without samples where these are not kept.
    pieces: Vec<Piece>,
    /// The piece of the current file, where samples are not kept.
    piece: Piece,
    /// Where the clock of the current file was set, if samples are not kept and it may have been: by a further pass.
    division: Option<(Division, Stored)>,
    /// The pieces of the only file whose samples are sent, and the number of samples so far.
    part: Option<(Arc<Division>, BTreeSet<usize>)>,
    place: usize,
    /// The values that may still be taken of the current file.
    room: Room,
    /// The numbers in the current batch.
    numbers: usize,
    damages: usize,
    last_untold: Option<Warning>,
    names: BTreeSet<String>,
    /// For each file the signals that take the time of reception, because their stamps are unusable.
    unstamped: Vec<BTreeSet<usize>>,
    /// For each surveyed file, where its clock was set; `None`: it was not.
    divisions: Vec<Option<Arc<Division>>>,
}

/// How many damaged places of a file are reported singly, besides the last.
const DAMAGES_TOLD: usize = 3;

/// The state of a signal between two samples.
struct Stream {
    signal: String,
    only_changes: bool,
    /// Whether the source names the stamp: then the stamp is trusted.
    is_stamp_chosen: bool,
    /// Whether the current file declares its stamps: then they are trusted, too.
    is_believed: bool,
    last_value: Option<RawValue>,
    stamps: Stamps,
    is_explained: bool,
}

impl Gathered {
    /// An empty recording of the wanted signals.
    pub(super) fn new(wants: &[Want<'_>], destination: Destination) -> Gathered {
        let stream = |want: &Want<'_>| Stream {
            signal: want.signal.to_owned(),
            only_changes: want.source.changed,
            is_stamp_chosen: want.source.time.is_some(),
            is_believed: false,
            last_value: None,
            stamps: Stamps::default(),
            is_explained: false,
        };
        let streams: Vec<_> = wants.iter().map(stream).collect();
        let found = vec![Found::default(); streams.len()];
        let recording = Recording { found, ..Recording::default() };
        Gathered {
            recording,
            destination,
            streams,
            file: PathBuf::new(),
            files: 0,
            pieces: Vec::new(),
            piece: Piece::default(),
            division: None,
            part: None,
            place: 0,
            room: Room::default(),
            numbers: 0,
            damages: 0,
            last_untold: None,
            names: BTreeSet::new(),
            unstamped: Vec::new(),
            divisions: Vec::new(),
        }
    }

    /// Sets the signals of the only file whose stamps are unusable, as a survey has found them.
    pub(super) fn without_stamps(mut self, signals: BTreeSet<usize>) -> Gathered {
        self.unstamped = vec![signals];
        self
    }

    /// Sends only these pieces of the only file.
    pub(super) fn of_pieces(mut self, division: Option<Arc<Division>>, pieces: BTreeSet<usize>) -> Gathered {
        self.part = division.map(|division| (division, pieces));
        self
    }

    /// The argument of [`Gathered::without_stamps`] for each file.
    pub(super) fn unstamped(&self) -> &[BTreeSet<usize>] {
        &self.unstamped
    }

    /// For each surveyed file, where its clock was set; `None`: it was not.
    pub(super) fn divisions(&self) -> &[Option<Arc<Division>>] {
        &self.divisions
    }

    /// Names the file that the next warnings are about.
    pub(super) fn about(&mut self, file: &Path) {
        self.file = file.into();
    }

    /// Begins a file, which has this many bytes on disk.
    pub(super) fn begin(&mut self, file: &Path, length: u64) {
        self.file = file.into();
        self.room = Room::of(length);
        for stream in &mut self.streams {
            // Another file may be another recording, in which the first value counts.
            stream.last_value = None;
            stream.stamps = Stamps::default();
            stream.is_believed = false;
        }
        if let Destination::Surveyed(surveyed) = &mut self.destination {
            surveyed.begin();
        }
    }

    /// The current file.
    pub(super) fn file(&self) -> &Path {
        &self.file
    }

    /// The name of the current file without folders.
    pub(super) fn file_name(&self) -> String {
        self.file.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Notes that the current file has a wanted signal, in this column or field.
    pub(super) fn found_in(&mut self, wanted: usize, part: &str) {
        let place = format!("{}: {part}", self.file_name());
        let places = self.recording.found.get_mut(wanted).map(|found| &mut found.places);
        if let Some(places) = places.filter(|places| !places.contains(&place)) {
            places.push(place);
        }
    }

    /// Trusts the stamps of a wanted signal in the current file.
    pub(super) fn believe(&mut self, wanted: usize) {
        if let Some(stream) = self.streams.get_mut(wanted) {
            stream.is_believed = true;
        }
    }

    /// Counts a row or message without a number for this signal.
    pub(super) fn missing(&mut self, wanted: usize) {
        if let Some(found) = self.recording.found.get_mut(wanted) {
            found.missing += 1;
        }
    }

    /// Adds a value, in the order of the file.
    pub(super) fn sample(&mut self, wanted: usize, time: Time, received: Time, value: RawValue) {
        let (Some(stream), Some(found)) =
            (self.streams.get_mut(wanted), self.recording.found.get_mut(wanted))
        else {
            return;
        };
        if stream.only_changes {
            if stream.last_value.as_ref().is_some_and(|last| is_same(last, &value)) {
                return;
            }
            stream.last_value = Some(value.clone());
        }
        if !self.room.take(&value) {
            return;
        }
        found.samples += 1;
        stream.stamps.see(time, received);
        match &mut self.destination {
            Destination::Kept => self.recording.samples.push(Sample { wanted, time, received, value }),
            Destination::Surveyed(surveyed) => {
                surveyed.see(wanted, received);
                self.piece.see(wanted, received);
            }
            Destination::Timed(receptions) => receptions.push(wanted, received),
            Destination::Sent(_) => {
                let place = self.place;
                self.place += 1;
                let is_of_part = |(division, pieces): &(Arc<Division>, BTreeSet<usize>)| {
                    division.piece_of(place).is_some_and(|piece| pieces.contains(&piece))
                };
                if !self.part.as_ref().is_none_or(is_of_part) {
                    return;
                }
                let is_unstamped =
                    self.unstamped.first().is_some_and(|unstamped| unstamped.contains(&wanted));
                let time = if is_unstamped { received } else { time };
                self.numbers += numbers(&value);
                self.recording.samples.push(Sample { wanted, time, received, value });
                if is_full(&self.recording.samples, self.numbers) {
                    self.send();
                }
            }
        }
    }

    /// Hands over the current batch. When the receiver has gone, the samples are dropped.
    pub(super) fn send(&mut self) {
        if let Destination::Sent(receiver) = &self.destination {
            let batch = std::mem::replace(&mut self.recording.samples, Vec::with_capacity(BATCH));
            self.numbers = 0;
            let _ = receiver.send(Ok(batch));
        }
    }

    /// The order of the samples, where they were only surveyed.
    pub(super) fn surveyed(&mut self) -> Option<&mut Surveyed> {
        match &mut self.destination {
            Destination::Surveyed(surveyed) => Some(surveyed),
            _ => None,
        }
    }

    /// The times of reception, where only these were kept.
    pub(super) fn receptions(self) -> Option<Stored> {
        match self.destination {
            Destination::Timed(receptions) => Some(receptions),
            _ => None,
        }
    }

    /// Splits the current file where its clock was set, by the times of reception of all its samples.
    pub(super) fn divide(&mut self, receptions: Stored) {
        let division = divide(&receptions);
        if let Some(failure) = receptions.failure() {
            let problem = format!("times of reception cannot be kept on disk: {failure}");
            self.damaged(Place::Whole, problem);
        }
        self.division = Some((division, receptions));
    }

    /// Adds a warning about a place of the current file.
    pub(super) fn warn(&mut self, place: Place, message: impl Into<String>) {
        let warning = Warning { file: self.file.clone(), place, message: message.into() };
        self.recording.warnings.push(warning);
    }

    /// Adds a damage: a part of the current file is lost.
    pub(super) fn damaged(&mut self, place: Place, message: impl Into<String>) {
        self.recording.degraded = true;
        self.damages += 1;
        if self.damages <= DAMAGES_TOLD {
            self.warn(place, message);
        } else {
            self.last_untold = Some(Warning { file: self.file.clone(), place, message: message.into() });
        }
    }

    /// The sessions of the pieces; pieces without samples are left out.
    fn groups(&mut self, wants: &[Want<'_>]) -> Vec<Group> {
        self.pieces.retain(|piece| !piece.extents.is_empty());
        groups(std::mem::take(&mut self.pieces), wants)
    }

    /// Keeps a name of the current file as a hint for a signal that is not found.
    pub(super) fn know(&mut self, name: &str) {
        if !self.names.contains(name) {
            self.names.insert(name.to_owned());
        }
    }

    /// Notes that the current file should have a wanted signal and does not.
    pub(super) fn absent(&mut self, want: &Want<'_>, reason: &str) {
        self.warn(Place::Whole, format!("signal {}: {reason}", want.signal));
        if let Some(stream) = self.streams.get_mut(want.index) {
            stream.is_explained = true;
        }
    }

    /// Sorts the samples into sessions, and within each by reception, and reports missing signals. Also returns the pieces of each
    /// session, without their samples.
    pub(super) fn finish(mut self, wants: &[Want<'_>]) -> (Recording, Vec<Vec<Piece>>) {
        for want in wants {
            if let Some(remark) = self.remark(want) {
                self.warn(Place::Whole, format!("signal {}: {remark}", want.signal));
            }
        }
        let groups = self.groups(wants);
        self.recording.joined = groups.iter().filter_map(Group::joined).collect();
        let pieces = groups.into_iter().map(|group| self.begin_session(group)).collect();
        (self.recording, pieces)
    }

    fn begin_session(&mut self, Group { mut pieces, because, .. }: Group) -> Vec<Piece> {
        let begin = self.recording.sessions.last().map_or(0, |session| session.samples.end);
        let mut files: Vec<PathBuf> = pieces.iter().map(|piece| piece.path.clone()).collect();
        files.dedup();
        let spans = || pieces.iter().map(Piece::span);
        let ends = spans().map(|it| it.0).min().zip(spans().map(|it| it.1).max());
        let span = ends.unwrap_or_default();
        let samples = begin..begin + pieces.iter().map(Piece::count).sum::<usize>();
        for piece in &mut pieces {
            match self.recording.samples.is_empty() {
                // The usual case, one piece: its samples are not copied.
                true => self.recording.samples = std::mem::take(&mut piece.samples),
                false => self.recording.samples.append(&mut piece.samples),
            }
        }
        self.recording.samples.get_mut(begin..).unwrap_or_default().sort_by_key(|sample| sample.received);
        if let (Some(because), Some(file)) = (&because, files.first()) {
            let message =
                format!("a session of its own, in which nothing counts of what came before: {because}");
            let warning = Warning { file: file.clone(), place: Place::Whole, message };
            self.recording.warnings.push(warning);
        }
        let recording = self.recording.sessions.len();
        let (part, origin) = (Stretch::ALL, span.0);
        self.recording.sessions.push(Session { samples, recording, part, origin, span, files, because });
        pieces
    }

    /// The warning about a signal after all files.
    fn remark(&self, want: &Want<'_>) -> Option<String> {
        let found = self.recording.found.get(want.index)?;
        if found.places.is_empty() {
            let name = want.source.file.as_deref().unwrap_or(&want.source.field);
            let hint = names::hint(name, self.names.iter().map(String::as_str));
            let is_explained = self.streams.get(want.index)?.is_explained;
            return (!is_explained).then(|| format!("no '{name}' in the recording{hint}"));
        }
        match found {
            Found { samples: 0, missing, places, .. } => Some(format!(
                "found in {}, but without a sample ({missing} without a value)",
                places.join(", ")
            )),
            Found { backward: 0, .. } => None,
            Found { backward, .. } => {
                Some(format!("{backward} time stamps are before the one ahead of them in the file"))
            }
        }
    }
}

/// Whether two values are the same; not-a-number equals itself.
fn is_same(a: &RawValue, b: &RawValue) -> bool {
    let same = |a: f64, b: f64| a == b || a.is_nan() && b.is_nan();
    match (a, b) {
        (RawValue::Number(a), RawValue::Number(b)) => same(*a, *b),
        (RawValue::Interval { lo, hi }, RawValue::Interval { lo: lo_b, hi: hi_b }) => {
            same(*lo, *lo_b) && same(*hi, *hi_b)
        }
        (RawValue::Vector(a), RawValue::Vector(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(*a, *b))
        }
        _ => false,
    }
}
