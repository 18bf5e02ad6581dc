//! Hypotheses of sudden faults beside a filter: a state that has jumped, such as the offset of a sensor, or an input that has become
//! noisier, or repeats its last value.
//!
//! A filter that expects an offset to change slowly explains a sudden fault by its other states, and takes long to return. So with
//! each moment a copy of the filter sets out for each fault as if it had happened since the moment before: with the variance of the
//! jump added to the state, or with more noise of the input. All copies get the same measurements, and are weighted by the density
//! that each gave to them and by how seldom its fault is. The estimate is the mixture of all. Of copies whose ages are close, the better
//! one gets the weight of both, so that those of a fault are spread evenly over the logarithm of its age: evidence that takes long needs
//! no exact beginning.
//!
//! One sensor fails, sooner or later in several ways; that two fail is rarer by far. So the faults of each sensor are a group, which
//! holds that all others are well. A fault that has nearly all of the weight of its group is taken for true there: its copy becomes
//! the filter of the group, and the other copies of the group end. The groups keep their weights, so that which sensor fails is open
//! until the evidence of the whole time has decided it, and what has been taken for true of a sensor that is well costs nothing then.
//! A group without weight begins anew at the best copy of all, as the hypothesis that its sensor fails, too.
//!
//! Where measurements are closer in time than the errors of the model last, what one of them shows is what the one before has shown
//! already: each counts as evidence in proportion to the time since the one before. (Likelihoods of a model that is not exact are
//! tempered in this way: P. Bissiri, C. Holmes, S. Walker 2016, doi:10.1111/rssb.12158.)
//!
//! This is a bank of filters for abrupt changes: A. Willsky 1976 (doi:10.1016/0005-1098(76)90041-8); H. Blom, Y. Bar-Shalom 1988
//! (doi:10.1109/9.1299) treat models that change back and forth. O(F) filters for F faults, no allocation after construction.

mod copy;
mod stuck;
mod weights;

use crate::matrix::{at, put};
use crate::method::{Gaussian, Innovation, Measurement, Method, Updated};
use crate::mixture::{Part, mix};
use copy::{Hypothesis, put_first};
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

/// What may happen to the sensors of a filter.
#[derive(Clone, Debug)]
pub struct Faults {
    /// The faults, 64 at most.
    pub all: Vec<Fault>,
    /// The faults that may happen while all sensors but one are well, as bits by their places: for each such sensor a group.
    pub groups: Vec<u64>,
    /// The mean time between two faults of a kind, in seconds.
    pub every: f64,
    /// For how long the errors of the model are alike, in seconds: of measurements that are closer, each is less evidence.
    pub evidence_every: f64,
}

impl Faults {
    /// Faults of which any may follow any other one, and measurements that count in full.
    #[must_use]
    pub fn together(all: Vec<Fault>, every: f64) -> Faults {
        Faults { all, groups: vec![u64::MAX], every, evidence_every: 0.0 }
    }

    fn is_of(&self, group: usize, fault: usize) -> bool {
        self.groups.get(group).is_some_and(|group| group >> fault & 1 == 1)
    }
}

/// The most faults: each has a bit.
const MOST_FAULTS: usize = 64;
/// The most copies for each fault.
const MOST: usize = 8;
/// The degrees of freedom of the density by which copies are weighted.
const DEGREES: f64 = 4.0;

/// A filter and its copies.
pub struct Hypotheses {
    filter: Box<dyn Method>,
    faults: Faults,
    /// Each group with each of its faults.
    kinds: Vec<(usize, usize)>,
    /// Those in use come first, of these one of each group that is without a fault since it began.
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
    /// Hypotheses beside a filter over a number of sensors whose memory begins with its mean and covariance. A sensor bears witness for
    /// `within` seconds after a measurement.
    #[must_use]
    pub fn new(filter: Box<dyn Method>, sensors: usize, mut faults: Faults, within: f64) -> Hypotheses {
        faults.all.truncate(MOST_FAULTS);
        if faults.groups.is_empty() {
            faults.groups.push(u64::MAX);
        }
        let mut memory = vec![0.0; filter.memory_len()];
        filter.save(&mut memory);
        let groups = faults.groups.len();
        let kinds: Vec<(usize, usize)> = (0..groups)
            .flat_map(|group| (0..faults.all.len()).map(move |fault| (group, fault)))
            .filter(|(group, fault)| faults.is_of(*group, *fault))
            .collect();
        let mut copies = vec![Hypothesis::new(memory, 0); groups + kinds.len() * (MOST + 1)];
        copies.iter_mut().take(groups).enumerate().for_each(|(group, copy)| copy.group = group);
        Hypotheses {
            estimate: filter.gaussian().clone(),
            knows_outliers: filter.knows_outliers(),
            filter,
            kinds,
            copies,
            count: groups,
            elapsed: 0.0,
            silent: vec![0.0; sensors],
            within,
            last: vec![Last::NONE; sensors],
            stack: Vec::with_capacity(sensors),
            faults,
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

    /// The share in which a moment counts as evidence, by how long ago its sensors have been measured before.
    fn pace(&self, measurements: &[Measurement]) -> f64 {
        if self.faults.evidence_every <= 0.0 {
            return 1.0;
        }
        let since = |sensor: usize| self.silent.get(sensor).copied().unwrap_or(0.0);
        let shares = measurements.iter().map(|it| (since(it.sensor) / self.faults.evidence_every).min(1.0));
        shares.sum::<f64>() / measurements.len().max(1) as f64
    }

    /// A copy of each group sets out for each of its faults.
    fn set_out(&mut self) {
        let share = (std::mem::take(&mut self.elapsed) / self.faults.every).min(1.0);
        for kind in 0..self.kinds.len() {
            let Some((group, place)) = self.kinds.get(kind).copied() else { return };
            if !self.may_happen(group, place) {
                continue;
            }
            let Some((used, free)) = self.copies.split_at_mut_checked(self.count) else { return };
            let (Some(own), Some(copy)) = (used.get(group), free.first_mut()) else { return };
            copy.becomes(own);
            (copy.fault, copy.age, copy.weight) = (Some(place), 0.0, own.weight + libm::log(share));
            match self.faults.all.get(place) {
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

    /// Updates a copy, and its weight in so far as the measurements are evidence.
    fn update_one(
        &mut self,
        place: usize,
        measurements: &[Measurement],
        controls: &[f64],
        evidence: f64,
    ) -> Updated {
        self.restore_from(place);
        let left_out = self.stack(place, measurements.iter(), controls);
        let updated = self.filter.update(&self.stack, controls);
        let density = self.evidence(&together(&updated, &left_out));
        let Some(copy) = self.copies.get_mut(place) else { return Updated::NOTHING };
        self.filter.save(&mut copy.memory);
        copy.weight += if evidence > 0.0 { evidence * density } else { 0.0 };
        updated
    }

    /// The filter becomes that of a copy.
    fn restore_from(&mut self, place: usize) {
        if let Some(copy) = self.copies.get(place) {
            self.filter.restore(&copy.memory);
        }
    }

    /// Stacks measurements as a copy takes them, whose filter is the present one. Returns what counts for those that it leaves out.
    fn stack<'m>(
        &mut self,
        place: usize,
        measurements: impl Iterator<Item = &'m Measurement>,
        controls: &[f64],
    ) -> Updated {
        self.stack.clear();
        let mut left_out = Updated::NOTHING;
        let Some(copy) = self.copies.get(place) else { return left_out };
        for measurement in measurements {
            if let Some(own) = self.left_out(place, measurement.sensor) {
                left_out = together(&left_out, &own);
                continue;
            }
            let mut measurement = *measurement;
            for (fault, it) in self.faults.all.iter().enumerate() {
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
        let groups = self.faults.groups.len();
        let mut is_first_done = false;
        for (place, copy) in self.copies.iter_mut().enumerate().take(self.count) {
            self.filter.restore(&copy.memory);
            if change(self.filter.as_mut()) {
                self.filter.save(&mut copy.memory);
                is_first_done |= place == 0;
            } else if place < groups {
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
        self.restore_from(self.heaviest(|_| true));
        self.filter.innovation(measurement, controls)
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        if measurements.is_empty() {
            return Updated::NOTHING;
        }
        let pace = self.pace(measurements);
        let is_alone = self.is_alone(measurements);
        let evidence = if is_alone { 0.0 } else { pace };
        self.compare(measurements);
        if self.elapsed > 0.0 && !is_alone {
            self.set_out();
        }
        self.expect_repeated(measurements, controls);
        let best = self.heaviest(|copy| copy.fault.is_none());
        let mut updated = Updated::NOTHING;
        for place in 0..self.count {
            let own = self.update_one(place, measurements, controls, evidence);
            if place == best {
                updated = own;
            }
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
        rest.chunks_exact_mut(own).zip(self.used()).for_each(|(to, copy)| copy.save(to));
    }

    fn restore(&mut self, memory: &[f64]) {
        let Gaussian { mean, spread } = &mut self.estimate;
        let own = self.filter.memory_len() + Hypothesis::BESIDE;
        let Some(([count, elapsed], rest)) = memory.split_first_chunk() else { return };
        self.count = (*count as usize).clamp(self.faults.groups.len(), self.copies.len());
        self.elapsed = *elapsed;
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
        let copies = self.copies.iter_mut().take(self.count);
        rest.chunks_exact(own).zip(copies).for_each(|(from, copy)| copy.restore(from));
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

#[cfg(test)]
mod tests;
