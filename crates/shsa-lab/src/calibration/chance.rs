//! Reproducible random numbers, from which surrogate recordings are drawn.

/// A generator of random numbers (`SplitMix64`, G. Steele and others 2014, doi:10.1145/2714064.2660195).
#[derive(Clone, Debug)]
pub struct Chance {
    state: u64,
}

impl Chance {
    /// The same seed gives the same numbers.
    #[must_use]
    pub fn new(seed: u64) -> Chance {
        Chance { state: seed }
    }

    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Uniform, above 0 and below 1.
    pub fn share(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Uniform, below `count`; 0 for none.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.share() * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        (-2.0 * self.share().ln()).sqrt() * (std::f64::consts::TAU * self.share()).cos()
    }

    /// Exponential with mean 1.
    pub fn exponential(&mut self) -> f64 {
        -self.share().ln()
    }

    /// Gamma with this shape and scale 1, for shapes from 1 (G. Marsaglia, W. Tsang 2000, doi:10.1145/358407.358414).
    pub fn gamma(&mut self, shape: f64) -> f64 {
        let d = shape.max(1.0) - 1.0 / 3.0;
        let c = 1.0 / (9.0 * d).sqrt();
        loop {
            let normal = self.normal();
            let v = (1.0 + c * normal).powi(3);
            if v > 0.0 && self.share().ln() < 0.5 * normal * normal + d - d * v + d * v.ln() {
                return d * v;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(mean: f64, variance: f64, mut draw: impl FnMut(&mut Chance) -> f64) {
        let mut chance = Chance::new(7);
        let drawn: Vec<f64> = (0..40_000).map(|_| draw(&mut chance)).collect();
        let found = drawn.iter().sum::<f64>() / drawn.len() as f64;
        let spread = drawn.iter().map(|it| (it - found).powi(2)).sum::<f64>() / drawn.len() as f64;
        assert!((found - mean).abs() < 0.03 * variance.sqrt(), "mean {found}");
        assert!((spread / variance - 1.0).abs() < 0.05, "variance {spread}");
    }

    #[test]
    fn means_and_variances_are_those_of_the_distributions() {
        check(0.5, 1.0 / 12.0, Chance::share);
        check(0.0, 1.0, Chance::normal);
        check(1.0, 1.0, Chance::exponential);
        check(7.5, 7.5, |chance| chance.gamma(7.5));
        check(4.5, 8.25, |chance| chance.below(10) as f64);
    }
}
