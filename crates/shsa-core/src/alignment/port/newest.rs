//! The newest values of a port, whatever its shape.

use super::Port;
use crate::interval::Interval;
use crate::knowledge::Shape;
use crate::time::{Span, Validity};

impl Port {
    /// The time between the last two receptions.
    #[must_use]
    pub fn spacing(&self) -> Option<Span> {
        Some(self.received? - self.received_before?)
    }

    /// The validity of a kept value, scalar or vector, `back` before the newest.
    #[must_use]
    pub fn moment(&self, back: usize) -> Option<Validity> {
        match self.shape {
            Shape::Scalar => self.scalars.newest(back).map(|sample| sample.validity),
            Shape::Vector => self.scans.iter().rev().nth(back).map(|scan| scan.validity),
        }
    }

    /// The newest value; for a vector, the hull of its elements.
    #[must_use]
    pub fn hull(&self) -> Option<Interval> {
        match self.shape {
            Shape::Scalar => self.newest().map(|sample| sample.value),
            Shape::Vector => self.scans.last()?.elements.iter().copied().reduce(Interval::hull),
        }
    }

    /// The width of the newest value, as a point; for a vector, of its widest element.
    #[must_use]
    pub fn widest(&self) -> Option<Interval> {
        let width = match self.shape {
            Shape::Scalar => self.newest()?.value.width(),
            Shape::Vector => self.scans.last()?.elements.iter().map(|it| it.width()).fold(0.0, f64::max),
        };
        Some(Interval::point(width))
    }
}
