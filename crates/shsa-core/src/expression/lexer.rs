//! Splits the text of a formula into tokens; a unit behind a number belongs to the number's token.
//!
//! **Which text is a unit.** Behind a number, after blanks or none, a known unit name begins a unit (a name could
//! not stand there otherwise). It goes on through `*`, `·` and `/` *written without blanks* before another known
//! unit name or a product of several in parentheses (`4.15 kJ/(kg K)`), through a blank before another known unit name (`5 N m`), and
//! through `^` with a whole number.
//! A name before `(` is a function, never a unit. So `9.81 m/s^2` is a number with a unit, and `2 m / s`
//! is `2 m` divided by the variable `s`. Where a variable has the name of such a unit, the checker warns.

use alloc::format;
use alloc::string::{String, ToString};
use core::ops::Range;

use super::problem::Problem;
use crate::unit::{Unit, is_unit_char, is_unit_name};

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    Number(f64, Option<Unit>),
    Name(String),
    Symbol(&'static str),
    End,
}

/// The symbols, longer ones first.
const SYMBOLS: [&str; 19] =
    ["..", "<=", ">=", "==", "!=", "<", ">", "=", "+", "-", "*", "/", "^", "(", ")", "[", "]", ",", "·"];

pub(super) struct Lexer<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lexer<'a> {
    pub(super) fn new(text: &'a str) -> Lexer<'a> {
        Lexer { text, at: 0 }
    }

    /// The next token and its place; always `End` after the last one.
    pub(super) fn next(&mut self) -> Result<(Token, Range<usize>), Problem> {
        let rest = from(self.text, self.at);
        let start = self.at + rest.len() - rest.trim_start().len();
        let rest = from(self.text, start);
        let Some(first) = rest.chars().next() else {
            return Ok((Token::End, self.text.len()..self.text.len()));
        };
        let (token, length) = if first.is_ascii_digit() || is_fraction(rest) {
            number(rest).map_err(|problem| shifted(problem, start))?
        } else if first.is_ascii_alphabetic() || first == '_' {
            let name = rest.get(..name_length(rest)).unwrap_or("");
            (Token::Name(name.to_string()), name.len())
        } else if let Some(symbol) = SYMBOLS.iter().find(|symbol| rest.starts_with(**symbol)) {
            (Token::Symbol(symbol), symbol.len())
        } else {
            return Err(stray(first, start));
        };
        self.at = start + length;
        Ok((token, start..self.at))
    }
}

fn stray(c: char, start: usize) -> Problem {
    let problem = Problem::error(
        start..start + c.len_utf8(),
        format!("`{}` has no meaning in a formula", c.escape_debug()),
    );
    match c {
        '!' => problem.with_help("write `not`"),
        '&' => problem.with_help("write `and`"),
        '|' => problem.with_help("write `or`"),
        '%' => problem.with_help("`%` is a unit: write it behind a number"),
        _ => problem,
    }
}

fn shifted(problem: Problem, by: usize) -> Problem {
    Problem { span: problem.span.start + by..problem.span.end + by, ..problem }
}

fn from(text: &str, at: usize) -> &str {
    text.get(at..).unwrap_or("")
}

/// The length of the leading characters that all fulfil `is`.
fn length_while(text: &str, is: impl Fn(char) -> bool) -> usize {
    text.find(|c| !is(c)).unwrap_or(text.len())
}

fn name_length(text: &str) -> usize {
    length_while(text, |c| c.is_ascii_alphanumeric() || c == '_')
}

fn digits(text: &str) -> usize {
    length_while(text, |c| c.is_ascii_digit())
}

/// Whether a number begins with a point.
fn is_fraction(text: &str) -> bool {
    text.strip_prefix('.').is_some_and(|rest| digits(rest) > 0)
}

/// The leading number and its unit, and the length of both.
fn number(text: &str) -> Result<(Token, usize), Problem> {
    let length = number_length(text);
    let value: f64 = text.get(..length).and_then(|digits| digits.parse().ok()).unwrap_or(f64::NAN);
    if !value.is_finite() {
        return Err(Problem::error(0..length, "this number is too large"));
    }
    let rest = from(text, length);
    let Some(extent) = unit_extent(rest) else { return Ok((Token::Number(value, None), length)) };
    let place = length + extent.start..length + extent.end;
    let unit = Unit::parse(rest.get(extent).unwrap_or(""))
        .map_err(|error| Problem::error(place.clone(), error.to_string()))?;
    Ok((Token::Number(value, Some(unit)), place.end))
}

/// Digits, a point unless another follows (`v[1..3]`), digits, an exponent.
fn number_length(text: &str) -> usize {
    let mut length = digits(text);
    let point = from(text, length).starts_with('.') && !from(text, length).starts_with("..");
    if point {
        length += 1 + digits(from(text, length + 1));
    }
    let tail = from(text, length);
    let exponent = tail.strip_prefix(['e', 'E']).map(|tail| tail.strip_prefix(['+', '-']).unwrap_or(tail));
    match exponent {
        Some(exponent) if digits(exponent) > 0 => length + tail.len() - exponent.len() + digits(exponent),
        _ => length,
    }
}

/// The place of the unit behind a number, if there is one.
fn unit_extent(text: &str) -> Option<Range<usize>> {
    let start = blanks(text);
    let mut end = match from(text, start).strip_prefix("1/") {
        Some(_) => factor_or_group_end(text, start + 2)?,
        None => factor_end(text, start)?,
    };
    while let Some(next) = joined_factor(text, end) {
        end = next;
    }
    Some(start..end)
}

/// The end of a further factor that belongs to the unit before `at`.
fn joined_factor(text: &str, at: usize) -> Option<usize> {
    let rest = from(text, at);
    let blank = blanks(rest);
    if blank > 0 {
        return factor_end(text, at + blank);
    }
    let operator = rest.chars().next().filter(|c| matches!(c, '*' | '/' | '·'))?;
    factor_or_group_end(text, at + operator.len_utf8())
}

/// The end of a unit name, or of a product of several unit names in parentheses, with its exponent.
fn factor_or_group_end(text: &str, at: usize) -> Option<usize> {
    factor_end(text, at).or_else(|| {
        let (inner, tail) = from(text, at).strip_prefix('(')?.split_once(')')?;
        let names = inner.split(|c| !is_unit_char(c)).filter(|name| is_unit_name(name)).count();
        // One name in parentheses is a variable: nobody writes a unit so.
        let is_product = names > 1 && Unit::parse(inner).is_ok();
        is_product.then(|| at + inner.len() + 2 + exponent_length(tail))
    })
}

/// The end of the unit name with its exponent at `at`.
fn factor_end(text: &str, at: usize) -> Option<usize> {
    let rest = from(text, at);
    let length = length_while(rest, is_unit_char);
    let (name, tail) = rest.split_at_checked(length)?;
    let is_longer = tail.starts_with(|c: char| c.is_ascii_digit());
    let is_call = tail.trim_start().starts_with('(');
    if is_longer || is_call || !is_unit_name(name) {
        return None;
    }
    Some(at + length + exponent_length(tail))
}

fn exponent_length(text: &str) -> usize {
    if let Some(exponent) = text.strip_prefix('^') {
        let sign = usize::from(exponent.starts_with('-'));
        let digits = digits(from(exponent, sign));
        return if digits > 0 { 1 + sign + digits } else { 0 };
    }
    length_while(text, |c| matches!(c, '⁻' | '⁰' | '¹' | '²' | '³' | '⁴'..='⁹'))
}

fn blanks(text: &str) -> usize {
    length_while(text, |c| matches!(c, ' ' | '\t'))
}
