//! Real functions to 64 correctly rounded bits or more, by `astro-float`.
//!
//! Rounding never moves a number across an f64. So a value within f64 bounds stays within them when rounded to 64 bits, and a
//! value outside stays outside.

use astro_float_num::{BigFloat, Consts, RoundingMode};
use shsa_core::interval::Interval;

const BITS: usize = 64;
/// The precision of intermediate results.
const MORE_BITS: usize = 256;
const NEAREST: RoundingMode = RoundingMode::ToEven;

/// The functions, and their common constants.
pub(crate) struct Oracle {
    constants: Consts,
}

impl Oracle {
    pub(crate) fn new() -> Oracle {
        Oracle { constants: Consts::new().unwrap() }
    }

    /// The value of the function called `name`; `None` where it is undefined. `y` counts only for binary functions.
    pub(crate) fn value(&mut self, name: &str, x: f64, y: f64) -> Option<BigFloat> {
        arithmetic(name, x, y).unwrap_or_else(|| self.elementary(name, x, y))
    }

    fn elementary(&mut self, name: &str, x: f64, y: f64) -> Option<BigFloat> {
        let c = &mut self.constants;
        let b = big(x);
        match name {
            "exp" => Some(b.exp(BITS, NEAREST, c)),
            "ln" => (x > 0.0).then(|| b.ln(BITS, NEAREST, c)),
            "sin" => Some(b.sin(BITS, NEAREST, c)),
            "cos" => Some(b.cos(BITS, NEAREST, c)),
            "tan" => Some(b.tan(BITS, NEAREST, c)),
            "asin" => (x.abs() <= 1.0).then(|| b.asin(BITS, NEAREST, c)),
            "acos" => (x.abs() <= 1.0).then(|| b.acos(BITS, NEAREST, c)),
            "atan" => Some(b.atan(BITS, NEAREST, c)),
            "atan2" => self.atan2(x, y),
            "powf" => self.powf(x, y),
            _ => panic!("no function called {name}"),
        }
    }

    fn atan2(&mut self, y: f64, x: f64) -> Option<BigFloat> {
        let c = &mut self.constants;
        if x == 0.0 {
            let half_pi = c.pi(BITS, NEAREST).div(&big(2.0), BITS, NEAREST);
            return (y != 0.0).then(|| if y > 0.0 { half_pi } else { half_pi.neg() });
        }
        let angle = big(y).div(&big(x), MORE_BITS, NEAREST).atan(MORE_BITS, NEAREST, c);
        let pi = c.pi(MORE_BITS, NEAREST);
        Some(match () {
            () if x > 0.0 => angle,
            () if y >= 0.0 => angle.add(&pi, MORE_BITS, NEAREST),
            () => angle.sub(&pi, MORE_BITS, NEAREST),
        })
    }

    fn powf(&mut self, x: f64, y: f64) -> Option<BigFloat> {
        match () {
            () if x < 0.0 || (x == 0.0 && y < 0.0) => None,
            () if y == 0.0 => Some(big(1.0)),
            () if x == 0.0 => Some(big(0.0)),
            () => Some(big(x).pow(&big(y), BITS, NEAREST, &mut self.constants)),
        }
    }
}

/// The inner `None`: undefined there. The outer one: a function of another kind.
fn arithmetic(name: &str, x: f64, y: f64) -> Option<Option<BigFloat>> {
    let (a, b) = (big(x), big(y));
    Some(match name {
        "neg" => Some(a.neg()),
        "add" => Some(a.add(&b, BITS, NEAREST)),
        "sub" => Some(a.sub(&b, BITS, NEAREST)),
        "mul" => Some(a.mul(&b, BITS, NEAREST)),
        "div" => (y != 0.0).then(|| a.div(&b, BITS, NEAREST)),
        "recip" => (x != 0.0).then(|| big(1.0).div(&a, BITS, NEAREST)),
        "sqr" => Some(a.mul(&a, BITS, NEAREST)),
        "sqrt" => (x >= 0.0).then(|| a.sqrt(BITS, NEAREST)),
        "hypot" => Some(hypot(&a, &b)),
        "abs" => Some(big(x.abs())),
        "min" => Some(big(x.min(y))),
        "max" => Some(big(x.max(y))),
        "floor" => Some(big(x.floor())),
        "ceil" => Some(big(x.ceil())),
        "round" => Some(big(x.round())),
        "sign" => Some(big(if x == 0.0 { 0.0 } else { x.signum() })),
        _ => return None,
    })
}

fn hypot(a: &BigFloat, b: &BigFloat) -> BigFloat {
    let square = |v: &BigFloat| v.mul(v, MORE_BITS, NEAREST);
    square(a).add(&square(b), MORE_BITS, NEAREST).sqrt(MORE_BITS, NEAREST)
}

/// `x^n`.
pub(crate) fn powi(x: f64, n: i32) -> Option<BigFloat> {
    let power = big(x).powi(n.unsigned_abs() as usize, MORE_BITS, NEAREST);
    if n >= 0 { Some(power) } else { (x != 0.0).then(|| power.reciprocal(MORE_BITS, NEAREST)) }
}

/// A finite f64, exactly.
pub(crate) fn big(x: f64) -> BigFloat {
    const SCALE: i32 = 200;
    if x == 0.0 || x.is_normal() {
        return BigFloat::from_f64(x, BITS);
    }
    // `from_f64` halves subnormal numbers (astro-float 0.9.6).
    let mut scaled = BigFloat::from_f64(x * 2f64.powi(SCALE), BITS);
    let exponent = scaled.exponent().unwrap();
    scaled.set_exponent(exponent - SCALE);
    scaled
}

/// Whether `value` lies within the bounds.
pub(crate) fn encloses(bounds: Interval, value: &BigFloat) -> bool {
    let above = bounds.lo() == f64::NEG_INFINITY || value.cmp(&big(bounds.lo())).unwrap() >= 0;
    let below = bounds.hi() == f64::INFINITY || value.cmp(&big(bounds.hi())).unwrap() <= 0;
    !bounds.is_empty() && above && below
}
