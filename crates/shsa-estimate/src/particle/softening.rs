//! Softening: what particles cannot show any more is known, and made good as far as it can be.
//!
//! Two things take away from what a cloud of particles shows. A measurement much more precise than the cloud is dense leaves few
//! particles. And each resampling leaves fewer ancestors: the cloud shows as much as `m = 1 / sum(W^2)` independent points, where `W` is the
//! weight of all particles that descend from one. A state without noise of its own gets no new values.
//!
//! Softening makes a part `h^2` of the cloud's covariance noise that waits: each particle moves towards the mean by the factor
//! `sqrt(1 - h^2)`, and the noise is drawn with regard to the next measurements (`proposal`). Mean and covariance stay. It is done
//! before a measurement that would leave few particles, and when resampling has left few ancestors and the states have had
//! less noise since than softening gives. A sharp or divided density becomes wider by that, never sharper.
//!
//! What is still uncertain counts in the published covariance: of `m` points that of a further one is `(1 + 1 / m) (m - 1) / (m - 3)` times
//! theirs (Student's distribution), and unbounded for three points or fewer.
//!
//! C. Musso, N. Oudjane, F. Le Gland 2001 (doi:10.1007/978-1-4757-3437-9_12); that mean and covariance stay: M. West 1993
//! (doi:10.1111/j.2517-6161.1993.tb01911.x). O(N n) for N particles of n states.

use super::sums::sum_of_products;

/// Fewer independent points than this are few: of so many the standard deviation is known to a tenth, `1 / sqrt(2 m)`.
pub(super) const FEW: f64 = 50.0;

/// What the particles have in common since they were softened.
#[derive(Clone, Debug)]
pub(super) struct Ancestry {
    /// The number of the ancestor of each particle.
    pub(super) ancestors: Vec<f64>,
    /// The number of independent points that show as much as the particles do.
    pub(super) points: f64,
    /// The variance of the noise that each state has had.
    pub(super) noise: Vec<f64>,
    /// Memory: the weights by ancestor, and the ancestors of resampled particles.
    weights: Vec<f64>,
}

impl Ancestry {
    /// Of so many particles that have nothing in common, with this many states.
    pub(super) fn new(count: usize, states: usize) -> Ancestry {
        let (ancestors, weights) = (vec![0.0; count], vec![0.0; count]);
        let mut ancestry = Ancestry { ancestors, points: count as f64, noise: vec![0.0; states], weights };
        ancestry.begin();
        ancestry
    }

    pub(super) fn copy_from(&mut self, other: &Ancestry) {
        self.ancestors.copy_from_slice(&other.ancestors);
        self.points = other.points;
        self.noise.copy_from_slice(&other.noise);
    }

    /// From here on, the particles have nothing in common.
    pub(super) fn begin(&mut self) {
        self.ancestors.iter_mut().enumerate().for_each(|(number, own)| *own = number as f64);
        self.noise.fill(0.0);
    }

    /// Particles have been resampled: each descends from its source.
    pub(super) fn resample(&mut self, sources: &[u32]) {
        let of = |source: &u32| self.ancestors.get(*source as usize).copied().unwrap_or(0.0);
        self.weights.iter_mut().zip(sources).for_each(|(own, source)| *own = of(source));
        std::mem::swap(&mut self.weights, &mut self.ancestors);
    }

    /// Counts the points that particles of these weights show.
    pub(super) fn count(&mut self, weights: &[f64]) {
        self.weights.fill(0.0);
        for (ancestor, weight) in self.ancestors.iter().zip(weights) {
            if let Some(sum) = self.weights.get_mut(*ancestor as usize) {
                *sum += weight;
            }
        }
        self.points = 1.0 / sum_of_products(&self.weights, &self.weights, 0.0);
    }
}

/// How many times as large as that of `points` independent points the variance of a further one is; infinite for too few.
pub(super) fn inflation(points: f64) -> f64 {
    if points > 3.0 { (1.0 + 1.0 / points) * (points - 1.0) / (points - 3.0) } else { f64::INFINITY }
}

/// The part of the covariance that becomes noise: the square of the best width of a normal kernel for a normal density, B. Silverman 1986,
/// doi:10.1201/9781315140919.
pub(super) fn part(particles: usize, states: usize) -> f64 {
    let n = states as f64;
    let width = libm::pow(4.0 / ((n + 2.0) * particles as f64), 1.0 / (n + 4.0));
    (width * width).min(1.0)
}
