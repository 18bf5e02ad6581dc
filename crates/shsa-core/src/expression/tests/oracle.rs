//! The values of written formulas by a plain recursion over what the language promises, and how sure they are.

use super::*;
use std::vec::Vec;

/// The value of a term at a point; `None` where it has none.
pub(super) type Plain = Option<f64>;

/// So near to the edge of a domain or to equality, rounding decides whether there is a value.
const EDGE: f64 = 1e-7;
/// Beyond this, what comes of a value is lost in rounding, or overflows.
const HUGE: f64 = 1e60;

/// A point at which a formula is evaluated.
pub(super) struct At<'a> {
    /// The formula that is evaluated.
    pub(super) whole: &'a Expr,
    pub(super) names: &'a [(&'a str, f64)],
    pub(super) vector: &'a [Plain],
}

/// Rounding, or an overflow, decides.
#[derive(Debug)]
pub(super) struct Unclear;

fn clear(number: f64) -> Result<Plain, Unclear> {
    match number {
        number if number.is_nan() => Ok(None),
        number if number.abs() < HUGE => Ok(Some(number)),
        _ => Err(Unclear),
    }
}

/// The number, `None` unless it is above an edge.
fn above(number: f64, edge: f64) -> Result<Option<f64>, Unclear> {
    let is_near = (number - edge).abs() < EDGE * (1.0 + edge.abs()) && number != edge;
    if is_near { Err(Unclear) } else { Ok((number >= edge).then_some(number)) }
}

impl At<'_> {
    pub(super) fn number(&self, expression: &Expr) -> Result<Plain, Unclear> {
        match &expression.node {
            Node::Number(value, unit) => clear(unit.as_ref().map_or(*value, |unit| unit.to_si(*value))),
            Node::Name(name) if name == "pi" => Ok(Some(core::f64::consts::PI)),
            Node::Name(name) => {
                Ok(self.names.iter().find(|(known, _)| known == name).map(|(_, value)| *value))
            }
            Node::Prefix(_, inner) => Ok(self.number(inner)?.map(|number| -number)),
            Node::Index(_, index) => {
                let Some(index) = self.number(index)? else { return Ok(None) };
                above(index, index.round())?;
                let place = index.floor();
                Ok(if place < 0.0 { None } else { self.vector.get(place as usize).copied().flatten() })
            }
            Node::Infix(infix, left, right) => {
                let both = self.number(left)?.zip(self.number(right)?);
                let divisor = if *infix == Infix::Divide { right } else { left };
                let is_zero = both.is_some_and(|(left, right)| match infix {
                    Infix::Divide => right == 0.0,
                    Infix::Power => left == 0.0 && right <= 0.0,
                    _ => false,
                });
                if is_zero && self.may_cancel(divisor) {
                    return Err(Unclear);
                }
                both.map_or(Ok(None), |(left, right)| infixed(*infix, left, right))
            }
            Node::Call(name, arguments) if name == "if" => self.choice(arguments),
            Node::Call(name, arguments) if name == "within" => {
                let [of, lo, hi] = arguments.as_slice() else { return Err(Unclear) };
                let (Some(of), Some(lo), Some(hi)) = (self.number(of)?, self.number(lo)?, self.number(hi)?)
                else {
                    return Ok(None);
                };
                Ok(above(of, lo)?.and(above(-of, -hi)?).map(|_| of))
            }
            Node::Call(name, arguments) => self.called(name, arguments),
            _ => Err(Unclear),
        }
    }

    /// Whether a divisor may have been cancelled out: `x / x` is 1, also at 0.
    fn may_cancel(&self, divisor: &Expr) -> bool {
        let is_repeated = |(name, _): &(&str, f64)| {
            !divisor.places_of(name).is_empty() && self.whole.places_of(name).len() > 1
        };
        self.names.iter().any(is_repeated) || !divisor.places_of("v").is_empty()
    }

    fn choice(&self, arguments: &[Expr]) -> Result<Plain, Unclear> {
        let [condition, then, other] = arguments else { return Err(Unclear) };
        let Node::Infix(infix, left, right) = &condition.node else { return Err(Unclear) };
        // All is evaluated, so that what is unclear anywhere is left out.
        let (then, other) = (self.number(then)?, self.number(other)?);
        let Some((left, right)) = self.number(left)?.zip(self.number(right)?) else { return Ok(None) };
        let is_equal = above(left, right)? == Some(left) && left == right;
        let holds = match infix {
            Infix::Less => left < right,
            Infix::AtMost => left <= right,
            Infix::Greater => left > right,
            Infix::AtLeast => left >= right,
            Infix::Equal => is_equal,
            _ => !is_equal,
        };
        Ok(if holds { then } else { other })
    }

    fn called(&self, name: &str, arguments: &[Expr]) -> Result<Plain, Unclear> {
        if let [Expr { node: Node::Name(vector), .. }] = arguments
            && vector == "v"
        {
            return reduced(name, self.vector);
        }
        if let [Expr { node: Node::Call(inner, of), .. }] = arguments
            && matches!(of.as_slice(), [Expr { node: Node::Name(vector), .. }] if vector == "v")
            && ["sqrt", "ln"].contains(&inner.as_str())
        {
            let each = |number: &Plain| number.map_or(Ok(None), |number| of_one(inner, number));
            let elements: Result<Vec<Plain>, Unclear> = self.vector.iter().map(each).collect();
            return reduced(name, &elements?);
        }
        let numbers: Result<Vec<Plain>, Unclear> =
            arguments.iter().map(|argument| self.number(argument)).collect();
        let numbers = numbers?;
        match (name, numbers.as_slice()) {
            ("min" | "max" | "mean" | "median" | "count" | "either" | "sum" | "norm", _) => {
                reduced(name, &numbers)
            }
            ("hypot", [Some(one), Some(other)]) => clear(one.hypot(*other)),
            (_, [Some(number)]) => of_one(name, *number),
            _ => Ok(None),
        }
    }
}

fn infixed(infix: Infix, left: f64, right: f64) -> Result<Plain, Unclear> {
    match infix {
        Infix::Add => clear(left + right),
        Infix::Subtract => clear(left - right),
        Infix::Multiply => clear(left * right),
        Infix::Divide if right.abs() < EDGE && right != 0.0 => Err(Unclear),
        Infix::Divide => clear(if right == 0.0 { f64::NAN } else { left / right }),
        Infix::Power => {
            // A negative base has a power where the exponent is whole, and not where rounding made it so.
            let is_near_whole = (right - right.round()).abs() < EDGE && right != right.round();
            let is_lost =
                left < EDGE && (is_near_whole || right.abs() > 1e6) || left.abs() < EDGE && left != 0.0;
            let is_near_zero = left == 0.0 && right.abs() < EDGE && right != 0.0;
            let power = if left == 0.0 && right < 0.0 { f64::NAN } else { left.powf(right) };
            if is_lost || is_near_zero { Err(Unclear) } else { clear(power) }
        }
        _ => Err(Unclear),
    }
}

fn of_one(name: &str, number: f64) -> Result<Plain, Unclear> {
    match name {
        "sqrt" => Ok(above(number, 0.0)?.map(f64::sqrt)),
        "ln" if number == 0.0 => Ok(None),
        "ln" => Ok(above(number, 0.0)?.map(f64::ln)),
        "asin" => Ok(above(number, -1.0)?.and(above(-number, -1.0)?).map(|_| number.asin())),
        "exp" => clear(number.exp()),
        "abs" => Ok(Some(number.abs())),
        "sin" => Ok(Some(number.sin())),
        "floor" => above(number, number.round()).map(|_| Some(number.floor())),
        "twice" => clear(2.0 * number),
        _ => Err(Unclear),
    }
}

/// What a function is of the numbers that have a value.
fn reduced(name: &str, all: &[Plain]) -> Result<Plain, Unclear> {
    let mut present: Vec<f64> = all.iter().copied().flatten().collect();
    present.sort_by(f64::total_cmp);
    let count = present.len() as f64;
    let middle = |place: usize| present.get(place).copied().unwrap_or(f64::NAN);
    let value = match name {
        "sum" | "norm" if present.len() < all.len() => f64::NAN,
        "sum" => present.iter().sum(),
        "norm" => present.iter().map(|number| number * number).sum::<f64>().sqrt(),
        "count" => count,
        _ if present.is_empty() => f64::NAN,
        "min" => middle(0),
        "max" => middle(present.len() - 1),
        "mean" => present.iter().sum::<f64>() / count,
        "median" => middle((present.len() - 1) / 2) / 2.0 + middle(present.len() / 2) / 2.0,
        // Of several different values it is not known which one holds.
        "either" => middle(0),
        _ => return Err(Unclear),
    };
    clear(value)
}
