//! The results of receiving observations, one by one and counted.

use super::clock::Misdated;
use crate::interval::Interval;
use crate::time::{Span, Validity};

/// Two readings further apart than the largest rate of change allows, errors of value and time included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// The earlier reading, SI.
    pub from: Interval,
    /// The later reading, SI.
    pub to: Interval,
    /// The longest possible time between them.
    pub within: Span,
    /// The largest rate of change, SI a second.
    pub max_rate: f64,
}

/// Why a reading is no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Defect {
    /// A list where a number is expected, the other way round, an empty list, or one that is too long.
    Shape,
    /// Not a number, or a list without a number.
    NotANumber,
    /// Infinite, or too large to compute with.
    Infinite,
    /// A lower bound above the upper one.
    Bounds,
}

/// How an observation was handled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Acceptance {
    /// Kept as the newest.
    Newest,
    /// Kept among older ones, as it came out of order.
    Reordered,
    /// Kept as the newest; the doubtful value before it cannot have come between.
    Refuting(Jump),
    /// Kept as the newest: a counter has begun anew, and nothing is kept of before.
    Anew {
        /// The last value before.
        last: Interval,
        /// The first value after.
        first: Interval,
    },
    /// Not kept yet: the value is possible only if the one before it was held, or if a counter begins anew. The next one decides.
    Doubtful,
    /// Not kept: the observation repeats the standing value before the next answer is due.
    Repeated,
    /// Dropped: the same value with the same validity is there.
    Duplicate,
    /// Dropped: older than everything kept, stamped in the future, or without a value.
    Dropped,
    /// Refused: it is no value.
    Invalid(Defect),
    /// Refused: the value, SI, is not possible.
    OutOfRange(Interval),
    /// Refused: the value could not have followed the one before it.
    TooFast(Jump),
}

impl Acceptance {
    /// Whether the value was accepted.
    #[must_use]
    pub fn is_kept(self) -> bool {
        matches!(
            self,
            Acceptance::Newest | Acceptance::Reordered | Acceptance::Refuting(_) | Acceptance::Anew { .. }
        )
    }

    /// Whether the value is possible for the signal.
    #[must_use]
    pub fn is_possible(self) -> bool {
        !matches!(self, Acceptance::Invalid(_) | Acceptance::OutOfRange(_))
    }
}

/// How many observations of a signal were handled how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Accepted.
    pub accepted: u64,
    /// Accepted although a newer one was there.
    pub reordered: u64,
    /// Dropped: the same had come before.
    pub duplicates: u64,
    /// Dropped: too old, or stamped in the future.
    pub dropped: u64,
    /// Refused, without a value: not-a-number, infinite, of the wrong shape.
    pub invalid: u64,
    /// Refused: not a possible value.
    pub out_of_range: u64,
    /// Refused: could not have followed the one before it.
    pub too_fast: u64,
    /// Received later after their time stamps than allowed, however they were handled.
    pub late: u64,
    /// Stamped before an earlier moment of reception, however they were handled.
    pub out_of_order: u64,
}

/// Adds up the counts of several runs.
impl core::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Counts) {
        let Counts {
            accepted,
            reordered,
            duplicates,
            dropped,
            invalid,
            out_of_range,
            too_fast,
            late,
            out_of_order,
        } = other;
        self.accepted += accepted;
        self.reordered += reordered;
        self.duplicates += duplicates;
        self.dropped += dropped;
        self.invalid += invalid;
        self.out_of_range += out_of_range;
        self.too_fast += too_fast;
        self.late += late;
        self.out_of_order += out_of_order;
    }
}

impl Counts {
    #[inline(never)]
    pub(super) fn add(&mut self, acceptance: Acceptance, is_late: bool, is_back: bool) {
        let count = match acceptance {
            Acceptance::Newest | Acceptance::Repeated | Acceptance::Doubtful | Acceptance::Anew { .. } => {
                &mut self.accepted
            }
            // The doubtful one has been counted as accepted: that stands for this one.
            Acceptance::Refuting(_) => &mut self.too_fast,
            Acceptance::Reordered => {
                self.reordered += 1;
                &mut self.accepted
            }
            Acceptance::Duplicate => &mut self.duplicates,
            Acceptance::Dropped => &mut self.dropped,
            Acceptance::Invalid(_) => &mut self.invalid,
            Acceptance::OutOfRange(_) => &mut self.out_of_range,
            Acceptance::TooFast(_) => &mut self.too_fast,
        };
        *count += 1;
        self.late += u64::from(is_late);
        self.out_of_order += u64::from(is_back);
    }
}

/// Readings that have been exactly the same for longer than allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Still {
    /// For how long they have been.
    pub lasted: Span,
    /// For how long they may be, at this value.
    pub allowed: Span,
}

/// The result of receiving an observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reception {
    /// How the observation was handled.
    pub acceptance: Acceptance,
    /// When the value was true.
    pub validity: Validity,
    /// The time from the stamp to the reception, where that is too long.
    pub late: Option<Span>,
    /// By how much the stamp certainly went back from the last moment of reception.
    pub back: Option<Span>,
    /// Since when the readings have been exactly the same, where that is too long.
    pub still: Option<Still>,
    /// The error of the time stamp.
    pub misdated: Option<Misdated>,
}

impl Reception {
    /// The reception of an observation dropped for no fault of its own.
    pub(super) fn dropped(validity: Validity) -> Reception {
        let acceptance = Acceptance::Dropped;
        Reception { acceptance, validity, late: None, back: None, still: None, misdated: None }
    }

    /// Whether the reading is sound by itself.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let refused = matches!(
            self.acceptance,
            Acceptance::Invalid(_)
                | Acceptance::OutOfRange(_)
                | Acceptance::TooFast(_)
                | Acceptance::Refuting(_)
        );
        !refused
            && self.late.is_none()
            && self.back.is_none()
            && self.still.is_none()
            && self.misdated.is_none()
    }
}
