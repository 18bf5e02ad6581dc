//! Single bad values that come again and again, although most are good: outliers that are too frequent to be chance.

use crate::numbers::{AT_ONCE, HALF, LASTING, MANY, RECURRING_LEAST, RECURRING_SHARE};
use crate::time::Span;

/// A smaller count is none.
const FEW: f64 = 0.01;

/// A count of single bad values that fades with each value.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Recurring {
    count: f64,
    /// The number of values over which the count fades.
    memory: f64,
}

impl Recurring {
    /// The count for values every `period`.
    pub(in super::super) fn new(period: Option<Span>) -> Recurring {
        let in_time = period.map_or(0.0, |period| LASTING.seconds() / period.seconds());
        Recurring { count: 0.0, memory: in_time.max(f64::from(MANY)) }
    }

    /// Takes over the count of before.
    pub(in super::super) fn inherit(&mut self, old: &Recurring) {
        self.count = old.count;
    }

    pub(in super::super) fn forget(&mut self) {
        self.count = 0.0;
    }

    /// Whether any is remembered.
    #[inline(always)]
    pub(in super::super) fn is_any(&self) -> bool {
        self.count > 0.0
    }

    /// Notes that a value has come.
    pub(in super::super) fn fade(&mut self) {
        self.count -= self.count / self.memory;
        if self.count < FEW {
            self.count = 0.0;
        }
    }

    /// Counts the value as a single bad one.
    pub(in super::super) fn add(&mut self) {
        self.count = (self.count + 1.0).min(AT_ONCE * self.enough());
    }

    /// Takes the last one back: it was not single.
    pub(in super::super) fn take_back(&mut self) {
        self.count = (self.count - 1.0).max(0.0);
    }

    /// Whether they are too many; `already`: whether they have been.
    pub(in super::super) fn are_too_many(&self, already: bool) -> bool {
        self.count >= if already { HALF * self.enough() } else { self.enough() }
    }

    fn enough(&self) -> f64 {
        RECURRING_LEAST.max(RECURRING_SHARE * self.memory)
    }

    /// How many single bad values there have been, among how many.
    pub(in super::super) fn counted(&self) -> (u32, u32) {
        (libm::round(self.count) as u32, libm::round(self.memory) as u32)
    }
}
