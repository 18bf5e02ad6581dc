//! Every function at many points: the enclosure holds the exact value and is narrow.

use super::oracle::{Oracle, encloses, powi};
use core::f64::consts::FRAC_PI_2;
use shsa_core::interval::Interval;

/// The number of cases for functions whose oracle takes some 50 microseconds.
const CASES: u32 = 10_000;

/// SplitMix64 (G. Steele, D. Lea, C. Flood, OOPSLA 2014, DOI 10.1145/2660193.2660195): the same cases in every run.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number at most four steps from plus or minus `size`, which is above zero.
    fn steps_from(&mut self, size: f64) -> f64 {
        let steps = self.below(9) as i64 - 4;
        let near = f64::from_bits(size.to_bits().wrapping_add_signed(steps));
        if self.below(2) == 0 { near } else { -near }
    }

    /// Any finite number, of any magnitude.
    fn any(&mut self) -> f64 {
        let value = f64::from_bits(self.bits());
        if value.is_finite() { value } else { self.any() }
    }

    /// Points where functions change or lose digits: everyday numbers, every magnitude, subnormal ones, the
    /// neighbourhoods of 0, 1 and the multiples of half pi, the range of the exponential.
    fn point(&mut self) -> f64 {
        match self.below(9) {
            0 => self.between(-10.0, 10.0),
            1 => self.any(),
            2 => f64::from_bits(self.bits() >> self.below(64).max(12)),
            3 => {
                let magnitude = self.below(20);
                let multiple = 1 + self.below(1 << magnitude);
                self.steps_from(multiple as f64 * FRAC_PI_2)
            }
            4 => self.steps_from(1.0),
            5 => 1.0 + self.between(-1e-3, 1e-3) * self.between(0.0, 1.0).powi(20),
            6 => self.between(-745.2, 709.8),
            7 => self.between(-1.0, 1.0),
            _ => self.below(2000) as f64 / 8.0 - 125.0,
        }
    }
}

/// The number of f64 values between the two bounds, including one of these.
fn steps_across(x: Interval) -> i64 {
    let ordinal = |value: f64| {
        let bits = value.to_bits() as i64;
        if bits < 0 { i64::MIN - bits } else { bits }
    };
    ordinal(x.hi()).saturating_sub(ordinal(x.lo()))
}

/// Compares `operation` at random points with the oracle's function called `name`; bounds may be `steps_max` apart.
#[track_caller]
fn check(name: &str, steps_max: i64, cases: u32, operation: impl Fn(Interval, Interval) -> Interval) {
    let mut oracle = Oracle::new();
    let mut random = Random(name.bytes().map(u64::from).sum());
    let mut defined = 0;
    for _ in 0..cases {
        let (x, y) = (random.point(), random.point());
        let result = operation(Interval::point(x), Interval::point(y));
        let Some(exact) = oracle.value(name, x, y) else {
            assert!(result.is_empty(), "{name}({x:?}, {y:?}) is not defined, not {result:?}");
            continue;
        };
        defined += 1;
        assert!(encloses(result, &exact), "{name}({x:?}, {y:?}) = {exact} is not in {result:?}");
        let steps = steps_across(result);
        assert!(steps <= steps_max, "{name}({x:?}, {y:?}): {result:?} is {steps} steps wide");
    }
    assert!(defined > cases / 5, "{name}: only {defined} of {cases} points were in the domain");
}

#[track_caller]
fn check_unary(name: &str, steps_max: i64, operation: impl Fn(Interval) -> Interval) {
    check(name, steps_max, CASES, |x, _| operation(x));
}

#[test]
fn sums_and_differences() {
    check("add", 1, CASES, |x, y| x + y);
    check("sub", 1, CASES, |x, y| x - y);
}

#[test]
fn products_and_quotients() {
    check("mul", 1, CASES, |x, y| x * y);
    check("div", 1, CASES, |x, y| x / y);
    check_unary("sqr", 1, Interval::sqr);
    check_unary("recip", 1, Interval::recip);
}

#[test]
fn roots() {
    check_unary("sqrt", 1, Interval::sqrt);
    check("hypot", 4, CASES, Interval::hypot);
}

#[test]
fn exponential_and_logarithm() {
    check_unary("exp", 4, Interval::exp);
    check_unary("ln", 4, Interval::ln);
}

#[test]
fn sine() {
    check_unary("sin", 4, Interval::sin);
}

#[test]
fn cosine() {
    check_unary("cos", 4, Interval::cos);
}

#[test]
fn tangent() {
    check_unary("tan", 4, Interval::tan);
}

#[test]
fn arc_sine() {
    check_unary("asin", 4, Interval::asin);
}

#[test]
fn arc_cosine() {
    check_unary("acos", 4, Interval::acos);
}

#[test]
fn arc_tangents() {
    check_unary("atan", 4, Interval::atan);
    check("atan2", 6, CASES, Interval::atan2);
}

#[test]
fn real_powers() {
    let mut random = Random(7);
    let mut oracle = Oracle::new();
    for _ in 0..CASES {
        // Bases near 1 with large exponents, and everyday bases with small exponents: most results are within f64.
        let x = random.point().abs().min(1e300);
        let y = random.between(-1.0, 1.0) * (700.0 / x.ln().abs().max(1e-9)).min(1e9);
        let result = Interval::point(x).powf(Interval::point(y));
        let Some(exact) = oracle.value("powf", x, y) else {
            assert!(result.is_empty(), "powf({x:?}, {y:?}) is not defined, not {result:?}");
            continue;
        };
        assert!(encloses(result, &exact), "powf({x:?}, {y:?}) = {exact} is not in {result:?}");
        assert!(steps_across(result) <= 4, "powf({x:?}, {y:?}): {result:?} is wide");
    }
}

#[test]
fn whole_powers() {
    let mut random = Random(11);
    for _ in 0..CASES {
        let (x, n) = (random.point(), random.below(41) as i32 - 20);
        let result = Interval::point(x).powi(n);
        let Some(exact) = powi(x, n) else {
            assert!(result.is_empty(), "{x:?}^{n} is not defined, not {result:?}");
            continue;
        };
        assert!(encloses(result, &exact), "{x:?}^{n} = {exact} is not in {result:?}");
        // The reciprocal of a power near the largest or smallest number loses digits.
        assert!(n < 0 || steps_across(result) <= 4, "{x:?}^{n}: {result:?} is wide");
    }
}
