//! Writes a resolved formula as text, in SI, as the parser reads it.

use alloc::format;
use alloc::string::String;

use super::Symbol;
use super::curve::Point;
use super::formula::Formula;
use super::operation::{Binary, Comparison, Constant, Operation, Reduction, Unary};
use super::temporal::Written;

/// The binding powers of a text's root, as in the parser.
const OR: u8 = 1;
const AND: u8 = 2;
const NOT: u8 = 3;
const COMPARISON: u8 = 4;
const SUM: u8 = 5;
const PRODUCT: u8 = 6;
const SIGN: u8 = 7;
const POWER: u8 = 8;
const ATOM: u8 = 9;

impl Formula {
    /// The formula as text with the variables' names; its numbers are in SI.
    ///
    /// The text can be parsed again, with the variables without units, and gives the same values up to the bounds of rounded
    /// constants. Time and length are linear in the formula's size.
    #[must_use]
    pub fn to_text(&self, name: &dyn Fn(Symbol) -> String) -> String {
        let mut writer = Writer { text: String::new(), name };
        writer.formula(self, OR);
        writer.text
    }
}

struct Writer<'a> {
    text: String,
    name: &'a dyn Fn(Symbol) -> String,
}

impl Writer<'_> {
    fn push(&mut self, text: &str) {
        self.text.push_str(text);
    }

    /// Writes the formula, in parentheses when it binds less than `least`.
    fn formula(&mut self, formula: &Formula, least: u8) {
        let is_enclosed = power(formula) < least;
        self.push(if is_enclosed { "(" } else { "" });
        self.bare(formula);
        self.push(if is_enclosed { ")" } else { "" });
    }

    fn bare(&mut self, formula: &Formula) {
        match (formula.operation(), formula.arguments()) {
            (Operation::Constant(constant) | Operation::Known(_, constant), _) => {
                self.push(&number(constant))
            }
            (Operation::Truth(truth), _) => self.push(if truth { "true" } else { "false" }),
            (Operation::Symbol(symbol), _) => self.push(&(self.name)(symbol)),
            (Operation::Previous(symbol), _) => self.push(&format!("previous({})", (self.name)(symbol))),
            (Operation::Elapsed, _) => self.push("dt"),
            (Operation::Unary(unary), [of]) => self.of_one(unary, of),
            (Operation::Binary(binary), [left, right]) => self.of_two(binary, left, right),
            (Operation::Compare(_), _) if Written::of(formula).is_some() => {
                Written::of(formula).iter().for_each(|written| self.over_time(written));
            }
            (Operation::Compare(comparison), [left, right]) => {
                self.infix(left, comparison_symbol(comparison), right, SUM, SUM);
            }
            (Operation::And, [left, right]) => self.infix(left, " and ", right, AND, NOT),
            (Operation::Or, [left, right]) => self.infix(left, " or ", right, OR, AND),
            (Operation::Not, [of]) => {
                self.push("not ");
                self.formula(of, NOT);
            }
            (Operation::Index, [of, index]) => {
                self.formula(of, ATOM);
                self.push("[");
                self.formula(index, OR);
                self.push("]");
            }
            (Operation::Slice(from, to), [of]) => {
                self.formula(of, ATOM);
                let to = if to == u32::MAX { String::new() } else { format!("{to}") };
                self.push(&format!("[{from}..{to}]"));
            }
            (Operation::Table, [of, ..]) => self.table(of, &formula.points()),
            (operation, arguments) => self.call(operation, arguments),
        }
    }

    fn of_one(&mut self, unary: Unary, of: &Formula) {
        match unary {
            Unary::Neg => {
                self.push("-");
                self.formula(of, SIGN);
            }
            Unary::Sqr => self.power(of, 2),
            Unary::Power(exponent) => self.power(of, exponent),
            Unary::Root(degree) => {
                self.push("root(");
                self.formula(of, OR);
                self.push(&format!(", {degree})"));
            }
            _ => {
                self.push(unary_name(unary));
                self.list(core::slice::from_ref(of));
            }
        }
    }

    fn power(&mut self, base: &Formula, exponent: i32) {
        self.formula(base, ATOM);
        self.push(&format!("^{exponent}"));
    }

    fn of_two(&mut self, binary: Binary, left: &Formula, right: &Formula) {
        match binary {
            Binary::Add => self.infix(left, " + ", right, SUM, PRODUCT),
            Binary::Sub => self.infix(left, " - ", right, SUM, PRODUCT),
            Binary::Mul => self.infix(left, " * ", right, PRODUCT, SIGN),
            Binary::Div => self.infix(left, " / ", right, PRODUCT, SIGN),
            Binary::Pow => self.infix(left, "^", right, ATOM, POWER),
            Binary::Min => self.of_both("min(", left, right),
            Binary::Max => self.of_both("max(", left, right),
            Binary::Atan2 | Binary::Bearing => self.of_both("atan2(", left, right),
            Binary::Hypot => self.of_both("hypot(", left, right),
        }
    }

    fn infix(&mut self, left: &Formula, symbol: &str, right: &Formula, least_left: u8, least_right: u8) {
        self.formula(left, least_left);
        self.push(symbol);
        self.formula(right, least_right);
    }

    fn of_both(&mut self, start: &str, left: &Formula, right: &Formula) {
        self.push(start);
        self.infix(left, ", ", right, OR, OR);
        self.push(")");
    }

    fn call(&mut self, operation: Operation, arguments: &[Formula]) {
        // a list occurs only below a reduction, which writes it
        let arguments = match (operation, arguments) {
            (Operation::Reduce(_), [list]) if list.operation() == Operation::List => list.arguments(),
            _ => arguments,
        };
        let (name, rest) = match operation {
            Operation::Select => ("if", String::new()),
            Operation::Reduce(reduction) => (reduction_name(reduction), String::new()),
            Operation::Within(Constant { bounds, .. }) => {
                ("within", format!(", {}, {}", decimal(bounds.lo()), decimal(bounds.hi())))
            }
            Operation::Derivative(span) => ("derivative", format!(", {} s", decimal(span.seconds()))),
            Operation::Delay(span) => ("delay", format!(", {} s", decimal(span.seconds()))),
            Operation::MovingMean(span) => ("moving_mean", format!(", {} s", decimal(span.seconds()))),
            Operation::Held(span) => ("held", format!(", {} s", decimal(span.seconds()))),
            Operation::Answered(span) => ("answered", format!(", {} s", decimal(span.seconds()))),
            _ => ("integral", String::new()),
        };
        self.push(name);
        self.list(arguments);
        if !rest.is_empty() {
            self.text.pop();
            self.push(&rest);
            self.push(")");
        }
    }

    fn over_time(&mut self, written: &Written<'_>) {
        self.push(written.name);
        self.push("(");
        for condition in [Some(written.of.0), written.of.1].into_iter().flatten() {
            self.formula(condition, OR);
            self.push(", ");
        }
        self.push(&format!("{} s)", decimal(written.span.seconds())));
    }

    fn table(&mut self, of: &Formula, points: &[Point]) {
        self.push("table(");
        self.formula(of, OR);
        for Point { at, value } in points {
            self.push(&format!(", [{}, {}]", decimal(at.value), decimal(value.value)));
        }
        self.push(")");
    }

    fn list(&mut self, arguments: &[Formula]) {
        self.push("(");
        for (place, argument) in arguments.iter().enumerate() {
            self.push(if place > 0 { ", " } else { "" });
            self.formula(argument, OR);
        }
        self.push(")");
    }
}

/// The binding power of the root.
fn power(formula: &Formula) -> u8 {
    match formula.operation() {
        Operation::Or => OR,
        Operation::And => AND,
        Operation::Not => NOT,
        Operation::Compare(_) => COMPARISON,
        Operation::Binary(Binary::Add | Binary::Sub) => SUM,
        Operation::Binary(Binary::Mul | Binary::Div) => PRODUCT,
        Operation::Unary(Unary::Neg) => SIGN,
        Operation::Constant(constant) if constant.is_certain() && constant.value < 0.0 => SIGN,
        Operation::Binary(Binary::Pow) | Operation::Unary(Unary::Sqr | Unary::Power(_)) => POWER,
        _ => ATOM,
    }
}

fn number(constant: Constant) -> String {
    let Constant { value, bounds } = constant;
    if constant.is_certain() || constant.is(0.0) {
        decimal(value)
    } else if value == 0.0 && bounds.lo() == -bounds.hi() {
        format!("plusminus({})", decimal(bounds.hi()))
    } else {
        format!("interval({}, {})", decimal(bounds.lo()), decimal(bounds.hi()))
    }
}

/// The shortest decimal that reads back as the same number.
fn decimal(value: f64) -> String {
    // a negative zero would read back as the negation of a term
    let text = format!("{:?}", value + 0.0);
    match text.strip_suffix(".0") {
        Some(whole) => String::from(whole),
        None => text,
    }
}

fn comparison_symbol(comparison: Comparison) -> &'static str {
    match comparison {
        Comparison::Less => " < ",
        Comparison::AtMost => " <= ",
        Comparison::Equal => " == ",
    }
}

fn unary_name(unary: Unary) -> &'static str {
    match unary {
        Unary::Abs => "abs",
        Unary::Floor => "floor",
        Unary::Sqrt => "sqrt",
        Unary::Exp => "exp",
        Unary::Ln => "ln",
        Unary::Sin => "sin",
        Unary::Cos => "cos",
        Unary::Tan => "tan",
        Unary::Asin => "asin",
        Unary::Acos => "acos",
        Unary::Atan => "atan",
        Unary::Neg | Unary::Sqr | Unary::Power(_) | Unary::Root(_) => "",
    }
}

fn reduction_name(reduction: Reduction) -> &'static str {
    match reduction {
        Reduction::Min => "min",
        Reduction::Max => "max",
        Reduction::Sum => "sum",
        Reduction::Mean => "mean",
        Reduction::Norm => "norm",
        Reduction::Median => "median",
        Reduction::Count => "count",
        Reduction::Either => "either",
        Reduction::OneOf => "one_of",
    }
}
