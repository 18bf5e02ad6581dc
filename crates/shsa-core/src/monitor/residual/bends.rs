//! How far a value may be from the line between two samples, by how far it has been from such lines lately.

use crate::numbers::{BENDS_AT_MOST, MANY, SURELY};

/// The deviation of a line's bulge by white noise of deviation 1: that of a second difference is the root of 6, and an eighth of it is
/// the bulge.
const OF_NOISE: f64 = 2.449_489_742_783_178 / 8.0;

/// How far a value has been from the lines between its samples.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super) struct Bends {
    /// The largest bulge that is beyond noise, fading, SI.
    largest: f64,
    /// The mean square of the bulges without the part of noise, SI.
    square: f64,
    /// The number of lines, up to the memory.
    lines: f64,
}

impl Bends {
    /// Takes in the bulge of a line between values with noise of this deviation, both SI.
    pub(in super::super) fn take(&mut self, bulge: f64, deviation: f64) {
        let noise = OF_NOISE * deviation;
        self.largest = (bulge - SURELY * noise).max(self.largest * (1.0 - 1.0 / f64::from(MANY)));
        self.lines = f64::from(MANY).min(self.lines + 1.0);
        self.square += (bulge * bulge - noise * noise - self.square) / self.lines;
    }

    /// How far a value may be from a line, SI.
    pub(in super::super) fn most(&self) -> f64 {
        BENDS_AT_MOST * self.largest.max(libm::sqrt(self.square.max(0.0)))
    }
}
