//! For each sensor what all the others say of it: residuals with which the filter over the others names the one.

use super::{Fusion, Verdict};
use crate::method::{Innovation, Measurement};
use shsa_core::time::Time;

/// A fusion of all sensors, and one without each of them.
///
/// What a sensor measures is no witness about itself, not even through the past of the filter: so a state of its own is kept for
/// the others. A measurement costs one step for each sensor and one more.
pub struct LeaveOneOut {
    all: Fusion,
    without: Vec<Fusion>,
}

impl LeaveOneOut {
    /// Made by a function that makes the same fusion each time, for so many sensors.
    ///
    /// # Errors
    /// Those of the function.
    pub fn new<E>(sensors: usize, make: impl Fn() -> Result<Fusion, E>) -> Result<LeaveOneOut, E> {
        let without = (0..sensors).map(|sensor| {
            let mut fusion = make()?;
            fusion.mask(sensor, true);
            Ok(fusion)
        });
        Ok(LeaveOneOut { without: without.collect::<Result<_, E>>()?, all: make()? })
    }

    /// The fusion of all.
    pub fn all(&mut self) -> &mut Fusion {
        &mut self.all
    }

    /// Takes a measurement in, everywhere.
    pub fn measure(&mut self, at: Time, measurement: Measurement) -> Verdict {
        for fusion in &mut self.without {
            fusion.measure(at, measurement);
        }
        self.all.measure(at, measurement)
    }

    /// A control input has this value from a time on.
    pub fn control(&mut self, at: Time, control: usize, value: f64) {
        self.without.iter_mut().for_each(|fusion| fusion.control(at, control, value));
        self.all.control(at, control, value);
    }

    /// What a sensor measures counts from now on, or does not.
    pub fn mask(&mut self, sensor: usize, is_masked: bool) {
        for (own, fusion) in self.without.iter_mut().enumerate() {
            fusion.mask(sensor, is_masked || own == sensor);
        }
        self.all.mask(sensor, is_masked);
    }

    /// The last measurement of a sensor beside what all the others say of it, and when. `None` where they say nothing.
    #[must_use]
    pub fn innovation(&self, sensor: usize) -> Option<(Time, Innovation)> {
        let fusion = self.without.get(sensor)?;
        fusion.innovation(sensor).filter(|(at, _)| fusion.is_known(*at))
    }
}
