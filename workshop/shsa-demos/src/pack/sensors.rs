//! The sensors: what they measure, how often, and how wrong they are at most. The figures are those of the model.

use super::battery::Battery;
use super::model::{CELLS, MODULES};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Steps of the simulation in a second.
pub(super) const STEPS_S: u64 = 10;

/// A sensor, by what it measures. Modules and cells count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Shunt,
    Hall,
    Inverter,
    Voltage,
    Module(usize),
    Temperature(usize),
    Cell(usize),
}

impl Place {
    /// All sensors.
    pub(super) fn all() -> impl Iterator<Item = Place> {
        let modules = (0..MODULES).flat_map(|module| [Place::Module(module), Place::Temperature(module)]);
        let cells = (0..MODULES * CELLS).map(Place::Cell);
        [Place::Shunt, Place::Hall, Place::Inverter, Place::Voltage].into_iter().chain(modules).chain(cells)
    }

    /// The name of its signal in the model.
    pub(super) fn name(self) -> String {
        match self {
            Place::Shunt => "/pack/shunt".to_owned(),
            Place::Hall => "/pack/hall".to_owned(),
            Place::Inverter => "/inverter/current".to_owned(),
            Place::Voltage => "/pack/voltage".to_owned(),
            Place::Module(module) => format!("/module/{}/voltage", module + 1),
            Place::Temperature(module) => format!("/module/{}/temperature", module + 1),
            Place::Cell(cell) => format!("/module/{}/cell/{}", cell / CELLS + 1, cell % CELLS + 1),
        }
    }

    /// Whether it measures in a step.
    pub(super) fn is_due(self, step: u64) -> bool {
        let every = match self {
            Place::Shunt | Place::Hall | Place::Inverter | Place::Voltage => 1,
            Place::Module(_) | Place::Cell(_) => STEPS_S / 2,
            Place::Temperature(_) => STEPS_S,
        };
        step.is_multiple_of(every)
    }

    /// The largest error of a reading.
    fn bound(self, value: f64) -> f64 {
        match self {
            Place::Shunt => 0.3 + 0.003 * value.abs(),
            Place::Hall => 1.0 + 0.01 * value.abs(),
            Place::Inverter => 2.0 + 0.02 * value.abs(),
            Place::Voltage => 0.5,
            Place::Module(_) => 0.05,
            Place::Temperature(_) => 1.0,
            Place::Cell(_) => 0.002,
        }
    }

    /// What a sensor without errors would show, A, V or degC.
    pub(super) fn truth(self, battery: &Battery, motor_a: f64) -> f64 {
        let cells = |from, count| battery.voltages_v().skip(from).take(count).sum::<f64>();
        match self {
            Place::Shunt | Place::Hall => battery.current_a,
            Place::Inverter => motor_a,
            Place::Voltage => battery.voltage_v(),
            Place::Module(module) => cells(module * CELLS, CELLS),
            Place::Temperature(module) => {
                battery.temperatures_k.get(module).map_or(f64::NAN, |warmth| warmth - 273.15)
            }
            Place::Cell(cell) => cells(cell, 1),
        }
    }
}

/// A sensor with an error that stays and one that changes; together they are within the bound.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    pub(super) place: Place,
    lasting: f64,
}

impl Sensor {
    pub(super) fn new(place: Place, random: &mut ChaCha8Rng) -> Sensor {
        Sensor { place, lasting: random.random_range(-0.6..0.6) }
    }

    /// A reading.
    pub(super) fn read(&self, value: f64, random: &mut ChaCha8Rng) -> f64 {
        value + self.place.bound(value) * (self.lasting + random.random_range(-0.4..0.4))
    }
}
