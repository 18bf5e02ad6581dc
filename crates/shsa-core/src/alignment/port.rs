//! The port of one signal: its recent observations, ready to be read at any moment.

mod counting;
mod keep;
mod newest;
mod standstill;

use super::about::Known;
use super::clock::Misdated;
use super::gate::Gate;
use super::history::{History, Reach, Reading, Sample};
use super::reception::{Acceptance, Counts, Reception, Still};
use crate::interval::Interval;
use crate::knowledge::{Shape, Signal};
use crate::numbers::CLOCKS_APART;
use crate::observation::{Observation, RawValue};
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;
use counting::Counting;
use standstill::Standstill;

/// The longest accepted vector: a depth image of 640 times 480 has fewer elements. A longer one is invalid.
pub const LONGEST_VECTOR: usize = 1 << 19;

/// The number of vectors kept of a signal.
const VECTORS: usize = 4;

/// A vector and the time in which it was true.
#[derive(Clone, Debug)]
struct Scan {
    validity: Validity,
    elements: Vec<Interval>,
}

/// The recent observations of one signal.
#[derive(Clone, Debug)]
pub struct Port {
    shape: Shape,
    /// Possible values; other readings are refused.
    range: Interval,
    /// The turn after which values repeat, SI.
    turn: Option<f64>,
    gate: Gate,
    scalars: History,
    /// The vectors, newest last; buffers are reused, so that nothing is allocated once they are large enough.
    scans: Vec<Scan>,
    counts: Counts,
    received: Option<Time>,
    received_before: Option<Time>,
    /// The newest stamp of this moment of reception, and that of the moment before.
    stamp: Option<Time>,
    stamp_before: Option<Time>,
    standstill: Standstill,
    /// The value at which readings may stay the same for longer.
    rests_at: Option<f64>,
    /// What a counter has counted; `None` of what may fall.
    counting: Option<Counting>,
}

impl Port {
    /// The port of a signal, whose variable has this shape, with room for `capacity` scalars.
    #[must_use]
    pub fn new(shape: Shape, signal: &Signal, capacity: usize) -> Port {
        let scans = Vec::with_capacity(if shape == Shape::Vector { VECTORS } else { 0 });
        let capacity = if shape == Shape::Scalar { capacity } else { 1 };
        Port {
            shape,
            range: signal.limits.range.unwrap_or(Interval::ENTIRE),
            turn: signal.limits.turn,
            gate: Gate::new(signal),
            scalars: History::new(capacity),
            scans,
            counts: Counts::default(),
            received: None,
            received_before: None,
            stamp: None,
            stamp_before: None,
            standstill: Standstill::default(),
            rests_at: signal.limits.rests_at,
            counting: signal.limits.counts.then(Counting::default),
        }
    }

    /// Takes over everything that the same signal's port has received before a change of the model, without less room.
    pub fn inherit(&mut self, old: Port) {
        let capacity = self.scalars.capacity();
        let Port { shape, range, turn, rests_at, mut gate, counting, .. } = *self;
        gate.inherit(old.gate);
        let counting = counting.map(|new| old.counting.unwrap_or(new));
        *self = Port { shape, range, turn, rests_at, gate, counting, ..old };
        self.scalars.make_room(capacity);
    }

    /// Takes in an observation.
    ///
    /// Late and reordered observations are kept in the order of time, repeated ones are dropped, impossible ones are refused, and
    /// all are counted. Tests between observations of one moment of reception do not depend on their order.
    #[inline]
    pub fn accept(&mut self, signal: &Signal, observation: &Observation, now: Time) -> Reception {
        if self.received.is_none_or(|last| last < now) {
            self.gate.turn();
            if self.stamp.is_some() {
                self.stamp_before = self.stamp.take();
            }
        }
        self.received_before = self.received.replace(now);
        let is_ahead = observation.stamp > now && observation.stamp - now > CLOCKS_APART;
        let validity = signal.validity(observation.stamp);
        if is_ahead {
            self.counts.dropped += 1;
            return Reception::dropped(validity);
        }
        let acceptance = self.keep(signal, &observation.value, validity);
        let late = lateness(signal, observation);
        let is_again = matches!(acceptance, Acceptance::Duplicate);
        let back = if is_again { None } else { self.went_back(signal, observation.stamp) };
        let allowed = signal.limits.frozen_after;
        let still = allowed.and_then(|allowed| self.stood_still(signal, observation, allowed, now));
        if matches!(acceptance, Acceptance::Newest) && late.is_none() && back.is_none() {
            // The most frequent case.
            self.counts.accepted += 1;
        } else {
            self.counts.add(acceptance, late.is_some(), back.is_some());
        }
        Reception { acceptance, validity, late, back, still, misdated: None }
    }

    /// Drops an observation with a wrong stamp, as the time of its value is unknown.
    pub fn drop_misdated(
        &mut self,
        signal: &Signal,
        observation: &Observation,
        misdated: Misdated,
        now: Time,
    ) -> Reception {
        if self.received.is_none_or(|last| last < now) {
            self.gate.turn();
        }
        self.received_before = self.received.replace(now);
        self.counts.dropped += 1;
        let dropped = Reception::dropped(signal.validity(observation.stamp));
        let is_symptom = !matches!(misdated, Misdated::Ahead(_));
        Reception { misdated: Some(misdated).filter(|_| is_symptom), ..dropped }
    }

    /// Whether the readings, this one included, have been exactly the same for longer than allowed.
    fn stood_still(
        &mut self,
        signal: &Signal,
        observation: &Observation,
        allowed: Span,
        now: Time,
    ) -> Option<Still> {
        let too_long = |lasted: Option<Span>, allowed: Span| {
            Some(Still { lasted: lasted?, allowed }).filter(|it| it.lasted >= allowed)
        };
        if self.shape == Shape::Vector {
            let newest = self.scans.last().filter(|scan| scan.validity == signal.validity(observation.stamp));
            let before = self.scans.len().checked_sub(2).and_then(|at| self.scans.get(at));
            let is_same =
                newest.zip(before).is_some_and(|(newest, before)| newest.elements == before.elements);
            newest?;
            return too_long(self.standstill.record(is_same, None, now), allowed);
        }
        let value = match observation.value {
            RawValue::Number(number) => signal.enclose_bounds(number, number),
            RawValue::Interval { lo, hi } => signal.enclose_bounds(lo, hi),
            RawValue::Vector(_) => return None,
        };
        let rests = signal.limits.rests_at.is_some_and(|rest| value.contains(rest));
        // At the end of what it can show, it may say the same for any time.
        let is_same = self.standstill.value == Some(value) && !signal.limits.is_at_end(value);
        let lasted = self.standstill.record(is_same, Some(value), now);
        too_long(lasted, if rests { signal.limits.rests_for? } else { allowed })
    }

    /// Notes a stamp; returns by how much it certainly went back, its error allowed for.
    #[inline]
    fn went_back(&mut self, signal: &Signal, stamp: Time) -> Option<Span> {
        if self.stamp.is_none_or(|newest| newest < stamp) {
            self.stamp = Some(stamp);
        }
        let (early, late) = signal.time_error;
        let before = self.stamp_before.filter(|before| stamp < *before || late < early)?;
        (stamp + late < before + early).then(|| before - stamp)
    }

    /// Opens the gate when too fast changes have become frequent, or closes it; after all observations of a moment.
    pub fn set_gate(&mut self, open: bool) {
        self.gate.set_open(open);
    }

    /// Measures later readings by the one before this one, which others have proved wrong.
    pub fn refute(&mut self, reading: Validity) {
        self.gate.refute(reading);
    }

    /// Whether the last reading before a jump, if any, could have got to the present ones at the largest rate of change.
    #[must_use]
    pub fn has_returned(&self) -> bool {
        self.gate.has_returned()
    }

    /// Accepts the present level of the readings, and forgets earlier jumps.
    pub fn come_home(&mut self) {
        self.gate.come_home();
    }

    /// Accepts the present level of the readings as the beginning of others.
    pub fn start_anew(&mut self) {
        self.gate.start_anew();
    }

    /// Whether the readings have started anew with their last jump: what counts from 0, or after a wrong first reading.
    #[must_use]
    pub fn has_started_anew(&self) -> bool {
        self.gate.has_started_anew()
    }

    /// The newest scalar, if it alone determines the value at a moment; see [`History::alone_at`].
    #[inline]
    #[must_use]
    pub fn scalar_alone_at(&self, moment: Validity) -> Option<Interval> {
        self.scalars.alone_at(moment)
    }

    /// The scalar with this validity; see [`History::exactly_at`].
    #[inline]
    #[must_use]
    pub fn scalar_exactly_at(&self, moment: Validity) -> Option<Interval> {
        match self.scalars.newest(0) {
            // The most frequent case.
            Some(newest) if newest.validity == moment && !self.scalars.is_repeated() => Some(newest.value),
            _ => self.scalars.exactly_at(moment),
        }
    }

    /// The bound of a scalar at a moment; see [`History::about`].
    #[inline]
    #[must_use]
    pub fn scalar_about(&self, moment: Validity, reach: Reach) -> Known {
        self.scalars.about(moment, reach)
    }

    /// A scalar at a moment; see [`History::at`].
    #[inline]
    #[must_use]
    pub fn scalar_at(&self, moment: Validity, reach: Reach) -> Option<Reading> {
        self.scalars.at(moment, reach)
    }

    /// The estimate of a scalar after its newest sample; see [`History::ahead`].
    #[must_use]
    pub fn scalar_ahead(&self, moment: Validity, max_rate: f64) -> Option<Interval> {
        self.scalars.ahead(moment, max_rate)
    }

    /// The vector that overlaps a moment or is nearest to it within `max_gap`.
    #[must_use]
    pub fn vector_at(&self, moment: Validity, max_gap: Span) -> Option<&[Interval]> {
        let nearest = self.scans.iter().rev().min_by_key(|scan| scan.validity.gap(moment))?;
        (nearest.validity.gap(moment) <= max_gap).then_some(nearest.elements.as_slice())
    }

    /// The validities of the scalars kept, oldest first.
    pub fn moments(&self) -> impl Iterator<Item = Validity> + '_ {
        let kept = self.scalars.len();
        (0..kept).rev().filter_map(|back| self.scalars.newest(back)).map(|sample| sample.validity)
    }

    /// The newest scalar.
    #[must_use]
    pub fn newest(&self) -> Option<&Sample> {
        self.scalars.newest(0)
    }

    /// When the port last received anything, valid or not.
    #[must_use]
    pub fn received(&self) -> Option<Time> {
        self.received
    }

    /// Whether the newest value is the one at which readings may stay the same for longer.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.rests_at.zip(self.newest()).is_some_and(|(rest, newest)| newest.value.contains(rest))
    }

    /// Whether the signal is a counter.
    #[must_use]
    pub fn is_counter(&self) -> bool {
        self.counting.is_some()
    }

    /// The counts of the observations.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }
}

/// The time from the stamp to the reception, when that is longer than allowed, whatever the error of the stamp.
fn lateness(signal: &Signal, observation: &Observation) -> Option<Span> {
    let most = signal.limits.max_delay?;
    let (_, error) = signal.time_error;
    let delay = observation.received - observation.stamp;
    (delay - error > most).then_some(delay)
}
