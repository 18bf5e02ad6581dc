//! The units in which worlds are written down: each dimension with the unit of its SI value first.

/// A unit: its text, and what one and zero of it are in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    pub(super) text: &'static str,
    factor: f64,
    zero: f64,
}

/// Units of one dimension; the first is the one in which quantities are written.
pub(super) type Dimension = &'static [Unit];

const fn unit(text: &'static str, factor: f64) -> Unit {
    Unit { text, factor, zero: 0.0 }
}

pub(super) const LENGTH: Dimension = &[unit("m", 1.0), unit("cm", 0.01), unit("ft", 0.3048)];
pub(super) const AREA: Dimension = &[unit("m^2", 1.0), unit("cm^2", 1e-4)];
pub(super) const SPEED: Dimension = &[unit("m/s", 1.0), unit("km/h", 1.0 / 3.6), unit("kn", 1852.0 / 3600.0)];
pub(super) const TIME: Dimension = &[unit("s", 1.0), unit("ms", 1e-3), unit("min", 60.0)];
/// Plain numbers: an error in per cent would be a share of the value.
pub(super) const RATIO: Dimension = &[unit("", 1.0)];
pub(super) const ANGLE: Dimension = &[unit("rad", 1.0), unit("deg", std::f64::consts::PI / 180.0)];
pub(super) const TURN: Dimension = &[unit("rad/s", 1.0), unit("deg/s", std::f64::consts::PI / 180.0)];
pub(super) const VOLTAGE: Dimension = &[unit("V", 1.0), unit("mV", 1e-3)];
pub(super) const CURRENT: Dimension = &[unit("A", 1.0), unit("mA", 1e-3)];
pub(super) const POWER: Dimension = &[unit("W", 1.0), unit("kW", 1e3)];
pub(super) const RESISTANCE: Dimension = &[unit("ohm", 1.0), unit("mohm", 1e-3)];
/// Points of a scale; the amounts are in K.
pub(super) const TEMPERATURE: Dimension = &[
    unit("K", 1.0),
    Unit { text: "degC", factor: 1.0, zero: 273.15 },
    Unit { text: "degF", factor: 5.0 / 9.0, zero: 459.67 * 5.0 / 9.0 },
];

impl Unit {
    /// The key of a variable or signal, unless its values are plain numbers.
    pub(super) fn key(self) -> Vec<String> {
        if self.text.is_empty() { Vec::new() } else { vec![format!("unit: \"{}\"", self.text)] }
    }

    /// A value of SI in this unit.
    pub(super) fn of(self, si: f64) -> f64 {
        (si - self.zero) / self.factor
    }

    /// A value in this unit, in SI.
    pub(super) fn si(self, value: f64) -> f64 {
        value * self.factor + self.zero
    }
}

/// A value in SI, as it is written in a model.
pub(super) fn quantity(dimension: Dimension, si: f64) -> String {
    let unit = dimension[0];
    format!("{:?} {}", unit.of(si), unit.text).trim_end().to_owned()
}

/// A rate of change in SI a second, as it is written in a model.
pub(super) fn rate(dimension: Dimension, si: f64) -> String {
    let unit = dimension[0];
    let text = if unit.text.is_empty() { "1" } else { unit.text };
    format!("{:?} {text}/s", unit.of(si))
}
