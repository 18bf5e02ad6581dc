//! A moment with its measurements, and all that holds after it.

use super::{Verdict, Watch};
use crate::method::{Innovation, Measurement};
use shsa_core::time::Time;

/// All that changes with measurements.
#[derive(Debug, PartialEq)]
pub(super) struct Past {
    /// Of the method.
    pub(super) memory: Vec<f64>,
    pub(super) watches: Vec<Watch>,
    /// The control inputs in force.
    pub(super) controls: Vec<f64>,
    pub(super) last_used: Option<Time>,
    /// The model had no value, and no measurement has counted since.
    pub(super) is_lost: bool,
}

// Written out: a derived `clone_from` would allocate.
impl Clone for Past {
    fn clone(&self) -> Past {
        Past {
            memory: self.memory.clone(),
            watches: self.watches.clone(),
            controls: self.controls.clone(),
            ..*self
        }
    }

    fn clone_from(&mut self, from: &Past) {
        self.memory.clone_from(&from.memory);
        self.watches.clone_from(&from.watches);
        self.controls.clone_from(&from.controls);
        (self.last_used, self.is_lost) = (from.last_used, from.is_lost);
    }
}

impl Past {
    pub(super) fn new(memory_len: usize, sensors: usize, controls: usize) -> Past {
        Past {
            memory: vec![0.0; memory_len],
            watches: vec![Watch::default(); sensors],
            controls: vec![0.0; controls],
            last_used: None,
            is_lost: false,
        }
    }

    /// Notes the innovation of a measurement that counts.
    pub(super) fn note(&mut self, sensor: usize, innovation: Innovation) {
        if let Some(watch) = self.watches.get_mut(sensor) {
            watch.note(innovation);
        }
    }

    /// A measurement of this sensor counts: it is no more in conflict, and the others have been backed by it.
    pub(super) fn accept(&mut self, sensor: usize) {
        for (place, watch) in self.watches.iter_mut().enumerate() {
            watch.accept(place == sensor);
        }
    }

    /// A measurement is too far off.
    pub(super) fn reject(&mut self, measurement: &Measurement, innovation: Innovation) {
        if let Some(watch) = self.watches.get_mut(measurement.sensor) {
            watch.reject(measurement, innovation);
        }
    }

    /// Whether a sensor is in conflict and nothing decides it.
    pub(super) fn is_doubtful(&self) -> bool {
        self.watches.iter().any(|watch| watch.is_undecided)
    }
}

/// A measurement at its moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taken {
    pub(super) measurement: Measurement,
    pub(super) is_masked: bool,
    pub(super) innovation: Option<Innovation>,
    pub(super) verdict: Verdict,
}

impl Taken {
    pub(super) fn new(measurement: Measurement, is_masked: bool) -> Taken {
        Taken { measurement, is_masked, innovation: None, verdict: Verdict::Rejected }
    }
}

/// What was measured and set at one time, and what holds after it.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    pub(super) at: Time,
    /// By sensor.
    pub(super) measured: Vec<Option<Taken>>,
    /// Control inputs that begin here.
    pub(super) set: Vec<Option<f64>>,
    pub(super) after: Past,
}

impl Moment {
    pub(super) fn new(after: &Past) -> Moment {
        Moment {
            at: Time(0),
            measured: vec![None; after.watches.len()],
            set: vec![None; after.controls.len()],
            after: after.clone(),
        }
    }

    /// Becomes another moment, without measurements.
    pub(super) fn begin(&mut self, at: Time) {
        self.at = at;
        self.measured.fill(None);
        self.set.fill(None);
    }

    /// What became of a sensor's measurement.
    pub(super) fn verdict(&self, sensor: usize) -> Option<Verdict> {
        Some(self.measured.get(sensor)?.as_ref()?.verdict)
    }
}
