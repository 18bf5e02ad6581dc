//! Systematic resampling: one random number places an even comb over the weights, and each tooth takes a particle.
//!
//! G. Kitagawa 1996 (doi:10.1080/10618600.1996.10474692). O(N), of a single state O(N log N).

use super::Particle;
use crate::matrix::{column, column_mut};

impl<S> Particle<S> {
    /// Resamples the particles by their weights, with an even comb over the sum of the weights.
    pub(super) fn resample(&mut self) {
        let count = self.weights.len();
        self.line_up();
        let (start, mut sum, mut from) = (self.random.share(), 0.0, 0);
        for place in self.order.iter().copied() {
            sum += self.weights.get(place as usize).copied().unwrap_or(0.0);
            // The teeth (i + start) / count up to the sum are those before this one.
            let tooth = sum * count as f64 - start;
            let to = if tooth < 0.0 { 0 } else { tooth as usize + 1 }.clamp(from, count);
            self.sources.get_mut(from..to).unwrap_or(&mut []).fill(place);
            from = to;
        }
        // Rounding may leave the sum a little below 1.
        let last = self.order.last().copied().unwrap_or(0);
        self.sources.get_mut(from..).unwrap_or(&mut []).fill(last);
        for state in 0..self.particles.ncols() {
            let own = column(&self.particles, state);
            let drawn =
                self.sources.iter().map(|source| own.get(*source as usize).copied().unwrap_or(f64::NAN));
            column_mut(&mut self.spare, state).iter_mut().zip(drawn).for_each(|(to, drawn)| *to = drawn);
        }
        std::mem::swap(&mut self.particles, &mut self.spare);
        self.weights.fill(1.0 / count as f64);
    }

    /// Sorts particles of a single state: then weights that are a little different choose a neighbour, which is next to the same, and
    /// the resampled ones are spread more evenly. Points of several states have no such order.
    fn line_up(&mut self) {
        if self.particles.ncols() == 1 {
            let own = column(&self.particles, 0);
            let number = |place: &u32| own.get(*place as usize).copied().unwrap_or(f64::NAN);
            self.order
                .sort_unstable_by(|one, other| number(one).total_cmp(&number(other)).then(one.cmp(other)));
        }
    }
}
