//! What the last values of a window were off by, and how old they are.

use crate::method::uniform;

/// A value's part in a mean: its age in seconds, and its weight.
pub(super) type Part = (f64, f64);

/// The ages, the variances and the bounds of the values in a window, oldest first.
#[derive(Clone, Debug)]
pub(super) struct Recent {
    pub(super) ages: Vec<f64>,
    pub(super) variances: Vec<f64>,
    pub(super) bounds: Vec<f64>,
    /// The bounds by their size.
    sorted: Vec<f64>,
}

impl Recent {
    pub(super) fn new(capacity: usize) -> Recent {
        let [ages, variances, bounds, sorted] = [(); 4].map(|()| Vec::with_capacity(capacity));
        Recent { ages, variances, bounds, sorted }
    }

    pub(super) fn push(&mut self, variance: f64, bound: f64, capacity: usize) {
        let Recent { ages, variances, bounds, .. } = self;
        for (kept, new) in [(ages, 0.0), (variances, variance), (bounds, bound)] {
            if kept.len() >= capacity {
                kept.rotate_left(1);
                kept.pop();
            }
            kept.push(new);
        }
    }

    /// How far the mean with these weights may be off within bounds, and the part of its variance that stands for that.
    pub(super) fn errors(&self, weights: impl Iterator<Item = f64>) -> (f64, f64) {
        errors(self.bounds.iter().rev().copied().zip(weights))
    }

    /// How far the median may be off: more than half of the values are off by no more, and it lies between two of these.
    pub(super) fn bound_of_median(&mut self) -> f64 {
        self.sorted.clone_from(&self.bounds);
        self.sorted.sort_unstable_by(f64::total_cmp);
        self.sorted.get(self.sorted.len() / 2).or(self.sorted.last()).copied().unwrap_or(0.0)
    }

    /// The variance of the mean with these weights, that of the newest value first: they sum to 1.
    pub(super) fn variance(&self, weights: impl Iterator<Item = f64> + Clone, growth: f64) -> f64 {
        let own: f64 =
            self.variances.iter().rev().zip(weights.clone()).map(|(own, weight)| weight * weight * own).sum();
        own + growth * walked(self.ages.iter().rev().copied().zip(weights))
    }
}

/// How far a sum of bounded errors, each with its weight, may be off, and its variance if each is anywhere within its bound.
pub(super) fn errors(parts: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    parts.fold((0.0, 0.0), |(bound, counted), (own, weight)| {
        (bound + weight * own, counted + weight * weight * uniform(own))
    })
}

/// `sum(w_i w_j min(a_i, a_j))` of parts with weights that sum to 1, the youngest first. Linear.
pub(super) fn walked(parts: impl Iterator<Item = Part>) -> f64 {
    let (mut sum, mut older, mut before) = (0.0, 1.0, 0.0);
    for (age, weight) in parts {
        sum += (age - before) * older * older;
        (older, before) = (older - weight, age);
    }
    sum
}
