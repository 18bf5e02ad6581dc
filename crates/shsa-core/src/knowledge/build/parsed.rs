//! Formulas of a model that are read and checked by themselves.

use super::problems::Problems;
use super::scope::Names;
use crate::expression::{self, Formula, Problem, check, parse_expression};
use crate::knowledge::draft::Text;

/// A condition over variables.
pub(super) fn condition(problems: &mut Problems, text: &Text, names: &Names) -> Option<Formula> {
    let parsed = reported(problems, text, parse_expression(&text.text))?;
    let checked = check(&parsed, names);
    for problem in checked.problems {
        problems.inside(text, problem);
    }
    let formula = checked.formula?;
    if formula.shape() != expression::Shape::Truth {
        problems.error(text, "this is no condition", "write a comparison like `abs(speed) > 0.2`");
        return None;
    }
    Some(formula)
}

/// The result; a problem is reported instead.
pub(super) fn reported<T>(problems: &mut Problems, text: &Text, read: Result<T, Problem>) -> Option<T> {
    read.map_err(|problem| problems.inside(text, problem)).ok()
}
