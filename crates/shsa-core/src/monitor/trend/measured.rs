//! A value with its middle and width, which every comparison needs.

use crate::interval::Interval;

/// A value with its middle and width, computed once for all comparisons with it.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// The value, SI.
    pub value: Interval,
    middle: f64,
    width: f64,
}

impl Measured {
    /// Computes the middle and the width.
    #[inline]
    #[must_use]
    pub fn of(value: Interval) -> Measured {
        Measured { value, middle: value.midpoint(), width: value.width() }
    }

    /// The same bounds with another best guess as the middle.
    pub(in super::super) fn with_guess(self, guess: f64) -> Measured {
        Measured { middle: guess, ..self }
    }

    /// The value with a margin on both sides; the middle stays.
    #[inline]
    pub(in super::super) fn widened(&self, margin: f64) -> Measured {
        let value = self.value.widened(margin);
        Measured { value, middle: self.middle, width: self.width + 2.0 * margin }
    }

    /// The middle of the value, SI.
    #[inline]
    pub(in super::super) fn middle(&self) -> f64 {
        self.middle
    }

    /// The width of the value, SI.
    #[inline]
    pub(in super::super) fn width(&self) -> f64 {
        self.width
    }
}
