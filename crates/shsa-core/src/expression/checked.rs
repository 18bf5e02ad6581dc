//! Checked formulas, equations and functions of the model, with their problems.

use super::Scope;
use super::affine::Weight;
use super::check::{Call, Checker, Operand, PARAMETER, Typed};
use super::formula::{Formula, Shape};
use super::measure::Measure;
use super::problem::{Problem, Severity};
use super::simplify::simplified;
use super::syntax::{Equation, Expr, Function};
use crate::unit::Dimension;
use alloc::vec::Vec;

/// A checked formula, with its problems.
#[derive(Clone, Debug)]
pub struct Checked {
    /// The formula, simplified; `None` when there is an error.
    pub formula: Option<Formula>,
    /// The dimension of its value; `None` when unknown, or when it fits every unit (a literal 0).
    pub dimension: Option<Dimension>,
    /// Every error and warning, in the order of the text.
    pub problems: Vec<Problem>,
}

/// A checked equation, with its problems.
#[derive(Clone, Debug)]
pub struct CheckedEquation {
    /// Both sides, simplified; `None` when there is an error.
    pub sides: Option<(Formula, Formula)>,
    /// The dimension of both sides; `None` when unknown.
    pub dimension: Option<Dimension>,
    /// Whether both sides are temperatures on a scale with its own zero: a relative error has no meaning for them.
    pub is_affine: bool,
    /// Every error and warning, in the order of the text.
    pub problems: Vec<Problem>,
}

/// Checks a formula.
///
/// Time: linear in the formula with the model's functions expanded, whose number of nodes is bounded.
#[must_use]
pub fn check(expression: &Expr, scope: &dyn Scope) -> Checked {
    let mut checker = Checker::new(scope);
    let typed = checker.resolve(expression);
    if let Some(typed) = &typed {
        checker.want_proper(typed, expression);
    }
    let problems = checker.finish();
    let dimension = typed.as_ref().and_then(|typed| typed.measure.dimension());
    let formula = typed.filter(|_| !has_error(&problems)).map(|typed| simplified(typed.formula));
    Checked { formula, dimension, problems }
}

/// Checks an equation: both sides, and that they can be equal.
///
/// Time: as [`check`].
#[must_use]
pub fn check_equation(equation: &Equation, scope: &dyn Scope) -> CheckedEquation {
    let mut checker = Checker::new(scope);
    let span = equation.lhs.span.start..equation.rhs.span.end;
    let sides = checker.resolve(&equation.lhs).zip(checker.resolve(&equation.rhs));
    let measure = sides.as_ref().and_then(|(lhs, rhs)| {
        checker.equal(
            &span,
            Operand { typed: lhs, at: &equation.lhs },
            Operand { typed: rhs, at: &equation.rhs },
        )
    });
    let is_affine =
        sides.as_ref().is_some_and(|(lhs, rhs)| lhs.weight == Weight::POINT || rhs.weight == Weight::POINT);
    let problems = checker.finish();
    let sides = sides.filter(|_| !has_error(&problems));
    let sides = sides.map(|(lhs, rhs)| (simplified(lhs.formula), simplified(rhs.formula)));
    CheckedEquation { sides, dimension: measure.and_then(Measure::dimension), is_affine, problems }
}

/// Checks a function of the model by itself, with parameters of unknown unit, once as numbers and once as vectors.
///
/// Returns the problems of the better try; problems with the units of arguments show at the calls.
#[must_use]
pub fn check_function(function: &Function, scope: &dyn Scope) -> Vec<Problem> {
    let with = |shape| {
        let mut checker = Checker::new(scope);
        let parameter = Typed::of(Formula::symbol(PARAMETER, shape), Measure::Unknown);
        let parameters = function.parameters.iter().map(|name| (name.clone(), parameter.clone())).collect();
        checker.calls.push(Call { function: function.name.clone(), place: None, parameters });
        checker.resolve(&function.body);
        checker.finish()
    };
    let as_numbers = with(Shape::Scalar);
    if !has_error(&as_numbers) {
        return as_numbers;
    }
    let as_vectors = with(Shape::Vector);
    if has_error(&as_vectors) { as_numbers } else { as_vectors }
}

fn has_error(problems: &[Problem]) -> bool {
    problems.iter().any(|problem| problem.severity == Severity::Error)
}
