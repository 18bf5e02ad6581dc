//! Comparisons of intervals, answered as far as the intervals allow.

use core::ops::Not;

use super::Interval;

/// The answer to a question about numbers that are known as intervals only (Kleene's three values).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Truth {
    /// Holds for no choice of members.
    False,
    /// Holds for some choices and not for others, or there is nothing to choose (an empty interval).
    Unknown,
    /// Holds for every choice of members.
    True,
}

impl Truth {
    /// True when both are, false when one is.
    #[must_use]
    pub fn and(self, other: Truth) -> Truth {
        self.min(other)
    }

    /// True when one is, false when both are.
    #[must_use]
    pub fn or(self, other: Truth) -> Truth {
        self.max(other)
    }

    /// Whether it is certainly true.
    #[must_use]
    pub fn is_true(self) -> bool {
        self == Truth::True
    }

    /// Whether it is certainly false.
    #[must_use]
    pub fn is_false(self) -> bool {
        self == Truth::False
    }

    /// True when `always`, false when `never`, unknown otherwise.
    fn known(always: bool, never: bool) -> Truth {
        if always {
            Truth::True
        } else if never {
            Truth::False
        } else {
            Truth::Unknown
        }
    }
}

impl From<bool> for Truth {
    fn from(value: bool) -> Truth {
        Truth::known(value, !value)
    }
}

impl Not for Truth {
    type Output = Truth;

    /// True when false and false when true.
    fn not(self) -> Truth {
        match self {
            Truth::False => Truth::True,
            Truth::Unknown => Truth::Unknown,
            Truth::True => Truth::False,
        }
    }
}

/// Comparisons of members, not of sets: `x.lt(y)` is true when every member of `x` lies below every member of `y`.
/// IEEE 1788-2015 answers `true` for empty intervals; here they are evidence of nothing, so unknown.
impl Interval {
    /// Whether the one is below the other.
    #[must_use]
    pub fn lt(self, other: Interval) -> Truth {
        self.compared(other, self.hi < other.lo, self.lo >= other.hi)
    }

    /// Whether the one is below the other or equal.
    #[must_use]
    pub fn le(self, other: Interval) -> Truth {
        self.compared(other, self.hi <= other.lo, self.lo > other.hi)
    }

    /// Whether the one is above the other.
    #[must_use]
    pub fn gt(self, other: Interval) -> Truth {
        other.lt(self)
    }

    /// Whether the one is above the other or equal.
    #[must_use]
    pub fn ge(self, other: Interval) -> Truth {
        other.le(self)
    }

    /// Whether the two are the same number; true for two equal points only.
    ///
    /// Called as a method on values; `==` compares bounds instead.
    #[must_use]
    pub fn eq(self, other: Interval) -> Truth {
        self.compared(other, self.is_point() && self == other, !self.overlaps(other))
    }

    fn compared(self, other: Interval, always: bool, never: bool) -> Truth {
        if self.is_empty() || other.is_empty() { Truth::Unknown } else { Truth::known(always, never) }
    }
}
