//! For each sensor what all the others say of it: residuals with which the filter over the others names the one.

use super::window::Window;
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
    /// Of each sensor what it measured beside what the others said.
    windows: Vec<Window>,
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
        let without = without.collect::<Result<_, E>>()?;
        Ok(LeaveOneOut { without, all: make()?, windows: vec![Window::default(); sensors] })
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
        let heard = self.innovation(measurement.sensor).filter(|(heard_at, _)| *heard_at == at);
        if let (Some((_, innovation)), Some(window)) = (heard, self.windows.get_mut(measurement.sensor)) {
            window.note(innovation);
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

    /// The fusion of all others than this sensor.
    pub fn without(&mut self, sensor: usize) -> Option<&mut Fusion> {
        self.without.get_mut(sensor)
    }

    /// How far the last 16 measurements of a sensor lie off from what all the others say, on average, in standard deviations of a
    /// single one. While all is well its variance is at most 1, however much the errors of the others go together. `None` of
    /// fewer, or where the others say nothing.
    #[must_use]
    pub fn departure(&self, sensor: usize) -> Option<f64> {
        self.windows.get(sensor)?.mean()
    }

    /// The sensor that lies: some sensor departs from all the others by more than so many standard deviations (5 is once in two
    /// million), and only without this one do the others agree with each other. A liar makes others depart from what it has spoilt,
    /// so who departs need not be it. `None` while nobody departs, or more than one may be it.
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

    /// The last measurement of a sensor beside what all the others say of it, and when. `None` where they say nothing.
    #[must_use]
    pub fn innovation(&self, sensor: usize) -> Option<(Time, Innovation)> {
        let fusion = self.without.get(sensor)?;
        fusion.innovation(sensor).filter(|(at, _)| fusion.is_known(*at))
    }
}
