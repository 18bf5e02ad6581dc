//! What a port knows newest, whatever its shape.

use super::Port;
use crate::interval::Interval;
use crate::knowledge::Shape;
use crate::time::Validity;

impl Port {
    /// When a value was true that is kept, scalar or vector: `back` before the newest.
    #[must_use]
    pub fn moment(&self, back: usize) -> Option<Validity> {
        match self.shape {
            Shape::Scalar => self.scalars.newest(back).map(|sample| sample.validity),
            Shape::Vector => self.scans.iter().rev().nth(back).map(|scan| scan.validity),
        }
    }

    /// The newest value; of a vector, what all of its elements lie within.
    #[must_use]
    pub fn hull(&self) -> Option<Interval> {
        match self.shape {
            Shape::Scalar => self.newest().map(|sample| sample.value),
            Shape::Vector => self.scans.last()?.elements.iter().copied().reduce(Interval::hull),
        }
    }

    /// How wide the newest value is, as a point; of a vector, its widest element.
    #[must_use]
    pub fn widest(&self) -> Option<Interval> {
        let width = match self.shape {
            Shape::Scalar => self.newest()?.value.width(),
            Shape::Vector => self.scans.last()?.elements.iter().map(|it| it.width()).fold(0.0, f64::max),
        };
        Some(Interval::point(width))
    }
}
