//! The port of one signal: its recent observations, ready to be read at any moment.

use super::history::{Acceptance, History, Reach, Reading, Sample};
use crate::interval::Interval;
use crate::knowledge::{Shape, Signal};
use crate::observation::{Observation, RawValue};
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;

/// A stamp further than this beyond the time of reception is no time of this system.
const MOST_AHEAD: Span = Span::from_millis(10_000);

/// The longest vector that is taken in: a depth image of 640 times 480 has fewer elements. A longer one is no value.
pub const LONGEST_VECTOR: usize = 1 << 19;

/// How many vectors of a signal are kept.
const VECTORS: usize = 4;

/// What became of the observations of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Taken in.
    pub accepted: u64,
    /// Taken in although a newer one was there.
    pub reordered: u64,
    /// Dropped: the same had come before.
    pub duplicates: u64,
    /// Dropped: too old, or stamped in the future.
    pub dropped: u64,
    /// Without a usable value: not-a-number, infinite, out of range, of the wrong shape.
    pub invalid: u64,
}

/// One vector with the time in which it was true.
#[derive(Clone, Debug)]
struct Scan {
    validity: Validity,
    elements: Vec<Interval>,
}

/// The recent observations of one signal.
#[derive(Clone, Debug)]
pub struct Port {
    shape: Shape,
    /// Physically possible values; what lies outside is no observation.
    range: Interval,
    scalars: History,
    /// Newest last; the buffers are used again, so that nothing is allocated once they are large enough.
    scans: Vec<Scan>,
    counts: Counts,
    received: Option<Time>,
    /// Time between the last two receptions.
    spacing: Option<Span>,
}

impl Port {
    /// For a variable of this shape and range, with room for `capacity` scalars.
    #[must_use]
    pub fn new(shape: Shape, range: Option<Interval>, capacity: usize) -> Port {
        let scans = Vec::with_capacity(if shape == Shape::Vector { VECTORS } else { 0 });
        let capacity = if shape == Shape::Scalar { capacity } else { 1 };
        Port {
            shape,
            range: range.unwrap_or(Interval::ENTIRE),
            scalars: History::new(capacity),
            scans,
            counts: Counts::default(),
            received: None,
            spacing: None,
        }
    }

    /// Goes on with all that the port of the same signal has received before a change, in no less room.
    pub fn inherit(&mut self, old: Port) {
        let capacity = self.scalars.capacity();
        let Port { shape, range, .. } = *self;
        *self = Port { shape, range, ..old };
        self.scalars.make_room(capacity);
    }

    /// Takes an observation in; `None` when it has no usable value.
    ///
    /// Late and reordered ones are kept in the order of time, the same one twice is dropped, and all are counted.
    pub fn accept(&mut self, signal: &Signal, observation: &Observation, now: Time) -> Option<Acceptance> {
        self.spacing = self.received.map(|last| now - last).or(self.spacing);
        self.received = Some(now);
        let validity = signal.validity(observation.stamp);
        let acceptance = if observation.stamp - now > MOST_AHEAD {
            Some(Acceptance::Dropped)
        } else {
            self.keep(signal, &observation.value, validity)
        };
        match acceptance {
            None => self.counts.invalid += 1,
            Some(Acceptance::Newest) => self.counts.accepted += 1,
            Some(Acceptance::Reordered) => {
                self.counts.accepted += 1;
                self.counts.reordered += 1;
            }
            Some(Acceptance::Duplicate) => self.counts.duplicates += 1,
            Some(Acceptance::Dropped) => self.counts.dropped += 1,
        }
        acceptance
    }

    fn keep(&mut self, signal: &Signal, value: &RawValue, validity: Validity) -> Option<Acceptance> {
        match (value, self.shape) {
            (RawValue::Vector(elements), Shape::Vector) => self.keep_scan(signal, elements, validity),
            (RawValue::Vector(_), Shape::Scalar) | (_, Shape::Vector) => None,
            (&RawValue::Number(number), _) => self.keep_scalar(signal.enclose(number), validity),
            (&RawValue::Interval { lo, hi }, _) => self.keep_scalar(signal.enclose_bounds(lo, hi), validity),
        }
    }

    fn keep_scalar(&mut self, value: Interval, validity: Validity) -> Option<Acceptance> {
        (value.is_bounded() && value.overlaps(self.range))
            .then(|| self.scalars.push(Sample { validity, value }))
    }

    fn keep_scan(&mut self, signal: &Signal, elements: &[f64], validity: Validity) -> Option<Acceptance> {
        if elements.is_empty() || elements.len() > LONGEST_VECTOR {
            return None;
        }
        match self.scans.last().map(|newest| newest.validity.to) {
            Some(newest) if newest == validity.to => return Some(Acceptance::Duplicate),
            Some(newest) if newest > validity.to => return Some(Acceptance::Dropped),
            _ => {}
        }
        let mut scan = if self.scans.len() < VECTORS {
            Scan { validity, elements: Vec::with_capacity(elements.len()) }
        } else {
            self.scans.remove(0)
        };
        scan.validity = validity;
        scan.elements.clear();
        scan.elements.extend(elements.iter().map(|&element| enclose_element(signal, element)));
        self.scans.push(scan);
        Some(Acceptance::Newest)
    }

    /// A scalar at a moment; see [`History::at`].
    #[must_use]
    pub fn scalar_at(&self, moment: Validity, reach: Reach) -> Option<Reading> {
        self.scalars.at(moment, reach)
    }

    /// The vector that overlaps a moment or is nearest to it within `max_gap`.
    #[must_use]
    pub fn vector_at(&self, moment: Validity, max_gap: Span) -> Option<&[Interval]> {
        let nearest = self.scans.iter().rev().min_by_key(|scan| scan.validity.gap(moment))?;
        (nearest.validity.gap(moment) <= max_gap).then_some(nearest.elements.as_slice())
    }

    /// When the scalars that are kept were true, oldest first.
    pub fn moments(&self) -> impl Iterator<Item = Validity> + '_ {
        let kept = self.scalars.len();
        (0..kept).rev().filter_map(|back| self.scalars.newest(back)).map(|sample| sample.validity)
    }

    /// The newest scalar.
    #[must_use]
    pub fn newest(&self) -> Option<&Sample> {
        self.scalars.newest(0)
    }

    /// When it last received anything, valid or not.
    #[must_use]
    pub fn received(&self) -> Option<Time> {
        self.received
    }

    /// Time between its last two receptions.
    #[must_use]
    pub fn spacing(&self) -> Option<Span> {
        self.spacing
    }

    /// What became of its observations.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }
}

/// An element of a scan. Infinity is how range sensors say that nothing is near: beyond every number, but not
/// nothing; not-a-number is nothing.
fn enclose_element(signal: &Signal, element: f64) -> Interval {
    if element == f64::INFINITY { Interval::new(f64::MAX, f64::INFINITY) } else { signal.enclose(element) }
}
