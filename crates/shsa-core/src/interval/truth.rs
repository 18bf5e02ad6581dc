//! Comparisons of intervals in three-valued logic.

use core::ops::Not;

use super::Interval;

/// The truth of a statement about numbers that are known as intervals only (Kleene's three values).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Truth {
    /// The statement holds for no choice of members.
    False,
    /// The statement holds for some choices and not for others, or an interval is empty.
    Unknown,
    /// The statement holds for every choice of members.
    True,
}

impl Truth {
    /// Conjunction: true when both are true, false when one is false.
    #[must_use]
    pub fn and(self, other: Truth) -> Truth {
        self.min(other)
    }

    /// Disjunction: true when one is true, false when both are false.
    #[must_use]
    pub fn or(self, other: Truth) -> Truth {
        self.max(other)
    }

    /// Whether the statement is certainly true.
    #[must_use]
    pub fn is_true(self) -> bool {
        self == Truth::True
    }

    /// Whether the statement is certainly false.
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

    /// Negation: true for false and false for true.
    fn not(self) -> Truth {
        match self {
            Truth::False => Truth::True,
            Truth::Unknown => Truth::Unknown,
            Truth::True => Truth::False,
        }
    }
}

/// Comparisons of members, not of sets: `x.lt(y)` is true when every member of `x` lies below every member of `y`. IEEE 1788-2015
/// answers `true` for empty intervals; here they are no evidence, so the answer is unknown.
impl Interval {
    /// Whether this number is below the other.
    #[must_use]
    pub fn lt(self, other: Interval) -> Truth {
        self.compared(other, self.hi < other.lo, self.lo >= other.hi)
    }

    /// Whether this number is below the other or equal.
    #[must_use]
    pub fn le(self, other: Interval) -> Truth {
        self.compared(other, self.hi <= other.lo, self.lo > other.hi)
    }

    /// Whether this number is above the other.
    #[must_use]
    pub fn gt(self, other: Interval) -> Truth {
        other.lt(self)
    }

    /// Whether this number is above the other or equal.
    #[must_use]
    pub fn ge(self, other: Interval) -> Truth {
        other.le(self)
    }

    /// Whether both are the same number; true for two equal points only.
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
