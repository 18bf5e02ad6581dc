//! Single bad values that come again and again, although most are good: outliers that are too frequent to be chance.

use crate::time::Span;

/// Of at least this share, and
const SHARE: f64 = 0.04;
/// of at least this number, single bad values are a fault, which ends at half of both.
const FEWEST: f64 = 4.5;
/// They are counted among at least this many values,
const AMONG: f64 = 64.0;
/// and over at least this time: shocks of a vehicle, and a bad road, are shorter.
const OVER: Span = Span::from_millis(5_000);
/// A smaller count is none.
const FEW: f64 = 0.01;
/// However many there were, no more are remembered than this multiple of what is enough.
const MOST: f64 = 1.5;

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
        let in_time = period.map_or(0.0, |period| OVER.seconds() / period.seconds());
        Recurring { count: 0.0, memory: in_time.max(AMONG) }
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
        self.count = (self.count + 1.0).min(MOST * self.enough());
    }

    /// Takes the last one back: it was not single.
    pub(in super::super) fn take_back(&mut self) {
        self.count = (self.count - 1.0).max(0.0);
    }

    /// Whether they are too many; `already`: whether they have been.
    pub(in super::super) fn are_too_many(&self, already: bool) -> bool {
        self.count >= if already { 0.5 * self.enough() } else { self.enough() }
    }

    fn enough(&self) -> f64 {
        FEWEST.max(SHARE * self.memory)
    }

    /// How many single bad values there have been, among how many.
    pub(in super::super) fn counted(&self) -> (u32, u32) {
        (libm::round(self.count) as u32, libm::round(self.memory) as u32)
    }
}
