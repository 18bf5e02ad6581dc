//! A drive: the battery, the car and the sensors, step by step.

use super::battery::{Battery, LIMIT_V};
use super::car::Car;
use super::faults::Fault;
use super::sensors::{Place, STEPS_S, Sensor};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use shsa_core::time::{Span, Time};

/// A step of the simulation.
pub(super) const STEP: Span = Span(1_000_000_000 / STEPS_S as i64);
/// The power is reduced below the first voltage of the lowest cell, down to nothing at the second.
const EASES_V: f64 = 3.35;
const STOPS_V: f64 = 3.0;

/// What a sensor says.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    /// The place of the sensor in [`Place::all`].
    pub(super) index: usize,
    pub(super) value: f64,
}

/// A drive.
pub(super) struct Drive {
    pub(super) step: u64,
    pub(super) battery: Battery,
    /// The sensor that is faulty.
    pub(super) faulty: Option<Place>,
    fault: Fault,
    car: Car,
    motor_a: f64,
    sensors: Vec<Sensor>,
    random: ChaCha8Rng,
}

impl Drive {
    pub(super) fn new(seed: u64, fault: Fault) -> Drive {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let battery = Battery::new(&mut random);
        let sensors = Place::all().map(|place| Sensor::new(place, &mut random)).collect();
        let car = Car::new(&mut random);
        Drive { step: 0, battery, faulty: None, fault, car, motor_a: 0.0, sensors, random }
    }

    pub(super) fn now(&self) -> Time {
        Time(self.step as i64 * STEP.0)
    }

    /// Goes on by a step, with as much power as the lowest voltage that is known permits.
    pub(super) fn go_on(&mut self, shown_lowest_v: f64) {
        self.step += 1;
        let share = ((shown_lowest_v - STOPS_V) / (EASES_V - STOPS_V)).clamp(0.0, 1.0);
        let power_w = self.car.drive(share, STEP.seconds(), &mut self.random);
        let voltage_v = self.battery.voltage_v();
        self.motor_a = power_w / voltage_v;
        self.battery.pass(self.motor_a + self.car.standby_w / voltage_v, STEP.seconds());
    }

    /// Whether a cell is below its limit.
    pub(super) fn is_below_limit(&self) -> bool {
        self.battery.lowest_v() < LIMIT_V
    }

    /// From now on the fault is there.
    pub(super) fn begin_fault(&mut self) {
        self.faulty = self.fault.place(&self.battery);
        if self.fault == Fault::CellWeak {
            self.battery.weaken();
        }
    }

    /// What the sensors say in this step.
    pub(super) fn readings(&mut self) -> Vec<Reading> {
        let (step, faulty, fault) = (self.step, self.faulty, self.fault);
        let (battery, motor_a, random) = (&self.battery, self.motor_a, &mut self.random);
        let due = self.sensors.iter().enumerate().filter(|(_, sensor)| sensor.place.is_due(step));
        let reading = |(index, sensor): (usize, &Sensor)| {
            let place = sensor.place;
            let value = sensor.read(place.truth(battery, motor_a), random);
            let said = if faulty == Some(place) { fault.said(value) } else { Some(value) };
            said.map(|value| Reading { index, value })
        };
        due.filter_map(reading).collect()
    }
}
