//! Moments so close that they count as one, and the step of the filter over them.
//!
//! Some methods depend on which of two stamps is the earlier one: what one value takes for an outlier, or which particles it
//! leaves, the next one does not see. So that a stamp that is a microsecond off changes nothing, measurements of a *cluster* are
//! stacked in the declared order of their sensors, whatever the order of their stamps, at the newest moment of the cluster.

use super::gate::{Gate, Watch};
use super::moment::{Moment, Taken};
use super::{Fusion, Verdict, derived};
use crate::method::{Measurement, Updated};
use shsa_core::time::{Span, Time};

/// Moments no further apart than this count as one.
const CLOSE: Span = Span(10_000);

/// Whether the second of two moments is close enough to the first.
pub(super) fn is_close(pair: &[Moment]) -> bool {
    matches!(pair, [before, next] if next.at - before.at <= CLOSE)
}

/// The number of moments, in the order of time, that count as one from the first on: each is close to the one before, and none
/// has a sensor or a control input that is in the cluster already. So a sensor at 100 kHz or more loses nothing. Clusters are
/// determined by the moments alone, and not by their order of arrival.
pub(super) fn first_cluster(moments: &[Moment]) -> usize {
    let is_of_it = |place: usize| {
        let (before, next) = (moments.get(..place), moments.get(place));
        let repeats = |next: &Moment| before.is_some_and(|all| all.iter().any(|it| it.has_input_of(next)));
        moments.get(place - 1..=place).is_some_and(is_close) && !next.is_some_and(repeats)
    };
    let others = (1..moments.len()).take_while(|place| is_of_it(*place)).count();
    moments.len().min(1 + others)
}

/// The measurement of a sensor in a cluster that counts, and its stamp.
fn counting(cluster: &mut [Moment], sensor: usize) -> Option<(Time, &mut Taken)> {
    let found =
        cluster.iter_mut().find_map(|moment| Some((moment.at, moment.measured.get_mut(sensor)?.as_mut()?)));
    found.filter(|(_, taken)| !taken.is_masked)
}

impl Fusion {
    /// Computes the moments of a cluster as one: the prediction to the newest, all measurements, all control inputs.
    pub(super) fn step(&mut self, cluster: &mut [Moment], elapsed: Span) {
        if elapsed > Span::ZERO && !self.method.predict(elapsed.seconds(), &self.now.controls) {
            self.now.is_lost = true;
        }
        if elapsed > Span::ZERO {
            self.go_on_doubting(elapsed, None);
        }
        match self.options.gate {
            Some(gate) => self.take_one_by_one(cluster, gate),
            None => self.take_together(cluster),
        }
        cluster.iter_mut().for_each(|moment| self.close(moment));
        self.method.save(&mut self.now.memory);
        cluster.iter_mut().for_each(|moment| moment.is_newest_of_cluster = false);
        if let Some(newest) = cluster.last_mut() {
            newest.after.clone_from(&self.now);
            newest.is_newest_of_cluster = true;
        }
    }

    /// Compares what is masked, and notes what counted and which control inputs begin.
    fn close(&mut self, moment: &mut Moment) {
        for taken in moment.measured.iter_mut().flatten().filter(|taken| taken.is_masked) {
            taken.innovation = self.method.innovation(&taken.measurement, &self.now.controls);
            taken.verdict = Verdict::Masked;
            self.now.watches.get_mut(taken.measurement.sensor).into_iter().for_each(Watch::excuse);
        }
        if moment.measured.iter().flatten().any(|taken| taken.verdict == Verdict::Used) {
            (self.now.last_used, self.now.is_lost) = (Some(moment.at), false);
        }
        for (control, set) in self.now.controls.iter_mut().zip(&moment.set) {
            *control = set.unwrap_or(*control);
        }
    }

    /// Updates with a measurement.
    pub(super) fn update(&mut self, measurement: &Measurement) -> Updated {
        if !self.is_derived(measurement.sensor) {
            return self.method.update(&[*measurement], &self.now.controls);
        }
        let Some(innovation) = self.method.innovation(measurement, &self.now.controls) else {
            return Updated::NOTHING;
        };
        let own = derived::share(self.method.mean().len(), innovation.uncertainty() / innovation.noise);
        if own >= 1.0 {
            return Updated { used: 1, ..Updated::NOTHING };
        }
        self.method.widen(1.0 / own);
        let variance = Some(innovation.noise / (1.0 - own));
        self.method.update(&[Measurement { variance, ..*measurement }], &self.now.controls)
    }

    fn take_together(&mut self, cluster: &mut [Moment]) {
        self.stack.clear();
        let sensors = 0..self.masked.len();
        for sensor in sensors.clone() {
            if let Some((at, taken)) = counting(cluster, sensor) {
                self.welcome(at, &taken.measurement);
            }
        }
        for sensor in sensors.clone() {
            let Some((_, taken)) = counting(cluster, sensor) else { continue };
            taken.innovation = self.method.innovation(&taken.measurement, &self.now.controls);
            taken.verdict = if taken.innovation.is_some() { Verdict::Used } else { Verdict::Rejected };
            if let Some(innovation) = taken.innovation {
                if !self.is_derived(sensor) {
                    self.stack.push(taken.measurement);
                }
                self.now.note(sensor, innovation);
            }
        }
        let mut used = self.method.update(&self.stack, &self.now.controls).used;
        for sensor in sensors.clone() {
            let Some((_, taken)) = counting(cluster, sensor).filter(|_| self.is_derived(sensor)) else {
                continue;
            };
            used += self.update(&taken.measurement).used;
        }
        if used == 0 {
            for sensor in sensors {
                counting(cluster, sensor)
                    .into_iter()
                    .for_each(|(_, taken)| taken.verdict = Verdict::Rejected);
            }
        }
    }

    fn take_one_by_one(&mut self, cluster: &mut [Moment], gate: Gate) {
        for sensor in 0..self.masked.len() {
            let Some((at, taken)) = counting(cluster, sensor) else { continue };
            taken.innovation = self.method.innovation(&taken.measurement, &self.now.controls);
            let is_near = taken.innovation.is_some_and(|it| it.contradiction() <= gate.threshold());
            let is_used = match taken.innovation {
                Some(innovation) if is_near => {
                    self.update(&taken.measurement);
                    self.now.note(sensor, innovation);
                    self.now.accept(sensor, at);
                    self.go_on_doubting(Span::ZERO, Some(&taken.measurement));
                    true
                }
                Some(innovation) => {
                    self.now.reject(&taken.measurement);
                    self.reconsider(sensor, at, gate, innovation)
                }
                None => false,
            };
            taken.verdict = if is_used { Verdict::Used } else { Verdict::Rejected };
        }
    }
}
