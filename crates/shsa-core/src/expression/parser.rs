//! Reads a formula: operators by binding power (Pratt, doi:10.1145/512927.512931), bounded in length and depth.
//!
//! From the weakest to the strongest: `or`, `and`, `not`, comparisons, `+ -`, `* /`, the sign `-`, `^`
//! (which binds to the right).

use alloc::borrow::ToOwned;
use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;

use super::builtin;
use super::lexer::{Lexer, Token};
use super::problem::Problem;
use super::syntax::{Equation, Expr, Infix, Node, Prefix};
use crate::unit::Unit;

/// The longest text of a formula in bytes.
pub const MAX_TEXT: usize = 20_000;
/// The deepest nesting of brackets, signs and powers.
///
/// This and the other depth limits keep recursion, unoptimised, within 1 MB of stack.
pub const MAX_NESTING: usize = 64;
/// The deepest tree of a formula; a row of operators makes a tree as deep as their number.
pub const MAX_DEPTH: usize = 150;

/// Reads a formula.
///
/// # Errors
/// The first place where the text is no formula, or is too long or too deep. Time and space are linear in the text.
pub fn parse_expression(text: &str) -> Result<Expr, Problem> {
    let mut parser = Parser::new(text)?;
    let expression = parser.expression(0, 0)?;
    parser.end()?;
    Ok(expression)
}

/// Reads `formula = formula`.
///
/// # Errors
/// As [`parse_expression`].
pub fn parse_equation(text: &str) -> Result<Equation, Problem> {
    let mut parser = Parser::new(text)?;
    let lhs = parser.expression(0, 0)?;
    if !parser.take("=")? {
        let problem = parser.unexpected("an `=` is missing");
        return Err(problem.with_help("an equation is written `variable = formula`"));
    }
    let rhs = parser.expression(0, 0)?;
    parser.end()?;
    Ok(Equation { lhs, rhs })
}

/// Reads the head of a function, such as `clamp01(x)`: its name and its parameters, all different.
///
/// With the body read by [`parse_expression`] it makes a [`Function`](super::Function).
///
/// # Errors
/// The place where the text is no head; names that are reserved or repeated.
pub fn parse_function_head(head: &str) -> Result<(String, Vec<String>), Problem> {
    let mut parser = Parser::new(head)?;
    let (name, place) = parser.name("the function's name")?;
    if builtin::is_reserved(&name) {
        return Err(Problem::error(place, format!("`{name}` has a meaning already")));
    }
    if !parser.take("(")? {
        let problem = parser.unexpected("a `(` is missing");
        return Err(problem.with_help("a function's head is written `name(parameter, parameter)`"));
    }
    let parameters = parser.parameters()?;
    parser.end()?;
    Ok((name, parameters))
}

/// A number with its unit, as written in a model outside formulas.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The number as written.
    pub value: f64,
    /// The unit behind the number, if any.
    pub unit: Option<Unit>,
}

/// Reads one number with or without a sign and a unit: `2.67 m`, `-100 ms`, `2 %`, `10 Hz`.
///
/// # Errors
/// The place where the text is something else.
pub fn parse_quantity(text: &str) -> Result<Quantity, Problem> {
    let mut parser = Parser::new(text)?;
    let negative = parser.take("-")?;
    let Token::Number(value, unit) = parser.token.clone() else {
        return Err(parser.unexpected("a number is missing"));
    };
    parser.advance()?;
    parser.end()?;
    Ok(Quantity { value: if negative { -value } else { value }, unit })
}

const OR: u8 = 1;
const AND: u8 = 2;
const COMPARISON: u8 = 3;
const SUM: u8 = 4;
const PRODUCT: u8 = 5;
const SIGN: u8 = 6;
const POWER: u8 = 7;

/// The operator of a token and its binding power.
fn infix(token: &Token) -> Option<(Infix, u8)> {
    let written = match token {
        Token::Symbol("·") => "*",
        Token::Symbol(symbol) => symbol,
        Token::Name(name) => name.as_str(),
        Token::Number(..) | Token::End => return None,
    };
    let found = Infix::ALL.into_iter().find(|infix| infix.symbol() == written)?;
    Some((found, power(found)))
}

const fn power(infix: Infix) -> u8 {
    match infix {
        Infix::Or => OR,
        Infix::And => AND,
        Infix::Less | Infix::AtMost | Infix::Greater | Infix::AtLeast | Infix::Equal | Infix::Unequal => {
            COMPARISON
        }
        Infix::Add | Infix::Subtract => SUM,
        Infix::Multiply | Infix::Divide => PRODUCT,
        Infix::Power => POWER,
    }
}

struct Parser<'a> {
    lexer: Lexer<'a>,
    token: Token,
    span: Range<usize>,
    /// The end of the token before.
    last_end: usize,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str) -> Result<Parser<'a>, Problem> {
        if text.len() > MAX_TEXT {
            let problem =
                Problem::error(0..text.len(), format!("this formula has more than {MAX_TEXT} bytes"));
            return Err(problem.with_help("split it by variables of its own"));
        }
        let mut parser = Parser { lexer: Lexer::new(text), token: Token::End, span: 0..0, last_end: 0 };
        parser.advance()?;
        Ok(parser)
    }

    fn advance(&mut self) -> Result<(), Problem> {
        self.last_end = self.span.end;
        (self.token, self.span) = self.lexer.next()?;
        Ok(())
    }

    /// Takes the symbol if it comes next; returns whether it did.
    fn take(&mut self, symbol: &str) -> Result<bool, Problem> {
        let found = matches!(&self.token, Token::Symbol(next) if *next == symbol);
        if found {
            self.advance()?;
        }
        Ok(found)
    }

    fn expect(&mut self, symbol: &str) -> Result<(), Problem> {
        if self.take(symbol)? { Ok(()) } else { Err(self.unexpected(&format!("a `{symbol}` is missing"))) }
    }

    fn unexpected(&self, missing: &str) -> Problem {
        let message = match &self.token {
            Token::End => format!("{missing} at the end"),
            Token::Symbol(symbol) => format!("{missing} before `{symbol}`"),
            Token::Name(name) => format!("{missing} before `{name}`"),
            Token::Number(value, _) => format!("{missing} before `{value}`"),
        };
        let problem = Problem::error(self.span.clone(), message);
        match self.token {
            // Wherever an equals sign is out of place, a comparison was meant.
            Token::Symbol("=") => problem.with_help("compare with `==`"),
            _ => problem,
        }
    }

    /// Checks that nothing follows.
    fn end(&mut self) -> Result<(), Problem> {
        let problem = match &self.token {
            Token::End => return Ok(()),
            Token::Name(name) => self.stray_name(name),
            Token::Symbol(")" | "]") => self.unexpected("an opening bracket is missing"),
            _ => self.unexpected("an operator is missing"),
        };
        Err(problem)
    }

    /// The problem of a name behind a term: a misspelt unit, or a product without its sign.
    fn stray_name(&self, name: &str) -> Problem {
        let problem = self.unexpected("an operator is missing");
        match Unit::parse(name) {
            Err(error) => match error.nearest {
                Some(unit) => problem
                    .with_help(format!("if it is a unit, did you mean `{unit}`? A product is written `*`")),
                None => problem.with_help("a product is written `*`"),
            },
            Ok(_) => problem.with_help("a unit stands behind a number only; a product is written `*`"),
        }
    }

    fn name(&mut self, what: &str) -> Result<(String, Range<usize>), Problem> {
        let Token::Name(name) = self.token.clone() else {
            return Err(self.unexpected(&format!("{what} is missing")));
        };
        let place = self.span.clone();
        self.advance()?;
        Ok((name, place))
    }

    fn parameters(&mut self) -> Result<Vec<String>, Problem> {
        let mut parameters: Vec<String> = Vec::new();
        loop {
            let (name, place) = self.name("a parameter")?;
            if builtin::is_reserved(&name) || parameters.contains(&name) {
                return Err(Problem::error(place, format!("`{name}` has a meaning already")));
            }
            parameters.push(name);
            if !self.take(",")? {
                self.expect(")")?;
                return Ok(parameters);
            }
        }
    }

    fn node(&self, node: Node, start: usize) -> Result<Expr, Problem> {
        let expression = Expr::new(node, start..self.last_end);
        if expression.depth() > MAX_DEPTH { Err(too_deep(expression.span)) } else { Ok(expression) }
    }

    /// Reads operators that bind at least as strongly as `least`.
    fn expression(&mut self, least: u8, depth: usize) -> Result<Expr, Problem> {
        if depth > MAX_NESTING {
            return Err(too_deep(self.span.clone()));
        }
        let start = self.span.start;
        let mut left = self.prefixed(depth)?;
        while let Some((operator, power)) = infix(&self.token).filter(|(_, power)| *power >= least) {
            self.advance()?;
            let right = if operator == Infix::Power {
                self.expression(SIGN, depth + 1)?
            } else {
                self.expression(power + 1, depth + 1)?
            };
            left = self.node(Node::Infix(operator, Box::new(left), Box::new(right)), start)?;
        }
        Ok(left)
    }

    fn prefixed(&mut self, depth: usize) -> Result<Expr, Problem> {
        let start = self.span.start;
        if matches!(&self.token, Token::Name(name) if name == Prefix::Not.symbol()) {
            self.advance()?;
            let of = self.expression(COMPARISON, depth + 1)?;
            return self.node(Node::Prefix(Prefix::Not, Box::new(of)), start);
        }
        if self.take("+")? {
            return self.expression(SIGN, depth + 1);
        }
        if !self.take("-")? {
            return self.postfixed(depth);
        }
        // `-5 degC` is a temperature below zero, not the negative of 278.15 K
        if let Token::Number(value, Some(unit)) = &self.token
            && unit.offset != 0.0
        {
            let number = Node::Number(-value, Some(unit.clone()));
            self.advance()?;
            return self.node(number, start);
        }
        let of = self.expression(SIGN, depth + 1)?;
        self.node(Node::Prefix(Prefix::Minus, Box::new(of)), start)
    }

    fn postfixed(&mut self, depth: usize) -> Result<Expr, Problem> {
        let start = self.span.start;
        let mut of = self.primary(depth)?;
        while self.take("[")? {
            let node = self.index(of, depth)?;
            of = self.node(node, start)?;
        }
        Ok(of)
    }

    /// Reads an index or a slice between `[` and `]`.
    fn index(&mut self, of: Expr, depth: usize) -> Result<Node, Problem> {
        let is_open = matches!(self.token, Token::Symbol(".."));
        let from = if is_open { None } else { Some(Box::new(self.expression(0, depth + 1)?)) };
        if !self.take("..")? {
            self.expect("]")?;
            return match from {
                Some(index) => Ok(Node::Index(Box::new(of), index)),
                None => Err(self.unexpected("an index is missing")),
            };
        }
        let is_open = matches!(self.token, Token::Symbol("]"));
        let to = if is_open { None } else { Some(Box::new(self.expression(0, depth + 1)?)) };
        self.expect("]")?;
        Ok(Node::Slice(Box::new(of), from, to))
    }

    fn primary(&mut self, depth: usize) -> Result<Expr, Problem> {
        let start = self.span.start;
        match self.token.clone() {
            Token::Number(value, unit) => {
                self.advance()?;
                self.node(Node::Number(value, unit), start)
            }
            Token::Name(name) if matches!(name.as_str(), "and" | "or") => {
                Err(self.unexpected("a number, a variable or a `(` is missing"))
            }
            Token::Name(name) => {
                self.advance()?;
                let node =
                    if self.take("(")? { Node::Call(name, self.arguments(depth)?) } else { Node::Name(name) };
                self.node(node, start)
            }
            Token::Symbol("[") => {
                self.advance()?;
                let at = self.expression(0, depth + 1)?;
                self.expect(",")?;
                let value = self.expression(0, depth + 1)?;
                self.expect("]")?;
                self.node(Node::Point(Box::new(at), Box::new(value)), start)
            }
            Token::Symbol("(") => {
                self.advance()?;
                let inner = self.expression(0, depth + 1)?;
                self.expect(")")?;
                Ok(inner)
            }
            _ => Err(self.unexpected("a number, a variable or a `(` is missing")),
        }
    }

    fn arguments(&mut self, depth: usize) -> Result<Vec<Expr>, Problem> {
        let mut arguments = Vec::new();
        if self.take(")")? {
            return Ok(arguments);
        }
        loop {
            arguments.push(self.expression(0, depth + 1)?);
            if !self.take(",")? {
                self.expect(")")?;
                return Ok(arguments);
            }
        }
    }
}

fn too_deep(span: Range<usize>) -> Problem {
    let message = format!(
        "this formula is nested deeper than {MAX_NESTING} levels, or has more than {MAX_DEPTH} operators in a row"
    );
    Problem::error(span, message).with_help("split it by variables of its own".to_owned())
}
