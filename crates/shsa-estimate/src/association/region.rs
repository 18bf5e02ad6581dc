//! A region of the plane: where a condition of `x` and `y` holds.

use crate::Error;
use crate::formulas::Vocabulary;
use shsa_core::expression::{Assignment, Program, Shape, State, Symbol, Value};
use shsa_core::time::{Time, Validity};

/// Where a condition of `x` and `y` holds, such as `x > 100 and abs(y + 3) < x * 0.36`, in the units of the positions.
///
/// # Example
/// ```
/// use shsa_estimate::association::Region;
///
/// let mut lane = Region::new("x > 100 and y < 4")?;
/// assert!(lane.contains([150.0, 2.0]) && !lane.contains([150.0, 5.0]));
/// # Ok::<(), shsa_estimate::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Region {
    program: Program,
    state: State<f64>,
}

impl Region {
    /// # Errors
    /// [`Error::Formula`] when the text is no condition of `x` and `y`, or one that needs the past.
    pub fn new(text: &str) -> Result<Region, Error> {
        const WHAT: &str = "a region";
        let wrong = |reason: String| Error::Formula { what: WHAT.to_owned(), reason };
        let mut names = Vocabulary::default();
        let (x, _) = (names.add_number("x"), names.add_number("y"));
        let condition = names.formula(WHAT, text)?;
        if condition.shape() != Shape::Truth {
            return Err(wrong(format!("`{text}`: a condition is expected, such as `x > 0`")));
        }
        if condition.is_stateful() {
            return Err(wrong(format!("`{text}`: needs the past")));
        }
        // The value does not matter, only whether there is one: the condition holds.
        let value = names.formula(WHAT, "1")?;
        let output = Symbol(x.0 + 2);
        let assignment = Assignment { symbol: output, formula: &value, condition: Some(&condition) };
        let program = Program::compile(&[assignment])
            .map_err(|problem| wrong(format!("`{text}`: {}", problem.message)))?;
        let state = program.new_state(0, 1.0);
        Ok(Region { program, state })
    }

    /// Whether a position is inside. Time: linear in the condition; allocates nothing.
    pub fn contains(&mut self, position: [f64; 2]) -> bool {
        let value =
            |symbol: Symbol| Value::Scalar(position.get(symbol.0 as usize).copied().unwrap_or(f64::NAN));
        let mut values = [Value::Scalar(f64::NAN); 2];
        for (slot, input) in values.iter_mut().zip(self.program.inputs()) {
            *slot = value(input.symbol);
        }
        let outcome = self.program.evaluate(&mut self.state, &values, Validity::at(Time(0)), None);
        !outcome.value.is_missing()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, position: [f64; 2], expected: &str) {
        let shown = match Region::new(text) {
            Ok(mut region) => region.contains(position).to_string(),
            Err(error) => error.to_string(),
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn a_region_is_where_a_condition_holds() {
        check("x > 1", [2.0, 0.0], "true");
        check("y < x and x < 3", [2.0, 1.0], "true");
        check("y < x and x < 3", [2.0, 2.5], "false");
        check("x > 1", [f64::NAN, 0.0], "false");
        check("1 < 2", [0.0, 0.0], "true");
    }

    #[test]
    fn what_is_no_region_is_refused() {
        for (text, reason) in [
            ("x > ", "`x > `: "),
            ("z > 1", "`z > 1`: `z` is not defined"),
            ("x + y", "`x + y`: a condition is expected"),
            ("previous(x) > 1", "`previous(x) > 1`: needs the past"),
        ] {
            let error = Region::new(text).unwrap_err().to_string();
            assert!(error.starts_with(&format!("the formula of a region {reason}")), "{error}");
        }
    }
}
