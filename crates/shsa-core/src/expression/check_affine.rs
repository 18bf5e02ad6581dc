//! Checks that temperatures are used as points: where only a difference has a meaning, where two must have the same zero.

use alloc::format;
use alloc::string::{String, ToString};
use core::ops::Range;

use super::affine::Weight;
use super::check::{Checker, Typed};
use super::measure::{Measure, PLAIN};
use super::operation::Reduction;
use super::problem::Problem;
use super::simplify::simplified;
use super::syntax::{Expr, Infix, Node};

impl Typed {
    /// Its value when it is a plain number that is known now.
    fn factor(&self) -> Option<f64> {
        let is_plain = self.measure == PLAIN || self.measure == Measure::Zero;
        let constant = is_plain.then(|| simplified(self.formula.clone()).as_constant()).flatten();
        constant.map(|constant| constant.value)
    }
}

impl Checker<'_> {
    /// The weight of a sum, difference, product or quotient; `None` where its measure says all.
    pub(super) fn combined(
        &mut self,
        infix: Infix,
        left: (&Typed, &Expr),
        right: (&Typed, &Expr),
    ) -> Option<Weight> {
        let (own, other) = (left.0.weight, right.0.weight);
        let plain = |typed: &Typed| typed.measure == PLAIN;
        let is_free = [own, other].iter().all(|&weight| weight == Weight::DIFFERENCE || !weight.is_known());
        match infix {
            Infix::Add => Some(own.plus(other)),
            Infix::Subtract => Some(own.plus(other.times(-1.0))),
            _ => {
                let factor = |of: (&Typed, &Expr)| if is_free { None } else { of.0.factor() };
                if let Some(factor) = factor(right) {
                    return Some(own.times(if infix == Infix::Divide { 1.0 / factor } else { factor }));
                }
                if let Some(factor) = factor(left).filter(|_| infix == Infix::Multiply) {
                    return Some(other.times(factor));
                }
                let what = format!("`{}`", infix.symbol());
                let own = self.want_difference(&what, left.0, left.1);
                let other = self.want_difference(&what, right.0, right.1);
                match (plain(left.0), plain(right.0)) {
                    (_, true) => Some(own),
                    (true, _) if infix == Infix::Multiply => Some(other),
                    _ => None,
                }
            }
        }
    }

    /// The weight of what a reduction makes of several numbers.
    pub(super) fn reduced(
        &mut self,
        span: &Range<usize>,
        name: &str,
        how: Reduction,
        typed: &[Typed],
        places: &[Expr],
    ) -> Weight {
        let all = || typed.iter().zip(places);
        let sum = typed.iter().fold(Weight::DIFFERENCE, |sum, one| sum.plus(one.weight));
        match how {
            Reduction::Sum => sum,
            Reduction::Mean => sum.times(1.0 / typed.len().max(1) as f64),
            Reduction::Count => Weight::DIFFERENCE,
            Reduction::Norm => {
                let differences = all().map(|(one, at)| self.want_difference(&format!("`{name}`"), one, at));
                differences.fold(Weight::DIFFERENCE, Weight::plus)
            }
            Reduction::Min | Reduction::Max | Reduction::Median | Reduction::Either => {
                let mut pairs = all();
                let Some(mut first) = pairs.next() else { return Weight::UNKNOWN };
                let mut weight = first.0.weight;
                for one in pairs {
                    weight = self.same_zero(span, name, first, one);
                    // what counts in K says less about the others than a temperature does
                    first = if first.0.weight == weight { first } else { one };
                }
                weight
            }
        }
    }

    /// Reports a temperature where only an amount has a meaning; the weight to go on with.
    pub(super) fn want_difference(&mut self, what: &str, typed: &Typed, at: &Expr) -> Weight {
        if typed.weight.may_be(Weight::DIFFERENCE) {
            return typed.weight;
        }
        if !typed.weight.is_proper() {
            return self.improper(typed.weight, at);
        }
        let message = format!("{what} takes a difference of temperatures, not a temperature in degC or degF");
        let help = "subtract `0 degC` for the difference from the zero of the scale, or `0 K` for the absolute temperature; or declare it in K";
        self.report(Problem::error(at.span.clone(), message).with_help(help));
        Weight::UNKNOWN
    }

    /// Reports what is neither a temperature nor a difference.
    pub(super) fn want_proper(&mut self, typed: &Typed, at: &Expr) {
        if !typed.weight.is_proper() {
            self.improper(typed.weight, at);
        }
    }

    fn improper(&mut self, weight: Weight, at: &Expr) -> Weight {
        let times = if weight.lo.abs() < weight.hi.abs() { weight.lo } else { weight.hi };
        let message = format!(
            "this is no temperature: the zero of the scale is in it {} times",
            libm::round(times * 1e6) / 1e6
        );
        let literal = temperature_in(at)
            .map(|(value, kelvin)| format!("for a difference write `{kelvin} K` instead of `{value}`"));
        let help = literal.unwrap_or_else(|| {
            "subtract `0 degC` from a temperature for a temperature difference (`t - 0 degC`), or write a constant that is a difference in K; the weights of a mean sum to 1".to_string()
        });
        self.report(Problem::error(at.span.clone(), message).with_help(help));
        Weight::UNKNOWN
    }

    /// What both sides of `what` (`=`, `<`, `min`, ...) have in common.
    pub(super) fn same_zero(
        &mut self,
        span: &Range<usize>,
        what: &str,
        (left, left_at): (&Typed, &Expr),
        (right, right_at): (&Typed, &Expr),
    ) -> Weight {
        for ((zero, at), other) in [((left, left_at), right), ((right, right_at), left)] {
            if zero.measure == Measure::Zero {
                self.warn_of_zero(other, at);
                return other.weight;
            }
        }
        for (typed, at, other) in [(left, left_at, right), (right, right_at, left)] {
            let is_fine =
                typed.weight.is_proper() || other.weight.is_known() && typed.weight.may_be(other.weight);
            if !is_fine {
                return self.improper(typed.weight, at);
            }
        }
        let common = left.weight.and(right.weight);
        if common.is_none() {
            let message = format!("`{what}` of a temperature and a difference of temperatures");
            let help = match temperature_in(left_at).or_else(|| temperature_in(right_at)) {
                Some((value, kelvin)) => format!("for a difference write `{kelvin} K` instead of `{value}`"),
                None => "write the difference in K; `t - 0 degC` makes a difference of a temperature, `d + 0 degC` a temperature of a difference".to_string(),
            };
            self.report(Problem::error(span.clone(), message).with_help(help));
        }
        common.unwrap_or(Weight::UNKNOWN)
    }

    /// A `0` without a unit is 0 K, which nobody means beside a temperature in degC.
    fn warn_of_zero(&mut self, other: &Typed, at: &Expr) {
        if !other.weight.may_be(Weight::DIFFERENCE) {
            let problem = Problem::warning(at.span.clone(), "`0` without a unit is 0 K here");
            self.report(problem.with_help("write `0 degC` or `0 K`"));
        }
    }
}

/// The first number in it that is written in degC or degF, and its difference in K.
fn temperature_in(expression: &Expr) -> Option<(String, f64)> {
    match &expression.node {
        Node::Number(value, Some(unit)) if unit.offset != 0.0 && *value != 0.0 => {
            Some((format!("{value} {unit}"), unit.to_si_difference(*value)))
        }
        Node::Prefix(_, of) => temperature_in(of),
        Node::Infix(_, left, right) => temperature_in(left).or_else(|| temperature_in(right)),
        _ => None,
    }
}
