//! The particle filter (SIR): the distribution as points that live by the model and die by the measurements.
//!
//! Each particle goes on by the formulas and noise of its own; a measurement weighs it by the density of its residual. Where the
//! effective number `1 / sum(w^2)` falls below a share of all, the particles are drawn again by their weights, systematically: one
//! random number places an even comb over the weights. Mean and covariance are those before that. Weights are kept as logarithms
//! until they are compared, so that a surprise does not make all of them zero.
//!
//! O(N n^2) for a prediction and O(N m (n + m)) for an update of N particles.
//!
//! N. Gordon, D. Salmond, A. Smith 1993 (doi:10.1049/ip-f-2.1993.0015); M. S. Arulampalam and others 2002
//! (doi:10.1109/78.978374); systematic resampling: G. Kitagawa 1996 (doi:10.1080/10618600.1996.10474692).

use crate::Error;
use crate::matrix::{Factors, Matrix, at, column, column_mut, put, symmetrise};
use crate::method::{Innovation, Measurement, Method, Updated, restore, save};
use crate::normal::{Normal, log_density};
use crate::random::Random;
use crate::system::{System, wrapped};

/// How many particles there are, and when they are drawn again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particles {
    /// Their number, 2 at least.
    pub count: usize,
    /// They are drawn again when the effective number falls to this share: 1 always, 0 never.
    pub resample_below: f64,
    /// The same seed gives the same estimates.
    pub seed: u64,
}

impl Default for Particles {
    fn default() -> Particles {
        Particles { count: 1000, resample_below: 0.5, seed: 1 }
    }
}

/// A particle filter.
#[derive(Clone, Debug)]
pub struct Particle<S> {
    system: S,
    options: Particles,
    random: Random,
    /// One particle a column.
    particles: Matrix,
    spare: Matrix,
    /// They sum to 1.
    weights: Vec<f64>,
    mean: Vec<f64>,
    p: Matrix,
    noise: Matrix,
    factors: Factors,
    normal: Vec<f64>,
    coloured: Vec<f64>,
    r: Matrix,
    r_factors: Factors,
    apart: Vec<f64>,
    used: Vec<Measurement>,
    logarithms: Vec<f64>,
}

impl<S: System> Particle<S> {
    /// Draws the particles of a mean and its covariance.
    ///
    /// # Errors
    /// Another size than the system's, a covariance that is not positive semidefinite, fewer than two particles, a share outside
    /// of 0 to 1.
    pub fn new(system: S, mean: &[f64], spread: &Matrix, options: Particles) -> Result<Particle<S>, Error> {
        let (n, m) = (system.states(), system.sensors());
        if mean.len() != n {
            return Err(Error::Size { what: "the initial state", found: mean.len(), wanted: n });
        }
        if options.count < 2 {
            return Err(Error::Range {
                what: "the number of particles",
                value: options.count as f64,
                range: "2 or more",
            });
        }
        let share = options.resample_below;
        if !(0.0..=1.0).contains(&share) {
            return Err(Error::Range {
                what: "the share to resample at",
                value: share,
                range: "from 0 to 1",
            });
        }
        let (mut random, mut normal) = (Random::new(options.seed), Normal::new(mean, spread)?);
        let mut particles = Matrix::zeros(n, options.count);
        for place in 0..options.count {
            normal.sample(&mut random, column_mut(&mut particles, place));
        }
        Ok(Particle {
            system,
            random,
            spare: particles.clone(),
            particles,
            weights: vec![1.0 / options.count as f64; options.count],
            mean: mean.to_vec(),
            p: spread.clone(),
            noise: Matrix::zeros(n, n),
            factors: Factors::new(n),
            normal: vec![0.0; n],
            coloured: vec![0.0; n],
            r: Matrix::zeros(m, m),
            r_factors: Factors::new(m),
            apart: vec![0.0; m],
            used: Vec::with_capacity(m),
            logarithms: vec![0.0; options.count],
            options,
        })
    }

    /// Mean and covariance of the weighted particles.
    fn summarise(&mut self) {
        self.mean.fill(0.0);
        for (place, weight) in self.weights.iter().enumerate() {
            for (mean, own) in self.mean.iter_mut().zip(column(&self.particles, place)) {
                *mean += weight * own;
            }
        }
        self.p.fill(0.0);
        for (place, weight) in self.weights.iter().enumerate() {
            let own = column(&self.particles, place);
            for (apart, (own, mean)) in self.coloured.iter_mut().zip(own.iter().zip(&self.mean)) {
                *apart = own - mean;
            }
            for (j, factor) in self.coloured.iter().enumerate() {
                let upper = column_mut(&mut self.p, j).get_mut(..=j).unwrap_or(&mut []);
                upper.iter_mut().zip(&self.coloured).for_each(|(p, apart)| *p += weight * factor * apart);
            }
        }
        for j in 0..self.mean.len() {
            for i in 0..j {
                let mirrored = at(&self.p, i, j);
                put(&mut self.p, j, i, mirrored);
            }
        }
        symmetrise(&mut self.p);
    }

    /// Keeps those measurements that the estimate has an expectation of, and factors their noise.
    fn choose(&mut self, measurements: &[Measurement], controls: &[f64]) {
        self.used.clear();
        for measurement in measurements.iter().take(self.apart.len()) {
            let own = self.system.covariance(measurement.sensor, measurement.sensor, &self.mean, controls);
            let variance = measurement.variance.unwrap_or(own);
            if variance > 0.0 && variance.is_finite() && measurement.value.is_finite() {
                let place = self.used.len();
                put(&mut self.r, place, place, variance);
                for (other, known) in self.used.iter().enumerate() {
                    let shared =
                        self.system.covariance(measurement.sensor, known.sensor, &self.mean, controls);
                    put(&mut self.r, place, other, shared);
                }
                self.used.push(*measurement);
            }
        }
        self.r_factors.factor(&self.r, self.used.len());
    }

    /// The logarithm of the density of all measurements for a particle; minus infinity where it has no value.
    fn log_density(&mut self, place: usize, controls: &[f64]) -> f64 {
        let state = column(&self.particles, place);
        for (measurement, apart) in self.used.iter().zip(&mut self.apart) {
            let expected = self.system.expected(measurement.sensor, state, controls);
            *apart = wrapped(measurement.value - expected, self.system.turn(measurement.sensor));
        }
        let count = self.used.len();
        self.r_factors.solve_lower(self.apart.get_mut(..count).unwrap_or(&mut []));
        let pairs = self.apart.iter().zip(&self.r_factors.d).take(count);
        let sum: f64 = pairs.map(|(apart, variance)| -0.5 * apart * apart / variance).sum();
        if sum.is_nan() { f64::NEG_INFINITY } else { sum }
    }

    /// One over the sum of the squared weights: how many particles it really is.
    #[must_use]
    pub fn effective(&self) -> f64 {
        1.0 / self.weights.iter().map(|weight| weight * weight).sum::<f64>()
    }

    /// Draws the particles again by their weights.
    fn resample(&mut self) {
        let count = self.weights.len();
        let start = self.random.share();
        let (mut from, mut sum) = (0, self.weights.first().copied().unwrap_or(1.0));
        for to in 0..count {
            let wanted = (to as f64 + start) / count as f64;
            while sum < wanted && from + 1 < count {
                from += 1;
                sum += self.weights.get(from).copied().unwrap_or(0.0);
            }
            column_mut(&mut self.spare, to).copy_from_slice(column(&self.particles, from));
        }
        std::mem::swap(&mut self.particles, &mut self.spare);
        self.weights.fill(1.0 / count as f64);
    }
}

impl<S: System> Method for Particle<S> {
    fn mean(&self) -> &[f64] {
        &self.mean
    }

    fn spread(&self) -> &Matrix {
        &self.p
    }

    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool {
        self.system.noise(&self.mean, controls, dt, &mut self.noise);
        if !self.noise.iter().all(|number| number.is_finite()) {
            return false;
        }
        let mut is_defined = false;
        for place in 0..self.weights.len() {
            let to = column_mut(&mut self.spare, place);
            self.system.transition(column(&self.particles, place), controls, dt, to);
            let is_finite = to.iter().all(|number| number.is_finite());
            is_defined |= is_finite;
            if !is_finite {
                // It has left the model: it stays where it was, and the next measurement will judge it.
                to.copy_from_slice(column(&self.particles, place));
            }
        }
        if !is_defined {
            return false;
        }
        std::mem::swap(&mut self.particles, &mut self.spare);
        self.factors.factor(&self.noise, self.mean.len());
        for place in 0..self.weights.len() {
            self.normal.iter_mut().for_each(|number| *number = self.random.normal());
            self.factors.colour(&self.normal, &mut self.coloured);
            let own = column_mut(&mut self.particles, place);
            own.iter_mut().zip(&self.coloured).for_each(|(own, noise)| *own += noise);
        }
        self.summarise();
        true
    }

    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation> {
        self.choose(&[*measurement], controls);
        self.used.first()?;
        let turn = self.system.turn(measurement.sensor);
        let about = self.system.expected(measurement.sensor, &self.mean, controls);
        let (mut sum, mut square, mut total) = (0.0, 0.0, 0.0);
        for (place, weight) in self.weights.iter().enumerate() {
            let expected = self.system.expected(measurement.sensor, column(&self.particles, place), controls);
            let apart = wrapped(expected - about, turn);
            if apart.is_finite() {
                (sum, square, total) =
                    (sum + weight * apart, square + weight * apart * apart, total + weight);
            }
        }
        let mean = sum / total;
        let variance = (square / total - mean * mean).max(0.0) + at(&self.r, 0, 0);
        let value = wrapped(measurement.value - about - mean, turn);
        (value.is_finite() && variance > 0.0).then_some(Innovation { value, variance })
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        self.choose(measurements, controls);
        if self.used.is_empty() {
            return Updated::NOTHING;
        }
        for place in 0..self.weights.len() {
            let logarithm = self.log_density(place, controls);
            if let Some(own) = self.logarithms.get_mut(place) {
                *own = logarithm;
            }
        }
        let greatest = self.logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if greatest == f64::NEG_INFINITY {
            return Updated { healed: true, ..Updated::NOTHING };
        }
        let mut total = 0.0;
        for (weight, logarithm) in self.weights.iter_mut().zip(&self.logarithms) {
            *weight *= libm::exp(logarithm - greatest);
            total += *weight;
        }
        // All weight lay with those that the measurement rules out: it begins anew from what the measurement says.
        let healed = total.is_nan() || total <= 0.0;
        let count = self.weights.len() as f64;
        self.weights
            .iter_mut()
            .for_each(|weight| *weight = if healed { 1.0 / count } else { *weight / total });
        let noise = self.r_factors.d.iter().take(self.used.len());
        let scale: f64 = noise.map(|variance| log_density(0.0, *variance)).sum();
        let updated = Updated {
            used: self.used.len(),
            normalized_square: -2.0 * greatest,
            log_likelihood: greatest + libm::log(total) + scale,
            healed,
        };
        self.summarise();
        if self.effective() <= self.options.resample_below * count {
            self.resample();
        }
        updated
    }

    fn widen(&mut self, factor: f64) {
        let far = factor.sqrt();
        for place in 0..self.weights.len() {
            for (own, mean) in column_mut(&mut self.particles, place).iter_mut().zip(&self.mean) {
                *own = mean + far * (*own - mean);
            }
        }
        self.p *= factor;
    }

    fn memory_len(&self) -> usize {
        self.particles.len() + self.weights.len() + self.mean.len() + self.p.len() + 1
    }

    fn save(&self, memory: &mut [f64]) {
        let random = [f64::from_bits(self.random.state())];
        let p = self.p.as_slice();
        save(memory, &[self.particles.as_slice(), &self.weights, &self.mean, p, &random]);
    }

    fn restore(&mut self, memory: &[f64]) {
        let mut random = [0.0];
        let (particles, p) = (self.particles.as_mut_slice(), self.p.as_mut_slice());
        restore(memory, &mut [particles, &mut self.weights, &mut self.mean, p, &mut random]);
        let [state] = random;
        self.random.set_state(state.to_bits());
    }
}
