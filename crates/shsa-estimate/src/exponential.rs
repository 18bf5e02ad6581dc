//! The exponential function of many numbers at once, none above zero, as weights of particles are compared.
//!
//! `libm::exp` tells cases apart by branches. This one has none, so that the loop over all numbers becomes vector instructions.

use std::f64::consts::LOG2_E;

/// Added to a number, it leaves the number's integral part, rounded, in the lowest bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// The logarithm of 2: its leading bits, whose product with an exponent is exact, and the rest.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// Below it the result is 0, as it would be subnormal.
const LEAST: f64 = -708.0;
/// 1 / k!. The first term left out is below 1e-17 for arguments up to half of the logarithm of 2.
const SERIES: [f64; 14] = [
    1.0,
    1.0,
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// `numbers <- exp(numbers)`, none of them above 0; not-a-number stays. Relative error below 1e-15.
pub(crate) fn exp_all(numbers: &mut [f64]) {
    numbers.iter_mut().for_each(|number| *number = exp(*number));
}

/// `exp(x) = 2^n exp(r)` for `x = n ln 2 + r`.
#[inline(always)]
fn exp(x: f64) -> f64 {
    let shifted = x * LOG2_E + ROUNDER;
    let n = shifted - ROUNDER;
    let r = x - n * LN_2[0] - n * LN_2[1];
    let sum = SERIES.iter().rev().fold(0.0, |sum, term| sum * r + term);
    // The exponent of a power of two is all of its bits.
    let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    if x < LEAST { 0.0 } else { sum * power }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_exponential_function() {
        let numbers: Vec<f64> = (0..1_000_000).map(|i| -0.000_7 * f64::from(i)).collect();
        let mut found = numbers.clone();
        exp_all(&mut found);
        for (x, found) in numbers.iter().zip(found) {
            let wanted = libm::exp(*x);
            assert!((found - wanted).abs() <= 1e-15 * wanted, "exp({x}) is {wanted}, not {found}");
        }
    }

    #[test]
    fn what_has_no_weight_is_zero() {
        let mut numbers = [f64::NEG_INFINITY, -1e300, -709.0, -0.0, f64::NAN];
        exp_all(&mut numbers);
        assert_eq!(numbers[..4], [0.0, 0.0, 0.0, 1.0]);
        assert!(numbers[4].is_nan());
    }
}
