//! Single operations on f64 rounded down or up, without switching the processor's rounding mode.
//!
//! Each operation computes the result rounded to nearest, then the exact sign of the rounding error, and steps to the neighbour
//! only where needed. So exact results stay exact, and the bounds are the tightest.

/// `a + b` rounded down. Both infinite with opposite signs: not-a-number.
#[inline]
pub(super) fn add_down(a: f64, b: f64) -> f64 {
    let (sum, error) = two_sum(a, b);
    // A not-a-number error (an overflow) steps too, back from infinity or on as not-a-number.
    let keeps = (error >= 0.0) | (sum == f64::NEG_INFINITY);
    let step = i64::from(!keeps);
    stepped(sum, if sum < 0.0 { step } else { -step })
}

/// `a + b` rounded up. Both infinite with opposite signs: not-a-number.
#[inline]
pub(super) fn add_up(a: f64, b: f64) -> f64 {
    -add_down(-a, -b)
}

/// `a * b` rounded down; zero times anything, infinities too, is zero.
#[inline]
pub(super) fn mul_down(a: f64, b: f64) -> f64 {
    down(product(a, b))
}

/// `a * b` rounded up; zero times anything, infinities too, is zero.
#[inline]
pub(super) fn mul_up(a: f64, b: f64) -> f64 {
    up(product(a, b))
}

/// `a / b` rounded down, for `b` not zero and at most one of the two infinite.
#[inline]
pub(super) fn div_down(a: f64, b: f64) -> f64 {
    down(quotient(a, b))
}

/// `a / b` rounded up, for `b` not zero and at most one of the two infinite.
#[inline]
pub(super) fn div_up(a: f64, b: f64) -> f64 {
    up(quotient(a, b))
}

/// The square root of `a >= 0`, rounded down.
#[inline]
pub(super) fn sqrt_down(a: f64) -> f64 {
    down(root(a))
}

/// The square root of `a >= 0`, rounded up.
#[inline]
pub(super) fn sqrt_up(a: f64) -> f64 {
    up(root(a))
}

/// A result rounded to nearest.
#[derive(Clone, Copy)]
struct Nearest {
    value: f64,
    /// The sign of `|exact| - |value|`.
    excess: i64,
}

#[inline]
fn down(Nearest { value, excess }: Nearest) -> f64 {
    let step = if value.is_sign_negative() { i64::from(excess > 0) } else { -i64::from(excess < 0) };
    stepped(value, step)
}

#[inline]
fn up(Nearest { value, excess }: Nearest) -> f64 {
    let step = if value.is_sign_negative() { -i64::from(excess < 0) } else { i64::from(excess > 0) };
    stepped(value, step)
}

/// The neighbour of `value` that is larger (`step` 1) or smaller (-1) in magnitude, or itself (0).
///
/// Branch-free: rounding errors are random, so a branch would be mispredicted half of the time.
#[inline]
fn stepped(value: f64, step: i64) -> f64 {
    f64::from_bits(value.to_bits().wrapping_add_signed(step))
}

/// The rounded sum and its exact error (Knuth's TwoSum; not-a-number after an overflow).
///
/// Source: S. Boldo, S. Graillat, J.-M. Muller, "On the robustness of the 2Sum and Fast2Sum algorithms", ACM TOMS
/// 2017 (DOI 10.1145/3054947).
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    (sum, (a - a_part) + (b - b_part))
}

#[inline]
fn product(a: f64, b: f64) -> Nearest {
    let value = a * b;
    match normal_excess(a, b, value) {
        Some(excess) => Nearest { value, excess },
        None => product_at_edge(a, b),
    }
}

#[inline]
fn quotient(a: f64, b: f64) -> Nearest {
    let value = a / b;
    // The quotient's error has the sign of what the quotient times the divisor lacks of the dividend.
    match normal_excess(value, b, a) {
        Some(excess) => Nearest { value, excess: -excess },
        None => quotient_at_edge(a, b),
    }
}

#[inline]
fn root(a: f64) -> Nearest {
    let value = libm::sqrt(a);
    match normal_excess(value, value, a) {
        Some(excess) => Nearest { value, excess: -excess },
        None if a == 0.0 || a == f64::INFINITY => Nearest { value, excess: 0 },
        None => Nearest { value, excess: -excess_of_product(value, value, a) },
    }
}

#[cold]
fn product_at_edge(a: f64, b: f64) -> Nearest {
    let value = a * b;
    if a == 0.0 || b == 0.0 {
        Nearest { value: 0.0, excess: 0 }
    } else if a.is_infinite() || b.is_infinite() {
        Nearest { value, excess: 0 }
    } else if value.is_infinite() {
        Nearest { value, excess: -1 }
    } else {
        Nearest { value, excess: excess_of_product(a, b, value) }
    }
}

#[cold]
fn quotient_at_edge(a: f64, b: f64) -> Nearest {
    let value = a / b;
    if a == 0.0 || b.is_infinite() {
        Nearest { value: 0.0, excess: 0 }
    } else if a.is_infinite() {
        Nearest { value, excess: 0 }
    } else if value.is_infinite() {
        Nearest { value, excess: -1 }
    } else {
        Nearest { value, excess: -excess_of_product(value, b, a) }
    }
}

const FRACTION_BITS: u32 = 52;
const IMPLICIT_BIT: u64 = 1 << FRACTION_BITS;
const EXPONENT_MASK: u64 = 0x7ff;
/// The sum of two biased exponents exceeds that of the product by this, when mantissas are whole numbers.
const PRODUCT_BIAS: u64 = 1023 + FRACTION_BITS as u64;

/// `|a * b| - |c|` in units of the last place of the exact product, when `c` is near `a * b` and all three are
/// normal numbers; `None` when one is not.
///
/// The difference is below half a unit of the last place of `c` (or, for a quotient or a root, of what was
/// rounded), so below 2^53 in units of the product's last place. Hence the lowest 64 bits of the 106-bit product
/// hold it, and wrapping arithmetic gives it exactly.
#[inline]
fn normal_excess(a: f64, b: f64, c: f64) -> Option<i64> {
    let (ea, eb, ec) = (biased_exponent(a), biased_exponent(b), biased_exponent(c));
    let normal = |exponent: u64| exponent.wrapping_sub(1) < EXPONENT_MASK - 1;
    if !(normal(ea) & normal(eb) & normal(ec)) {
        return None;
    }
    let shift = ec.wrapping_add(PRODUCT_BIAS).wrapping_sub(ea + eb);
    let exact = mantissa(a).wrapping_mul(mantissa(b));
    let rounded = mantissa(c).wrapping_shl(shift as u32);
    Some(exact.wrapping_sub(rounded) as i64)
}

#[inline]
fn biased_exponent(x: f64) -> u64 {
    (x.to_bits() >> FRACTION_BITS) & EXPONENT_MASK
}

/// The mantissa of a normal number as a whole number.
#[inline]
fn mantissa(x: f64) -> u64 {
    (x.to_bits() & (IMPLICIT_BIT - 1)) | IMPLICIT_BIT
}

/// The sign of `|a * b| - |c|` for any finite numbers.
fn excess_of_product(a: f64, b: f64, c: f64) -> i64 {
    let ((ma, ea), (mb, eb), (mc, ec)) = (decomposed(a), decomposed(b), decomposed(c));
    let shift = ec - ea - eb;
    let exact = shifted(u128::from(ma) * u128::from(mb), -shift);
    exact.cmp(&shifted(u128::from(mc), shift)) as i64
}

/// `(m, e)` with `|x| = m * 2^e`, subnormal numbers and zero included.
fn decomposed(x: f64) -> (u64, i32) {
    let exponent = biased_exponent(x);
    if exponent == 0 {
        (x.abs().to_bits(), -1074)
    } else {
        (mantissa(x), exponent as i32 - PRODUCT_BIAS as i32)
    }
}

/// `m * 2^by`, at most the largest number; unchanged when `by` is negative.
fn shifted(m: u128, by: i32) -> u128 {
    let by = by.max(0) as u32;
    if m == 0 {
        0
    } else if by >= m.leading_zeros() {
        u128::MAX
    } else {
        m << by
    }
}
