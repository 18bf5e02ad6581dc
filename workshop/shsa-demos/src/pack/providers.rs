//! What the car is shown: by the engine, or by each sensor as it is.

use super::battery::CAPACITY_C;
use super::drive::{Reading, STEP};
use super::model::model;
use super::sensors::Place;
use super::values::Values;
use shsa_core::engine::Options;
use shsa_core::knowledge::{NeedId, SignalId};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_demo::DemoError;
use shsa_demo::{Healed, Healer};

/// Without the engine: what was said last stands, and the shunt is counted.
pub(super) struct Sensors {
    said: Vec<Option<f64>>,
    places: Vec<Place>,
    charge: f64,
}

impl Sensors {
    /// It knows the charge of the beginning.
    pub(super) fn new(charge: f64) -> Sensors {
        let places: Vec<Place> = Place::all().collect();
        Sensors { said: vec![None; places.len()], places, charge }
    }

    /// Takes in what is said in a step; returns what is shown.
    pub(super) fn show(&mut self, readings: &[Reading]) -> Values {
        for reading in readings {
            if let Some(said) = self.said.get_mut(reading.index) {
                *said = Some(reading.value);
            }
        }
        let current = self.of(|place| place == Place::Shunt).next().unwrap_or_default();
        self.charge -= current * STEP.seconds() / CAPACITY_C;
        Values {
            charge: self.charge,
            current,
            voltage: self.of(|place| place == Place::Voltage).next().unwrap_or_default(),
            lowest: self.of(|place| matches!(place, Place::Cell(_))).fold(f64::INFINITY, f64::min),
            hottest: self
                .of(|place| matches!(place, Place::Temperature(_)))
                .fold(f64::NEG_INFINITY, f64::max),
        }
    }

    fn of(&self, wanted: fn(Place) -> bool) -> impl Iterator<Item = f64> {
        let sensors = self.places.iter().zip(&self.said).filter(move |(place, _)| wanted(**place));
        sensors.filter_map(|(_, said)| *said)
    }
}

/// The engine, with the signal of each sensor and the time of the newest value of each need.
pub(super) struct Engine {
    healer: Healer,
    signals: Vec<Option<SignalId>>,
    needs: Vec<Need>,
}

struct Need {
    id: NeedId,
    name: String,
    last: Time,
}

impl Engine {
    /// # Errors
    /// [`DemoError::Model`] when the model has errors, which tests exclude.
    pub(super) fn new() -> Result<Engine, DemoError> {
        let healer = Healer::new(&model(), "models/pack.yaml", Options::default())?;
        let signal = |place: Place| {
            let name = place.name();
            healer.sources().find(|(_, source)| *source == name).map(|(id, _)| id)
        };
        let signals = Place::all().map(signal).collect();
        let needs =
            healer.needs().map(|(id, name)| Need { id, name: name.to_owned(), last: Time(0) }).collect();
        Ok(Engine { healer, signals, needs })
    }

    /// Takes in what is said at a time; returns values and decisions.
    pub(super) fn heal(&mut self, readings: &[Reading], now: Time) -> Vec<Healed> {
        for reading in readings {
            if let Some(&Some(signal)) = self.signals.get(reading.index) {
                self.healer.observe(signal, now, now, RawValue::Number(reading.value));
            }
        }
        self.healer.pass(now);
        std::iter::from_fn(|| self.healer.poll()).collect()
    }

    /// The variable of a need that has a new value now.
    pub(super) fn served(&mut self, id: NeedId, now: Time) -> Option<&str> {
        let need = self.needs.iter_mut().find(|need| need.id == id)?;
        need.last = now;
        Some(&need.name)
    }

    /// The longest time that a need waits for a new value.
    pub(super) fn gap(&self, now: Time) -> Span {
        self.needs.iter().map(|need| now - need.last).max().unwrap_or(Span(0))
    }
}
