//! Predictions of each sensor by all others: residuals that isolate a faulty sensor.

use super::window::Window;
use super::{Fusion, Verdict};
use crate::method::{Innovation, Measurement};
use shsa_core::time::Time;

/// A fusion of all sensors, and one without each sensor.
///
/// The past measurements of a sensor are no independent witness about it. So each fusion without a sensor keeps a state of its
/// own. A measurement costs one step for each sensor and one more.
pub struct LeaveOneOut {
    all: Fusion,
    without: Vec<Fusion>,
    /// For each sensor, its measurements compared with the predictions by the others.
    windows: Vec<Window>,
}

impl LeaveOneOut {
    /// Fusions made by a function that returns the same fusion each time, for this many sensors.
    ///
    /// # Errors
    /// The errors of the function.
    pub fn new<E>(sensors: usize, make: impl Fn() -> Result<Fusion, E>) -> Result<LeaveOneOut, E> {
        let without = (0..sensors).map(|sensor| {
            let mut fusion = make()?;
            fusion.mask(sensor, true);
            Ok(fusion)
        });
        let without = without.collect::<Result<_, E>>()?;
        Ok(LeaveOneOut { without, all: make()?, windows: vec![Window::default(); sensors] })
    }

    /// The fusion of all sensors.
    pub fn all(&mut self) -> &mut Fusion {
        &mut self.all
    }

    /// Gives a measurement to all fusions.
    pub fn measure(&mut self, at: Time, measurement: Measurement) -> Verdict {
        for fusion in &mut self.without {
            fusion.measure(at, measurement);
        }
        let latest = self.innovation(measurement.sensor).filter(|(taken_at, _)| *taken_at == at);
        if let (Some((_, innovation)), Some(window)) = (latest, self.windows.get_mut(measurement.sensor)) {
            window.note(innovation);
        }
        self.all.measure(at, measurement)
    }

    /// Sets a control input from a time on.
    pub fn control(&mut self, at: Time, control: usize, value: f64) {
        self.without.iter_mut().for_each(|fusion| fusion.control(at, control, value));
        self.all.control(at, control, value);
    }

    /// Sets whether a sensor's measurements count from now on.
    pub fn mask(&mut self, sensor: usize, is_masked: bool) {
        for (own, fusion) in self.without.iter_mut().enumerate() {
            fusion.mask(sensor, is_masked || own == sensor);
        }
        self.all.mask(sensor, is_masked);
    }

    /// The fusion of all sensors but this one.
    pub fn without(&mut self, sensor: usize) -> Option<&mut Fusion> {
        self.without.get_mut(sensor)
    }

    /// The faulty sensor: some sensor departs from all the others by more than this many standard deviations (5 occur once in two
    /// million), and only without this one are the others consistent. A faulty sensor spoils the predictions of others, so the
    /// departing sensor need not be the faulty one. `None` while no sensor departs, or several may be faulty.
    #[must_use]
    pub fn suspect(&self, deviations: f64) -> Option<usize> {
        let departs = |window: &Window| window.mean().is_some_and(|mean| mean.abs() > deviations);
        if !self.windows.iter().any(departs) {
            return None;
        }
        let mut explained =
            self.without.iter().enumerate().filter(|(_, rest)| rest.is_consistent(deviations));
        let (only, _) = explained.next()?;
        explained.next().is_none().then_some(only)
    }

    /// The last measurement of a sensor compared with the prediction by all others, and its time. `None` without a prediction.
    #[must_use]
    pub fn innovation(&self, sensor: usize) -> Option<(Time, Innovation)> {
        let fusion = self.without.get(sensor)?;
        fusion.innovation(sensor).filter(|(at, _)| fusion.is_known(*at))
    }
}
