//! The state before the measurements of a moment. Measurements that come one by one are taken in together from there: the noise
//! is drawn once for all of them, and the result is the same. The weights that the particles have by them.

use super::Particle;
use super::softening::Ancestry;
use super::sums::{add_squares, greatest};
use crate::exponential::exp_all;
use crate::kernel::add_scaled;
use crate::matrix::{Matrix, at, column, put};
use crate::method::{Gaussian, Measurement, Updated};
use crate::normal::log_density;
use crate::system::{Ensemble, wrapped};

/// The state before the noise of a moment was drawn, and the measurements taken in since then.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    pub(super) particles: Matrix,
    weights: Vec<f64>,
    estimate: Gaussian,
    cloud: Matrix,
    ancestry: Ancestry,
    noise: Matrix,
    random: u64,
    /// Whether noise was drawn for the measurements.
    pub(super) is_drawn: bool,
    pub(super) measurements: Vec<Measurement>,
    /// What was returned for these measurements so far.
    returned: Updated,
}

impl Moment {
    /// Memory for this many particles and sensors.
    pub(super) fn new(count: usize, sensors: usize, estimate: &Gaussian) -> Moment {
        let n = estimate.mean.len();
        Moment {
            particles: Matrix::zeros(count, n),
            weights: vec![0.0; count],
            estimate: estimate.clone(),
            cloud: estimate.spread.clone(),
            ancestry: Ancestry::new(count, n),
            noise: Matrix::zeros(n, n),
            random: 0,
            is_drawn: false,
            measurements: Vec::with_capacity(sensors),
            returned: Updated::NOTHING,
        }
    }

    /// The result of the measurements that are new among all of the moment. They are kept if the moment's noise was drawn for them.
    fn new_part(&mut self, all: Updated, used: &[Measurement]) -> Updated {
        if !self.is_drawn {
            return all;
        }
        self.measurements.clear();
        self.measurements.extend_from_slice(used);
        let before = std::mem::replace(&mut self.returned, all);
        Updated {
            used: all.used.saturating_sub(before.used),
            normalized_square: (all.normalized_square - before.normalized_square).max(0.0),
            log_likelihood: all.log_likelihood - before.log_likelihood,
            healed: all.healed,
        }
    }
}

impl<S> Particle<S> {
    /// Ends the moment: what was drawn for it stays.
    pub(super) fn end_moment(&mut self) {
        self.moment.measurements.clear();
        (self.moment.is_drawn, self.moment.returned) = (false, Updated::NOTHING);
    }

    /// Keeps the state before the measurements of a moment.
    fn remember(&mut self) {
        let Moment { particles, weights, estimate, cloud, ancestry, noise, random, .. } = &mut self.moment;
        cloud.copy_from(&self.cloud);
        ancestry.copy_from(&self.ancestry);
        particles.copy_from(&self.particles);
        weights.copy_from_slice(&self.weights);
        estimate.mean.copy_from_slice(&self.estimate.mean);
        estimate.spread.copy_from(&self.estimate.spread);
        noise.copy_from(&self.pending);
        *random = self.random.state();
    }

    /// Returns to the state before the first draw of the moment.
    fn return_to_memory(&mut self) {
        let Moment { particles, weights, estimate, cloud, ancestry, noise, random, .. } = &self.moment;
        self.cloud.copy_from(cloud);
        self.ancestry.copy_from(ancestry);
        self.particles.copy_from(particles);
        self.weights.copy_from_slice(weights);
        self.estimate.mean.copy_from_slice(&estimate.mean);
        self.estimate.spread.copy_from(&estimate.spread);
        self.pending.copy_from(noise);
        self.random.set_state(*random);
    }
}

impl<S: Ensemble> Particle<S> {
    /// Updates with measurements, together with those of the same moment so far.
    pub(super) fn update_moment(&mut self, new: &[Measurement], controls: &[f64]) -> Updated {
        if self.moment.measurements.len() + new.len() > self.apart.ncols() {
            self.end_moment();
        }
        if self.moment.is_drawn {
            self.return_to_memory();
        }
        self.choose(new, controls);
        if let Some(all) = self.take_in_all(controls) {
            self.conclude();
            return self.moment.new_part(all, &self.used);
        }
        // The new measurements change nothing: the result of the earlier ones is computed again.
        if self.moment.is_drawn {
            self.return_to_memory();
            self.choose(&[], controls);
            if !self.used.is_empty() && self.take_in_all(controls).is_some() {
                self.conclude();
            }
        }
        Updated { healed: true, ..Updated::NOTHING }
    }

    /// Keeps the usable ones among the measurements of the moment so far and new ones, and factors their noise.
    pub(super) fn choose(&mut self, new: &[Measurement], controls: &[f64]) {
        self.used.clear();
        for place in 0..self.moment.measurements.len() {
            if let Some(earlier) = self.moment.measurements.get(place).copied() {
                self.choose_one(&earlier, controls);
            }
        }
        new.iter().for_each(|measurement| self.choose_one(measurement, controls));
        self.r_factors.factor(&self.r, self.used.len());
    }

    /// Keeps a measurement if it has a value and a variance.
    pub(super) fn choose_one(&mut self, measurement: &Measurement, controls: &[f64]) {
        let Measurement { sensor, value, variance, .. } = *measurement;
        let own = self.system.covariance(sensor, sensor, &self.estimate.mean, controls);
        let (variance, place) = (variance.unwrap_or(own), self.used.len());
        let is_usable = variance > 0.0 && variance.is_finite() && value.is_finite();
        if !is_usable || place >= self.apart.ncols() {
            return;
        }
        put(&mut self.r, place, place, variance);
        for (other, known) in self.used.iter().enumerate() {
            let shared = self.system.covariance(sensor, known.sensor, &self.estimate.mean, controls);
            put(&mut self.r, place, other, shared);
        }
        self.used.push(*measurement);
    }

    /// The residual of each particle from measurement i as column i of `apart`, made independent of those before.
    pub(super) fn compare(&mut self, controls: &[f64]) {
        let count = self.weights.len();
        for (j, measurement) in self.used.iter().enumerate() {
            let turn = self.system.turn(measurement.sensor);
            let (known, own) = self.apart.as_mut_slice().split_at_mut(j * count);
            let own = own.get_mut(..count).unwrap_or(&mut []);
            self.system.expectations(measurement.sensor, &self.particles, controls, own);
            own.iter_mut().for_each(|own| *own = wrapped(measurement.value - *own, turn));
            separate(own, known, &self.r_factors.l, j);
        }
    }

    /// Adds the logarithm of the density of all measurements, apart from a factor, for each particle; minus infinity for a particle
    /// without a value.
    fn weigh(&mut self, controls: &[f64]) {
        self.compare(controls);
        for (j, variance) in self.r_factors.d.iter().enumerate().take(self.used.len()) {
            add_squares(&mut self.logarithms, -0.5 / variance, column(&self.apart, j));
        }
        let all = self.logarithms.iter_mut();
        all.for_each(|sum| *sum = if sum.is_nan() { f64::NEG_INFINITY } else { *sum });
    }

    /// Takes in the measurements in use, with softened particles where few would be left.
    fn take_in_all(&mut self, controls: &[f64]) -> Option<Updated> {
        if !self.moment.is_drawn {
            self.remember();
        }
        let all = self.take_in(controls);
        if all.is_none() || !self.are_few(self.effective()) {
            return all;
        }
        self.return_to_memory();
        self.soften();
        // What the moment begins with: particles that draw from the transition return to it.
        self.remember();
        self.take_in(controls)
    }

    /// Draws the noise that is due, and weighs the particles by the measurements in use. `None` where no particle has a value.
    fn take_in(&mut self, controls: &[f64]) -> Option<Updated> {
        self.logarithms.fill(0.0);
        self.factors.fill(1.0);
        if self.is_noticeable() {
            self.moment.is_drawn = true;
            self.propose(controls);
        }
        self.weigh(controls);
        let scale = greatest(&self.logarithms);
        if scale == f64::NEG_INFINITY {
            return None;
        }
        let densities = &mut self.logarithms;
        densities.iter_mut().for_each(|logarithm| *logarithm -= scale);
        exp_all(densities);
        densities.iter_mut().zip(&self.factors).for_each(|(density, factor)| *density *= factor);
        let greatest = greatest(densities);
        self.weights.iter_mut().zip(&*densities).for_each(|(weight, density)| *weight *= density);
        let total = self.weights.iter().sum::<f64>();
        // The measurement rules out all particles that had weight: all particles get equal weights.
        let healed = total.is_nan() || total <= 0.0;
        if healed {
            let count = self.weights.len();
            self.weights.fill(1.0 / count as f64);
        } else {
            self.weights.iter_mut().for_each(|weight| *weight /= total);
        }
        let variances = self.r_factors.d.iter().take(self.used.len());
        let of_noise: f64 = variances.map(|variance| log_density(0.0, *variance)).sum();
        Some(Updated {
            used: self.used.len(),
            normalized_square: (-2.0 * (scale + libm::log(greatest))).max(0.0),
            log_likelihood: scale + libm::log(total) + of_noise,
            healed,
        })
    }
}

/// Makes row `j` independent of the rows before it, of which each has as many numbers, by the factors of their covariance.
pub(super) fn separate(own: &mut [f64], known: &[f64], factors: &Matrix, j: usize) {
    for (k, known) in known.chunks_exact(own.len().max(1)).take(j).enumerate() {
        let shared = at(factors, j, k);
        if shared != 0.0 {
            add_scaled(own, -shared, known);
        }
    }
}
