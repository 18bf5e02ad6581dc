//! Healthy sessions taken apart: what the witnesses of a variable agree on, what each is off by, and what is left of each value.

use crate::calibration::session::Session;
use crate::order::{mean, median, variance};
use shsa_core::knowledge::{IdVec, KnowledgeBase, Scaling, SignalId, VariableId};
use shsa_core::observation::{Observation, RawValue};

/// The agreed value of a variable is a straight line through so many values before and after a moment: the most with which
/// what changes fast is not left of all its witnesses together.
const AROUND: [usize; 4] = [15, 7, 3, 1];

/// Witnesses have something in common beside what is agreed on when their rests together have more than this share of their
/// variance, and a signal that is alone when its rests vary more than so many times as much as its noise.
const COMMON: f64 = 0.2;
const BEYOND_NOISE: f64 = 4.0;
/// The median distance from zero of what is normally distributed, in standard deviations.
const NORMAL_MEDIAN: f64 = 0.674_5;

/// The values of one signal in one stretch, in its own unit.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    /// Where its observations are in the stretch.
    pub(super) places: Vec<usize>,
    /// What each tells about: seconds since the first observation of the stretch.
    pub(super) times: Vec<f64>,
    /// What the signal said,
    pub(super) values: Vec<f64>,
    /// and what of it is neither agreed on nor an offset of the session.
    pub(super) rests: Vec<f64>,
}

impl Track {
    /// What is left of each value, beside that of the other's value before it.
    fn beside<'t>(&'t self, other: &'t Track) -> impl Iterator<Item = (f64, f64)> + 't {
        let rest = move |(time, rest): (&f64, &f64)| {
            let before = other.times.partition_point(|it| it <= time).checked_sub(1)?;
            Some((*rest, *other.rests.get(before)?))
        };
        self.times.iter().zip(&self.rests).filter_map(rest)
    }
}

/// A stretch of a session, taken apart.
#[derive(Clone, Debug)]
pub(super) struct Piece<'a> {
    pub(super) session: usize,
    pub(super) observations: &'a [Observation],
    pub(super) tracks: IdVec<SignalId, Track>,
    /// How long it lasts, in seconds.
    pub(super) lasts: f64,
}

/// All sessions, taken apart.
#[derive(Clone, Debug)]
pub(super) struct Parts<'a> {
    pub(super) pieces: Vec<Piece<'a>>,
    /// What each signal shows more than is agreed on, by session, in its own unit; 0 of a signal that is alone.
    pub(super) offsets: Vec<IdVec<SignalId, f64>>,
}

impl<'a> Parts<'a> {
    /// Takes sessions apart. Time: O(n log n).
    pub(super) fn of(knowledge: &KnowledgeBase, sessions: &'a [Session]) -> Parts<'a> {
        let count = knowledge.signals().len();
        let mut parts = Parts {
            pieces: Vec::new(),
            offsets: sessions.iter().map(|_| IdVec::filled(count, |_: SignalId| 0.0)).collect(),
        };
        for (session, it) in sessions.iter().enumerate() {
            parts.pieces.extend(it.stretches().iter().map(|it| Piece::of(knowledge, session, it)));
        }
        for variable in knowledge.variables().ids() {
            for around in AROUND {
                // Once to find the offsets, once without them.
                parts.agree(knowledge, variable, around);
                parts.agree(knowledge, variable, around);
                if !parts.is_moved(knowledge.carriers(variable)) {
                    break;
                }
            }
        }
        parts
    }

    /// Whether what is left of the values of a variable goes with the variable itself.
    fn is_moved(&self, signals: &[SignalId]) -> bool {
        let own = |signal: SignalId| variance(&self.rests(signal));
        if let [alone] = *signals {
            return own(alone) > BEYOND_NOISE * self.noise(alone);
        }
        signals.windows(2).any(|two| {
            let &[one, other] = two else { return false };
            let beside = self.pieces.iter().flat_map(|it| it.tracks[one].beside(&it.tracks[other]));
            let together: Vec<f64> = beside.map(|(one, other)| one * other).collect();
            // In units of both: the product of what they have in common.
            mean(&together) > COMMON * (own(one) * own(other)).sqrt()
        })
    }

    /// The variance of the noise of a signal by second differences, in which what changes slowly is not seen; by their median, as
    /// the plant may jump now and then.
    pub(super) fn noise(&self, signal: SignalId) -> f64 {
        let second = self.pieces.iter().flat_map(|it| it.tracks[signal].values.windows(3));
        let usual = median(second.map(|it| (it[0] - 2.0 * it[1] + it[2]).abs()));
        (usual / NORMAL_MEDIAN).powi(2) / 6.0
    }

    fn agree(&mut self, knowledge: &KnowledgeBase, variable: VariableId, around: usize) {
        let scale = |signal: SignalId| direction(knowledge, signal) * super::edit::scale(knowledge, signal);
        let signals = knowledge.carriers(variable);
        for piece in &mut self.pieces {
            let offsets = &self.offsets[piece.session];
            let mut all: Vec<(f64, f64)> = Vec::new();
            for &signal in signals {
                let track = &piece.tracks[signal];
                let base = |value: f64| scale(signal) * (value - offsets[signal]) + zero(knowledge, signal);
                all.extend(track.times.iter().zip(&track.values).map(|(time, value)| (*time, base(*value))));
            }
            all.sort_by(|one, other| one.0.total_cmp(&other.0));
            let agreed = Line::through(&all);
            for &signal in signals {
                let (scale, zero, offset) = (scale(signal), zero(knowledge, signal), offsets[signal]);
                let track = &mut piece.tracks[signal];
                let rest =
                    |(time, value): (&f64, &f64)| value - offset - (agreed.at(*time, around) - zero) / scale;
                track.rests = track.times.iter().zip(&track.values).map(rest).collect();
            }
        }
        if signals.len() > 1 {
            self.move_offsets(signals);
        }
    }

    /// Moves what is left all through a session into its offsets.
    fn move_offsets(&mut self, signals: &[SignalId]) {
        for session in 0..self.offsets.len() {
            for &signal in signals {
                let own = || self.pieces.iter().filter(|it| it.session == session);
                let rests: Vec<f64> = own().flat_map(|it| it.tracks[signal].rests.iter().copied()).collect();
                let more = mean(&rests);
                self.offsets[session][signal] += more;
                for piece in self.pieces.iter_mut().filter(|it| it.session == session) {
                    piece.tracks[signal].rests.iter_mut().for_each(|rest| *rest -= more);
                }
            }
        }
    }

    /// All that is left of the values of a signal.
    pub(super) fn rests(&self, signal: SignalId) -> Vec<f64> {
        self.pieces.iter().flat_map(|it| it.tracks[signal].rests.iter().copied()).collect()
    }

    /// What a signal shows more than is agreed on, over all sessions.
    pub(super) fn offset(&self, signal: SignalId) -> f64 {
        mean(&self.offsets.iter().map(|it| it[signal]).collect::<Vec<f64>>())
    }
}

/// -1 of a unit that counts the other way.
fn direction(knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
    knowledge.signals()[signal].unit.as_ref().map_or(1.0, |unit| unit.to_si_difference(1.0).signum())
}

/// What zero of a signal's unit is in SI.
fn zero(knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
    knowledge.signals()[signal].unit.as_ref().map_or(0.0, |unit| unit.to_si(0.0))
}

impl<'a> Piece<'a> {
    fn of(knowledge: &KnowledgeBase, session: usize, observations: &'a [Observation]) -> Piece<'a> {
        let mut tracks = IdVec::filled(knowledge.signals().len(), |_: SignalId| Track::default());
        let begin = observations.first().map_or(0.0, |it| it.stamp.seconds());
        for (place, observation) in observations.iter().enumerate() {
            let signal = &knowledge.signals()[observation.signal];
            let Some(value) = number(&observation.value, signal.scaling) else { continue };
            let track = &mut tracks[observation.signal];
            let delay = signal.delay.seconds();
            let turn =
                signal.limits.turn.map(|turn| turn / super::edit::scale(knowledge, observation.signal));
            let value = unwrapped(value, track.values.last().copied(), turn);
            track.places.push(place);
            track.times.push(observation.stamp.seconds() - begin - delay);
            track.values.push(value);
        }
        for (id, variable) in knowledge.variables().enumerate() {
            if let (Some(turn), [first, others @ ..]) = (variable.wraps, knowledge.carriers(id)) {
                others.iter().for_each(|other| bring_beside(knowledge, &mut tracks, *first, *other, turn));
            }
        }
        let ends = observations.first().zip(observations.last());
        let lasts = ends.map_or(0.0, |(first, last)| (last.received - first.received).seconds());
        Piece { session, observations, tracks, lasts }
    }
}

/// The number that an observation brings, in its signal's unit.
pub(super) fn number(value: &RawValue, scaling: Option<Scaling>) -> Option<f64> {
    let reading = match value {
        RawValue::Number(value) => *value,
        RawValue::Interval { lo, hi } => 0.5 * (lo + hi),
        RawValue::Vector(_) => return None,
    };
    Some(scaling.map_or(reading, |it| it.value(reading))).filter(|value| value.is_finite())
}

/// Shifts what one signal said of what wraps by whole turns (SI) to what another one of the same variable said.
fn bring_beside(
    knowledge: &KnowledgeBase,
    tracks: &mut IdVec<SignalId, Track>,
    one: SignalId,
    other: SignalId,
    turn: f64,
) {
    let base = |signal: SignalId, value: f64| {
        direction(knowledge, signal) * super::edit::scale(knowledge, signal) * value + zero(knowledge, signal)
    };
    let (known, moved) = (&tracks[one], &tracks[other]);
    let Some((time, value)) = moved.times.first().zip(moved.values.first()) else { return };
    let place = known.times.partition_point(|it| it < time).min(known.values.len().saturating_sub(1));
    let Some(known) = known.values.get(place) else { return };
    let turns = ((base(one, *known) - base(other, *value)) / turn).round();
    let by = turns * turn / (direction(knowledge, other) * super::edit::scale(knowledge, other));
    tracks[other].values.iter_mut().for_each(|value| *value += by);
}

/// A value of what wraps, in the turn in which it is nearest to the one before it, or to zero.
fn unwrapped(value: f64, before: Option<f64>, turn: Option<f64>) -> f64 {
    turn.map_or(value, |turn| value + turn * ((before.unwrap_or(0.0) - value) / turn).round())
}

/// A local straight line through points (W. S. Cleveland 1979, doi:10.1080/01621459.1979.10481038, with even weights).
struct Line<'p> {
    points: &'p [(f64, f64)],
    /// Sums of 1, time, value, time * time and time * value of all points before each.
    sums: Vec<[f64; 5]>,
    middle: (f64, f64),
}

impl<'p> Line<'p> {
    fn through(points: &'p [(f64, f64)]) -> Line<'p> {
        let count = points.len().max(1) as f64;
        let middle = (
            points.iter().map(|it| it.0).sum::<f64>() / count,
            points.iter().map(|it| it.1).sum::<f64>() / count,
        );
        let mut sum = [0.0; 5];
        let mut sums = vec![sum];
        for (time, value) in points {
            let (time, value) = (time - middle.0, value - middle.1);
            let terms = [1.0, time, value, time * time, time * value];
            sum.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            sums.push(sum);
        }
        Line { points, sums, middle }
    }

    fn at(&self, time: f64, around: usize) -> f64 {
        let place = self.points.partition_point(|it| it.0 < time);
        let (from, to) = (place.saturating_sub(around), (place + around + 1).min(self.points.len()));
        let (Some(before), Some(after)) = (self.sums.get(from), self.sums.get(to)) else {
            return self.middle.1;
        };
        let difference = |at: usize| after[at] - before[at];
        let count = difference(0).max(1.0);
        let (time_mean, value_mean) = (difference(1) / count, difference(2) / count);
        let spread = difference(3) / count - time_mean * time_mean;
        let slope =
            if spread > 1e-12 { (difference(4) / count - time_mean * value_mean) / spread } else { 0.0 };
        self.middle.1 + value_mean + slope * (time - self.middle.0 - time_mean)
    }
}
