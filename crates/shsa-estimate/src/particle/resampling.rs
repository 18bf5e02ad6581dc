//! Systematic resampling: one random number places an even comb over the weights, and each tooth takes a particle.
//!
//! G. Kitagawa 1996 (doi:10.1080/10618600.1996.10474692). O(N), of a single state O(N log N).

use crate::matrix::{Matrix, column, column_mut};
use crate::random::Random;

/// The comb, and where its teeth are.
#[derive(Clone, Debug)]
pub(super) struct Comb {
    /// For each resampled particle, its source.
    sources: Vec<u32>,
    /// The particles in the order in which the comb meets them.
    order: Vec<u32>,
}

impl Comb {
    /// A comb for this many particles.
    pub(super) fn new(count: usize) -> Comb {
        Comb { sources: vec![0; count], order: (0..count as u32).collect() }
    }

    /// Resamples particles by their weights, which sum to 1, into `to`.
    pub(super) fn resample(
        &mut self,
        particles: &Matrix,
        weights: &[f64],
        random: &mut Random,
        to: &mut Matrix,
    ) {
        self.line_up(particles);
        let (count, start, mut sum, mut from) = (weights.len(), random.share(), 0.0, 0);
        for place in self.order.iter().copied() {
            sum += weights.get(place as usize).copied().unwrap_or(0.0);
            // The teeth (i + start) / count up to the sum are those before this one.
            let tooth = sum * count as f64 - start;
            let to = if tooth < 0.0 { 0 } else { tooth as usize + 1 }.clamp(from, count);
            self.sources.get_mut(from..to).unwrap_or(&mut []).fill(place);
            from = to;
        }
        // Rounding may leave the sum a little below 1.
        let last = self.order.last().copied().unwrap_or(0);
        self.sources.get_mut(from..).unwrap_or(&mut []).fill(last);
        for state in 0..particles.ncols() {
            let own = column(particles, state);
            let drawn =
                self.sources.iter().map(|source| own.get(*source as usize).copied().unwrap_or(f64::NAN));
            column_mut(to, state).iter_mut().zip(drawn).for_each(|(to, drawn)| *to = drawn);
        }
    }

    /// For each resampled particle, the place of its source.
    pub(super) fn sources(&self) -> &[u32] {
        &self.sources
    }

    /// Sorts particles of a single state: then weights that are a little different choose a neighbour, which is next to the same, and
    /// the resampled ones are spread more evenly. Points of several states have no such order.
    fn line_up(&mut self, particles: &Matrix) {
        if particles.ncols() == 1 {
            let own = column(particles, 0);
            let number = |place: &u32| own.get(*place as usize).copied().unwrap_or(f64::NAN);
            self.order
                .sort_unstable_by(|one, other| number(one).total_cmp(&number(other)).then(one.cmp(other)));
        }
    }
}
