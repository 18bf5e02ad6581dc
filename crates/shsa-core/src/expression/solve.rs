//! Solves an equation for a variable that occurs once in it: operation by operation from the root to the variable.
//!
//! Where an operation has several inverses, the bounds of the inner term (from the declared ranges of the variables) select the
//! possible branches; several branches become `either(..)` of `within(..)`, over intervals their hull.

use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, PI};

use super::alternatives::{alternatives, count, one_of};
use super::builtin::MOST_ALTERNATIVES;
use super::checked::check_equation;
use super::curve::{Curve, Point};
use super::formula::{Formula, Shape, whole_power};
use super::inverse_table::inverses;
use super::operation::{Binary, Constant, Operation, Reduction, Unary};
use super::problem::{Problem, Severity};
use super::simplify::simplified;
use super::syntax::Equation;
use super::{Scope, Symbol};
use crate::interval::Interval;

/// The most branches of an inverse sine, cosine or tangent.
const MAX_BRANCHES: usize = 16;
const NOT_NEGATIVE: Interval = Interval::new(0.0, f64::INFINITY);

/// The formula of `wanted` that follows from the equation.
///
/// Uses of `wanted` inside `previous(..)` do not count: they are state. Where both sides use `wanted`, or one side several times,
/// equal terms are collected first (`x + x = y` gives `y / 2`).
///
/// # Errors
/// The first error of the equation, or the reason why it cannot be solved for `wanted`, at the place of `wanted`. Time: linear in
/// the size of the equation.
pub fn solve(equation: &Equation, wanted: Symbol, scope: &dyn Scope) -> Result<Formula, Problem> {
    let checked = check_equation(equation, scope);
    let error = checked.problems.into_iter().find(|problem| problem.severity == Severity::Error);
    let span = equation.lhs.span.start..equation.rhs.span.end;
    let Some((lhs, rhs)) = checked.sides else {
        return Err(error.unwrap_or_else(|| Problem::error(span, "this equation has an error")));
    };
    let places = || {
        let is_wanted = |name: &&str| scope.symbol(name) == Some(wanted);
        let name = scope.names().into_iter().find(is_wanted).unwrap_or("");
        let mut places = equation.lhs.places_of(name);
        places.extend(equation.rhs.places_of(name));
        places
    };
    let solver = Solver { wanted, scope };
    let solution = solver.solve_each(lhs, rhs).map_err(|why| {
        let place = places().pop().unwrap_or(span.clone());
        Problem::error(place, format!("this cannot be solved for it: {}", why.message)).with_help(why.help)
    })?;
    let solution = simplified(solution);
    if solution.shape() != scope.kind(wanted).shape {
        let message = "this cannot be solved for it: a vector of values would follow for one number";
        return Err(Problem::error(places().pop().unwrap_or(span), message));
    }
    let too_large = || Problem::error(span, "the solved formula is too large");
    if solution.is_bounded() { Ok(solution) } else { Err(too_large()) }
}

/// Why an equation cannot be solved.
struct Obstacle {
    message: String,
    help: &'static str,
}

fn obstacle<T>(message: impl Into<String>, help: &'static str) -> Result<T, Obstacle> {
    Err(Obstacle { message: message.into(), help })
}

struct Solver<'a> {
    wanted: Symbol,
    scope: &'a dyn Scope,
}

impl Solver<'_> {
    /// Solves for each of the values of `one_of` by itself: the solution is one of the solutions.
    fn solve_each(&self, lhs: Formula, rhs: Formula) -> Result<Formula, Obstacle> {
        let count = count(&lhs).saturating_mul(count(&rhs));
        if count == 1 {
            return self.solve(lhs, rhs);
        }
        if count > MOST_ALTERNATIVES {
            return obstacle(
                format!("`one_of` leaves {count} alternatives, more than {MOST_ALTERNATIVES}"),
                "give what is chosen a variable of its own",
            );
        }
        let (left, right) = (alternatives(&lhs), alternatives(&rhs));
        let pairs = left.iter().flat_map(|lhs| right.iter().map(move |rhs| (lhs, rhs)));
        let occurs = |(lhs, rhs): (&Formula, &Formula)| {
            lhs.occurrences(self.wanted) + rhs.occurrences(self.wanted) > 0
        };
        if !pairs.clone().all(occurs) {
            return obstacle(
                "one of the alternatives does not need it",
                "it may have every value where that one holds",
            );
        }
        let solutions = pairs.map(|(lhs, rhs)| self.solve(lhs.clone(), rhs.clone()).map(simplified));
        solutions.collect::<Result<Vec<Formula>, Obstacle>>().map(one_of)
    }

    fn solve(&self, lhs: Formula, rhs: Formula) -> Result<Formula, Obstacle> {
        match (lhs.occurrences(self.wanted), rhs.occurrences(self.wanted)) {
            (0, 0) => {
                obstacle("it does not occur", "only `previous(..)` of it, or nothing, is in this equation")
            }
            (1, 0) => self.inverted(&lhs, rhs),
            (0, 1) => self.inverted(&rhs, lhs),
            _ => {
                let difference = simplified(Formula::binary(Binary::Sub, lhs, rhs));
                match difference.occurrences(self.wanted) {
                    1 => self.inverted(&difference, Formula::number(0.0)),
                    count => obstacle(
                        format!("it occurs {count} times"),
                        "write the equation so that it occurs once, or give a relation for each direction",
                    ),
                }
            }
        }
    }

    /// The formula of the wanted variable for which `side` equals `target`.
    fn inverted(&self, side: &Formula, target: Formula) -> Result<Formula, Obstacle> {
        let (mut side, mut target) = (side, target);
        loop {
            let operation = side.operation();
            if operation == Operation::Symbol(self.wanted) {
                return Ok(target);
            }
            let arguments = side.arguments();
            let Some(place) = arguments.iter().position(|argument| argument.occurrences(self.wanted) > 0)
            else {
                return obstacle("it does not occur", "");
            };
            target = match (operation, arguments) {
                (Operation::Unary(unary), [of]) => self.of_one(unary, of, target)?,
                (Operation::Binary(binary), [of, other]) if place == 0 => {
                    self.of_left(binary, of, other, target)?
                }
                (Operation::Binary(binary), [other, of]) => self.of_right(binary, of, other, target)?,
                (Operation::Table, [of, ..]) => self.of_table(side, of, target)?,
                (Operation::Within(bounds), [_]) => Formula::node(Operation::Within(bounds), vec![target]),
                _ => return blocked(side),
            };
            if !target.is_bounded() {
                return obstacle(
                    "the solved formula is too large",
                    "split the equation by variables of its own",
                );
            }
            match arguments.get(place) {
                Some(next) => side = next,
                None => return obstacle("it does not occur", ""),
            }
        }
    }

    fn of_one(&self, unary: Unary, of: &Formula, target: Formula) -> Result<Formula, Obstacle> {
        let inverse = |unary| move |target| Formula::unary(unary, target);
        let solved = match unary {
            Unary::Neg => inverse(Unary::Neg)(target),
            Unary::Sqrt => inverse(Unary::Sqr)(within(target, NOT_NEGATIVE)),
            Unary::Exp => inverse(Unary::Ln)(target),
            Unary::Ln => inverse(Unary::Exp)(target),
            Unary::Asin => inverse(Unary::Sin)(within(target, widened(-FRAC_PI_2, FRAC_PI_2))),
            Unary::Acos => inverse(Unary::Cos)(within(target, widened(0.0, PI))),
            Unary::Atan => inverse(Unary::Tan)(within(target, widened(-FRAC_PI_2, FRAC_PI_2))),
            Unary::Abs => self.of_even(of, within(target, NOT_NEGATIVE))?,
            Unary::Sqr => self.of_even(of, inverse(Unary::Sqrt)(target))?,
            Unary::Power(0) => return obstacle("it cancels out", "it may have every value"),
            Unary::Power(power) => self.of_power(power, of, target)?,
            Unary::Root(degree) if degree % 2 == 0 => whole_power(within(target, NOT_NEGATIVE), degree),
            Unary::Root(degree) => whole_power(target, degree),
            Unary::Sin | Unary::Cos | Unary::Tan => self.of_wave(unary, of, target)?,
            Unary::Floor => return blocked_by("floor", "many values give the same result"),
        };
        Ok(solved)
    }

    /// The inverse of each stretch in which the table only rises or falls, where the inner term can be there.
    fn of_table(&self, table: &Formula, of: &Formula, target: Formula) -> Result<Formula, Obstacle> {
        let inverses = inverses(&table.points());
        if let [inverse] = inverses.as_slice() {
            return Ok(Formula::table(target, inverse));
        }
        if inverses.is_empty() {
            return obstacle("it cancels out", "the table has one value wherever it may be");
        }
        let range = self.bounds(of);
        let is_possible = |inverse: &&Vec<Point>| Curve::new(inverse).over(Interval::ENTIRE).overlaps(range);
        let possible: Vec<&Vec<Point>> = inverses.iter().filter(is_possible).collect();
        // Where the inner term is never on the table, the bounds choose nothing.
        let (chosen, range) = match possible.as_slice() {
            [] => (inverses.iter().collect(), Interval::ENTIRE),
            _ => (possible, range),
        };
        if chosen.len() > MAX_BRANCHES {
            return obstacle(
                format!("the table rises and falls, and {} places give the same result", chosen.len()),
                "declare a range of the variables inside in which it only rises or only falls",
            );
        }
        let branches = chosen.into_iter().map(|inverse| Formula::table(target.clone(), inverse));
        self.branches(of, branches.collect(), range)
    }

    fn of_power(&self, power: i32, of: &Formula, target: Formula) -> Result<Formula, Obstacle> {
        let degree = power.saturating_abs();
        let target =
            if power < 0 { Formula::binary(Binary::Div, Formula::number(1.0), target) } else { target };
        match degree {
            1 => Ok(target),
            2 => self.of_even(of, Formula::unary(Unary::Sqrt, target)),
            _ if degree % 2 == 0 => self.of_even(of, Formula::unary(Unary::Root(degree), target)),
            _ => Ok(Formula::unary(Unary::Root(degree), target)),
        }
    }

    /// `target` or its negative, or both, by the bounds of the inner term.
    fn of_even(&self, of: &Formula, target: Formula) -> Result<Formula, Obstacle> {
        let range = self.bounds(of);
        if range.lo() >= 0.0 {
            return Ok(target);
        }
        let negative = Formula::unary(Unary::Neg, target.clone());
        if range.hi() <= 0.0 {
            return Ok(negative);
        }
        self.branches(of, vec![target, negative], range)
    }

    /// `binary(of, other) = target`
    fn of_left(
        &self,
        binary: Binary,
        of: &Formula,
        other: &Formula,
        target: Formula,
    ) -> Result<Formula, Obstacle> {
        let other = other.clone();
        let solved = match binary {
            Binary::Add => Formula::binary(Binary::Sub, target, other),
            Binary::Sub => Formula::binary(Binary::Add, target, other),
            Binary::Mul if other.is(0.0) => return obstacle("it cancels out", "it may have every value"),
            Binary::Mul => Formula::binary(Binary::Div, target, other),
            Binary::Div => Formula::binary(Binary::Mul, target, other),
            Binary::Pow => {
                // A negative base has powers where an exponent may be whole.
                let is_signed = !other.is_certain() && self.bounds(of).lo() < 0.0;
                let exponent = Formula::binary(Binary::Div, Formula::number(1.0), other);
                let inverse = |target| Formula::binary(Binary::Pow, target, exponent);
                match is_signed {
                    true => self.of_even(of, inverse(Formula::unary(Unary::Abs, target)))?,
                    false => inverse(within(target, NOT_NEGATIVE)),
                }
            }
            Binary::Hypot => {
                let square = Formula::unary(Unary::Sqr, within(target, NOT_NEGATIVE));
                let rest = Formula::binary(Binary::Sub, square, Formula::unary(Unary::Sqr, other));
                self.of_even(of, Formula::unary(Unary::Sqrt, rest))?
            }
            Binary::Min => return blocked_by("min", "the other argument may be the result"),
            Binary::Max => return blocked_by("max", "the other argument may be the result"),
            Binary::Atan2 | Binary::Bearing => return blocked_by("atan2", "it is not unique"),
        };
        Ok(solved)
    }

    /// `binary(other, of) = target`
    fn of_right(
        &self,
        binary: Binary,
        of: &Formula,
        other: &Formula,
        target: Formula,
    ) -> Result<Formula, Obstacle> {
        let solved = match binary {
            Binary::Sub => Formula::binary(Binary::Sub, other.clone(), target),
            Binary::Div => Formula::binary(Binary::Div, other.clone(), target),
            Binary::Pow => {
                // A negative base has powers, too: the sizes of both sides are equal.
                let is_signed = self.bounds(other).lo() < 0.0;
                let size = |of| if is_signed { Formula::unary(Unary::Abs, of) } else { of };
                let logarithm = |of| Formula::unary(Unary::Ln, size(of));
                Formula::binary(Binary::Div, logarithm(target), logarithm(other.clone()))
            }
            symmetric => self.of_left(symmetric, of, other, target)?,
        };
        Ok(solved)
    }

    /// The inverse of sine, cosine or tangent: the principal branch if the inner term stays within it, else all possible
    /// branches.
    fn of_wave(&self, unary: Unary, of: &Formula, target: Formula) -> Result<Formula, Obstacle> {
        let (inverse, principal) = match unary {
            Unary::Sin => (Unary::Asin, widened(-FRAC_PI_2, FRAC_PI_2)),
            Unary::Cos => (Unary::Acos, widened(0.0, PI)),
            _ => (Unary::Atan, widened(-FRAC_PI_2, FRAC_PI_2)),
        };
        let range = self.bounds(of);
        let angle = Formula::unary(inverse, target);
        if principal.intersection(range) == range {
            return Ok(angle);
        }
        let help = "declare a range, such as `range: [-90 deg, 90 deg]`, for the variables inside";
        if !range.is_bounded() {
            return obstacle("infinitely many angles give the same result", help);
        }
        let half_turns = |branch: f64| Formula::constant(multiple_of_pi(branch));
        let add = |left: &Formula, right| Formula::binary(Binary::Add, left.clone(), right);
        let subtract = |left: Formula, right: &Formula| Formula::binary(Binary::Sub, left, right.clone());
        let first = libm::floor(range.lo() / PI) - 1.0;
        let count = libm::ceil(range.hi() / PI) - first + 2.0;
        if count > MAX_BRANCHES as f64 {
            return obstacle(format!("more than {MAX_BRANCHES} angles give the same result"), help);
        }
        let turns = (0..count as i32).map(|turn| first + f64::from(turn));
        let branches: Vec<Formula> = turns
            .filter_map(|turn| {
                let is_even = libm::fmod(turn, 2.0) == 0.0;
                let (centre, formula) = match unary {
                    Unary::Sin if is_even => (turn, add(&angle, half_turns(turn))),
                    Unary::Sin => (turn, subtract(half_turns(turn), &angle)),
                    Unary::Cos if is_even => (turn + 0.5, add(&angle, half_turns(turn))),
                    Unary::Cos => (turn + 0.5, subtract(half_turns(turn + 1.0), &angle)),
                    _ => (turn, add(&angle, half_turns(turn))),
                };
                widened((centre - 0.5) * PI, (centre + 0.5) * PI).overlaps(range).then_some(formula)
            })
            .collect();
        self.branches(of, branches, range)
    }

    /// The branches within the range.
    fn branches(&self, of: &Formula, branches: Vec<Formula>, range: Interval) -> Result<Formula, Obstacle> {
        if of.shape() == Shape::Vector || branches.iter().any(|branch| branch.shape() == Shape::Vector) {
            return obstacle(
                "several vectors give the same result",
                "declare a range that allows one of them",
            );
        }
        let mut within = branches.into_iter().map(|branch| within(branch, range)).collect::<Vec<_>>();
        if within.len() == 1 {
            return Ok(within.pop().unwrap_or_else(|| Formula::number(0.0)));
        }
        Ok(Formula::node(Operation::Reduce(Reduction::Either), vec![Formula::node(Operation::List, within)]))
    }

    /// The bounds of a formula, from the declared ranges of its variables.
    fn bounds(&self, formula: &Formula) -> Interval {
        formula.bounds(&|symbol| self.scope.kind(symbol).range)
    }
}

fn blocked(side: &Formula) -> Result<Formula, Obstacle> {
    let is_listed = side.arguments().iter().all(|argument| argument.operation() == Operation::List);
    match side.operation() {
        Operation::Reduce(Reduction::Min | Reduction::Max | Reduction::Mean) if is_listed => {
            blocked_by("what passes over arguments without a value", "any of them may have none")
        }
        Operation::Select => blocked_by("if", "each branch has its own inverse"),
        Operation::Reduce(_) | Operation::List => {
            blocked_by("a function of a vector", "many vectors give the same result")
        }
        Operation::Index | Operation::Slice(..) => blocked_by("`[..]`", "the other elements stay unknown"),
        operation if operation.recalls() => {
            blocked_by("a time operator", "its value at other times counts too")
        }
        _ => blocked_by("a comparison", "many values give the same result"),
    }
}

fn blocked_by<T>(what: &str, why: &'static str) -> Result<T, Obstacle> {
    obstacle(format!("{what} has no inverse"), why)
}

fn within(formula: Formula, range: Interval) -> Formula {
    if range == Interval::ENTIRE {
        return formula;
    }
    Formula::node(Operation::Within(Constant::between(range)), vec![formula])
}

/// An interval with room for the rounding of angles written in degrees.
fn widened(lo: f64, hi: f64) -> Interval {
    Interval::new(lo - 1e-9, hi + 1e-9)
}

fn multiple_of_pi(factor: f64) -> Constant {
    let pi = Interval::new(PI, PI.next_up());
    Constant { value: factor * PI, bounds: Interval::point(factor) * pi }
}
