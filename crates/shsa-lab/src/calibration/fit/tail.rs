//! Tails of a signal's residuals: values rarer than any observed one, including their uncertainty.

use crate::calibration::chance::Chance;

/// The tail begins at this quantile, on either side.
const FROM: f64 = 0.95;
/// With fewer clusters, the shape of a tail is unknown.
const FEWEST: usize = 8;
/// The range of shapes: from bounded to so heavy that there is barely a variance.
const SHAPES: (f64, f64) = (-0.4, 0.45);
/// With this many clusters, the signal's own shape has the same weight as the common shape.
const OWN: f64 = 50.0;

/// One tail of a signal's residuals.
#[derive(Clone, Debug)]
pub(super) struct Side {
    /// The positive threshold of the tail.
    pub(super) from: f64,
    /// The mean excess over it.
    scale: f64,
    /// The number of clusters of excesses: excesses closer than the memory form one cluster.
    clusters: f64,
    /// The shape of a generalised Pareto distribution, and its standard error.
    shape: f64,
    error: f64,
    /// The excesses, ascending.
    pub(super) excesses: Vec<f64>,
}

impl Side {
    /// The tail of values whose sign was turned so that the tail is above; `memory` is in values.
    pub(super) fn of(values: &[f64], memory: f64) -> Side {
        let sorted = crate::order::sorted(values.iter().copied());
        let from = crate::order::quantile(&sorted, FROM).unwrap_or(0.0).max(0.0);
        let excesses: Vec<f64> = sorted.into_iter().map(|it| it - from).filter(|it| *it > 0.0).collect();
        let clusters = (excesses.len() as f64 / memory.max(1.0)).max(1.0);
        let (shape, error) = weighted_moments(&excesses, clusters);
        let scale = crate::order::mean(&excesses);
        Side { from, scale, clusters, shape, error, excesses }
    }

    /// As many excesses as were observed, ascending, drawn with a scale and a shape that are consistent with the observed ones
    /// (A. McNeil, R. Frey 2000, doi:10.1016/S0927-5398(00)00012-8).
    pub(super) fn drawn(&self, chance: &mut Chance) -> Vec<f64> {
        if self.scale <= 0.0 {
            return self.excesses.clone();
        }
        let clusters = self.clusters.max(2.0);
        let scale = self.scale * clusters / chance.gamma(clusters);
        let shape = (self.shape + self.error * chance.normal()).clamp(SHAPES.0, SHAPES.1);
        let excess = |chance: &mut Chance| {
            let exponential = chance.exponential();
            if shape.abs() < 1e-3 {
                scale * exponential
            } else {
                scale * (1.0 - shape) * (shape * exponential).exp_m1() / shape
            }
        };
        crate::order::sorted((0..self.excesses.len()).map(|_| excess(chance)))
    }
}

/// The shape by probability-weighted moments (J. Hosking, J. Wallis 1987, doi:10.1080/00401706.1987.10488243), and its
/// standard error.
fn weighted_moments(ascending: &[f64], clusters: f64) -> (f64, f64) {
    let count = ascending.len() as f64;
    let first = crate::order::mean(ascending);
    let weighted = |(at, excess): (usize, &f64)| excess * (1.0 - (at as f64 + 0.65) / count);
    let second = ascending.iter().enumerate().map(weighted).sum::<f64>() / count.max(1.0);
    let shape = 2.0 - first / (first - 2.0 * second);
    if ascending.len() < FEWEST || !shape.is_finite() {
        return (0.0, 0.2);
    }
    (shape.clamp(SHAPES.0, SHAPES.1), 1.0 / clusters.sqrt())
}

/// Gives tails with little evidence about their shape the common shape: exponential, unless the common estimate differs by two
/// standard errors.
pub(super) fn share_shapes<'s>(sides: impl Iterator<Item = &'s mut Side>) {
    let mut sides: Vec<&mut Side> = sides.filter(|it| it.excesses.len() >= FEWEST).collect();
    let weight: f64 = sides.iter().map(|it| it.error.powi(-2)).sum();
    let mean = sides.iter().map(|it| it.shape * it.error.powi(-2)).sum::<f64>() / weight.max(1e-9);
    let error = weight.max(1e-9).sqrt().recip();
    let common = if mean.abs() > 2.0 * error { mean } else { 0.0 };
    for side in &mut sides {
        let own = side.clusters / (side.clusters + OWN);
        side.shape = own * side.shape + (1.0 - own) * common;
        side.error = (own * side.error.powi(2) + (1.0 - own) * error.powi(2)).sqrt().min(side.error);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(shape: f64) {
        let mut chance = Chance::new(11);
        let draw = |chance: &mut Chance| {
            let it = chance.exponential();
            if shape == 0.0 { it } else { (shape * it).exp_m1() / shape }
        };
        let drawn = crate::order::sorted((0..20_000).map(|_| draw(&mut chance)));
        let (found, _) = weighted_moments(&drawn, 20_000.0);
        assert!((found - shape).abs() < 0.05, "{found} is not {shape}");
    }

    #[test]
    fn shapes_are_found() {
        check(0.0);
        check(0.3);
        check(-0.3);
    }

    #[test]
    fn what_is_drawn_goes_beyond_what_was_seen() {
        let mut chance = Chance::new(5);
        let values: Vec<f64> = (0..2_000).map(|_| chance.normal()).collect();
        let side = Side::of(&values, 1.0);
        let largest = side.excesses.last().copied().unwrap();
        let beyond = (0..200).filter(|_| side.drawn(&mut chance).last().copied() > Some(largest)).count();
        assert!((50..190).contains(&beyond), "{beyond} of 200");
    }
}
