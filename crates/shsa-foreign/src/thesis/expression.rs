//! Python expressions as formulas of ours, by recursive descent, bounded in depth and length.

use std::collections::BTreeMap;
use std::ops::Range;

use super::functions::{self};
use super::python::{Names, Translated, Trouble};
use super::term::{Binding, Term};
use super::tokens::{MAX_TEXT, Token};

/// The deepest nesting of brackets and operators, which keeps the recursion within a small stack.
const MAX_DEPTH: usize = 64;

const ADDITIVE: [(&str, &str, Binding, Binding); 2] =
    [("+", " + ", Binding::Sum, Binding::Product), ("-", " - ", Binding::Sum, Binding::Product)];
const COMPARISONS: [&str; 6] = ["<=", ">=", "==", "!=", "<", ">"];

/// Whether a sign computes and assigns at once.
pub(super) fn is_change(symbol: &str) -> bool {
    symbol.len() > 1 && symbol.ends_with('=') && !COMPARISONS.contains(&symbol)
}

pub(super) struct Parser<'a> {
    pub(super) tokens: Vec<(Token, Range<usize>)>,
    pub(super) at: usize,
    pub(super) depth: usize,
    pub(super) names: &'a Names<'a>,
    /// The meaning of each name: an input, or the assigned term.
    pub(super) bound: BTreeMap<String, Term>,
    /// The last assignment to another name than the output.
    pub(super) last: Option<(String, Range<usize>)>,
    pub(super) result: Translated,
}

pub(super) type Parsed = Result<Term, Trouble>;

impl Parser<'_> {
    pub(super) fn token(&self) -> &Token {
        self.tokens.get(self.at).map_or(&Token::End, |(token, _)| token)
    }

    pub(super) fn ahead(&self, by: usize) -> &Token {
        self.tokens.get(self.at + by).map_or(&Token::End, |(token, _)| token)
    }

    pub(super) fn place(&self) -> Range<usize> {
        self.tokens.get(self.at).map_or(0..0, |(_, place)| place.clone())
    }

    pub(super) fn is(&self, symbol: &str) -> bool {
        matches!(self.token(), Token::Symbol(next) if *next == symbol)
    }

    pub(super) fn is_word(&self, word: &str) -> bool {
        matches!(self.token(), Token::Name(next) if next == word)
    }

    pub(super) fn take(&mut self, symbol: &str) -> bool {
        let found = self.is(symbol);
        self.at += usize::from(found);
        found
    }

    pub(super) fn take_word(&mut self, word: &str) -> bool {
        let found = self.is_word(word);
        self.at += usize::from(found);
        found
    }

    pub(super) fn expect(&mut self, symbol: &str) -> Result<(), Trouble> {
        if self.take(symbol) { Ok(()) } else { Err(self.unexpected(&format!("a `{symbol}` is missing"))) }
    }

    pub(super) fn trouble(&self, message: impl Into<String>) -> Trouble {
        Trouble::new(self.place(), message.into())
    }

    pub(super) fn unexpected(&self, missing: &str) -> Trouble {
        let place = match self.token() {
            Token::End => " at the end".to_owned(),
            Token::Line => " at the end of the line".to_owned(),
            Token::Name(name) => format!(" before `{name}`"),
            Token::Number(number) => format!(" before `{number}`"),
            Token::Symbol(symbol) => format!(" before `{symbol}`"),
            Token::Text => " before a string".to_owned(),
        };
        self.trouble(format!("{missing}{place}"))
    }

    pub(super) fn name(&mut self) -> Result<String, Trouble> {
        match self.token() {
            Token::Name(name) => {
                let name = name.clone();
                self.at += 1;
                Ok(name)
            }
            _ => Err(self.unexpected("a name is missing")),
        }
    }

    /// The error for a token after a whole expression.
    pub(super) fn stray(&self) -> Trouble {
        match self.token() {
            Token::Symbol("^") => self.trouble("`^` is an exclusive or in Python: a power is written `**`"),
            Token::Symbol(symbol @ ("&" | "|" | "<<" | ">>" | "@" | "~")) => {
                self.trouble(format!("`{symbol}` works on bits or matrices: no formula here does"))
            }
            Token::Symbol("!") => self.trouble("`!` is no Python: write `not`"),
            Token::Symbol(symbol) if is_change(symbol) => {
                self.trouble(format!("`{symbol}` changes a value: only plain assignments can be taken over"))
            }
            Token::Name(word) if word == "for" => self.trouble("a loop can not be taken over"),
            Token::Name(word) if word == "in" || word == "is" => {
                self.trouble(format!("`{word}` can not be taken over: compare numbers"))
            }
            Token::Symbol("=") => self.trouble("`=` stands in the midst: compare with `==`"),
            _ => self.unexpected("an operator is missing"),
        }
    }

    pub(super) fn expression(&mut self) -> Parsed {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.trouble(format!("the formula is nested deeper than {MAX_DEPTH} levels")));
        }
        let value = self.conditional();
        self.depth -= 1;
        value
    }

    fn conditional(&mut self) -> Parsed {
        if self.take_word("lambda") {
            self.parameters(":")?;
            self.expect(":")?;
            return self.expression();
        }
        let then = self.either()?;
        if !self.take_word("if") {
            return Ok(then);
        }
        let condition = self.either()?;
        if !self.take_word("else") {
            return Err(self.unexpected("an `else` is missing"));
        }
        let other = self.expression()?;
        self.sized(Term::atom(format!("if({}, {}, {})", condition.text, then.text, other.text)))
    }

    /// A term of bounded length: nested chains of comparisons would double it repeatedly.
    pub(super) fn sized(&self, term: Term) -> Parsed {
        if term.text.len() > MAX_TEXT {
            return Err(self.trouble(format!("the formula would have more than {MAX_TEXT} bytes")));
        }
        Ok(term)
    }

    fn either(&mut self) -> Parsed {
        let mut left = self.both()?;
        while self.take_word("or") {
            let right = self.both()?;
            left = self.infix(&left, " or ", &right, Binding::Or, Binding::And)?;
        }
        Ok(left)
    }

    fn both(&mut self) -> Parsed {
        let mut left = self.negated()?;
        while self.take_word("and") {
            let right = self.negated()?;
            left = self.infix(&left, " and ", &right, Binding::And, Binding::Not)?;
        }
        Ok(left)
    }

    fn negated(&mut self) -> Parsed {
        let mut count = 0_usize;
        while self.take_word("not") {
            count += 1;
        }
        let of = self.compared()?;
        if count.is_multiple_of(2) {
            Ok(of)
        } else {
            Ok(Term::new(format!("not {}", of.at_least(Binding::Comparison)), Binding::Not))
        }
    }

    /// `a < b < c` is `a < b and b < c`.
    fn compared(&mut self) -> Parsed {
        let mut left = self.sum()?;
        let mut chain: Option<Term> = None;
        while let Token::Symbol(symbol) = *self.token()
            && COMPARISONS.contains(&symbol)
        {
            self.at += 1;
            let right = self.sum()?;
            let text = format!("{} {symbol} {}", left.at_least(Binding::Sum), right.at_least(Binding::Sum));
            let link = Term::new(text, Binding::Comparison);
            chain = Some(match chain {
                None => self.sized(link)?,
                Some(before) => self.infix(&before, " and ", &link, Binding::And, Binding::Not)?,
            });
            left = right;
        }
        Ok(chain.unwrap_or(left))
    }

    fn infix(&self, left: &Term, symbol: &str, right: &Term, power: Binding, least: Binding) -> Parsed {
        self.sized(Term::new(format!("{}{symbol}{}", left.at_least(power), right.at_least(least)), power))
    }

    fn sum(&mut self) -> Parsed {
        let mut left = self.product()?;
        while let Some((_, ours, power, least)) = ADDITIVE.iter().find(|(symbol, ..)| self.is(symbol)) {
            self.at += 1;
            let right = self.product()?;
            left = self.infix(&left, ours, &right, *power, *least)?;
        }
        Ok(left)
    }

    fn product(&mut self) -> Parsed {
        let mut left = self.signed()?;
        while let Token::Symbol(symbol @ ("*" | "/" | "//" | "%")) = *self.token() {
            self.at += 1;
            let right = self.signed()?;
            left = self.factor(symbol, &left, &right)?;
        }
        Ok(left)
    }

    fn factor(&self, symbol: &str, left: &Term, right: &Term) -> Parsed {
        if symbol == "*" {
            return self.infix(left, " * ", right, Binding::Product, Binding::Sign);
        }
        let quotient = self.infix(left, " / ", right, Binding::Product, Binding::Sign)?;
        if symbol == "/" {
            return Ok(quotient);
        }
        let whole = Term::atom(format!("floor({})", quotient.text));
        if symbol == "//" {
            return self.sized(whole);
        }
        let product = self.infix(right, " * ", &whole, Binding::Product, Binding::Sign)?;
        self.infix(left, " - ", &product, Binding::Sum, Binding::Product)
    }

    fn signed(&mut self) -> Parsed {
        let mut negative = false;
        while self.is("-") || self.is("+") {
            negative ^= self.is("-");
            self.at += 1;
        }
        let of = self.power()?;
        if negative {
            Ok(Term::new(format!("-{}", of.at_least(Binding::Power)), Binding::Sign))
        } else {
            Ok(of)
        }
    }

    fn power(&mut self) -> Parsed {
        let base = self.postfixed()?;
        if !self.take("**") {
            return Ok(base);
        }
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.trouble(format!("the formula is nested deeper than {MAX_DEPTH} levels")));
        }
        let exponent = self.signed()?;
        self.depth -= 1;
        self.sized(functions::power(&base, &exponent))
    }
}
