//! Which files, and which parts of them, form one recording: a session. Sessions are never mixed.
//!
//! A **piece** is a file, or a part of it between two settings of its clock. Pieces are handled in the order in which they are
//! given. Two pieces with different signals belong to one session where their times overlap. Two pieces with a common signal
//! belong to one session where one follows the end of the other at once, as the parts of a bag do; otherwise they are two
//! recordings, whether their times overlap or lie apart. So no time-out, window or comparison spans two recordings.

use super::clock::{LEAP, Step};
use super::cut::Stretch;
use super::{Sample, Want};
use shsa_core::time::{Span, Time};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A part of a recording follows within this time, or within [`PERIODS`] of its fastest signal.
const AT_ONCE: Span = Span::from_millis(1_000);

/// How many periods of its fastest signal may pass before a part of a recording follows.
const PERIODS: i64 = 3;

/// A recording, or a part of one that is replayed by itself: earlier samples do not count in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// The range of its samples.
    pub samples: Range<usize>,
    /// The number of its recording, from 0; parts of a recording between which something is left out have the same number.
    pub recording: usize,
    /// The part of its recording; all of it where nothing is left out.
    pub part: Stretch,
    /// The origin of times in the session: the reception of the first sample of its recording, left out or not.
    pub origin: Time,
    /// The reception of its first and of its last sample.
    pub span: (Time, Time),
    /// The files of its samples, in the order in which they are given.
    pub files: Vec<PathBuf>,
    /// Why the session is separate from the one before; `None` for the first.
    pub because: Option<Because>,
}

/// Why a session begins.
#[derive(Clone, Debug, PartialEq)]
pub enum Because {
    /// Another recording of the same time: both have this signal.
    Overlap {
        /// The signal's name.
        signal: String,
        /// A file of the earlier session that has it.
        file: PathBuf,
    },
    /// Another recording with the same signal, this long after the end of the earlier one; negative: before its start.
    Apart {
        /// From the end of the earlier recording to the start of this one.
        gap: Span,
    },
    /// The clock was set.
    ClockSet {
        /// The time before.
        from: Time,
        /// The time after.
        to: Time,
    },
    /// Earlier samples were left out.
    LeftOut {
        /// The length of the part that was left out.
        length: Span,
    },
}

impl fmt::Display for Because {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Because::Overlap { signal, file } => {
                write!(f, "it overlaps in time with {}, and both have {signal}", file.display())
            }
            Because::Apart { gap } if *gap < Span::ZERO => {
                write!(f, "it ends {} before the recording ahead of it begins", length(*gap))
            }
            Because::Apart { gap } => {
                write!(f, "it begins {} after the end of the recording before", length(*gap))
            }
            Because::ClockSet { from, to } => {
                let direction = if to < from { "back" } else { "forward" };
                write!(f, "its clock was set {direction} by {}", length(*to - *from))
            }
            Because::LeftOut { length: left_out } => {
                write!(f, "{} before it are left out", length(*left_out))
            }
        }
    }
}

/// A length of time in a suitable unit.
fn length(span: Span) -> String {
    match span.abs().seconds() {
        seconds if seconds < 120.0 => format!("{seconds:.3} s"),
        seconds if seconds < 7_200.0 => format!("{:.1} min", seconds / 60.0),
        seconds if seconds < 172_800.0 => format!("{:.1} h", seconds / 3_600.0),
        seconds => format!("{:.1} d", seconds / 86_400.0),
    }
}

/// A signal in a piece: its first and its last reception, and how many samples there are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    from: Time,
    to: Time,
    count: i64,
}

impl Extent {
    /// That of a signal whose first sample comes next, with this reception.
    fn begin(received: Time) -> Extent {
        Extent { from: received, to: received, count: 0 }
    }

    fn see(&mut self, received: Time) {
        self.from = self.from.min(received);
        self.to = self.to.max(received);
        self.count += 1;
    }

    fn period(&self) -> Span {
        Span((self.to - self.from).0 / (self.count - 1).max(1))
    }
}

/// A file, or a part of it between two settings of its clock.
#[derive(Clone, Debug, Default)]
pub(super) struct Piece {
    /// The number of the file, as the same file may be given twice.
    pub(super) file: usize,
    pub(super) path: PathBuf,
    /// Which parts of the file it is, counted from 0.
    pub(super) parts: BTreeSet<usize>,
    /// How the clock was set before the piece.
    pub(super) step: Option<Step>,
    /// By wanted signal.
    pub(super) extents: BTreeMap<usize, Extent>,
    /// The samples in the order of the file; empty where they are not kept.
    pub(super) samples: Vec<Sample>,
}

impl Piece {
    /// Takes all its samples, which are not copied. `O(samples)`.
    pub(super) fn take(&mut self, samples: Vec<Sample>) {
        let mut extents: Vec<Option<Extent>> = Vec::new();
        for Sample { wanted, received, .. } in &samples {
            if extents.len() <= *wanted {
                extents.resize(*wanted + 1, None);
            }
            if let Some(extent) = extents.get_mut(*wanted) {
                extent.get_or_insert(Extent::begin(*received)).see(*received);
            }
        }
        let found = extents.into_iter().enumerate().filter_map(|(wanted, extent)| Some((wanted, extent?)));
        self.extents = found.collect();
        self.samples = samples;
    }

    pub(super) fn see(&mut self, wanted: usize, received: Time) {
        self.extents.entry(wanted).or_insert(Extent::begin(received)).see(received);
    }

    /// Adds a later part of the file.
    fn absorb(&mut self, later: Piece) {
        self.parts.extend(later.parts);
        for (wanted, Extent { from, to, count }) in later.extents {
            let extent = self.extents.entry(wanted).or_insert(Extent { from, to, count: 0 });
            (extent.from, extent.to) = (extent.from.min(from), extent.to.max(to));
            extent.count += count;
        }
        self.samples.extend(later.samples);
    }

    /// The number of its samples.
    pub(super) fn count(&self) -> usize {
        self.extents.values().map(|it| usize::try_from(it.count).unwrap_or(0)).sum()
    }

    /// The earliest and the latest reception.
    pub(super) fn span(&self) -> (Time, Time) {
        let from = self.extents.values().map(|it| it.from).min();
        let to = self.extents.values().map(|it| it.to).max();
        (from.unwrap_or_default(), to.unwrap_or_default())
    }
}

/// The relation of a piece to the pieces of a session.
enum Relation {
    /// No common signal, and overlapping times with this much in common.
    Beside(Span),
    /// One follows the other at once.
    GoesOn,
    /// Another session, for this reason.
    Other(Because),
}

/// The pieces of one recording.
#[derive(Debug)]
pub(super) struct Group {
    pub(super) pieces: Vec<Piece>,
    pub(super) because: Option<Because>,
    /// Whether a piece follows another one at once, and whether one has other signals of the same time.
    goes_on: bool,
    is_beside: bool,
}

impl Group {
    /// The statement that several files form one recording, with the reason.
    pub(super) fn joined(&self) -> Option<String> {
        let mut files: Vec<&Path> = self.pieces.iter().map(|piece| piece.path.as_path()).collect();
        files.dedup();
        let (first, last) = files.first().zip(files.last()).filter(|_| files.len() > 1)?;
        let between = if files.len() > 2 { " .. " } else { " and " };
        let why = match (self.goes_on, self.is_beside) {
            (true, false) => "each goes on where another one ends",
            (false, _) => "they are of one time, and no signal is in two of them",
            (true, true) => "each goes on where another one ends, or has other signals of the same time",
        };
        let files = format!("{} files ({}{between}{})", files.len(), first.display(), last.display());
        Some(format!("{files} are one recording: {why}"))
    }
}

/// Groups pieces into sessions. Time: O(pieces^2 signals).
pub(super) fn groups(pieces: Vec<Piece>, wants: &[Want<'_>]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for piece in rejoined(pieces) {
        match group_of(&groups, &piece, wants) {
            Ok((number, goes_on)) => {
                let Some(group) = groups.get_mut(number) else { continue };
                group.goes_on |= goes_on;
                group.is_beside |= !goes_on;
                group.pieces.push(piece);
            }
            Err(because) => {
                groups.push(Group { pieces: vec![piece], because, goes_on: false, is_beside: false });
            }
        }
    }
    groups
}

/// The session of a piece, and whether the piece follows another one there; or why a new session begins. Among several possible
/// sessions, the order of preference is: one that the piece follows, one with files of its folder, the one with the longest
/// common time, the latest.
fn group_of(groups: &[Group], piece: &Piece, wants: &[Want<'_>]) -> Result<(usize, bool), Option<Because>> {
    let mut because = None;
    let mut best: Option<((bool, bool, Span), usize)> = None;
    for (number, group) in groups.iter().enumerate() {
        let rank = match relation(group, piece, wants) {
            Relation::Other(reason) => {
                because = Some(reason);
                continue;
            }
            Relation::GoesOn => (true, true, Span::MAX),
            Relation::Beside(common) => {
                let folder = |path: &Path| path.parent().map(Path::to_path_buf);
                let is_beside = group.pieces.iter().any(|it| folder(&it.path) == folder(&piece.path));
                (false, is_beside, common)
            }
        };
        if best.is_none_or(|(most, _)| rank >= most) {
            best = Some((rank, number));
        }
    }
    let set = piece.step.map(|Step { from, to }| Because::ClockSet { from, to });
    best.map(|((goes_on, ..), number)| (number, goes_on)).ok_or(set.or(because))
}

fn relation(group: &Group, piece: &Piece, wants: &[Want<'_>]) -> Relation {
    if group.pieces.iter().any(|it| it.file == piece.file) {
        let (from, to) = piece.step.map_or_else(Default::default, |step| (step.from, step.to));
        return Relation::Other(Because::ClockSet { from, to });
    }
    let mut nearest: Option<(Span, Span)> = None;
    for (wanted, own) in &piece.extents {
        for other in &group.pieces {
            let Some(extent) = other.extents.get(wanted) else { continue };
            let gap = if own.from >= extent.to { own.from - extent.to } else { own.to - extent.from };
            let is_apart = own.from >= extent.to || own.to <= extent.from;
            if !is_apart || own.from == extent.from && own.to == extent.to {
                let signal = wants.get(*wanted).map_or("", |want| want.signal).to_owned();
                return Relation::Other(Because::Overlap { signal, file: other.path.clone() });
            }
            let period = own.period().min(extent.period());
            if nearest.is_none_or(|(least, _)| gap.abs() < least.abs()) {
                nearest = Some((gap, period));
            }
        }
    }
    let (from, to) = piece.span();
    match nearest {
        Some((gap, period)) if gap.abs() <= AT_ONCE.max(period.times(PERIODS)) => Relation::GoesOn,
        Some((gap, _)) => Relation::Other(Because::Apart { gap }),
        None => {
            let begins = group.pieces.iter().map(|it| it.span().0).min().unwrap_or_default();
            let ends = group.pieces.iter().map(|it| it.span().1).max().unwrap_or_default();
            let common = to.min(ends) - from.max(begins);
            let gap = if from > ends { from - ends } else { to - begins };
            if common < -LEAP { Relation::Other(Because::Apart { gap }) } else { Relation::Beside(common) }
        }
    }
}

/// Joins pieces of one file that a leap of time has split, where another file of the recording has continued: then the clock was
/// not set, and the signals of the file were silent.
fn rejoined(pieces: Vec<Piece>) -> Vec<Piece> {
    let spans: Vec<(usize, (Time, Time), Vec<usize>)> =
        pieces.iter().map(|it| (it.file, it.span(), it.extents.keys().copied().collect())).collect();
    let goes_on = |piece: &Piece, step: Step| {
        let is_beside = |signals: &[usize]| !signals.iter().any(|it| piece.extents.contains_key(it));
        let is_there = |(from, to): (Time, Time)| from <= step.from && step.to <= to;
        let of_other = spans.iter().filter(|(file, ..)| *file != piece.file);
        step.to > step.from
            && of_other.into_iter().any(|(_, span, signals)| is_there(*span) && is_beside(signals))
    };
    let mut joined: Vec<Piece> = Vec::new();
    for piece in pieces {
        let before = joined.last_mut().filter(|before| before.file == piece.file);
        match (before, piece.step) {
            (Some(before), Some(step)) if goes_on(&piece, step) => {
                before.absorb(piece);
            }
            _ => joined.push(piece),
        }
    }
    joined
}
