//! The particle filter (SIR): a distribution as weighted points, propagated by the model and selected by the measurements.
//!
//! Each particle is propagated by the formulas. Its noise waits until the measurements of the moment are known, and is drawn with
//! regard to them (`proposal`); without a measurement it is drawn at the next step, and counts in the covariance meanwhile.
//! Each particle is weighted by the density of its residual, corrected for how the noise was drawn. Measurements of a moment that
//! come one by one give the same result as together (`moment`). When the effective number `1 / sum(w^2)` falls below a share of
//! all, the particles are resampled by their weights (`resampling`). Mean and covariance are those before resampling. Weights are
//! kept as logarithms until they are compared, so that a surprising measurement does not make all of them zero.
//!
//! The particles are stored by state elements, not one by one: all loops run over one element of many particles, in vector
//! instructions, and formulas are evaluated for many of them at once.
//!
//! O(N n^2) for a prediction and O(N (n^2 + m n + m^2)) for an update of N particles.
//!
//! Where few particles are left, or few ancestors of them, they are softened, and the covariance says how little they show
//! (`softening`).
//!
//! N. Gordon, D. Salmond, A. Smith 1993 (doi:10.1049/ip-f-2.1993.0015); M. S. Arulampalam and others 2002
//! (doi:10.1109/78.978374).

mod moment;
mod proposal;
mod resampling;
mod softening;
mod sums;

use crate::Error;
use crate::kernel::are_finite;
use crate::matrix::{Factors, Matrix, at, column, column_mut, put};
use crate::method::{Gaussian, Innovation, Measurement, Method, Updated, restore, save};
use crate::normal::Normal;
use crate::random::Random;
use crate::system::{Ensemble, wrapped};
use moment::Moment;
use proposal::Proposal;
use resampling::Comb;
use softening::{Ancestry, FEW, inflation, part};
use sums::sum_of_products;

/// The number of particles, and the criterion for resampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particles {
    /// The number, at least 2.
    pub count: usize,
    /// Particles are resampled when the effective number falls to this share: 1 always, 0 never.
    pub resample_below: f64,
    /// The seed: the same one gives the same estimates.
    pub seed: u64,
}

impl Default for Particles {
    fn default() -> Particles {
        Particles { count: 1000, resample_below: 0.5, seed: 1 }
    }
}

/// The variance of noise that is noticed, as a share of a state's variance.
const NOTICED: f64 = 1e-4;

/// A particle filter.
#[derive(Clone, Debug)]
pub struct Particle<S> {
    system: S,
    options: Particles,
    random: Random,
    /// Element i of all particles as column i.
    particles: Matrix,
    spare: Matrix,
    /// The weights, which sum to 1.
    weights: Vec<f64>,
    /// Mean and covariance: that of the particles and the noise that waits, and what few particles do not show.
    estimate: Gaussian,
    /// The covariance of the particles and the noise that waits.
    cloud: Matrix,
    ancestry: Ancestry,
    /// The noise of this step, and that which waits to be drawn.
    noise: Matrix,
    pending: Matrix,
    moment: Moment,
    proposal: Proposal,
    r: Matrix,
    r_factors: Factors,
    used: Vec<Measurement>,
    /// The residual of each particle from measurement i as column i.
    apart: Matrix,
    /// The weights by the measurements of a moment, as the product of a factor and of what has this logarithm.
    logarithms: Vec<f64>,
    factors: Vec<f64>,
    /// Working memory: one number for each particle.
    numbers: Vec<f64>,
    comb: Comb,
}

impl<S: Ensemble> Particle<S> {
    /// Draws the particles from a mean and its covariance.
    ///
    /// # Errors
    /// A size other than the system's, a covariance that is not positive semidefinite, fewer than two particles, or a share
    /// outside of 0 to 1.
    pub fn new(system: S, mean: &[f64], spread: &Matrix, options: Particles) -> Result<Particle<S>, Error> {
        let (n, m) = (system.states(), system.sensors());
        let estimate = Gaussian::new(mean, spread, n)?;
        if options.count < 2 || u32::try_from(options.count).is_err() {
            return Err(Error::Range {
                what: "the number of particles",
                value: options.count as f64,
                range: "2 or more, below 2^32",
            });
        }
        let value = options.resample_below;
        if !(0.0..=1.0).contains(&value) {
            return Err(Error::Range { what: "the share to resample at", value, range: "from 0 to 1" });
        }
        let (mut random, mut normal) = (Random::new(options.seed), Normal::new(mean, spread)?);
        let mut particles = Matrix::zeros(options.count, n);
        let mut drawn = vec![0.0; n];
        for place in 0..options.count {
            normal.sample(&mut random, &mut drawn);
            drawn.iter().enumerate().for_each(|(state, number)| put(&mut particles, place, state, *number));
        }
        Ok(Particle {
            system,
            random,
            spare: particles.clone(),
            particles,
            weights: vec![1.0 / options.count as f64; options.count],
            moment: Moment::new(options.count, m, &estimate),
            proposal: Proposal::new(options.count, n, m),
            cloud: estimate.spread.clone(),
            ancestry: Ancestry::new(options.count, n),
            estimate,
            noise: Matrix::zeros(n, n),
            pending: Matrix::zeros(n, n),
            r: Matrix::zeros(m, m),
            r_factors: Factors::new(m),
            used: Vec::with_capacity(m),
            apart: Matrix::zeros(options.count, m),
            logarithms: vec![0.0; options.count],
            factors: vec![1.0; options.count],
            numbers: vec![0.0; options.count],
            comb: Comb::new(options.count),
            options,
        })
    }

    /// Mean and covariance of the weighted particles and the noise that waits.
    fn summarise(&mut self) {
        let mean = &mut self.estimate.mean;
        for (state, mean) in mean.iter_mut().enumerate() {
            *mean = sum_of_products(&self.weights, column(&self.particles, state), 0.0);
        }
        for (j, about) in mean.iter().enumerate() {
            let pairs = self.weights.iter().zip(column(&self.particles, j));
            self.numbers.iter_mut().zip(pairs).for_each(|(to, (weight, own))| *to = weight * (own - about));
            for (i, mean) in mean.iter().enumerate().take(j + 1) {
                let covariance = sum_of_products(&self.numbers, column(&self.particles, i), *mean)
                    + at(&self.pending, i, j);
                put(&mut self.cloud, i, j, covariance);
                put(&mut self.cloud, j, i, covariance);
            }
        }
        self.ancestry.count(&self.weights);
        self.publish();
    }

    /// Computes mean and covariance, and resamples if the effective number is low.
    fn conclude(&mut self) {
        self.summarise();
        if self.effective() <= self.options.resample_below * self.weights.len() as f64 {
            self.comb.resample(&self.particles, &self.weights, &mut self.random, &mut self.spare);
            std::mem::swap(&mut self.particles, &mut self.spare);
            self.ancestry.resample(self.comb.sources());
            let count = self.weights.len();
            self.weights.fill(1.0 / count as f64);
            self.ancestry.count(&self.weights);
            self.soften_if_related();
        }
    }

    /// The effective number of particles: one over the sum of the squared weights.
    #[must_use]
    pub fn effective(&self) -> f64 {
        1.0 / sum_of_products(&self.weights, &self.weights, 0.0)
    }

    /// Whether so many points are few. Of few particles not all can be independent.
    pub(super) fn are_few(&self, points: f64) -> bool {
        points < FEW.min(self.options.resample_below * self.weights.len() as f64)
    }

    /// Makes a part of the covariance noise that waits.
    pub(super) fn soften(&mut self) {
        let (mean, n) = (&self.estimate.mean, self.estimate.mean.len());
        let part = part(self.weights.len(), n);
        let kept = (1.0 - part).sqrt();
        for (state, mean) in mean.iter().enumerate() {
            let own = column_mut(&mut self.particles, state).iter_mut();
            own.for_each(|own| *own = mean + kept * (*own - mean));
        }
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let waiting = at(&self.pending, i, j);
            put(&mut self.pending, i, j, waiting + part * (at(&self.cloud, i, j) - waiting));
        }
        self.ancestry.begin();
    }

    /// Softens after resampling where few ancestors are left and noise has not made up for that.
    fn soften_if_related(&mut self) {
        if self.are_few(self.ancestry.points) {
            let part = part(self.weights.len(), self.ancestry.noise.len());
            let is_new = |(state, noise): (usize, &f64)| *noise >= part * at(&self.cloud, state, state);
            match self.ancestry.noise.iter().enumerate().all(is_new) {
                true => self.ancestry.begin(),
                false => self.soften(),
            }
        }
    }

    /// The published covariance: that of the particles and the noise that waits, and how little the particles may show.
    fn publish(&mut self) {
        let inflation = inflation(self.ancestry.points);
        let spread = &mut self.estimate.spread;
        spread.copy_from(&self.cloud);
        if inflation.is_finite() {
            *spread *= inflation;
            return;
        }
        for state in 0..spread.nrows() {
            spread.row_mut(state).fill(0.0);
            put(spread, state, state, f64::INFINITY);
        }
    }

    /// Particles without a predicted value stay where they were, for the next measurement to judge. Returns whether any has one.
    fn bring_back(&mut self) -> bool {
        let (states, mut is_defined) = (self.particles.ncols(), false);
        for place in 0..self.weights.len() {
            let is_finite = (0..states).all(|state| at(&self.spare, place, state).is_finite());
            is_defined |= is_finite;
            for state in 0..if is_finite { 0 } else { states } {
                let before = at(&self.particles, place, state);
                put(&mut self.spare, place, state, before);
            }
        }
        is_defined
    }

    /// Whether the noise that waits is more than rounding beside the spread of some state. Less of it waits for the next step, so
    /// that the random numbers of later steps are the same whether two measurements have the same stamp or nearly the same.
    fn is_noticeable(&self) -> bool {
        (0..self.particles.ncols())
            .any(|state| at(&self.pending, state, state) > NOTICED * at(&self.cloud, state, state))
    }
}

impl<S: Ensemble> Method for Particle<S> {
    fn gaussian(&self) -> &Gaussian {
        &self.estimate
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        &mut self.estimate
    }

    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool {
        self.system.noise(&self.estimate.mean, controls, dt, &mut self.noise);
        if !are_finite(self.noise.as_slice()) {
            return false;
        }
        self.end_moment();
        // Nothing was measured since the last step.
        if self.is_noticeable() {
            self.disturb();
        }
        self.system.transitions(&self.particles, controls, dt, &mut self.spare);
        if !are_finite(self.spare.as_slice()) && !self.bring_back() {
            return false;
        }
        std::mem::swap(&mut self.particles, &mut self.spare);
        self.pending += &self.noise;
        for (state, noise) in self.ancestry.noise.iter_mut().enumerate() {
            *noise += at(&self.noise, state, state);
        }
        self.summarise();
        true
    }

    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation> {
        self.used.clear();
        self.choose_one(measurement, controls);
        self.used.first()?;
        let waiting = self.variance_of_noise(measurement.sensor, controls);
        let turn = self.system.turn(measurement.sensor);
        let about = self.system.expected(measurement.sensor, &self.estimate.mean, controls);
        let (mut sum, mut square, mut total) = (0.0, 0.0, 0.0);
        self.system.expectations(measurement.sensor, &self.particles, controls, &mut self.numbers);
        for (weight, expected) in self.weights.iter().zip(&self.numbers) {
            let apart = wrapped(expected - about, turn);
            if apart.is_finite() {
                (sum, square, total) =
                    (sum + weight * apart, square + weight * apart * apart, total + weight);
            }
        }
        let mean = sum / total;
        let noise = at(&self.r, 0, 0);
        let own = (square / total - mean * mean).max(0.0) + waiting;
        let inflation = inflation(self.ancestry.points);
        // Where the particles show nothing, every measurement fits.
        let variance = noise + if inflation.is_finite() { own * inflation } else { f64::MAX };
        let value = wrapped(measurement.value - about - mean, turn);
        (value.is_finite() && variance > 0.0).then_some(Innovation { value, variance, noise, errors: None })
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        self.used.clear();
        measurements.iter().for_each(|measurement| self.choose_one(measurement, controls));
        if self.used.is_empty() {
            return Updated::NOTHING;
        }
        self.update_moment(measurements, controls)
    }

    fn widen(&mut self, factor: f64) {
        self.end_moment();
        let Gaussian { mean, spread } = &mut self.estimate;
        self.cloud *= factor;
        for (state, mean) in mean.iter().enumerate() {
            let own = column_mut(&mut self.particles, state).iter_mut();
            own.for_each(|own| *own = mean + factor.sqrt() * (*own - mean));
        }
        *spread *= factor;
        self.pending *= factor;
    }

    fn memory_len(&self) -> usize {
        let (states, numbers) = (self.estimate.mean.len(), self.cloud.len());
        self.particles.len() + 2 * self.weights.len() + 2 * states + 2 * numbers + 2
    }

    fn save(&self, memory: &mut [f64]) {
        let Particle { particles, weights, estimate, cloud, pending, ancestry, .. } = self;
        let Ancestry { ancestors, points, noise, .. } = ancestry;
        let single = [f64::from_bits(self.random.state()), *points];
        let (particles, cloud, pending) = (particles.as_slice(), cloud.as_slice(), pending.as_slice());
        save(memory, &[particles, weights, &estimate.mean, cloud, pending, ancestors, noise, &single]);
    }

    fn restore(&mut self, memory: &[f64]) {
        self.end_moment();
        let Particle { particles, weights, estimate, cloud, pending, ancestry, .. } = self;
        let mut single = [0.0; 2];
        let (particles, cloud) = (particles.as_mut_slice(), cloud.as_mut_slice());
        let (mean, pending) = (estimate.mean.as_mut_slice(), pending.as_mut_slice());
        let Ancestry { ancestors, points, noise, .. } = ancestry;
        restore(memory, &mut [particles, weights, mean, cloud, pending, ancestors, noise, &mut single]);
        let [state, counted] = single;
        self.random.set_state(state.to_bits());
        *points = counted;
        self.publish();
    }
}
