//! Formulas in conversions: `2 * sin(X)`, of the number `X` (or `X1`) in the record, in the language of formulas of models.

use shsa_core::expression::{
    Assignment, Function, Kind, Program, Scope, Shape, State, Symbol, Value, check, parse_expression,
};
use shsa_core::time::{Time, Validity};
use std::cell::RefCell;

/// The names of the number in the record.
const NAMES: [&str; 4] = ["X", "X1", "x", "x1"];

/// The number in the record.
const RAW: Symbol = Symbol(0);

/// The converted number.
const CONVERTED: Symbol = Symbol(1);

/// The moment of every evaluation: the formula remembers nothing.
const NOW: Validity = Validity::at(Time(0));

/// A formula of one number.
#[derive(Clone, Debug)]
pub(super) struct Algebra {
    program: Program,
    /// The registers, which each evaluation fills anew.
    state: RefCell<State<f64>>,
}

impl Algebra {
    /// Understands a formula.
    ///
    /// # Errors
    /// Why the formula cannot be computed here.
    pub(super) fn of(text: &str) -> Result<Algebra, String> {
        let refused = |problem: String| format!("the formula '{text}' is not computed here: {problem}");
        let written = parse_expression(text).map_err(|problem| refused(problem.to_string()))?;
        let checked = check(&written, &OneNumber);
        let problem = checked.problems.first().map(ToString::to_string);
        let formula = checked.formula.ok_or_else(|| refused(problem.unwrap_or_default()))?;
        if formula.is_stateful() || formula.shape() != Shape::Scalar {
            return Err(refused("it is no number of the present value".to_owned()));
        }
        let assignment = Assignment { symbol: CONVERTED, formula: &formula, condition: None };
        let program = Program::compile(&[assignment]).map_err(|problem| refused(problem.to_string()))?;
        let state = RefCell::new(program.new_state(1, 1.0));
        Ok(Algebra { program, state })
    }

    /// The value of the formula; `None` where it has none, as the root of a negative number.
    pub(super) fn apply(&self, raw: f64) -> Option<f64> {
        let mut state = self.state.try_borrow_mut().ok()?;
        let inputs = [Value::Scalar(raw)];
        let inputs = inputs.get(..self.program.inputs().len())?;
        let value = self.program.evaluate(&mut state, inputs, NOW, None).value.scalar();
        Some(value).filter(|value| !value.is_nan())
    }
}

/// The names in such a formula.
struct OneNumber;

impl Scope for OneNumber {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        NAMES.contains(&name).then_some(RAW)
    }

    fn kind(&self, _symbol: Symbol) -> Kind {
        Kind { shape: Shape::Scalar, unit: None, range: None, constant: None }
    }

    fn function(&self, _name: &str) -> Option<&Function> {
        None
    }

    fn names(&self) -> Vec<&str> {
        vec!["X"]
    }

    fn function_names(&self) -> Vec<&str> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, raw: f64, expected: Option<f64>) {
        assert_eq!(Algebra::of(text).unwrap().apply(raw), expected, "{text}");
    }

    #[test]
    fn formulas_of_the_number_are_computed() {
        check("X1*X1+1", 3.0, Some(10.0));
        check("2 * sin(X)", 0.0, Some(0.0));
        check("(X - 32) / 1.8", 50.0, Some(10.0));
        check("7", 3.0, Some(7.0));
        check("sqrt(X)", -1.0, None);
    }

    #[test]
    fn other_formulas_are_refused_by_name() {
        for text in ["log(X)", "X >> 2", "X +", "integral(X)", "Y + 1", "X < 2"] {
            let problem = Algebra::of(text).unwrap_err();
            assert!(
                problem.starts_with(&format!("the formula '{text}' is not computed here: ")),
                "{problem}"
            );
        }
    }
}
