//! The proposal: how the process noise of each particle is drawn when the measurements of the moment are known.
//!
//! With the noise of the transition alone, precise measurements would leave few particles at each moment, all would soon descend
//! from one, and a state that no measurement shows would be certain of the value of that one. So the noise `w` is drawn
//! after the measurements, `z = h(f + w) + v`, from a normal distribution that is the optimal one for linear `h`:
//!
//! * `q(w) = N(K y, (I - K H) Q)` with the residual `y = z - h(f)` of the particle, `K = Q H' S^-1`, `S = H Q H' + R`, and `H` the
//!   derivatives at the mean of all particles. The measurements are processed one by one, as in the Kalman filter.
//! * The weight is multiplied by `p(z | f + w) p(w) / q(w)`. As `q(w) N(y; 0, S) = p(w) N(y - H w; 0, R)` for any `H`, this is
//!   `N(y; 0, S) p(z | f + w) / N(y - H w; 0, R)`: without the inverse of `Q`, which may be singular. The weights are exact, whatever the
//!   error of the linearisation.
//! * A particle at which `h` is not what the linearisation says, by more than a standard deviation of `v` at `w = K y`, draws from
//!   the transition, `q(w) = p(w)`: a proposal that is far from the density would leave large weights to chance. The choice
//!   depends on `f` and `z` alone, so the weights stay exact.
//! * One of [`DEFENSIVE`] other particles draws from the transition, too, and all of these are weighted by the density of the
//!   mixture. So no weight is more than that many times the weight without a proposal, where `h` has the measured value at a
//!   second place that the linearisation does not show: the other sign of `abs(x)`, another turn of an angle.
//!
//! Where the measurements tell little about the noise, it is drawn from the transition: the proposal would gain less than it costs.
//! A measurement without finite derivatives counts with `H = 0`, so that the proposal ignores it.
//!
//! O(N m n + N n^2 + m n^2) for N particles, and the measurement functions three times instead of once.
//!
//! A. Doucet, S. Godsill, C. Andrieu 2000, II.D (doi:10.1023/A:1008935410038); the mixture: T. Hesterberg 1995
//! (doi:10.1080/00401706.1995.10484303).

use super::Particle;
use super::moment::separate;
use super::sums::add_squares;
use crate::exponential::exp_all;
use crate::kernel::{self, Absorb, add_scaled, are_finite};
use crate::matrix::{Factors, Matrix, at, column, column_mut, put, variance_along};
use crate::random::Random;
use crate::system::{Ensemble, wrapped};

/// The largest square of the error of the linearisation, in variances of the measurement noise, that a proposal may have.
const TRUSTED: f64 = 1.0;
/// What the noise adds to the variances of the residuals, in variances of the measurement noise, from which on a proposal pays:
/// below it, the effective number of particles falls by no more than 2 % for want of one, `1 - sqrt(1 + 2 s) / (1 + s)`.
const INFORMATIVE: f64 = 0.25;
/// One of this many particles draws from the transition.
const DEFENSIVE: usize = 20;

/// The linearised measurements of a moment.
#[derive(Clone, Debug)]
pub(super) struct Proposal {
    /// The gradient of independent measurement i as column i.
    h: Matrix,
    /// The gain of measurement i, after those before, as column i.
    gains: Matrix,
    /// The variance of each residual, given those before.
    variances: Vec<f64>,
    /// The covariance of the noise, given the measurements.
    remaining: Matrix,
    factors: Factors,
    scratch: Vec<f64>,
    /// The residuals at the particles without noise, as far as the linearisation explains them.
    linear: Matrix,
    /// Whether the linearisation holds for a particle.
    is_trusted: Vec<bool>,
    /// Whether a particle draws from the proposal, and not from the transition.
    is_moved: Vec<bool>,
}

impl Proposal {
    /// Memory for this many particles, states and sensors.
    pub(super) fn new(count: usize, n: usize, m: usize) -> Proposal {
        Proposal {
            h: Matrix::zeros(n, m),
            gains: Matrix::zeros(n, m),
            variances: vec![0.0; m],
            remaining: Matrix::zeros(n, n),
            factors: Factors::new(n),
            scratch: vec![0.0; kernel::SCRATCH * n],
            linear: Matrix::zeros(count, m),
            is_trusted: vec![true; count],
            is_moved: vec![true; count],
        }
    }

    /// The gains of the measurements, whose independent noise has these variances, and the noise that they leave. Returns whether
    /// the measurements tell enough about the noise.
    fn absorb(&mut self, noise: &Matrix, variances: &[f64]) -> bool {
        let (n, mut share) = (noise.nrows(), 0.0);
        self.remaining.copy_from(noise);
        for (j, variance) in variances.iter().enumerate() {
            let gain = column_mut(&mut self.gains, j);
            gain.fill(0.0);
            let (p, h) = (self.remaining.as_mut_slice(), column(&self.h, j));
            let absorb = Absorb { p, h, noise: *variance, apart: 1.0, step: gain };
            let absorbed = kernel::run(absorb, n, &mut self.scratch);
            let whole = absorbed.map_or(*variance, |absorbed| absorbed.variance);
            self.variances.get_mut(j).into_iter().for_each(|own| *own = whole);
            share += whole / variance - 1.0;
        }
        share > INFORMATIVE
    }
}

/// The source of noise.
struct Draws<'a> {
    factors: &'a mut Factors,
    random: &'a mut Random,
    /// A number for each particle.
    work: &'a mut [f64],
}

impl Draws<'_> {
    /// Adds normal numbers with a covariance to the particles for which it is so.
    fn add(&mut self, covariance: &Matrix, is_drawn: impl Iterator<Item = bool> + Clone, to: &mut Matrix) {
        let n = covariance.nrows();
        self.factors.factor(covariance, n);
        for k in 0..n {
            let deviation = self.factors.d.get(k).copied().unwrap_or(0.0).sqrt();
            if deviation > 0.0 {
                for (number, is_drawn) in self.work.iter_mut().zip(is_drawn.clone()) {
                    *number = if is_drawn { self.random.normal() } else { 0.0 };
                }
                for i in k..n {
                    add_multiple(column_mut(to, i), deviation * at(&self.factors.l, i, k), self.work);
                }
            }
        }
    }
}

/// `to += factor * from`, unless the factor is 0.
fn add_multiple(to: &mut [f64], factor: f64, from: &[f64]) {
    if factor != 0.0 {
        add_scaled(to, factor, from);
    }
}

/// `to -= h' w`, for each particle: `h` has a factor for each column of `w`.
fn subtract(to: &mut [f64], h: &[f64], w: &Matrix) {
    h.iter().enumerate().for_each(|(i, slope)| add_multiple(to, -slope, column(w, i)));
}

impl<S: Ensemble> Particle<S> {
    /// Draws the noise that waits from the transition.
    pub(super) fn disturb(&mut self) {
        let (factors, random, work) = (&mut self.proposal.factors, &mut self.random, &mut self.numbers);
        let mut draws = Draws { factors, random, work };
        draws.add(&self.pending, std::iter::repeat(true), &mut self.particles);
        self.pending.fill(0.0);
    }

    /// The variance that the noise that waits adds to an expectation. Where there is no derivative, the noise is drawn instead.
    pub(super) fn variance_of_noise(&mut self, sensor: usize, controls: &[f64]) -> f64 {
        let gradient = column_mut(&mut self.proposal.h, 0);
        self.system.gradient(sensor, &self.estimate.mean, controls, gradient);
        let variance = variance_along(&self.pending, column(&self.proposal.h, 0));
        if variance.is_finite() {
            return variance.max(0.0);
        }
        self.disturb();
        0.0
    }

    /// Draws the noise that waits with regard to the measurements in use; sets the logarithms to those of `p(w) / q(w)`.
    pub(super) fn propose(&mut self, controls: &[f64]) {
        self.linearise(controls);
        let variances = self.r_factors.d.get(..self.used.len()).unwrap_or(&[]);
        if !self.proposal.absorb(&self.pending, variances) {
            self.disturb();
            return;
        }
        self.compare(controls);
        // A particle without an expectation may have one with noise; the proposal is valid with any residual.
        let all = self.apart.iter_mut();
        all.for_each(|apart| *apart = if apart.is_finite() { *apart } else { 0.0 });
        self.shift();
        self.test(controls);
        self.draw();
    }

    /// The gradients at the mean, made independent of each other; 0 where one is not finite.
    fn linearise(&mut self, controls: &[f64]) {
        let n = self.estimate.mean.len();
        for (j, measurement) in self.used.iter().enumerate() {
            let (known, own) = self.proposal.h.as_mut_slice().split_at_mut(j * n);
            let own = own.get_mut(..n).unwrap_or(&mut []);
            self.system.gradient(measurement.sensor, &self.estimate.mean, controls, own);
            if !are_finite(own) {
                own.fill(0.0);
            }
            separate(own, known, &self.r_factors.l, j);
        }
    }

    /// Moves the particles to the means of their proposals; adds the logarithm of the density of the residuals.
    fn shift(&mut self) {
        let Proposal { h, gains, variances, linear, .. } = &mut self.proposal;
        self.spare.fill(0.0);
        for (j, variance) in variances.iter().enumerate().take(self.used.len()) {
            self.numbers.copy_from_slice(column(&self.apart, j));
            subtract(&mut self.numbers, column(h, j), &self.spare);
            add_squares(&mut self.logarithms, -0.5 / variance, &self.numbers);
            for (i, gain) in column(gains, j).iter().enumerate() {
                add_multiple(column_mut(&mut self.spare, i), *gain, &self.numbers);
            }
        }
        for j in 0..self.used.len() {
            let linear = column_mut(linear, j);
            linear.copy_from_slice(column(&self.apart, j));
            subtract(linear, column(h, j), &self.spare);
        }
        add_scaled(self.particles.as_mut_slice(), 1.0, self.spare.as_slice());
    }

    /// Finds the particles at which the linearisation holds, and those that draw from the transition; takes the latter back.
    fn test(&mut self, controls: &[f64]) {
        self.compare(controls);
        self.numbers.fill(0.0);
        let first = (self.random.bits() % DEFENSIVE as u64) as usize;
        let Proposal { h, linear, is_trusted, is_moved, .. } = &mut self.proposal;
        for (j, measurement) in self.used.iter().enumerate() {
            let turn = self.system.turn(measurement.sensor);
            let inverse = 1.0 / self.r_factors.d.get(j).copied().unwrap_or(f64::NAN);
            let pairs = column(&self.apart, j).iter().zip(column(linear, j));
            for (sum, (apart, linear)) in self.numbers.iter_mut().zip(pairs) {
                let error = wrapped(apart - linear, turn);
                *sum += error * error * inverse;
            }
        }
        let flags = is_trusted.iter_mut().zip(is_moved);
        for (place, ((is_trusted, is_moved), error)) in flags.zip(&self.numbers).enumerate() {
            *is_trusted = *error <= TRUSTED;
            *is_moved = *is_trusted && place % DEFENSIVE != first;
            if *is_moved {
                continue;
            }
            for state in 0..self.particles.ncols() {
                put(&mut self.particles, place, state, at(&self.moment.particles, place, state));
                let back = at(&self.spare, place, state);
                for j in 0..self.used.len() {
                    let before = at(linear, place, j);
                    put(linear, place, j, before + at(h, state, j) * back);
                }
            }
        }
    }

    /// Draws the noise, and completes `p(w) / q(w)` for it.
    fn draw(&mut self) {
        let Proposal { h, remaining, variances, factors, linear, is_trusted, is_moved, .. } =
            &mut self.proposal;
        let (random, work, to) = (&mut self.random, &mut self.numbers, &mut self.spare);
        to.fill(0.0);
        let mut draws = Draws { factors, random, work };
        draws.add(remaining, is_moved.iter().copied(), to);
        draws.add(&self.pending, is_moved.iter().map(|is_moved| !is_moved), to);
        let mut scale = 0.0;
        for (j, variance) in self.r_factors.d.iter().enumerate().take(self.used.len()) {
            let linear = column_mut(linear, j);
            subtract(linear, column(h, j), to);
            add_squares(&mut self.logarithms, 0.5 / variance, linear);
            scale += 0.5 * libm::log(variance / variances.get(j).copied().unwrap_or(f64::NAN));
        }
        self.logarithms.iter_mut().for_each(|logarithm| *logarithm += scale);
        mix(&mut self.logarithms, &mut self.factors, is_trusted);
        add_scaled(self.particles.as_mut_slice(), 1.0, to.as_slice());
        self.pending.fill(0.0);
    }
}

/// From the logarithms of `p / q` to `p / (a q + (1 - a) p)`, for the share `1 - a` of particles that draw from `p`: logarithms, and
/// factors beside them. A particle that is not trusted keeps its weight.
fn mix(logarithms: &mut [f64], factors: &mut [f64], is_trusted: &[bool]) {
    const SHARE: f64 = 1.0 / DEFENSIVE as f64;
    factors.iter_mut().zip(&*logarithms).for_each(|(factor, logarithm)| *factor = -logarithm.abs());
    exp_all(factors);
    for ((logarithm, factor), is_trusted) in logarithms.iter_mut().zip(factors).zip(is_trusted) {
        let (of_q, of_p) = if *logarithm > 0.0 { (*factor, 1.0) } else { (1.0, *factor) };
        let mixed = 1.0 / ((1.0 - SHARE) * of_q + SHARE * of_p);
        *factor = if *is_trusted && mixed.is_finite() { mixed } else { 1.0 };
        *logarithm = if *is_trusted { logarithm.min(0.0) } else { 0.0 };
    }
}
