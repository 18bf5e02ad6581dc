//! Sine, cosine, tangent and their inverses; angles in radians.

use super::Interval;
use super::elementary::{near, near_or_zero};

/// The range of sine and cosine.
const UNIT: Interval = Interval { lo: -1.0, hi: 1.0 };
/// Pi; its nearest f64 lies below it.
const PI: Interval = Interval { lo: core::f64::consts::PI, hi: core::f64::consts::PI.next_up() };
/// Half of pi, likewise.
const HALF_PI: Interval =
    Interval { lo: core::f64::consts::FRAC_PI_2, hi: core::f64::consts::FRAC_PI_2.next_up() };
/// Quarter turns in a radian; the nearest f64 lies above it.
const QUARTERS: Interval =
    Interval { lo: core::f64::consts::FRAC_2_PI.next_down(), hi: core::f64::consts::FRAC_2_PI };
/// Beyond this, quarter turns are not counted, as f64 has no fractions there.
const QUARTERS_MAX: f64 = 1e15;

impl Interval {
    /// `{sin x}`, within -1 and 1; exactly 0 at 0.
    ///
    /// A point is enclosed closely at any magnitude. A wider interval gives `[-1, 1]` when its bounds are beyond about 1e15; from
    /// about 1e8 on, a crest near a bound may be included.
    #[must_use]
    pub fn sin(self) -> Interval {
        self.wave(1, |x| near_or_zero(libm::sin(x)))
    }

    /// `{cos x}`, within -1 and 1; exactly 1 at 0. Large arguments as for `sin`.
    #[must_use]
    pub fn cos(self) -> Interval {
        self.wave(0, |x| if x == 0.0 { Interval { lo: 1.0, hi: 1.0 } } else { near(libm::cos(x)) })
    }

    /// `{tan x}`; every number when a pole lies (or, by rounding, may lie) inside. Exactly 0 at 0.
    ///
    /// A point never is a pole, because no f64 but 0 is a multiple of half pi.
    #[must_use]
    pub fn tan(self) -> Interval {
        if !self.is_bounded() {
            return if self.is_empty() { Interval::EMPTY } else { Interval::ENTIRE };
        }
        if !self.is_point() && (self * QUARTERS).meets(1, 2) {
            return Interval::ENTIRE;
        }
        self.increasing(|x| near_or_zero(libm::tan(x)))
    }

    /// `{asin x, -1 <= x <= 1}`, within half pi of 0; exactly 0 at 0.
    #[must_use]
    pub fn asin(self) -> Interval {
        let inside = self.intersection(UNIT);
        inside.increasing(|x| near_or_zero(libm::asin(x))).intersection(HALF_PI.hull(-HALF_PI))
    }

    /// `{acos x, -1 <= x <= 1}`, from 0 to pi; exactly 0 at 1.
    #[must_use]
    pub fn acos(self) -> Interval {
        // The arc cosine is decreasing, so it is computed as an increasing function of -x.
        let mirrored = -self.intersection(UNIT);
        mirrored.increasing(|x| near_or_zero(libm::acos(-x))).intersection(Interval { lo: 0.0, hi: PI.hi })
    }

    /// `{atan x}`, within half pi of 0; exactly 0 at 0.
    #[must_use]
    pub fn atan(self) -> Interval {
        self.increasing(|x| near_or_zero(libm::atan(x))).intersection(HALF_PI.hull(-HALF_PI))
    }

    /// `{angle of the point (x, y) from the positive x axis}`, above -pi and up to pi; `self` is `y`.
    ///
    /// Not defined at `(0, 0)`: empty there. Where the box meets the negative x axis from below, the angle jumps
    /// from -pi to pi, and the result is `[-pi, pi]`.
    #[must_use]
    pub fn atan2(self, x: Interval) -> Interval {
        let y = self;
        if y.is_empty() || x.is_empty() {
            Interval::EMPTY
        } else if x.lo < 0.0 && y.lo < 0.0 && y.hi >= 0.0 {
            PI.hull(-PI)
        } else if y.lo >= 0.0 {
            angles_above(y, x)
        } else if y.hi <= 0.0 {
            -angles_above(-y, x)
        } else {
            Interval { lo: angle(y.lo, x.lo).lo, hi: angle(y.hi, x.lo).hi }
        }
    }

    /// A wave between -1 and 1 whose crests lie `crest` quarter turns (and whole turns) from 0, from enclosures
    /// at points.
    fn wave(self, crest: i64, at: impl Fn(f64) -> Interval) -> Interval {
        if !self.is_bounded() {
            return if self.is_empty() { Interval::EMPTY } else { UNIT };
        }
        if self.is_point() {
            return at(self.lo).intersection(UNIT);
        }
        let quarters = self * QUARTERS;
        let ends = at(self.lo).hull(at(self.hi)).intersection(UNIT);
        Interval {
            lo: if quarters.meets(crest + 2, 4) { -1.0 } else { ends.lo },
            hi: if quarters.meets(crest, 4) { 1.0 } else { ends.hi },
        }
    }

    /// Whether the interval contains a whole number that leaves `remainder` when divided by `modulus`; true when that is unclear.
    fn meets(self, remainder: i64, modulus: i64) -> bool {
        if !(self.lo > -QUARTERS_MAX && self.hi < QUARTERS_MAX) {
            return true;
        }
        let truncated = self.lo as i64;
        let first = truncated + i64::from((truncated as f64) < self.lo);
        let met = first + (remainder - first).rem_euclid(modulus);
        met as f64 <= self.hi
    }
}

/// `atan2` for `y` not below 0, both not empty: decreasing in `x`; increasing in `y` right of the y axis, else decreasing.
fn angles_above(y: Interval, x: Interval) -> Interval {
    if y.hi == 0.0 {
        return angles_on_axis(x);
    }
    let lo = angle(if x.hi > 0.0 { y.lo } else { y.hi }, x.hi).lo;
    let hi = angle(if x.lo < 0.0 { y.lo } else { y.hi }, x.lo).hi;
    Interval { lo: lo.max(0.0), hi: hi.min(PI.hi) }
}

/// `atan2` for `y = 0`: 0 to the right, pi to the left, nothing at the origin.
fn angles_on_axis(x: Interval) -> Interval {
    let right = if x.hi > 0.0 { Interval { lo: 0.0, hi: 0.0 } } else { Interval::EMPTY };
    let left = if x.lo < 0.0 { PI } else { Interval::EMPTY };
    right.hull(left)
}

/// The enclosure of `atan2` at a point. `libm` divides first and then takes the arc tangent, hence one more step.
fn angle(y: f64, x: f64) -> Interval {
    if y == 0.0 && x >= 0.0 {
        return Interval { lo: 0.0, hi: 0.0 };
    }
    // Adding zero turns a negative zero, which would be on the other side of the cut, into a positive one.
    let wide = near(libm::atan2(y + 0.0, x + 0.0));
    Interval { lo: wide.lo.next_down(), hi: wide.hi.next_up() }
}
