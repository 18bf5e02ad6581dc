//! Simplifies formulas where that makes intervals tighter, and folds constants.
//!
//! Interval arithmetic treats two uses of a variable as two variables: `x - x` over `[0, 1]` is `[-1, 1]`. So equal terms of sums
//! and equal factors of products are collected: `x - x` becomes `0 * x`, `x * x` the square, `x / x` becomes `x^0`. Both keep
//! their variable, because the result has no value where the variable has none; `x^0` is 1 also at 0, where `x / x` is not
//! defined. An uncertain number (`plusminus`) is independent at each of its places and never collected with another.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::curve::Curve;
use super::formula::{Formula, whole_power};
use super::number::Number;
use super::operation::{Binary, Constant, Operation, Unary};
use crate::interval::Interval;

/// The formula, simplified from the leaves to the root.
///
/// Time: n levels log n for n nodes.
pub(super) fn simplified(formula: Formula) -> Formula {
    if formula.arguments().is_empty() {
        return formula;
    }
    let operation = formula.operation();
    let arguments = formula.into_arguments().into_iter().map(simplified).collect();
    let formula = Formula::node(operation, arguments);
    folded(&formula).unwrap_or_else(|| rewritten(formula))
}

/// The constant result of an operation on constants; `None` when there is none.
fn folded(formula: &Formula) -> Option<Formula> {
    // An operation on a named constant stays one, as the constant may occur in other places.
    if formula.arguments().iter().any(|argument| matches!(argument.operation(), Operation::Known(..))) {
        return None;
    }
    let constants: Option<Vec<Constant>> = formula.arguments().iter().map(Formula::as_constant).collect();
    let constant = match (formula.operation(), constants?.as_slice()) {
        (Operation::Unary(unary), [of]) => joined(of.value.unary(unary), of.bounds.unary(unary)),
        (Operation::Binary(binary), [left, right]) => computed(binary, *left, *right),
        (Operation::Table, [of, ..]) => {
            let points = formula.points();
            let curve = Curve::new(&points);
            joined(of.value.along(curve), of.bounds.along(curve))
        }
        (Operation::Compare(comparison), [left, right]) => {
            let truth = left.bounds.compare(comparison, right.bounds);
            let is_known = truth.is_true() || truth.is_false();
            return is_known.then(|| Formula::node(Operation::Truth(truth.is_true()), Vec::new()));
        }
        _ => None,
    };
    constant.map(Formula::constant)
}

fn computed(binary: Binary, left: Constant, right: Constant) -> Option<Constant> {
    joined(left.value.binary(binary, right.value), left.bounds.binary(binary, right.bounds))
}

fn joined(value: f64, bounds: Interval) -> Option<Constant> {
    let bounds = Interval::hull(bounds, Interval::point(value));
    (value.is_finite() && bounds.is_bounded()).then_some(Constant { value, bounds })
}

/// Rewrites the root of a formula with simplified arguments.
fn rewritten(formula: Formula) -> Formula {
    match (formula.operation(), formula.arguments()) {
        (Operation::Unary(unary), [of]) => of_one(unary, of).unwrap_or(formula),
        (Operation::Binary(Binary::Min | Binary::Max), [left, right])
            if left == right && !left.is_uncertain() =>
        {
            left.clone()
        }
        (Operation::Binary(Binary::Add | Binary::Sub), _) => {
            Sum::of(&formula).map_or_else(|| neutral(formula), Sum::formula)
        }
        (Operation::Binary(Binary::Mul | Binary::Div), _) => {
            Product::of(&formula).map_or_else(|| neutral(formula), Product::formula)
        }
        (Operation::Not, [of]) => of_not(of).unwrap_or(formula),
        (Operation::Select, [condition, then, other]) => match condition.operation() {
            Operation::Truth(truth) => {
                if truth {
                    then.clone()
                } else {
                    other.clone()
                }
            }
            _ => formula,
        },
        _ => formula,
    }
}

fn of_one(unary: Unary, of: &Formula) -> Option<Formula> {
    let Operation::Unary(inner) = of.operation() else { return None };
    let [innermost] = of.arguments() else { return None };
    match (unary, inner) {
        (Unary::Neg, Unary::Neg) => Some(innermost.clone()),
        (Unary::Abs, Unary::Abs | Unary::Neg) => Some(Formula::unary(Unary::Abs, innermost.clone())),
        (Unary::Sqr, Unary::Abs | Unary::Neg) => Some(Formula::unary(Unary::Sqr, innermost.clone())),
        (Unary::Sqrt, Unary::Sqr) => Some(Formula::unary(Unary::Abs, innermost.clone())),
        _ => None,
    }
}

fn of_not(of: &Formula) -> Option<Formula> {
    match (of.operation(), of.arguments()) {
        (Operation::Not, [inner]) => Some(inner.clone()),
        (Operation::Truth(truth), _) => Some(Formula::node(Operation::Truth(!truth), Vec::new())),
        _ => None,
    }
}

/// Removes zeros and ones without effect, and moves signs into sums.
fn neutral(formula: Formula) -> Formula {
    let (Operation::Binary(binary), [left, right]) = (formula.operation(), formula.arguments()) else {
        return formula;
    };
    let simple = match binary {
        Binary::Add if left.is(0.0) => Some(right.clone()),
        Binary::Add | Binary::Sub if right.is(0.0) => Some(left.clone()),
        Binary::Sub if left.is(0.0) => Some(negative(right.clone())),
        Binary::Add => {
            positive_of(right).map(|right| Formula::binary(Binary::Sub, left.clone(), right.clone()))
        }
        Binary::Sub => {
            positive_of(right).map(|right| Formula::binary(Binary::Add, left.clone(), right.clone()))
        }
        Binary::Mul if left.is(1.0) => Some(right.clone()),
        Binary::Mul | Binary::Div if right.is(1.0) => Some(left.clone()),
        Binary::Mul if left.is(-1.0) => Some(negative(right.clone())),
        Binary::Mul | Binary::Div if right.is(-1.0) => Some(negative(left.clone())),
        _ => None,
    };
    simple.unwrap_or(formula)
}

fn negative(formula: Formula) -> Formula {
    match positive_of(&formula) {
        Some(positive) => positive.clone(),
        None => Formula::unary(Unary::Neg, formula),
    }
}

/// The argument of a negation.
fn positive_of(formula: &Formula) -> Option<&Formula> {
    (formula.operation() == Operation::Unary(Unary::Neg)).then(|| formula.arguments().first()).flatten()
}

/// A sum as terms with factors, in the order of their first appearance.
struct Sum {
    constant: Constant,
    terms: Vec<(Constant, Formula)>,
    places: BTreeMap<Formula, usize>,
    constants: usize,
    is_collected: bool,
}

impl Sum {
    /// The sum with equal terms collected; `None` when there is nothing to collect.
    fn of(formula: &Formula) -> Option<Sum> {
        let zero = Constant::exact(0.0);
        let mut sum = Sum {
            constant: zero,
            terms: Vec::new(),
            places: BTreeMap::new(),
            constants: 0,
            is_collected: false,
        };
        sum.add(formula, Constant::exact(1.0))?;
        (sum.is_collected || sum.constants > 1).then_some(sum)
    }

    fn add(&mut self, formula: &Formula, factor: Constant) -> Option<()> {
        let minus = computed(Binary::Sub, Constant::exact(0.0), factor)?;
        match (formula.operation(), formula.arguments()) {
            (Operation::Binary(Binary::Add), [left, right]) => {
                self.add(left, factor)?;
                self.add(right, factor)
            }
            (Operation::Binary(Binary::Sub), [left, right]) => {
                self.add(left, factor)?;
                self.add(right, minus)
            }
            (Operation::Unary(Unary::Neg), [of]) => self.add(of, minus),
            // An uncertain factor of a sum is one number: each term of it would take its own.
            (Operation::Binary(Binary::Mul), [left, right]) if left.is_certain() => {
                self.add(right, computed(Binary::Mul, left.as_constant()?, factor)?)
            }
            (Operation::Binary(Binary::Mul), [left, right]) if right.is_certain() => {
                self.add(left, computed(Binary::Mul, right.as_constant()?, factor)?)
            }
            (Operation::Constant(constant), _) => {
                self.constant =
                    computed(Binary::Add, self.constant, computed(Binary::Mul, constant, factor)?)?;
                self.constants += 1;
                Some(())
            }
            _ => self.add_term(formula, factor),
        }
    }

    fn add_term(&mut self, formula: &Formula, factor: Constant) -> Option<()> {
        if formula.is_uncertain() {
            self.terms.push((factor, formula.clone()));
            return Some(());
        }
        let place = self.places.get(formula).copied();
        match place.and_then(|place| self.terms.get_mut(place)) {
            Some((sum, _)) => {
                *sum = computed(Binary::Add, *sum, factor)?;
                self.is_collected = true;
            }
            None => {
                self.places.insert(formula.clone(), self.terms.len());
                self.terms.push((factor, formula.clone()));
            }
        }
        Some(())
    }

    fn formula(self) -> Formula {
        let constant =
            (self.constants > 0 && !self.constant.is(0.0)).then(|| Formula::constant(self.constant));
        let terms = self.terms.into_iter().map(|(factor, term)| {
            let formula = Formula::binary(Binary::Mul, Formula::constant(factor), term);
            if factor.is(0.0) { formula } else { neutral(formula) }
        });
        let sum = terms.chain(constant).reduce(|sum, term| neutral(Formula::binary(Binary::Add, sum, term)));
        sum.unwrap_or_else(|| Formula::number(0.0))
    }
}

/// The highest power that is collected.
const MAX_POWER: i32 = 1_000_000_000;

/// A product as powers, in the order of their first appearance.
struct Product {
    constant: Constant,
    factors: Vec<(i32, Formula)>,
    places: BTreeMap<Formula, usize>,
    constants: usize,
    is_collected: bool,
}

impl Product {
    /// The product with equal factors collected; `None` when there is nothing to collect.
    fn of(formula: &Formula) -> Option<Product> {
        let mut product = Product {
            constant: Constant::exact(1.0),
            factors: Vec::new(),
            places: BTreeMap::new(),
            constants: 0,
            is_collected: false,
        };
        product.multiply(formula, 1)?;
        (product.is_collected || product.constants > 1).then_some(product)
    }

    fn multiply(&mut self, formula: &Formula, exponent: i32) -> Option<()> {
        match (formula.operation(), formula.arguments()) {
            (Operation::Binary(Binary::Mul), [left, right]) => {
                self.multiply(left, exponent)?;
                self.multiply(right, exponent)
            }
            (Operation::Binary(Binary::Div), [left, right]) => {
                self.multiply(left, exponent)?;
                self.multiply(right, -exponent)
            }
            (Operation::Unary(Unary::Neg), [of]) if exponent.abs() == 1 => {
                self.constant = computed(Binary::Mul, self.constant, Constant::exact(-1.0))?;
                self.multiply(of, exponent)
            }
            (Operation::Unary(Unary::Sqr), [of]) => self.multiply_factor(of, bounded(exponent, 2)?),
            (Operation::Unary(Unary::Power(power)), [of]) if power != 0 => {
                self.multiply_factor(of, bounded(exponent, power)?)
            }
            (Operation::Constant(constant), _) if exponent.abs() == 1 => {
                let binary = if exponent > 0 { Binary::Mul } else { Binary::Div };
                self.constant = computed(binary, self.constant, constant)?;
                self.constants += 1;
                Some(())
            }
            _ => self.multiply_factor(formula, exponent),
        }
    }

    fn multiply_factor(&mut self, formula: &Formula, exponent: i32) -> Option<()> {
        if formula.is_uncertain() {
            self.factors.push((exponent, formula.clone()));
            return Some(());
        }
        let place = self.places.get(formula).copied();
        match place.and_then(|place| self.factors.get_mut(place)) {
            Some((sum, _)) => {
                *sum = sum.checked_add(exponent).filter(|sum| sum.abs() <= MAX_POWER)?;
                self.is_collected = true;
            }
            None => {
                self.places.insert(formula.clone(), self.factors.len());
                self.factors.push((exponent, formula.clone()));
            }
        }
        Some(())
    }

    fn formula(self) -> Formula {
        let (under, over): (Vec<_>, Vec<_>) =
            self.factors.into_iter().partition(|(exponent, _)| *exponent < 0);
        let over = over.into_iter().map(|(exponent, base)| whole_power(base, exponent));
        let over = over.reduce(|product, factor| Formula::binary(Binary::Mul, product, factor));
        let constant = Formula::constant(self.constant);
        let over = match over {
            Some(over) if self.constant.is(0.0) => Formula::binary(Binary::Mul, constant, over),
            Some(over) => neutral(Formula::binary(Binary::Mul, constant, over)),
            None => constant,
        };
        let under = under.into_iter().map(|(exponent, base)| whole_power(base, -exponent));
        under.fold(over, |over, under| Formula::binary(Binary::Div, over, under))
    }
}

fn bounded(exponent: i32, power: i32) -> Option<i32> {
    exponent.checked_mul(power).filter(|product| product.abs() <= MAX_POWER)
}
