//! The readings of a signal at one moment, taken together.

use super::{DETECTED, Evidence};
use crate::alignment::{Acceptance, Defect, Jump, Misdated, Reception, Still};
use crate::interval::Interval;
use crate::time::Span;

/// The symptoms of a signal's readings at one moment, the worst of each kind.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moment {
    defect: Option<Defect>,
    outside: Option<Interval>,
    jump: Option<Jump>,
    refuted: Option<Jump>,
    back: Option<Span>,
    late: Option<Span>,
    still: Option<Still>,
    misdated: Option<Misdated>,
}

impl Moment {
    pub(super) fn add(&mut self, reception: &Reception) {
        self.late = self.late.max(reception.late);
        self.back = self.back.max(reception.back);
        self.still = self.still.max(reception.still);
        self.misdated = self.misdated.max(reception.misdated);
        match reception.acceptance {
            Acceptance::Invalid(defect) => self.defect = self.defect.max(Some(defect)),
            Acceptance::OutOfRange(value) => {
                self.outside = Some(self.outside.map_or(value, |other| larger(other, value)));
            }
            Acceptance::TooFast(jump) => {
                self.jump = Some(self.jump.map_or(jump, |other| worse(other, jump)));
            }
            Acceptance::Refuting(jump) => {
                self.refuted = Some(self.refuted.map_or(jump, |other| worse(other, jump)));
            }
            Acceptance::Newest
            | Acceptance::Anew { .. }
            | Acceptance::Doubtful
            | Acceptance::Repeated
            | Acceptance::Reordered
            | Acceptance::Duplicate
            | Acceptance::Dropped => {}
        }
    }

    /// The jump from the last reading of before, which was in doubt, to this moment.
    pub(super) fn refuted(&self) -> Option<Jump> {
        self.refuted
    }

    /// The evidence by symptom, in the order of [`DETECTED`].
    pub(super) fn shown(&self) -> [Option<Evidence>; DETECTED.len()] {
        [
            self.defect.map(Evidence::Invalid),
            self.outside.map(Evidence::OutOfRange),
            self.jump.map(Evidence::TooFast),
            self.still.map(Evidence::Frozen),
            self.misdated.map(Evidence::WrongClock),
            self.back.map(Evidence::OutOfOrder),
            self.late.map(Evidence::Late),
        ]
    }
}

fn larger(one: Interval, other: Interval) -> Interval {
    let order = one.lo().total_cmp(&other.lo()).then(one.hi().total_cmp(&other.hi()));
    if order.is_lt() { other } else { one }
}

/// The jump over the longer distance; of equally long ones, the choice does not depend on the order.
fn worse(one: Jump, other: Jump) -> Jump {
    let order = one.from.distance(one.to).total_cmp(&other.from.distance(other.to));
    let order = order.then(one.to.lo().total_cmp(&other.to.lo())).then(one.to.hi().total_cmp(&other.to.hi()));
    if order.then(one.within.cmp(&other.within)).is_lt() { other } else { one }
}
