//! Normal random numbers for particles, fast and the same in every run.
//!
//! Uniform numbers by `SplitMix64` (G. Steele and others 2014, doi:10.1145/2714064.2660195), whose state is one word that can be
//! saved with the filter; normal ones by the ziggurat (G. Marsaglia, W. Tsang 2000, doi:10.18637/jss.v005.i08), which needs a
//! table look-up and a product for 99 of 100 numbers.

/// Layers of the ziggurat.
const LAYERS: usize = 128;
/// The end of the lowest layer.
const TAIL: f64 = 3.442_619_855_899;
/// The area of a layer.
const AREA: f64 = 9.912_563_035_262_17e-3;

/// A generator of random numbers.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
    /// The right end of each layer, and 0 above the last one.
    ends: [f64; LAYERS + 1],
    /// The density at these ends.
    heights: [f64; LAYERS + 1],
}

impl Random {
    /// A generator with a seed: the same one gives the same numbers.
    #[must_use]
    pub fn new(seed: u64) -> Random {
        let density = |x: f64| libm::exp(-0.5 * x * x);
        let (mut ends, mut heights) = ([0.0; LAYERS + 1], [1.0; LAYERS + 1]);
        // The lowest layer includes the tail: its width is that of a box of the same area.
        let mut below = (AREA / density(TAIL), 0.0);
        for (layer, (end, height)) in ends.iter_mut().zip(&mut heights).enumerate().take(LAYERS) {
            (*end, *height) = below;
            let at = if layer == 0 { TAIL } else { libm::sqrt(-2.0 * libm::log(AREA / below.0 + below.1)) };
            below = (at, density(at));
        }
        Random { state: seed, ends, heights }
    }

    /// The state, which is all that changes.
    #[must_use]
    pub fn state(&self) -> u64 {
        self.state
    }

    /// Restores a state.
    pub fn set_state(&mut self, state: u64) {
        self.state = state;
    }

    /// 64 random bits.
    #[inline]
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Uniform, above 0 and below 1.
    #[inline]
    pub fn share(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Normal with mean 0 and standard deviation 1.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        loop {
            let bits = self.bits();
            let layer = (bits & 127) as usize;
            let even = ((bits >> 11) as f64 + 0.5) / (1_u64 << 52) as f64 - 1.0;
            let (Some(end), Some(above)) = (self.ends.get(layer), self.ends.get(layer + 1)) else { continue };
            let x = even * end;
            if x.abs() < *above {
                return x;
            }
            if let Some(x) = self.beside(layer, x) {
                return x;
            }
        }
    }

    /// A sample beside the box of a layer: in the wedge under the density, or in the tail.
    #[cold]
    fn beside(&mut self, layer: usize, x: f64) -> Option<f64> {
        if layer == 0 {
            return Some(libm::copysign(self.tail(), x));
        }
        let (low, high) = (*self.heights.get(layer)?, *self.heights.get(layer + 1)?);
        let height = low + (high - low) * self.share();
        (height < libm::exp(-0.5 * x * x)).then_some(x)
    }

    fn tail(&mut self) -> f64 {
        loop {
            let x = -libm::log(self.share()) / TAIL;
            if -2.0 * libm::log(self.share()) > x * x {
                return TAIL + x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_and_tails_are_those_of_the_normal_distribution() {
        let mut random = Random::new(3);
        let drawn: Vec<f64> = (0..400_000).map(|_| random.normal()).collect();
        let moment = |power: i32| drawn.iter().map(|x| x.powi(power)).sum::<f64>() / drawn.len() as f64;
        assert!(moment(1).abs() < 0.008, "{}", moment(1));
        assert!((moment(2) - 1.0).abs() < 0.012, "{}", moment(2));
        assert!(moment(3).abs() < 0.03, "{}", moment(3));
        assert!((moment(4) - 3.0).abs() < 0.08, "{}", moment(4));
        let beyond =
            |limit: f64| drawn.iter().filter(|x| x.abs() > limit).count() as f64 / drawn.len() as f64;
        assert!((beyond(1.0) - 0.31731).abs() < 0.004, "{}", beyond(1.0));
        assert!((beyond(2.0) - 0.0455).abs() < 0.002, "{}", beyond(2.0));
        assert!((beyond(3.5) / 0.000_465_3 - 1.0).abs() < 0.4, "{}", beyond(3.5));
    }

    #[test]
    fn a_state_goes_on_where_it_was() {
        let mut random = Random::new(9);
        let _ = random.normal();
        let state = random.state();
        let first: Vec<u64> = (0..5).map(|_| random.normal().to_bits()).collect();
        random.set_state(state);
        let again: Vec<u64> = (0..5).map(|_| random.normal().to_bits()).collect();
        assert_eq!(first, again);
    }
}
