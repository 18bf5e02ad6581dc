//! Sensors that repeat their last value.
//!
//! A steady quantity makes a sensor that is well repeat itself, too: that it does is no evidence. So a copy for which a sensor is stuck
//! leaves the repeated value out, and gets for it the greatest density that the most probable copy for which the sensor is well gives to
//! any value, after the other values of the moment: as much as where that copy expects just this value. What decides is how surprised each copy is, by this value and by those
//! of the other sensors. A value that changes shows that its sensor is not stuck.

use super::{Fault, Hypotheses};
use crate::method::{Measurement, Tally, Updated};

/// The last value of a sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Last {
    /// Not-a-number before the first one.
    pub(super) value: f64,
    /// Whether the present moment repeats it.
    pub(super) is_repeated: bool,
    /// What counts for a repeated value that is left out.
    pub(super) expected: Updated,
}

impl Last {
    pub(super) const NONE: Last = Last { value: f64::NAN, is_repeated: false, expected: Updated::NOTHING };
}

impl Hypotheses {
    /// Notes which sensors repeat their values. Those that do not are stuck no more.
    pub(super) fn compare(&mut self, measurements: &[Measurement]) {
        self.last.iter_mut().for_each(|last| last.is_repeated = false);
        for measurement in measurements {
            let Some(last) = self.last.get_mut(measurement.sensor) else { continue };
            last.is_repeated = last.value.to_bits() == measurement.value.to_bits();
            last.value = measurement.value;
            if !last.is_repeated {
                self.clear(measurement.sensor);
            }
        }
    }

    /// A sensor is not stuck: the copies of this fault end, and no other one takes it for stuck.
    fn clear(&mut self, sensor: usize) {
        for fault in 0..self.faults.all.len() {
            if self.faults.all.get(fault) != Some(&Fault::Stuck(sensor)) {
                continue;
            }
            for copy in self.copies.iter_mut().take(self.count) {
                if copy.has(fault) && copy.fault == Some(fault) {
                    copy.weight = f64::NEG_INFINITY;
                }
                copy.faulty &= !(1 << fault);
            }
        }
    }

    /// Whether a fault of a group may begin, or end, at this moment. A filter with one working sensor only asks whether the stuck ones
    /// work again.
    pub(super) fn may_happen(&self, group: usize, fault: usize) -> bool {
        let own = self.copies.get(group).is_some_and(|copy| copy.has(fault));
        match self.faults.all.get(fault) {
            Some(Fault::Stuck(sensor)) => self.is_repeated(*sensor) && (own || self.working(group) > 1),
            _ => self.working(group) > 1 || self.last.len() < 2,
        }
    }

    /// The number of sensors that are not silent, nor stuck for the copy of a group that is without a fault since it began.
    fn working(&self, group: usize) -> usize {
        let is_stuck = |sensor: usize| {
            let mut faults = self.faults.all.iter().enumerate();
            let own = self.copies.get(group);
            faults.any(|(at, it)| *it == Fault::Stuck(sensor) && own.is_some_and(|copy| copy.has(at)))
        };
        let silent = self.silent.iter().enumerate();
        silent.filter(|(sensor, silent)| **silent <= self.within && !is_stuck(*sensor)).count()
    }

    fn is_repeated(&self, sensor: usize) -> bool {
        self.last.get(sensor).is_some_and(|last| last.is_repeated)
    }

    /// Notes what counts for the repeated values where they are left out.
    pub(super) fn expect_repeated(&mut self, measurements: &[Measurement], controls: &[f64]) {
        for fault in 0..self.faults.all.len() {
            let Some(Fault::Stuck(sensor)) = self.faults.all.get(fault).copied() else { continue };
            let measurement = measurements.iter().find(|it| it.sensor == sensor);
            let Some(measurement) = measurement.filter(|_| self.is_repeated(sensor)) else { continue };
            let place = self.heaviest(|copy| !copy.has(fault));
            self.restore_from(place);
            self.stack(place, measurements.iter().filter(|it| it.sensor != sensor), controls);
            self.filter.update(&self.stack, controls);
            self.stack(place, std::iter::once(measurement), controls);
            let stacked = self.stack.first().copied();
            let innovation = stacked.and_then(|it| self.filter.innovation(&it, controls));
            let expected = innovation.map_or(Updated::NOTHING, |it| {
                let mut tally = Tally::NOTHING;
                tally.count(0.0, it.variance);
                tally.updated(false)
            });
            self.last.get_mut(sensor).into_iter().for_each(|last| last.expected = expected);
        }
    }

    /// What counts for a value that a copy leaves out because its sensor is stuck; `None`: it does not.
    pub(super) fn left_out(&self, place: usize, sensor: usize) -> Option<Updated> {
        let copy = self.copies.get(place)?;
        let mut faults = self.faults.all.iter().enumerate();
        let is_stuck = faults.any(|(fault, it)| *it == Fault::Stuck(sensor) && copy.has(fault));
        self.last.get(sensor).filter(|_| is_stuck).map(|last| last.expected)
    }
}
