//! Formulas of ours as Python code, for the thesis's `implementation/2`.

use shsa_core::expression::{
    Binary, Comparison, Constant, Formula, Operation, Reduction, Shape, Symbol, Unary,
};

use super::term::{Binding, Term};

/// The formula as a Python expression over SI values; `name` gives the value of a variable.
///
/// # Errors
/// The part of the formula that Python expressions do not have, in a few words. Time: linear in the formula.
pub(super) fn expression(formula: &Formula, name: &dyn Fn(Symbol) -> String) -> Result<String, String> {
    Writer { name }.term(formula).map(|term| term.text().to_owned())
}

struct Writer<'a> {
    name: &'a dyn Fn(Symbol) -> String,
}

type Written = Result<Term, String>;

impl Writer<'_> {
    fn term(&self, formula: &Formula) -> Written {
        let vector = formula.shape() == Shape::Vector;
        match (formula.operation(), formula.arguments()) {
            (Operation::Symbol(symbol), _) => Ok(Term::atom((self.name)(symbol))),
            (Operation::Constant(constant) | Operation::Known(_, constant), _) => number(constant),
            (Operation::Truth(truth), _) => Ok(Term::atom(if truth { "True" } else { "False" }.to_owned())),
            (Operation::Unary(_) | Operation::Binary(_) | Operation::Within(_), _) if vector => {
                Err("arithmetic of lists".to_owned())
            }
            (Operation::Unary(unary), [of]) => self.of_one(unary, of),
            (Operation::Binary(binary), [left, right]) => self.of_two(binary, left, right),
            (Operation::Compare(comparison), [left, right]) => {
                let symbol = match comparison {
                    Comparison::Less => "<",
                    Comparison::AtMost => "<=",
                    Comparison::Equal => "==",
                };
                self.infix(left, symbol, right, Binding::Comparison, Binding::Sum, Binding::Sum)
            }
            (Operation::And, [left, right]) => {
                self.infix(left, "and", right, Binding::And, Binding::And, Binding::Not)
            }
            (Operation::Or, [left, right]) => {
                self.infix(left, "or", right, Binding::Or, Binding::Or, Binding::And)
            }
            (Operation::Not, [of]) => {
                Ok(Term::new(format!("not {}", self.term(of)?.at_least(Binding::Not)), Binding::Not))
            }
            (Operation::Select, [condition, then, other]) => {
                let (condition, then, other) = (self.term(condition)?, self.term(then)?, self.term(other)?);
                let text = format!("({} if {} else {})", then.text(), condition.text(), other.text());
                Ok(Term::atom(text))
            }
            (Operation::List, items) => {
                let items = items.iter().map(|item| Ok(self.term(item)?.text().to_owned()));
                Ok(Term::atom(format!("[{}]", items.collect::<Result<Vec<_>, String>>()?.join(", "))))
            }
            (Operation::Reduce(reduction), [of]) => self.reduced(reduction, of),
            (Operation::Index, [of, index]) => {
                let place = index.as_constant().map(|constant| constant.value).filter(|place| *place >= 0.0);
                let place = place.ok_or_else(|| "a computed place in a list".to_owned())?;
                Ok(Term::atom(format!("{}[{}]", self.term(of)?.at_least(Binding::Atom), place.floor())))
            }
            (Operation::Slice(from, to), [of]) => {
                let to = if to == u32::MAX { String::new() } else { to.to_string() };
                Ok(Term::atom(format!("{}[{from}:{to}]", self.term(of)?.at_least(Binding::Atom))))
            }
            (Operation::Within(_), _) => Err("`within`".to_owned()),
            (Operation::Table, _) => Err("`table`".to_owned()),
            _ => Err("values of other times".to_owned()),
        }
    }

    fn infix(
        &self,
        left: &Formula,
        symbol: &str,
        right: &Formula,
        power: Binding,
        least: Binding,
        right_least: Binding,
    ) -> Written {
        let (left, right) = (self.term(left)?, self.term(right)?);
        Ok(Term::new(format!("{} {symbol} {}", left.at_least(least), right.at_least(right_least)), power))
    }

    fn call(&self, name: &str, arguments: &[&Formula]) -> Written {
        let arguments = arguments.iter().map(|of| Ok(self.term(of)?.text().to_owned()));
        Ok(Term::atom(format!("{name}({})", arguments.collect::<Result<Vec<_>, String>>()?.join(", "))))
    }

    fn of_one(&self, unary: Unary, of: &Formula) -> Written {
        let to_power = |exponent: &str| -> Written {
            Ok(Term::new(format!("{} ** {exponent}", self.term(of)?.at_least(Binding::Atom)), Binding::Power))
        };
        let name = match unary {
            Unary::Neg => {
                return Ok(Term::new(format!("-{}", self.term(of)?.at_least(Binding::Power)), Binding::Sign));
            }
            Unary::Sqr => return to_power("2"),
            Unary::Power(exponent) => return to_power(&exponent.to_string()),
            Unary::Root(3) => "math.cbrt",
            Unary::Root(degree) if degree % 2 == 0 => return to_power(&format!("(1 / {degree})")),
            Unary::Root(_) => return Err("a root of a high degree".to_owned()),
            Unary::Abs => "abs",
            Unary::Floor => "math.floor",
            Unary::Sqrt => "math.sqrt",
            Unary::Exp => "math.exp",
            Unary::Ln => "math.log",
            Unary::Sin => "math.sin",
            Unary::Cos => "math.cos",
            Unary::Tan => "math.tan",
            Unary::Asin => "math.asin",
            Unary::Acos => "math.acos",
            Unary::Atan => "math.atan",
        };
        self.call(name, &[of])
    }

    fn of_two(&self, binary: Binary, left: &Formula, right: &Formula) -> Written {
        match binary {
            Binary::Add => self.infix(left, "+", right, Binding::Sum, Binding::Sum, Binding::Product),
            Binary::Sub => self.infix(left, "-", right, Binding::Sum, Binding::Sum, Binding::Product),
            Binary::Mul => self.infix(left, "*", right, Binding::Product, Binding::Product, Binding::Sign),
            Binary::Div => self.infix(left, "/", right, Binding::Product, Binding::Product, Binding::Sign),
            Binary::Pow => self.infix(left, "**", right, Binding::Power, Binding::Atom, Binding::Sign),
            Binary::Min => self.call("min", &[left, right]),
            Binary::Max => self.call("max", &[left, right]),
            Binary::Atan2 | Binary::Bearing => self.call("math.atan2", &[left, right]),
            Binary::Hypot => self.call("math.hypot", &[left, right]),
        }
    }

    fn reduced(&self, reduction: Reduction, of: &Formula) -> Written {
        let name = match reduction {
            Reduction::Min => "min",
            Reduction::Max => "max",
            Reduction::Sum => "sum",
            Reduction::Mean => "statistics.mean",
            Reduction::Median => "statistics.median",
            Reduction::Norm => "numpy.linalg.norm",
            Reduction::Count => "len",
            Reduction::Either => return Err("`either`".to_owned()),
            Reduction::OneOf => return Err("`one_of`".to_owned()),
        };
        self.call(name, &[of])
    }
}

fn number(constant: Constant) -> Written {
    let Constant { value, bounds } = constant;
    if constant.is_certain() || constant.is(0.0) {
        let power = if value < 0.0 { Binding::Sign } else { Binding::Atom };
        return Ok(Term::new(decimal(value), power));
    }
    if !bounds.is_bounded() {
        return Err("a number without bounds".to_owned());
    }
    Ok(Term::atom(format!("interval([{}, {}])", decimal(bounds.lo()), decimal(bounds.hi()))))
}

/// The shortest decimal that reads back as the same number.
fn decimal(value: f64) -> String {
    let text = format!("{:?}", value + 0.0);
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}
