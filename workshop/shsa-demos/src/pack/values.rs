//! The five numbers that the car needs, as values or as errors of them.

use super::battery::Battery;
use super::sensors::Place;

/// The five numbers that the car needs of its battery; or the errors of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Values {
    /// The charge, a share.
    pub charge: f64,
    /// The current, A.
    pub current: f64,
    /// The voltage of the battery, V.
    pub voltage: f64,
    /// The lowest voltage of a cell, V.
    pub lowest: f64,
    /// The temperature of the hottest module, degC; an error in K.
    pub hottest: f64,
}

impl Values {
    /// What is true.
    pub(super) fn of(battery: &Battery) -> Values {
        Values {
            charge: battery.charge(),
            current: battery.current_a,
            voltage: battery.voltage_v(),
            lowest: battery.lowest_v(),
            hottest: Place::Temperature(battery.hottest()).truth(battery, 0.0),
        }
    }

    /// The number of a need of the model.
    pub(super) fn need(&mut self, name: &str) -> Option<&mut f64> {
        match name {
            "charge" => Some(&mut self.charge),
            "current" => Some(&mut self.current),
            "pack_voltage" => Some(&mut self.voltage),
            "lowest" => Some(&mut self.lowest),
            "hottest" => Some(&mut self.hottest),
            _ => None,
        }
    }

    /// The larger errors of two.
    pub(super) fn worse(self, errors: Values) -> Values {
        Values {
            charge: self.charge.max(errors.charge.abs()),
            current: self.current.max(errors.current.abs()),
            voltage: self.voltage.max(errors.voltage.abs()),
            lowest: self.lowest.max(errors.lowest.abs()),
            hottest: self.hottest.max(errors.hottest.abs()),
        }
    }

    /// How far these are from the truth.
    pub(super) fn beside(self, truth: Values) -> Values {
        Values {
            charge: self.charge - truth.charge,
            current: self.current - truth.current,
            voltage: self.voltage - truth.voltage,
            lowest: self.lowest - truth.lowest,
            hottest: self.hottest - truth.hottest,
        }
    }
}
