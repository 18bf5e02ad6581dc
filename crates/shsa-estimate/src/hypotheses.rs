//! Hypotheses of sudden faults beside a filter: a state that has jumped, such as the offset of a sensor, or an input that has become
//! noisier, or repeats its last value.
//!
//! A filter that expects an offset to change slowly explains a sudden fault by its other states, and takes long to return. So with
//! each moment a copy of the filter sets out for each fault as if it had happened since the moment before: with the variance of the
//! jump added to the state, or with more noise of the input. All copies get the same measurements, and are weighted by the density
//! that each gave to them and by how seldom its fault is. The estimate is the mixture of all. A fault that has nearly all of the
//! weight is taken for true: its copy becomes the filter, and the others end. Of copies whose ages are close, the better one gets the
//! weight of both, so that those of a fault are spread evenly over the logarithm of its age: evidence that takes long needs no exact
//! beginning.
//!
//! This is a bank of filters for abrupt changes: A. Willsky 1976 (doi:10.1016/0005-1098(76)90041-8); H. Blom, Y. Bar-Shalom 1988
//! (doi:10.1109/9.1299) treat models that change back and forth. O(F) filters for F faults, no allocation after construction.

mod stuck;
mod weights;

use crate::matrix::{at, put};
use crate::method::{Gaussian, Innovation, Measurement, Method, Updated};
use crate::mixture::{Part, mix};
use stuck::Last;

/// A fault that may happen at any time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A state jumps, with this standard deviation.
    Jump(usize, f64),
    /// The standard deviation of a sensor's noise is so many times as large from now on, or again as declared.
    Noisier(usize, f64),
    /// A sensor repeats its last value, whatever it should show, or works again.
    Stuck(usize),
}

/// The most faults: each has a bit.
const MOST_FAULTS: usize = 64;
/// The most copies for each fault.
const MOST: usize = 8;
/// The degrees of freedom of the density by which copies are weighted.
const DEGREES: f64 = 4.0;

/// A copy of the filter.
#[derive(Clone, Debug)]
struct Hypothesis {
    memory: Vec<f64>,
    /// The logarithm of its weight.
    weight: f64,
    /// The place of its fault; `None`: nothing has happened.
    fault: Option<usize>,
    /// How long ago its fault began, in seconds.
    age: f64,
    /// The sensors that are noisier or stuck, as bits by the places of the faults.
    faulty: u64,
}

impl Hypothesis {
    /// How many numbers stand beside the memory of the filter.
    const BESIDE: usize = 4;

    fn becomes(&mut self, other: &Hypothesis) {
        self.memory.copy_from_slice(&other.memory);
        (self.weight, self.fault, self.age, self.faulty) =
            (other.weight, other.fault, other.age, other.faulty);
    }

    fn has(&self, fault: usize) -> bool {
        self.faulty >> fault & 1 == 1
    }
}

/// A filter and its copies.
pub struct Hypotheses {
    filter: Box<dyn Method>,
    faults: Vec<Fault>,
    /// The mean time between two faults of a kind, in seconds.
    every: f64,
    /// Those in use come first; the first one is without a fault since it began.
    copies: Vec<Hypothesis>,
    count: usize,
    /// The time since copies set out last.
    elapsed: f64,
    /// The time since the last measurement of each sensor, and for how long a sensor bears witness after one; in seconds.
    silent: Vec<f64>,
    within: f64,
    last: Vec<Last>,
    estimate: Gaussian,
    stack: Vec<Measurement>,
    /// Whether the density of the filter is that of a mixture with outliers.
    knows_outliers: bool,
}

impl Hypotheses {
    /// Hypotheses beside a filter over a number of sensors whose memory begins with its mean and covariance, for 64 faults at most, each
    /// of which happens about once in `every` seconds. A sensor bears witness for `within` seconds after a measurement.
    #[must_use]
    pub fn new(
        filter: Box<dyn Method>,
        sensors: usize,
        mut faults: Vec<Fault>,
        every: f64,
        within: f64,
    ) -> Hypotheses {
        faults.truncate(MOST_FAULTS);
        let mut memory = vec![0.0; filter.memory_len()];
        filter.save(&mut memory);
        let first = Hypothesis { memory, weight: 0.0, fault: None, age: 0.0, faulty: 0 };
        Hypotheses {
            estimate: filter.gaussian().clone(),
            knows_outliers: filter.knows_outliers(),
            filter,
            copies: vec![first; 1 + faults.len() * (MOST + 1)],
            count: 1,
            elapsed: 0.0,
            silent: vec![0.0; sensors],
            within,
            last: vec![Last::NONE; sensors],
            stack: Vec::with_capacity(sensors),
            faults,
            every,
        }
    }

    /// Notes which sensors are measured. Returns whether the others are all silent: what a lone sensor shows is no evidence of its
    /// faults, but of how little is known of what it measures. A filter with one sensor in all has no better evidence.
    fn is_alone(&mut self, measurements: &[Measurement]) -> bool {
        for measurement in measurements {
            self.silent.get_mut(measurement.sensor).into_iter().for_each(|silent| *silent = 0.0);
        }
        self.silent.len() > 1 && self.silent.iter().filter(|silent| **silent <= self.within).count() < 2
    }

    /// A copy sets out for each fault.
    fn set_out(&mut self) {
        let share = (std::mem::take(&mut self.elapsed) / self.every).min(1.0);
        for place in 0..self.faults.len() {
            if !self.may_happen(place) {
                continue;
            }
            let Some((used, free)) = self.copies.split_at_mut_checked(self.count) else { return };
            let (Some(own), Some(copy)) = (used.first(), free.first_mut()) else { return };
            copy.becomes(own);
            (copy.fault, copy.age, copy.weight) = (Some(place), 0.0, own.weight + libm::log(share));
            match self.faults.get(place) {
                Some(Fault::Jump(state, size)) => {
                    self.filter.restore(&copy.memory);
                    let spread = &mut self.filter.gaussian_mut().spread;
                    put(spread, *state, *state, at(spread, *state, *state) + size * size);
                    self.filter.save(&mut copy.memory);
                }
                _ => copy.faulty ^= 1 << place,
            }
            self.count += 1;
        }
    }

    /// Updates a copy, without its weight where the measurements are no evidence.
    fn update_one(
        &mut self,
        place: usize,
        measurements: &[Measurement],
        controls: &[f64],
        is_alone: bool,
    ) -> Updated {
        let left_out = self.stack_for(place, measurements, controls);
        let updated = self.filter.update(&self.stack, controls);
        let density = self.evidence(&together(&updated, &left_out));
        let Some(copy) = self.copies.get_mut(place) else { return Updated::NOTHING };
        self.filter.save(&mut copy.memory);
        copy.weight += if is_alone { 0.0 } else { density };
        updated
    }

    /// Restores the filter of a copy, and stacks the measurements as the copy takes them. Returns what counts for those that it leaves out.
    fn stack_for(&mut self, place: usize, measurements: &[Measurement], controls: &[f64]) -> Updated {
        self.stack.clear();
        let mut left_out = Updated::NOTHING;
        let Some(copy) = self.copies.get(place) else { return left_out };
        self.filter.restore(&copy.memory);
        for measurement in measurements {
            if let Some(own) = self.left_out(place, measurement.sensor) {
                left_out = together(&left_out, &own);
                continue;
            }
            let mut measurement = *measurement;
            for (fault, it) in self.faults.iter().enumerate() {
                let Fault::Noisier(sensor, times) = it else { continue };
                if *sensor == measurement.sensor && copy.has(fault) {
                    let known = self.filter.innovation(&measurement, controls).map(|it| it.noise);
                    measurement.variance = known.map(|own| own * times * times).or(measurement.variance);
                }
            }
            self.stack.push(measurement);
        }
        left_out
    }

    /// The logarithm of the density of the innovations of a moment. Where the filter does not know outliers it is that of Student's t with
    /// [`DEGREES`] instead of the normal one: an outlier, which all copies have alike, is no evidence for a fault.
    fn evidence(&self, updated: &Updated) -> f64 {
        if self.knows_outliers {
            return updated.log_likelihood;
        }
        let (square, used) = (updated.normalized_square, updated.used as f64);
        updated.log_likelihood + 0.5 * square - 0.5 * (DEGREES + used) * libm::log1p(square / DEGREES)
    }

    fn used(&self) -> &[Hypothesis] {
        self.copies.get(..self.count).unwrap_or(&[])
    }

    /// The mean and the covariance of all copies.
    fn mix(&mut self) {
        let n = self.estimate.mean.len();
        let used = self.copies.get(..self.count).unwrap_or(&[]).iter();
        let parts = used.filter_map(|copy| {
            let (mean, spread) = copy.memory.split_at_checked(n)?;
            Some(Part { weight: copy.weight, mean, spread })
        });
        mix(&mut self.estimate, parts);
    }

    /// Changes the filter of each copy.
    fn each(&mut self, mut change: impl FnMut(&mut dyn Method) -> bool) -> bool {
        let mut is_first_done = false;
        for (place, copy) in self.copies.iter_mut().enumerate().take(self.count) {
            self.filter.restore(&copy.memory);
            if change(self.filter.as_mut()) {
                self.filter.save(&mut copy.memory);
                is_first_done |= place == 0;
            } else if place == 0 {
                return false;
            } else {
                copy.weight = f64::NEG_INFINITY;
            }
        }
        is_first_done
    }
}

impl Method for Hypotheses {
    fn gaussian(&self) -> &Gaussian {
        &self.estimate
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        &mut self.estimate
    }

    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool {
        if !self.each(|filter| filter.predict(dt, controls)) {
            return false;
        }
        self.elapsed += dt;
        self.silent.iter_mut().for_each(|silent| *silent += dt);
        self.copies.iter_mut().take(self.count).for_each(|copy| copy.age += dt);
        self.mix();
        true
    }

    /// Against the most probable copy.
    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation> {
        let used = self.copies.get(..self.count)?;
        let best = used.iter().max_by(|one, other| one.weight.total_cmp(&other.weight))?;
        self.filter.restore(&best.memory);
        self.filter.innovation(measurement, controls)
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        if measurements.is_empty() {
            return Updated::NOTHING;
        }
        let is_alone = self.is_alone(measurements);
        self.compare(measurements);
        if self.elapsed > 0.0 && !is_alone {
            self.set_out();
        }
        self.expect_repeated(measurements, controls);
        let updated = self.update_one(0, measurements, controls, is_alone);
        for place in 1..self.count {
            self.update_one(place, measurements, controls, is_alone);
        }
        if !is_alone {
            self.weigh();
            self.thin_out();
        }
        self.mix();
        updated
    }

    fn widen(&mut self, factor: f64) {
        self.each(|filter| {
            filter.widen(factor);
            true
        });
        self.mix();
    }

    fn is_gaussian(&self) -> bool {
        false
    }

    fn concludes(&self) -> bool {
        true
    }

    fn memory_len(&self) -> usize {
        let Gaussian { mean, spread } = &self.estimate;
        let own = self.filter.memory_len() + Hypothesis::BESIDE;
        2 + self.silent.len() + self.last.len() + self.copies.len() * own + mean.len() + spread.len()
    }

    fn save(&self, memory: &mut [f64]) {
        let Gaussian { mean, spread } = &self.estimate;
        let head = [self.count as f64, self.elapsed];
        let Some(rest) = put_first(memory, &head).and_then(|rest| put_first(rest, &self.silent)) else {
            return;
        };
        let Some((values, rest)) = rest.split_at_mut_checked(self.last.len()) else { return };
        values.iter_mut().zip(&self.last).for_each(|(to, last)| *to = last.value);
        let Some(rest) = put_first(rest, mean).and_then(|rest| put_first(rest, spread.as_slice())) else {
            return;
        };
        let own = self.filter.memory_len() + Hypothesis::BESIDE;
        for (to, copy) in rest.chunks_exact_mut(own).zip(self.used()) {
            let fault = copy.fault.map_or(-1.0, |fault| fault as f64);
            let beside = [copy.weight, fault, copy.age, f64::from_bits(copy.faulty)];
            put_first(to, &beside).and_then(|to| put_first(to, &copy.memory));
        }
    }

    fn restore(&mut self, memory: &[f64]) {
        let Gaussian { mean, spread } = &mut self.estimate;
        let own = self.filter.memory_len() + Hypothesis::BESIDE;
        let Some(([count, elapsed], rest)) = memory.split_first_chunk() else { return };
        (self.count, self.elapsed) = ((*count as usize).clamp(1, self.copies.len()), *elapsed);
        let Some((silent, rest)) = rest.split_at_checked(self.silent.len()) else { return };
        self.silent.copy_from_slice(silent);
        let Some((values, rest)) = rest.split_at_checked(self.last.len()) else { return };
        self.last
            .iter_mut()
            .zip(values)
            .for_each(|(last, value)| *last = Last { value: *value, ..Last::NONE });
        let Some((own_mean, rest)) = rest.split_at_checked(mean.len()) else { return };
        let Some((own_spread, rest)) = rest.split_at_checked(spread.len()) else { return };
        mean.copy_from_slice(own_mean);
        spread.as_mut_slice().copy_from_slice(own_spread);
        for (from, copy) in rest.chunks_exact(own).zip(self.copies.iter_mut().take(self.count)) {
            let Some(([weight, fault, age, faulty], saved)) = from.split_first_chunk() else { return };
            (copy.weight, copy.age, copy.faulty) = (*weight, *age, faulty.to_bits());
            copy.fault = (*fault >= 0.0).then_some(*fault as usize);
            copy.memory.copy_from_slice(saved);
        }
    }
}

/// The innovations of two updates as those of one.
fn together(one: &Updated, other: &Updated) -> Updated {
    Updated {
        used: one.used + other.used,
        normalized_square: one.normalized_square + other.normalized_square,
        log_likelihood: one.log_likelihood + other.log_likelihood,
        healed: one.healed || other.healed,
    }
}

/// Copies numbers to the begin of a memory; returns the rest.
fn put_first<'m>(memory: &'m mut [f64], numbers: &[f64]) -> Option<&'m mut [f64]> {
    let (own, rest) = memory.split_at_mut_checked(numbers.len())?;
    own.copy_from_slice(numbers);
    Some(rest)
}

#[cfg(test)]
mod tests;
