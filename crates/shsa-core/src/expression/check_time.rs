//! Checks the functions over a span of the past: of numbers, and of conditions.

use alloc::vec;
use core::ops::Range;

use super::builtin::Builtin;
use super::check::{Checker, Typed};
use super::formula::Formula;
use super::measure::{Measure, PLAIN};
use super::operation::Operation;
use super::syntax::Expr;
use super::temporal;
use crate::unit::Dimension;

/// A rate, a delay or a mean.
pub(super) fn over_window(
    checker: &mut Checker<'_>,
    span: &Range<usize>,
    function: Builtin,
    of: &Expr,
    window: &Expr,
) -> Option<Typed> {
    let what = match function {
        Builtin::Delay => "`delay`",
        Builtin::MovingMean => "`moving_mean`",
        _ => "`derivative`",
    };
    let typed = checker.scalar(what, of);
    let window = checker.span(what, window);
    let (typed, window) = typed.zip(window)?;
    let weight = typed.weight;
    let (operation, measure) = match function {
        Builtin::Delay => (Operation::Delay(window), typed.measure),
        Builtin::MovingMean => (Operation::MovingMean(window), typed.measure),
        _ => {
            let measure = typed.measure.combine(Measure::Known(Dimension::TIME), Dimension::over);
            (Operation::Derivative(window), checker.noted(span, measure))
        }
    };
    let made = checker.made(span, Formula::node(operation, vec![typed.formula]), measure)?;
    Some(if function == Builtin::Derivative { made } else { made.weighing(weight) })
}

/// Whether a condition has held throughout a span, or once.
pub(super) fn lasting(
    checker: &mut Checker<'_>,
    span: &Range<usize>,
    function: Builtin,
    condition: &Expr,
    window: &Expr,
) -> Option<Typed> {
    let is_once = function == Builtin::Once;
    let what = if is_once { "`once`" } else { "`always`" };
    let condition = checker.truth(what, condition);
    let (condition, window) = condition.zip(checker.span(what, window))?;
    let held = if is_once { temporal::once } else { temporal::always };
    checker.made(span, held(condition.formula, window), PLAIN)
}

/// Whether a response has followed each trigger within a span.
pub(super) fn answered(
    checker: &mut Checker<'_>,
    span: &Range<usize>,
    trigger: &Expr,
    response: &Expr,
    window: &Expr,
) -> Option<Typed> {
    let what = "`answered`";
    let (trigger, response) = (checker.truth(what, trigger), checker.truth(what, response));
    let ((trigger, response), window) = trigger.zip(response).zip(checker.span(what, window))?;
    checker.made(span, temporal::answered(trigger.formula, response.formula, window), PLAIN)
}
