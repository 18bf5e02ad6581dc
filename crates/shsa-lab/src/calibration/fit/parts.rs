//! Decomposes healthy sessions: the value on which a variable's witnesses agree, the offset of each witness, and the residual of
//! each value.

use crate::calibration::session::Session;
use crate::order::{mean, median, variance};
use shsa_core::knowledge::{IdVec, KnowledgeBase, Scaling, SignalId, VariableId};
use shsa_core::observation::{Observation, RawValue};

/// The agreed value of a variable at a moment is a straight line through this many values before and after it: the largest number
/// with which a fast change is not a residual of all witnesses at once.
const AROUND: [usize; 4] = [15, 7, 3, 1];

/// Witnesses have a common residual if their residuals' covariance exceeds this share of their variance. A single signal has more
/// than noise if the variance of its residuals exceeds that of its noise by this factor.
const COMMON: f64 = 0.2;
const BEYOND_NOISE: f64 = 4.0;
/// The median absolute value of a normal distribution, in standard deviations.
const NORMAL_MEDIAN: f64 = 0.674_5;

/// The values of one signal in one stretch, in the signal's unit.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    /// The indices of its observations in the stretch.
    pub(super) places: Vec<usize>,
    /// The time that each value is about: seconds since the first observation of the stretch.
    pub(super) times: Vec<f64>,
    /// The values of the signal,
    pub(super) values: Vec<f64>,
    /// and their residuals, without the agreed value and the offset of the session.
    pub(super) rests: Vec<f64>,
}

impl Track {
    /// The residual of each value, with the other track's residual before it.
    fn beside<'t>(&'t self, other: &'t Track) -> impl Iterator<Item = (f64, f64)> + 't {
        let rest = move |(time, rest): (&f64, &f64)| {
            let before = other.times.partition_point(|it| it <= time).checked_sub(1)?;
            Some((*rest, *other.rests.get(before)?))
        };
        self.times.iter().zip(&self.rests).filter_map(rest)
    }
}

/// A decomposed stretch of a session.
#[derive(Clone, Debug)]
pub(super) struct Piece<'a> {
    pub(super) session: usize,
    pub(super) observations: &'a [Observation],
    pub(super) tracks: IdVec<SignalId, Track>,
    /// Its duration in seconds.
    pub(super) lasts: f64,
}

/// All sessions, decomposed.
#[derive(Clone, Debug)]
pub(super) struct Parts<'a> {
    pub(super) pieces: Vec<Piece<'a>>,
    /// The offset of each signal from the agreed value, by session, in the signal's unit; 0 for a single signal.
    pub(super) offsets: Vec<IdVec<SignalId, f64>>,
}

impl<'a> Parts<'a> {
    /// Decomposes sessions; signals that are exact tell what a variable is. Time: O(n log n).
    pub(super) fn of(
        knowledge: &KnowledgeBase,
        sessions: &'a [Session],
        exact: &IdVec<SignalId, bool>,
    ) -> Parts<'a> {
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
                // The first pass finds the offsets, the second one removes them.
                parts.agree(knowledge, variable, exact, around);
                parts.agree(knowledge, variable, exact, around);
                if !parts.is_moved(knowledge.carriers(variable)) {
                    break;
                }
            }
        }
        parts
    }

    /// Whether the residuals of a variable's signals follow the variable itself.
    fn is_moved(&self, signals: &[SignalId]) -> bool {
        let own = |signal: SignalId| variance(&self.rests(signal));
        if let [alone] = *signals {
            return own(alone) > BEYOND_NOISE * self.noise(alone);
        }
        signals.windows(2).any(|two| {
            let &[one, other] = two else { return false };
            let beside = self.pieces.iter().flat_map(|it| it.tracks[one].beside(&it.tracks[other]));
            let together: Vec<f64> = beside.map(|(one, other)| one * other).collect();
            // The covariance, compared with the geometric mean of both variances.
            mean(&together) > COMMON * (own(one) * own(other)).sqrt()
        })
    }

    /// The variance of a signal's noise by second differences, which do not see slow changes; by their median, because the plant
    /// may jump at times.
    pub(super) fn noise(&self, signal: SignalId) -> f64 {
        let second = self.pieces.iter().flat_map(|it| it.tracks[signal].values.windows(3));
        let usual = median(second.map(|it| (it[0] - 2.0 * it[1] + it[2]).abs()));
        (usual / NORMAL_MEDIAN).powi(2) / 6.0
    }

    fn agree(
        &mut self,
        knowledge: &KnowledgeBase,
        variable: VariableId,
        exact: &IdVec<SignalId, bool>,
        around: usize,
    ) {
        let scale = |signal: SignalId| direction(knowledge, signal) * super::edit::scale(knowledge, signal);
        let signals = knowledge.carriers(variable);
        for piece in &mut self.pieces {
            let offsets = &self.offsets[piece.session];
            let mut all: Vec<(f64, f64)> = Vec::new();
            let is_any_exact = signals.iter().any(|it| exact[*it]);
            for &signal in signals.iter().filter(|it| exact[**it] || !is_any_exact) {
                let track = &piece.tracks[signal];
                let base = |value: f64| scale(signal) * (value - offsets[signal]) + zero(knowledge, signal);
                all.extend(track.times.iter().zip(&track.values).map(|(time, value)| (*time, base(*value))));
            }
            all.sort_by(|one, other| one.0.total_cmp(&other.0));
            let agreed = Line::through(&all);
            let agreed_at = |time: f64| if is_any_exact { held(&all, time) } else { agreed.at(time, around) };
            for &signal in signals {
                let (scale, zero, offset) = (scale(signal), zero(knowledge, signal), offsets[signal]);
                let track = &mut piece.tracks[signal];
                let rest = |(time, value): (&f64, &f64)| value - offset - (agreed_at(*time) - zero) / scale;
                track.rests = track.times.iter().zip(&track.values).map(rest).collect();
            }
        }
        if signals.len() > 1 {
            self.move_offsets(signals);
        }
    }

    /// Moves the mean residual of a session into its offset.
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

    /// All residuals of a signal.
    pub(super) fn rests(&self, signal: SignalId) -> Vec<f64> {
        self.pieces.iter().flat_map(|it| it.tracks[signal].rests.iter().copied()).collect()
    }

    /// The mean offset of a signal over all sessions.
    pub(super) fn offset(&self, signal: SignalId) -> f64 {
        mean(&self.offsets.iter().map(|it| it[signal]).collect::<Vec<f64>>())
    }
}

/// -1 of a unit that counts the other way.
fn direction(knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
    knowledge.signals()[signal].unit.as_ref().map_or(1.0, |unit| unit.to_si_difference(1.0).signum())
}

/// The SI value of zero in a signal's unit.
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

/// The number in a raw value, in its signal's unit.
pub(super) fn number(value: &RawValue, scaling: Option<Scaling>) -> Option<f64> {
    let reading = match value {
        RawValue::Number(value) => *value,
        RawValue::Interval { lo, hi } => 0.5 * (lo + hi),
        RawValue::Vector(_) => return None,
    };
    Some(scaling.map_or(reading, |it| it.value(reading))).filter(|value| value.is_finite())
}

/// Shifts the values of a signal that wraps by whole turns (SI), so that they lie next to those of another signal of the same
/// variable.
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

/// A value that wraps, in the turn in which it is nearest to the previous one, or to zero.
fn unwrapped(value: f64, before: Option<f64>, turn: Option<f64>) -> f64 {
    turn.map_or(value, |turn| value + turn * ((before.unwrap_or(0.0) - value) / turn).round())
}

/// The last one of some points up to a time, or the first one: what is exact stands until it changes.
fn held(points: &[(f64, f64)], time: f64) -> f64 {
    let place = points.partition_point(|it| it.0 <= time).saturating_sub(1);
    points.get(place).map_or(0.0, |it| it.1)
}

/// A local straight line through points (W. S. Cleveland 1979, doi:10.1080/01621459.1979.10481038, with even weights).
struct Line<'p> {
    points: &'p [(f64, f64)],
    /// For each point, the sums of 1, time, value, time * time and time * value over all points before it.
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
