//! Recordings that could have been: sessions with what is left of their values drawn anew in blocks, beyond what was seen, too.

use super::parts::{Parts, Track};
use super::tail::{Side, share_shapes};
use crate::calibration::chance::Chance;
use crate::order::quantile;
use shsa_core::knowledge::{IdVec, KnowledgeBase, Scaling, SignalId};
use shsa_core::observation::{Observation, RawValue};

/// A block lasts so many memories,
const MEMORIES: f64 = 10.0;
/// and holds so many values of the slowest signal at least,
const FEWEST: f64 = 20.0;
/// but is no longer than this share of the longest stretch.
const LONGEST: f64 = 0.25;
/// Of a signal that is alone, what leaves its own course by more than so many deviations may as well be the plant that jumps: it
/// stays where it was.
const JUMPS: f64 = 6.0;
/// Correlations below this are forgotten.
const FORGOTTEN: f64 = 0.1;
/// No longer memory is looked for.
const MOST_MEMORY: usize = 200;

/// What surrogate sessions are drawn from.
pub(super) struct Source<'a> {
    parts: &'a Parts<'a>,
    /// Both tails of each signal: below, above.
    tails: IdVec<SignalId, [Side; 2]>,
    /// By how much the offset of each signal differs from session to session, in its unit.
    pub(super) between: IdVec<SignalId, f64>,
    /// What each reading is rounded to, in its unit; 0 where it is not.
    quanta: IdVec<SignalId, f64>,
    /// How a reading becomes a value in its signal's unit.
    scalings: IdVec<SignalId, Option<Scaling>>,
    /// What is larger than this is not drawn anew, in its unit; below 0 of a signal that is not fitted, which stays as it was.
    largest: IdVec<SignalId, f64>,
    /// How long a block is, in seconds.
    block_s: f64,
}

/// What is left of the values of each signal, by piece, in one drawing.
type Rests = Vec<IdVec<SignalId, Vec<f64>>>;

impl<'a> Source<'a> {
    /// `between` is a standard deviation for each signal that is fitted.
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

    /// How long the longest stretch lasts, in seconds.
    pub(super) fn longest_s(&self) -> f64 {
        longest_s(self.parts)
    }

    /// The observations of one session that could have been, by stretch. Time: O(n log n).
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

    /// Where each block of a stretch is taken from: the piece and a moment of it.
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

    /// What is left of all values, with tails drawn anew: the largest excess is where the largest one was.
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

/// Moves a reading by so much in its signal's unit, in which it stays a whole multiple.
fn move_by(reading: &mut RawValue, by: f64, quantum: f64, scaling: Option<Scaling>) {
    let moved = |reading: f64| {
        let value = scaling.map_or(reading, |it| it.value(reading)) + by;
        let value = if quantum > 0.0 { (value / quantum).round() * quantum } else { value };
        scaling.map_or(value, |it| it.reading(value))
    };
    let by = scaling.map_or(by, |it| by / it.scale);
    match reading {
        RawValue::Number(value) => *value = moved(*value),
        RawValue::Interval { lo, hi } => (*lo, *hi) = (*lo + by, *hi + by),
        RawValue::Vector(_) => {}
    }
}

/// What the readings of a signal are whole multiples of; 0 where nearly all of them differ.
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

/// The usual time between two values of a signal, in seconds; 0 without two.
pub(super) fn period(parts: &Parts<'_>, signal: SignalId) -> f64 {
    let gaps = parts.pieces.iter().flat_map(|it| it.tracks[signal].times.windows(2));
    quantile(&crate::order::sorted(gaps.map(|pair| pair[1] - pair[0])), 0.5).unwrap_or(0.0)
}

/// How many values it takes until what is left of one says nothing about the next.
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
