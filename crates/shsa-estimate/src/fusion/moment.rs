//! A moment with its measurements, and the state after it.

use super::{Verdict, Watch};
use crate::method::{Innovation, Measurement};
use shsa_core::time::Time;

/// The state that measurements change.
#[derive(Debug)]
pub(super) struct Past {
    /// The memory of the method.
    pub(super) memory: Vec<f64>,
    pub(super) watches: Vec<Watch>,
    /// The control inputs in force.
    pub(super) controls: Vec<f64>,
    pub(super) last_used: Option<Time>,
    /// Whether the model had no value, and no measurement has counted since.
    pub(super) is_lost: bool,
    /// Whether a sensor is in conflict. Then `doubt` is updated: a method's memory, uncertain enough for the sensor to fit.
    pub(super) is_doubted: bool,
    pub(super) doubt: Vec<f64>,
}

// Not derived, as an old doubt is no part of the state.
impl PartialEq for Past {
    fn eq(&self, other: &Past) -> bool {
        let parts = |it: &Past| (it.last_used, it.is_lost, it.is_doubted);
        let is_same = self.memory == other.memory
            && self.watches == other.watches
            && self.controls == other.controls
            && parts(self) == parts(other);
        is_same && (!self.is_doubted || self.doubt == other.doubt)
    }
}

// Not derived, as a derived `clone_from` would allocate.
impl Clone for Past {
    fn clone(&self) -> Past {
        Past {
            memory: self.memory.clone(),
            watches: self.watches.clone(),
            controls: self.controls.clone(),
            doubt: self.doubt.clone(),
            ..*self
        }
    }

    fn clone_from(&mut self, from: &Past) {
        self.memory.clone_from(&from.memory);
        self.watches.clone_from(&from.watches);
        self.controls.clone_from(&from.controls);
        (self.last_used, self.is_lost) = (from.last_used, from.is_lost);
        self.is_doubted = from.is_doubted;
        // An old doubt need not be copied.
        if from.is_doubted {
            self.doubt.clone_from(&from.doubt);
        }
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
            is_doubted: false,
            doubt: vec![0.0; memory_len],
        }
    }

    /// Notes the innovation of a measurement that counts.
    pub(super) fn note(&mut self, sensor: usize, innovation: Innovation) {
        if let Some(watch) = self.watches.get_mut(sensor) {
            watch.note(innovation);
        }
    }

    /// Notes a measurement of this sensor that counts and ends a conflict.
    pub(super) fn accept(&mut self, sensor: usize, at: Time) {
        self.watches.get_mut(sensor).into_iter().for_each(|watch| watch.accept(at));
    }

    /// Notes a rejected measurement.
    pub(super) fn reject(&mut self, measurement: &Measurement) {
        self.watches.get_mut(measurement.sensor).into_iter().for_each(|watch| watch.reject(measurement));
    }

    /// Whether a sensor is in an undecided conflict.
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

/// The measurements and control inputs of a time, and the state after it.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    pub(super) at: Time,
    /// The measurements, by sensor.
    pub(super) measured: Vec<Option<Taken>>,
    /// Control inputs that begin at this moment.
    pub(super) set: Vec<Option<f64>>,
    /// Only the newest moment of a cluster has it.
    pub(super) after: Past,
    pub(super) is_newest_of_cluster: bool,
}

impl Moment {
    pub(super) fn new(after: &Past) -> Moment {
        Moment {
            at: Time(0),
            measured: vec![None; after.watches.len()],
            set: vec![None; after.controls.len()],
            after: after.clone(),
            is_newest_of_cluster: true,
        }
    }

    /// Resets to another moment, without measurements.
    pub(super) fn begin(&mut self, at: Time) {
        self.at = at;
        self.measured.fill(None);
        self.set.fill(None);
    }

    /// Whether a sensor or a control input has a value at both moments.
    pub(super) fn has_input_of(&self, other: &Moment) -> bool {
        let measured = self.measured.iter().zip(&other.measured);
        let set = self.set.iter().zip(&other.set);
        measured.into_iter().any(|(own, other)| own.is_some() && other.is_some())
            || set.into_iter().any(|(own, other)| own.is_some() && other.is_some())
    }

    /// The verdict on a sensor's measurement.
    pub(super) fn verdict(&self, sensor: usize) -> Option<Verdict> {
        Some(self.measured.get(sensor)?.as_ref()?.verdict)
    }
}
