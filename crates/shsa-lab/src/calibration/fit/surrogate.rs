//! Surrogate recordings: sessions whose residuals are drawn anew in blocks, including values beyond the observed ones.

use super::parts::{Parts, Track};
use super::tail::{Side, share_shapes};
use crate::calibration::chance::Chance;
use crate::order::quantile;
use shsa_core::knowledge::{IdVec, KnowledgeBase, Scaling, SignalId};
use shsa_core::observation::{Observation, RawValue};

/// The length of a block in memories of the residuals,
const MEMORIES: f64 = 10.0;
/// with at least this many values of the slowest signal,
const FEWEST: f64 = 20.0;
/// and at most this share of the longest stretch.
const LONGEST: f64 = 0.25;
/// A residual of a single signal beyond this many deviations may be a jump of the plant, so it stays in place.
const JUMPS: f64 = 6.0;
/// Smaller correlations count as none.
const FORGOTTEN: f64 = 0.1;
/// The longest memory in values.
const MOST_MEMORY: usize = 200;

/// The source from which surrogate sessions are drawn.
pub(super) struct Source<'a> {
    parts: &'a Parts<'a>,
    /// The tails of each signal's residuals: below, above.
    tails: IdVec<SignalId, [Side; 2]>,
    /// The deviation of each signal's offset between sessions, in its unit.
    pub(super) between: IdVec<SignalId, f64>,
    /// The quantum of each signal's readings, in its unit; 0 for none.
    quanta: IdVec<SignalId, f64>,
    /// The scaling of each signal's readings.
    scalings: IdVec<SignalId, Option<Scaling>>,
    /// The largest residual that is drawn anew, in the signal's unit; negative for a signal that is not fitted, and stays
    /// unchanged.
    largest: IdVec<SignalId, f64>,
    /// The length of a block in seconds.
    block_s: f64,
}

/// The residuals of each signal, by piece, in one drawing.
type Rests = Vec<IdVec<SignalId, Vec<f64>>>;

impl<'a> Source<'a> {
    /// `between` is a standard deviation for each fitted signal.
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        parts: &'a Parts<'a>,
        between: IdVec<SignalId, Option<f64>>,
    ) -> Source<'a> {
        let count = knowledge.signals().len();
        let largest = IdVec::filled(count, |signal: SignalId| {
            let is_alone = knowledge.carriers(knowledge.signals()[signal].variable).len() == 1;
            match between[signal] {
                None => -1.0,
                Some(_) if is_alone => JUMPS * crate::order::winsorised(&parts.rests(signal)).sqrt(),
                Some(_) => f64::INFINITY,
            }
        });
        let between = IdVec::filled(count, |signal: SignalId| between[signal].unwrap_or(0.0));
        let memories: IdVec<SignalId, f64> = IdVec::filled(count, |signal| memory(parts, signal));
        let mut tails = IdVec::filled(count, |signal: SignalId| {
            let mut rests = parts.rests(signal);
            rests.retain(|rest| rest.abs() <= largest[signal]);
            let below: Vec<f64> = rests.iter().map(|rest| -rest).collect();
            [Side::of(&below, memories[signal]), Side::of(&rests, memories[signal])]
        });
        share_shapes(tails.iter_mut().flatten());
        let quanta = IdVec::filled(count, |signal| quantum(parts, signal));
        let longest = longest_s(parts);
        let wanted = knowledge.signals().ids().map(|signal| {
            let period = period(parts, signal);
            (MEMORIES * memories[signal]).max(FEWEST) * period
        });
        let block_s = wanted.fold(0.0, f64::max).min(LONGEST * longest).max(1e-3);
        let scalings = IdVec::filled(count, |signal: SignalId| knowledge.signals()[signal].scaling);
        Source { parts, tails, between, quanta, scalings, largest, block_s }
    }

    /// The duration of the longest stretch in seconds.
    pub(super) fn longest_s(&self) -> f64 {
        longest_s(self.parts)
    }

    /// The observations of one surrogate session, by stretch. Time: O(n log n).
    pub(super) fn drawn(&self, session: usize, chance: &mut Chance) -> Vec<Vec<Observation>> {
        let rests = self.rests(chance);
        let sessions = self.parts.offsets.len() as f64;
        let spread = (1.0 + 1.0 / sessions).sqrt();
        let offsets = IdVec::filled(self.between.len(), |signal: SignalId| {
            let own = self.parts.offsets.get(session).map_or(0.0, |it| it[signal]);
            let drawn = self.between[signal] * spread * chance.normal();
            if self.largest[signal] < 0.0 { 0.0 } else { self.parts.offset(signal) - own + drawn }
        });
        let own = self.parts.pieces.iter().filter(|it| it.session == session);
        own.map(|piece| {
            let mut observations = piece.observations.to_vec();
            let blocks = self.blocks(piece.lasts, chance);
            for (signal, track) in piece.tracks.enumerate() {
                self.redraw(&mut observations, signal, track, &rests, &blocks, offsets[signal]);
            }
            observations
        })
        .collect()
    }

    /// The source of each block of a stretch: the piece and a moment in it.
    fn blocks(&self, lasts: f64, chance: &mut Chance) -> Vec<(usize, f64)> {
        let count = (lasts / self.block_s).ceil().max(1.0) as usize;
        let room: Vec<f64> = self.parts.pieces.iter().map(|it| (it.lasts - self.block_s).max(1e-9)).collect();
        let all: f64 = room.iter().sum();
        let drawn = |_| {
            let mut at = chance.share() * all;
            for (number, room) in room.iter().enumerate() {
                if at < *room || number + 1 == self.parts.pieces.len() {
                    return (number, at.min(*room));
                }
                at -= room;
            }
            (0, 0.0)
        };
        (0..count).map(drawn).collect()
    }

    fn redraw(
        &self,
        observations: &mut [Observation],
        signal: SignalId,
        track: &Track,
        rests: &Rests,
        blocks: &[(usize, f64)],
        offset: f64,
    ) {
        let mut now = None;
        let mut next = 0;
        for (at, place) in track.places.iter().enumerate() {
            let number =
                ((track.times[at].max(0.0) / self.block_s) as usize).min(blocks.len().saturating_sub(1));
            let Some(&(from, moment)) = blocks.get(number) else { continue };
            let source = &self.parts.pieces[from].tracks[signal];
            if now.replace(number) != Some(number) {
                let inside = (track.times[at] - number as f64 * self.block_s).max(0.0);
                next = source.times.partition_point(|time| *time < moment + inside);
            }
            let drawn = &rests[from][signal];
            let rest = drawn.get(next).or(drawn.last()).copied().unwrap_or(0.0);
            next += 1;
            let is_drawn = track.rests[at].abs() <= self.largest[signal];
            let changed = if is_drawn { rest - track.rests[at] } else { 0.0 } + offset;
            move_by(&mut observations[*place].value, changed, self.quanta[signal], self.scalings[signal]);
        }
    }

    /// All residuals, with their tails drawn anew: the largest drawn excess replaces the largest observed one.
    fn rests(&self, chance: &mut Chance) -> Rests {
        let drawn = IdVec::filled(self.tails.len(), |signal: SignalId| {
            let [below, above] = &self.tails[signal];
            [below.drawn(chance), above.drawn(chance)]
        });
        let anew = |rest: f64, side: &Side, drawn: &[f64]| {
            let rank = side.excesses.partition_point(|excess| *excess < rest - side.from);
            drawn.get(rank).map_or(rest, |excess| side.from + excess)
        };
        let one = |signal: SignalId, rest: f64| {
            if rest.abs() > self.largest[signal] {
                return 0.0;
            }
            let ([below, above], [low, high]) = (&self.tails[signal], &drawn[signal]);
            if rest > above.from {
                anew(rest, above, high)
            } else if -rest > below.from {
                -anew(-rest, below, low)
            } else {
                rest
            }
        };
        let of_piece = |piece: &super::parts::Piece<'_>| {
            IdVec::filled(piece.tracks.len(), |signal: SignalId| {
                piece.tracks[signal].rests.iter().map(|rest| one(signal, *rest)).collect()
            })
        };
        self.parts.pieces.iter().map(of_piece).collect()
    }
}

fn longest_s(parts: &Parts<'_>) -> f64 {
    parts.pieces.iter().map(|it| it.lasts).fold(0.0, f64::max)
}

/// Changes a reading by an amount in its signal's unit, and a reading with a quantum by a multiple of it: set points of 55 and 65 are no
/// multiples of their step.
fn move_by(reading: &mut RawValue, by: f64, quantum: f64, scaling: Option<Scaling>) {
    let moved = |reading: f64| {
        let by = if quantum > 0.0 { (by / quantum).round() * quantum } else { by };
        let value = scaling.map_or(reading, |it| it.value(reading)) + by;
        scaling.map_or(value, |it| it.reading(value))
    };
    let by = scaling.map_or(by, |it| by / it.scale);
    match reading {
        RawValue::Number(value) => *value = moved(*value),
        RawValue::Interval { lo, hi } => (*lo, *hi) = (*lo + by, *hi + by),
        RawValue::Vector(_) => {}
    }
}

/// The quantum of a signal's readings; 0 if nearly all of them differ.
pub(super) fn quantum(parts: &Parts<'_>, signal: SignalId) -> f64 {
    let values = parts.pieces.iter().flat_map(|it| it.tracks[signal].values.iter().copied());
    let mut sorted = crate::order::sorted(values);
    let count = sorted.len();
    sorted.dedup();
    if 4 * sorted.len() > count {
        return 0.0;
    }
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    steps.reduce(f64::min).filter(|step| *step > 0.0).unwrap_or(0.0)
}

/// The median time between two values of a signal in seconds; 0 for fewer than two.
pub(super) fn period(parts: &Parts<'_>, signal: SignalId) -> f64 {
    let gaps = parts.pieces.iter().flat_map(|it| it.tracks[signal].times.windows(2));
    quantile(&crate::order::sorted(gaps.map(|pair| pair[1] - pair[0])), 0.5).unwrap_or(0.0)
}

/// The number of values after which residuals are independent.
fn memory(parts: &Parts<'_>, signal: SignalId) -> f64 {
    let product = |lag: usize| {
        let of = |it: &super::parts::Piece<'_>| {
            let rests = &it.tracks[signal].rests;
            rests.iter().zip(rests.iter().skip(lag)).map(|(one, next)| one * next).sum::<f64>()
        };
        parts.pieces.iter().map(of).sum::<f64>()
    };
    let all = product(0);
    (1..MOST_MEMORY).find(|lag| product(*lag) < FORGOTTEN * all).unwrap_or(MOST_MEMORY) as f64
}
