//! The SI exponents of a quantity, with angles and amounts of data as base dimensions of their own.

use core::fmt;

/// Exponents of length, mass, time, current, temperature, amount, luminous intensity, angle and data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Dimension {
    exponents: [i8; 9],
}

const ANGLE: usize = 7;
const DATA: usize = 8;
const SYMBOLS: [&str; 9] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad", "B"];
/// The places of the symbols above in the exponents: mass is written before length.
const ORDER: [usize; 9] = [1, 0, 2, 3, 4, 5, 6, ANGLE, DATA];
/// Dimensions that have a better known name.
const NAMED: [([i8; 9], &str); 10] = [
    ([1, 1, -2, 0, 0, 0, 0, 0, 0], "N"),
    ([-1, 1, -2, 0, 0, 0, 0, 0, 0], "Pa"),
    ([2, 1, -2, 0, 0, 0, 0, 0, 0], "J"),
    ([2, 1, -3, 0, 0, 0, 0, 0, 0], "W"),
    ([2, 1, -3, -1, 0, 0, 0, 0, 0], "V"),
    ([2, 1, -3, -2, 0, 0, 0, 0, 0], "ohm"),
    ([-2, -1, 4, 2, 0, 0, 0, 0, 0], "F"),
    ([2, 1, -2, -2, 0, 0, 0, 0, 0], "H"),
    ([0, 1, -2, -1, 0, 0, 0, 0, 0], "T"),
    ([0, 0, 1, 1, 0, 0, 0, 0, 0], "A*s"),
];

impl Dimension {
    /// The dimension of a plain number.
    pub const PLAIN: Dimension = Dimension::of([0; 9]);
    /// The dimension of a length.
    pub const LENGTH: Dimension = Dimension::of([1, 0, 0, 0, 0, 0, 0, 0, 0]);
    /// The dimension of a time.
    pub const TIME: Dimension = Dimension::of([0, 0, 1, 0, 0, 0, 0, 0, 0]);
    /// The dimension of an angle.
    pub const ANGLE: Dimension = Dimension::of([0, 0, 0, 0, 0, 0, 0, 1, 0]);
    /// The dimension of a frequency.
    pub const FREQUENCY: Dimension = Dimension::of([0, 0, -1, 0, 0, 0, 0, 0, 0]);
    /// The dimension of an amount of data.
    pub const DATA: Dimension = Dimension::of([0, 0, 0, 0, 0, 0, 0, 0, 1]);

    /// The dimension of exponents in the order of the type's description.
    #[must_use]
    pub const fn of(exponents: [i8; 9]) -> Dimension {
        Dimension { exponents }
    }

    /// The exponents in the order of the type's description.
    #[must_use]
    pub const fn exponents(self) -> [i8; 9] {
        self.exponents
    }

    /// The dimension of a product; `None` when an exponent leaves its range.
    #[must_use]
    pub fn times(self, other: Dimension) -> Option<Dimension> {
        self.zip(other, i8::checked_add)
    }

    /// The dimension of a quotient; `None` when an exponent leaves its range.
    #[must_use]
    pub fn over(self, other: Dimension) -> Option<Dimension> {
        self.zip(other, i8::checked_sub)
    }

    /// The dimension of a power; `None` when an exponent leaves its range.
    #[must_use]
    pub fn power(self, exponent: i8) -> Option<Dimension> {
        self.zip(self, |own, _| own.checked_mul(exponent))
    }

    /// The dimension of a root; `None` when an exponent is no multiple of `degree`.
    #[must_use]
    pub fn root(self, degree: i8) -> Option<Dimension> {
        self.zip(self, |own, _| (own.checked_rem(degree)? == 0).then_some(own.checked_div(degree)?))
    }

    /// The dimension without its angle.
    #[must_use]
    pub const fn without_angle(self) -> Dimension {
        let [length, mass, time, current, temperature, amount, intensity, _, data] = self.exponents;
        Dimension::of([length, mass, time, current, temperature, amount, intensity, 0, data])
    }

    /// The exponent of the angle.
    #[must_use]
    pub const fn angle(self) -> i8 {
        let [.., angle, _] = self.exponents;
        angle
    }

    fn zip(self, other: Dimension, with: impl Fn(i8, i8) -> Option<i8>) -> Option<Dimension> {
        let mut exponents = [0; 9];
        let pairs = self.exponents.iter().zip(other.exponents);
        for (result, (own, its)) in exponents.iter_mut().zip(pairs) {
            *result = with(*own, its)?;
        }
        Some(Dimension { exponents })
    }

    fn power_of(self, place: usize) -> i8 {
        self.exponents.get(place).copied().unwrap_or(0)
    }
}

impl fmt::Display for Dimension {
    /// `m/s^2`, `V`, `rad`, `1` for a plain number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((_, name)) = NAMED.iter().find(|(exponents, _)| *exponents == self.exponents) {
            return f.write_str(name);
        }
        let mut first = true;
        for (place, symbol) in ORDER.into_iter().zip(SYMBOLS).filter(|&(place, _)| self.power_of(place) > 0) {
            f.write_str(if first { "" } else { "*" })?;
            write_power(f, symbol, self.power_of(place))?;
            first = false;
        }
        if first {
            f.write_str("1")?;
        }
        for (place, symbol) in ORDER.into_iter().zip(SYMBOLS).filter(|&(place, _)| self.power_of(place) < 0) {
            f.write_str("/")?;
            write_power(f, symbol, self.power_of(place))?;
        }
        Ok(())
    }
}

fn write_power(f: &mut fmt::Formatter<'_>, symbol: &str, exponent: i8) -> fmt::Result {
    match exponent.unsigned_abs() {
        1 => f.write_str(symbol),
        power => write!(f, "{symbol}^{power}"),
    }
}
