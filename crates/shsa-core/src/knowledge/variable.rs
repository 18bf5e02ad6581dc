//! Variables: physical quantities, and how wrapping values are shown.

use super::properties::Properties;
use crate::circle;
use crate::interval::{Course, Interval};
use crate::unit::Unit;
use alloc::string::String;

/// Whether a variable is one number or a list of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// One number.
    #[default]
    Scalar,
    /// A list of numbers; the observations decide its length.
    Vector,
}

impl Shape {
    /// All shapes, with their names in models.
    pub const NAMES: [(&'static str, Shape); 2] = [("scalar", Shape::Scalar), ("vector", Shape::Vector)];
}

/// A physical quantity.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Unique in the model.
    pub name: String,
    /// The unit in which values are read and shown; `None` when the model gives none. Inside, values are coherent SI.
    pub unit: Option<Unit>,
    /// One number or a list.
    pub shape: Shape,
    /// Physically possible values, in SI.
    pub range: Option<Interval>,
    /// Largest rate of change, SI units a second: how fast the uncertainty of an old value grows.
    pub max_rate: Option<f64>,
    /// The turn after which the values repeat, SI, above 0; `None` if they do not wrap. For scalars only.
    pub wraps: Option<f64>,
    /// The value of a constant, SI: a constant is always provided.
    pub constant: Option<Interval>,
    /// Named numbers for the utility.
    pub properties: Properties,
}

/// By what share a range may differ from a turn and still span one: both 360 deg and 6.283 rad are in use.
const SPANS_A_TURN: f64 = 1e-3;

impl Variable {
    /// Where the turn of shown values begins: at the lower end of a range that spans one turn, else at 0.
    #[must_use]
    pub fn turn_begins(&self) -> f64 {
        let spans_one = |range: &Interval| {
            self.wraps.is_some_and(|turn| (range.width() / turn - 1.0).abs() < SPANS_A_TURN)
        };
        self.range.filter(spans_one).map_or(0.0, Interval::lo)
    }

    /// A value as it is shown and published, SI: a wrapping value is moved so that its middle lies in the shown turn.
    #[must_use]
    pub fn brought_back(&self, value: Interval) -> Interval {
        self.wraps.map_or(value, |turn| circle::brought_back(value, self.turn_begins(), turn))
    }

    /// What bounds the variable between two moments at which it is known. The range does not bound values that wrap, as these are
    /// stored unwrapped.
    #[must_use]
    pub fn course(&self) -> Course {
        let range = self.range.filter(|_| self.wraps.is_none());
        let max_rate = self.max_rate.unwrap_or(f64::INFINITY);
        Course { max_rate, range: range.unwrap_or(Interval::ENTIRE), ..Course::ANY }
    }

    /// The part of a value that is possible, SI: empty where the value lies outside of the range altogether. A value that wraps is
    /// never wider than a turn.
    #[inline]
    #[must_use]
    pub fn possible(&self, value: Interval) -> Interval {
        match (self.wraps, self.range) {
            (None, None) => value,
            (None, Some(range)) => value.intersection(range),
            (Some(turn), range) => self.possible_turned(value, turn, range.unwrap_or(Interval::ENTIRE)),
        }
    }

    fn possible_turned(&self, value: Interval, turn: f64, range: Interval) -> Interval {
        let begins = self.turn_begins();
        let range = if range.width() < turn * (1.0 - SPANS_A_TURN) { range } else { Interval::ENTIRE };
        match value.width() >= turn {
            true => Interval::new(begins, begins + turn).intersection(range),
            false if range.is_bounded() => circle::nearest(value, range, turn).intersection(range),
            false => value,
        }
    }

    /// The range of readings: a range that spans a turn is extended by one turn on either side, as sensors count from different
    /// points.
    #[must_use]
    pub fn readable(&self) -> Option<Interval> {
        let wide = |range: Interval, turn: f64| range.width() >= turn * (1.0 - SPANS_A_TURN);
        match (self.range, self.wraps) {
            (Some(range), Some(turn)) if wide(range, turn) => Some(range.widened(turn)),
            (range, _) => range,
        }
    }
}
