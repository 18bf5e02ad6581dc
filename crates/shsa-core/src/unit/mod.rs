//! Units: SI exponents with scale and offset, as values.
//!
//! The core computes in coherent SI units only (angles in radians); a unit converts at the interface: `value_si = value * scale +
//! offset`. An angle is a base dimension of its own, so that angles and plain numbers are told apart. A unit with an offset
//! (`degC`, `degF`) only converts: inside a compound (`degC/s`) it is a difference and has no offset.

mod dimension;
mod table;

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::{String, ToString};
use core::fmt;
use core::ops::Range;

use crate::interval::Interval;
pub use dimension::Dimension;
pub(crate) use table::{is_unit_char, is_unit_name};
pub use table::{known, nearest, prefixes};

/// The longest text of a unit in bytes.
const MAX_TEXT: usize = 200;
/// The deepest nesting of parentheses in a unit.
const MAX_DEPTH: usize = 8;

/// A unit of a quantity: its dimension, its size in SI, and its zero.
#[derive(Clone, Debug)]
pub struct Unit {
    /// The SI exponents.
    pub dimension: Dimension,
    /// The size in coherent SI units; positive.
    pub scale: f64,
    /// The SI value of the unit's zero; not 0 for `degC` and `degF` only.
    pub offset: f64,
    text: String,
}

impl PartialEq for Unit {
    fn eq(&self, other: &Unit) -> bool {
        self.dimension == other.dimension && self.scale == other.scale && self.offset == other.offset
    }
}

/// The error of a text that is no unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitError {
    /// The problem, naming the part.
    pub message: String,
    /// The nearest known unit, if one is near.
    pub nearest: Option<String>,
    /// The place in the text, in bytes.
    pub span: Range<usize>,
}

impl fmt::Display for UnitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        match &self.nearest {
            Some(nearest) => write!(f, "; did you mean `{nearest}`?"),
            None => Ok(()),
        }
    }
}

impl core::error::Error for UnitError {}

impl Unit {
    /// The coherent SI unit of a dimension.
    #[must_use]
    pub fn si(dimension: Dimension) -> Unit {
        Unit { dimension, scale: 1.0, offset: 0.0, text: dimension.to_string() }
    }

    /// The unit of a plain number.
    #[must_use]
    pub fn one() -> Unit {
        Unit::si(Dimension::PLAIN)
    }

    /// Reads `m/s^2`, `deg`, `km/h`, `degC`, `%`, `kg*m^2`, `N m`, `J/(kg K)`, `m²`, `µV`, `1/s`, ...
    ///
    /// Products are written `*`, `·` or a blank; `/` divides by the next factor only; SI prefixes go with the
    /// units that take them.
    ///
    /// # Errors
    /// An unknown name, with the nearest known one; a text that is no product of powers of units; exponents beyond 127.
    pub fn parse(text: &str) -> Result<Unit, UnitError> {
        let trimmed = text.trim();
        if trimmed.len() > MAX_TEXT {
            return Err(UnitError {
                message: "this unit is too long".to_owned(),
                nearest: None,
                span: 0..text.len(),
            });
        }
        let start = text.len() - text.trim_start().len();
        let mut reader = Reader { text: trimmed, at: 0, start };
        let product = reader.product(0)?;
        if reader.at < trimmed.len() {
            return Err(reader.error("this is no part of a unit"));
        }
        let scale = product.over / product.under;
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(reader.error("the size of this unit is beyond all bounds"));
        }
        let offset = if product.factors == 1 { product.offset } else { 0.0 };
        Ok(Unit { dimension: product.dimension, scale, offset, text: trimmed.to_owned() })
    }

    /// Whether values in this unit are SI values already.
    #[must_use]
    pub fn is_si(&self) -> bool {
        self.scale == 1.0 && self.offset == 0.0
    }

    /// Whether the zero is a convention, as for `degC` and `degF`: values are points, of which only differences count.
    #[must_use]
    pub fn is_affine(&self) -> bool {
        self.offset != 0.0
    }

    /// A value of this unit in SI, rounded to nearest.
    #[must_use]
    pub fn to_si(&self, value: f64) -> f64 {
        value * self.scale + self.offset
    }

    /// An SI value in this unit, rounded to nearest.
    #[must_use]
    pub fn from_si(&self, value: f64) -> f64 {
        (value - self.offset) / self.scale
    }

    /// Converts a difference or tolerance in this unit to SI, without the offset.
    #[must_use]
    pub fn to_si_difference(&self, value: f64) -> f64 {
        value * self.scale
    }

    /// An interval of this unit in SI, rounded outward; exact when the unit is SI.
    #[must_use]
    pub fn to_si_interval(&self, value: Interval) -> Interval {
        if self.is_si() { value } else { self.to_si_difference_interval(value) + self.offset_enclosed() }
    }

    /// An SI interval in this unit, rounded outward; exact when the unit is SI.
    #[must_use]
    pub fn from_si_interval(&self, value: Interval) -> Interval {
        if self.is_si() { value } else { (value - self.offset_enclosed()) / enclosed(self.scale) }
    }

    /// Converts an interval of differences or tolerances in this unit to SI, rounded outward, without the offset.
    #[must_use]
    pub fn to_si_difference_interval(&self, value: Interval) -> Interval {
        if self.scale == 1.0 { value } else { value * enclosed(self.scale) }
    }

    fn offset_enclosed(&self) -> Interval {
        if self.offset == 0.0 { Interval::point(0.0) } else { enclosed(self.offset) }
    }
}

/// A written number with its rounding: whole numbers are exact, all others within two units in the last place.
pub(crate) fn enclosed(size: f64) -> Interval {
    if libm::trunc(size) == size && size.abs() < 9e15 {
        return Interval::point(size);
    }
    Interval::new(size.next_down().next_down(), size.next_up().next_up())
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// A product of factors under construction; the size as a quotient, so that `km/h` is rounded once.
struct Product {
    dimension: Dimension,
    over: f64,
    under: f64,
    offset: f64,
    factors: usize,
}

impl Product {
    const ONE: Product =
        Product { dimension: Dimension::PLAIN, over: 1.0, under: 1.0, offset: 0.0, factors: 0 };

    /// This times `factor^exponent`.
    fn times(self, factor: &Product, exponent: i8) -> Option<Product> {
        let dimension = self.dimension.times(factor.dimension.power(exponent)?)?;
        let power = libm::pow(factor.over, f64::from(exponent).abs());
        let root = libm::pow(factor.under, f64::from(exponent).abs());
        let (over, under) = if exponent < 0 { (root, power) } else { (power, root) };
        Some(Product {
            dimension,
            over: self.over * over,
            under: self.under * under,
            offset: if exponent == 1 { factor.offset } else { 0.0 },
            factors: self.factors + factor.factors + usize::from(exponent != 1),
        })
    }
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    start: usize,
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or("")
    }

    fn error(&self, message: &str) -> UnitError {
        let span = self.start + self.at..self.start + self.text.len().max(self.at);
        UnitError { message: format!("{message}: `{}`", self.text), nearest: None, span }
    }

    fn take(&mut self, c: char) -> bool {
        let found = self.rest().starts_with(c);
        self.at += if found { c.len_utf8() } else { 0 };
        found
    }

    /// Skips blanks; returns whether there were any.
    fn blanks(&mut self) -> bool {
        let rest = self.rest();
        let skipped = rest.len() - rest.trim_start_matches([' ', '\t']).len();
        self.at += skipped;
        skipped > 0
    }

    fn product(&mut self, depth: usize) -> Result<Product, UnitError> {
        let mut product = Product::ONE;
        let mut sign = 1;
        loop {
            self.blanks();
            let factor = self.factor(depth)?;
            let exponent = self.exponent()?;
            product = product
                .times(&factor, exponent.saturating_mul(sign))
                .ok_or_else(|| self.error("the exponents of this unit are too large"))?;
            match self.operator() {
                Some(next) => sign = next,
                None => return Ok(product),
            }
        }
    }

    /// The sign of the next factor's exponent, when there is a next factor.
    fn operator(&mut self) -> Option<i8> {
        let blank = self.blanks();
        if self.take('/') {
            return Some(-1);
        }
        if self.take('*') || self.take('·') {
            return Some(1);
        }
        (blank && self.rest().chars().next().is_some_and(|c| is_unit_char(c) || c == '(')).then_some(1)
    }

    fn factor(&mut self, depth: usize) -> Result<Product, UnitError> {
        if self.take('(') {
            if depth == MAX_DEPTH {
                return Err(self.error("this unit is nested too deeply"));
            }
            let inner = self.product(depth + 1)?;
            self.blanks();
            return if self.take(')') { Ok(inner) } else { Err(self.error("a `)` is missing in this unit")) };
        }
        if self.rest().starts_with('1') {
            self.at += 1;
            return Ok(Product::ONE);
        }
        let rest = self.rest();
        let name = rest.get(..rest.find(|c| !is_unit_char(c)).unwrap_or(rest.len())).unwrap_or("");
        if name.is_empty() {
            return Err(self.error(if self.text.is_empty() {
                "a unit is missing"
            } else {
                "a unit's name is missing"
            }));
        }
        let size = table::look_up(name).ok_or_else(|| self.unknown(name))?;
        self.at += name.len();
        Ok(Product {
            dimension: size.dimension,
            over: size.over,
            under: size.under,
            offset: size.offset,
            factors: 1,
        })
    }

    fn unknown(&self, name: &str) -> UnitError {
        let start = self.start + self.at;
        UnitError {
            message: format!("`{name}` is no unit known here"),
            nearest: table::nearest_unit(name),
            span: start..start + name.len(),
        }
    }

    /// `^2`, `^-1`, `²`, `⁻¹`; 1 when there is none.
    fn exponent(&mut self) -> Result<i8, UnitError> {
        let caret = self.take('^');
        let negative = if caret { self.take('-') } else { self.take('⁻') };
        let mut digits = String::new();
        while let Some((digit, length)) = self.digit(caret) {
            digits.push(digit);
            self.at += length;
        }
        if digits.is_empty() && !caret && !negative {
            return Ok(1);
        }
        match digits.parse::<i8>() {
            Ok(exponent) => Ok(if negative { -exponent } else { exponent }),
            Err(_) => Err(self.error("this exponent is no whole number up to 127")),
        }
    }

    fn digit(&self, plain: bool) -> Option<(char, usize)> {
        let c = self.rest().chars().next()?;
        let digit = match c {
            '0'..='9' if plain => c,
            '⁰' if !plain => '0',
            '¹' if !plain => '1',
            '²' if !plain => '2',
            '³' if !plain => '3',
            '⁴'..='⁹' if !plain => char::from_digit(4 + (u32::from(c) - u32::from('⁴')), 10)?,
            _ => return None,
        };
        Some((digit, c.len_utf8()))
    }
}

#[cfg(test)]
mod tests;
