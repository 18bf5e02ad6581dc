//! Formulas: parse, check shapes and units, solve for a variable, compile, evaluate over numbers and intervals.
//!
//! The way of a formula: text -> [`Expr`] (written, with places) -> [`Formula`] (looked up, in SI, simplified)
//! -> [`Program`] (flat, over registers). An equation is solved between the second and the third.
//!
//! Every formula terminates: no loops, no recursion, bounded length, and time operators keep bounded state.
//!
//! # The language
//!
//! * Numbers with or without a unit: `2.67 m`, `9.81 m/s^2`, `20 %`, `-5 degC`. A unit is written without blanks
//!   around its operators: `4 m/s` is a speed, `4 m / s` divides 4 m by the variable `s` (see `lexer`).
//! * `+ - * / ^` (`^` binds to the right, and before the sign), `< <= > >= == !=`, `and or not`,
//!   `if(condition, then, else)`; `pi`, `true`, `false`.
//! * `sqrt exp ln log10 abs floor sin cos tan asin acos atan atan2 hypot`, `root(x, 3)`.
//! * Of a vector, or of several numbers: `min max sum mean norm median count`. `min`, `max`, `mean`, `median` and
//!   `count` pass elements without a value over; `sum` and `norm` of such vectors have no value. `v[i]` counts from
//!   0 and rounds the index down, `v[a..b]` ends before `b`; out of range is no value. Arithmetic and functions of one
//!   number go element by element; vectors of different lengths have no result.
//! * Uncertainty: `plusminus(e)`, `interval(lo, hi)` of constants; each place in a formula is a number of its own.
//!   `within(x, lo, hi)` is what of `x` lies in the bounds (`inf` for none), `either(x, y)` the one that has a value.
//! * `table(x, [x0, y0], [x1, y1], ..)`: the lines between points; no value outside. `one_of(x, y)`: one of both, which one is
//!   not known.
//! * Time: `previous(x)`, `dt`, `derivative(x, window)`, `integral(x)`, `delay(x, span)`,
//!   `moving_mean(x, window)` over the time of the last window, which has to be over once.
//! * Conditions over time: `always(condition, span)`, `once(condition, span)`, `answered(trigger, response, span)`; unknown where
//!   an observation leaves them open, where nothing was observed, and while the first span is not over.
//! * Functions of the model, which may not use themselves.
//!
//! Temperatures in `degC` or `degF` are points: `t - u` is a difference (in K), `t + 2 K`, means, medians and sums whose
//! weights are constants that sum to 1 are temperatures; `t + u`, `2 * t` and `t / u` are errors. `t - 0 degC` is the
//! difference from the zero of the scale, `t - 0 K` the absolute temperature. What is declared in K may be both.
//!
//! A missing input, the root of a negative number, or a division by zero has no value, and neither has the result, but for functions
//! that pass over it: they hold both cases where it is open which of them holds.
//!
//! Where a variable or a named constant occurs more than once, the interval of a formula is narrowed by its derivatives: it is as a rule
//! no more than a twentieth wider than the range of values.

mod problem;
mod syntax;
mod builtin;
mod lexer;
mod parser;
mod operation;
mod curve;
mod domain;
mod number;
mod formula;
mod temporal;
mod inline;
mod text;
mod simplify;
mod bounds;
mod lacking;
mod measure;
mod affine;
mod check;
mod check_time;
mod check_call;
mod check_table;
mod check_operator;
mod checked;
mod inverse_table;
mod alternatives;
mod solve;
mod slope;
mod tape;
mod extremes;
mod program;
mod compile;
mod history;
mod registers;
mod selection;
mod presence;
mod state;
mod weighing;
mod evaluate;
mod choice;

use alloc::vec::Vec;

pub use builtin::{WORDS, functions, is_reserved};
pub use checked::{Checked, CheckedEquation, check, check_equation, check_function};
pub use curve::{Curve, Point, Segment};
pub use evaluate::{Outcome, Value};
pub use formula::{Formula, MAX_LEVELS, MAX_NODES, Shape};
pub use number::Number;
pub use operation::{Binary, Comparison, Constant, Operation, Reduction, Unary};
pub use parser::{
    MAX_DEPTH, MAX_NESTING, MAX_TEXT, Quantity, parse_equation, parse_expression, parse_function_head,
    parse_quantity,
};
pub use problem::{Problem, Severity};
pub use program::{Assignment, Input, InputKind, MAX_INSTRUCTIONS, Program};
pub use solve::solve;
pub use state::State;
pub use syntax::{Equation, Expr, Function, Infix, Node, Prefix};
pub(crate) use temporal::{answered, implied, once, truth_as_number};

use crate::interval::Interval;
use crate::unit::Unit;

/// A variable of the model, as a dense number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Symbol(pub u32);

/// The declaration of a variable.
#[derive(Clone, Debug)]
pub struct Kind {
    /// A number or a vector; a truth is no variable.
    pub shape: Shape,
    /// The unit; `None` is not checked.
    pub unit: Option<Unit>,
    /// The bounds that its values never leave, in SI.
    pub range: Option<Interval>,
    /// The value in SI of a constant; it replaces the name in formulas.
    pub constant: Option<Constant>,
}

/// The declarations that the checker reads from a model.
pub trait Scope {
    /// The variable or constant of this name.
    fn symbol(&self, name: &str) -> Option<Symbol>;
    /// The declaration of a variable or constant.
    fn kind(&self, symbol: Symbol) -> Kind;
    /// The model's function of this name.
    fn function(&self, name: &str) -> Option<&Function>;
    /// The names of all variables and constants, for suggestions.
    fn names(&self) -> Vec<&str>;
    /// The names of all functions of the model, for suggestions.
    fn function_names(&self) -> Vec<&str>;
}

#[cfg(test)]
mod tests;
