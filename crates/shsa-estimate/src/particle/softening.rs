//! Softening: what particles cannot show any more is known, and made good as far as it can be.
//!
//! Two things take away from what a cloud of particles shows. A measurement much more precise than the cloud is dense leaves few
//! particles. And each resampling leaves fewer ancestors: two particles descend from different ones with the probability
//! `apart = prod(1 - sum(w^2))`, so the cloud shows as much as `m = 1 / (1 - apart (1 - sum(w^2)))` independent points. A state without noise
//! of its own gets no new values.
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

/// Fewer independent points than this are few: of so many the standard deviation is known to a tenth, `1 / sqrt(2 m)`.
pub(super) const FEW: f64 = 50.0;

/// What the particles have in common since they were softened.
#[derive(Clone, Debug)]
pub(super) struct Ancestry {
    /// The probability that two particles have different ancestors.
    pub(super) apart: f64,
    /// The variance of the noise that each state has had.
    pub(super) noise: Vec<f64>,
}

impl Ancestry {
    /// Of particles that have nothing in common, with this many states.
    pub(super) fn new(states: usize) -> Ancestry {
        Ancestry { apart: 1.0, noise: vec![0.0; states] }
    }

    pub(super) fn copy_from(&mut self, other: &Ancestry) {
        self.apart = other.apart;
        self.noise.copy_from_slice(&other.noise);
    }

    pub(super) fn begin(&mut self) {
        self.apart = 1.0;
        self.noise.fill(0.0);
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
