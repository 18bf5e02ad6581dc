//! Formulas of the thesis's programs: Python code as formulas of ours, where possible.
//!
//! Converted are expressions of numbers (arithmetic, comparisons, `and or not`, conditional expressions, the functions of `math`
//! and `numpy` that we have too), `lambda`, a `def` that ends with `return`, and successive assignments whose last one is to the
//! output (`y = ..` or, of an itom, `y.v = ..`). Other code (loops, branches, exceptions, functions of other files) is reported
//! with its place. Code is never run.

use std::collections::BTreeSet;
use std::ops::Range;

use super::expression::{Parsed, Parser, is_change};
use super::term::Term;
use super::tokens::{Token, tokens};

/// Why a piece of Python is no formula, and its place in the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Trouble {
    pub(super) span: Range<usize>,
    pub(super) message: String,
}

impl Trouble {
    pub(super) fn new(span: Range<usize>, message: String) -> Trouble {
        Trouble { span, message }
    }
}

/// The names that a piece of Python may use.
pub(super) struct Names<'a> {
    /// The computed variable; `None` for a condition, which reads it like an input.
    pub(super) output: Option<&'a str>,
    /// The inputs in the order of the parameters of a function, with our names.
    pub(super) inputs: Vec<(&'a str, &'a str)>,
    /// Whether angles are plain numbers in radians, as in Python.
    pub(super) plain_angles: bool,
}

/// A formula of ours.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Translated {
    /// The formula in our language, with our names.
    pub(super) formula: String,
    /// Our names of the inputs that the formula reads.
    pub(super) used: BTreeSet<String>,
    /// Our names of the inputs that the formula reads as lists.
    pub(super) vectors: BTreeSet<String>,
    /// The place where the code computes the time `t` of the output.
    pub(super) time: Option<Range<usize>>,
}

/// Translates a piece of Python.
///
/// # Errors
/// The first place without a counterpart in our language. Time: linear in the text and in the formula, which is bounded.
pub(super) fn translate(code: &str, names: &Names) -> Result<Translated, Trouble> {
    let tokens = tokens(code)?;
    let bound = names.inputs.iter().map(|(name, ours)| ((*name).to_owned(), Term::atom((*ours).to_owned())));
    let mut parser = Parser {
        tokens,
        at: 0,
        depth: 0,
        names,
        bound: bound.collect(),
        last: None,
        result: Translated::default(),
    };
    let formula = parser.program()?;
    parser.result.used = parser.result.used.iter().filter(|name| formula.mentions(name)).cloned().collect();
    parser.result.formula = formula.text().to_owned();
    Ok(parser.result)
}

/// Words that begin statements other than a straight way to one formula.
pub(super) const STATEMENTS: [&str; 15] = [
    "if", "for", "while", "try", "with", "import", "from", "class", "global", "nonlocal", "assert", "del",
    "raise", "pass", "match",
];

impl Parser<'_> {
    fn program(&mut self) -> Parsed {
        let mut value = None;
        loop {
            while matches!(self.token(), Token::Line) {
                self.at += 1;
            }
            if matches!(self.token(), Token::End) {
                return value.ok_or_else(|| self.nothing());
            }
            if self.take_word("def") {
                self.definition()?;
                continue;
            }
            let is_return = self.is_word("return");
            if let Some(computed) = self.statement(value.is_some())? {
                value = Some(computed);
            }
            if !matches!(self.token(), Token::Line | Token::End) {
                return Err(self.stray());
            }
            if is_return {
                return value.ok_or_else(|| self.nothing());
            }
        }
    }

    /// The error that the output is not computed, at the last assignment.
    fn nothing(&self) -> Trouble {
        match &self.last {
            Some((target, place)) => self.other(target, place.clone()),
            None => self.trouble("nothing computes the output"),
        }
    }

    fn other(&self, target: &str, place: Range<usize>) -> Trouble {
        let output = self.names.output.unwrap_or("the condition");
        Trouble::new(place, format!("this assigns to `{target}`, not to the output `{output}`"))
    }

    /// Takes `def name(parameters):`; its body follows as statements.
    fn definition(&mut self) -> Result<(), Trouble> {
        self.name()?;
        self.expect("(")?;
        self.parameters(")")?;
        self.expect(")")?;
        self.expect(":")
    }

    /// Takes parameters, which are inputs by their names, else by their order.
    pub(super) fn parameters(&mut self, end: &str) -> Result<(), Trouble> {
        let mut parameters = Vec::new();
        while !self.is(end) {
            parameters.push(self.name()?);
            if !self.is(end) {
                self.expect(",")?;
            }
        }
        let inputs = &self.names.inputs;
        if parameters.iter().all(|name| inputs.iter().any(|(input, _)| input == name)) {
            return Ok(());
        }
        if parameters.len() > inputs.len() {
            let message =
                format!("the function has {} parameters for {} inputs", parameters.len(), inputs.len());
            return Err(self.trouble(message));
        }
        let terms: Vec<Term> = inputs.iter().map(|(_, ours)| Term::atom((*ours).to_owned())).collect();
        self.bound.extend(parameters.into_iter().zip(terms));
        Ok(())
    }

    /// Takes a statement; returns the value when it is that of the output.
    fn statement(&mut self, has_value: bool) -> Result<Option<Term>, Trouble> {
        if let Token::Name(word) = self.token()
            && STATEMENTS.contains(&word.as_str())
        {
            let message = format!("`{word}` is a statement: only formulas can be taken over");
            return Err(self.trouble(message));
        }
        if self.take_word("return") {
            return self.expression().map(Some);
        }
        if let Token::Symbol(symbol) = self.ahead(1)
            && is_change(symbol)
        {
            self.at += 1;
            return Err(self.stray());
        }
        if let Some((target, field)) = self.target() {
            return self.assignment(&target, field.as_deref());
        }
        if has_value {
            return Err(self.trouble("this computes nothing: only assignments may stand in a row"));
        }
        self.expression().map(Some)
    }

    /// The name before `=`, and its field.
    fn target(&self) -> Option<(String, Option<String>)> {
        let Token::Name(name) = self.token() else { return None };
        match (self.ahead(1), self.ahead(2), self.ahead(3)) {
            (Token::Symbol("="), ..) => Some((name.clone(), None)),
            (Token::Symbol("."), Token::Name(field), Token::Symbol("=")) => {
                Some((name.clone(), Some(field.clone())))
            }
            _ => None,
        }
    }

    fn assignment(&mut self, target: &str, field: Option<&str>) -> Result<Option<Term>, Trouble> {
        let is_output = self.names.output == Some(target);
        let place = self.place();
        self.at += if field.is_some() { 4 } else { 2 };
        match field {
            Some("t") if is_output => {
                self.time(place);
                return Ok(None);
            }
            None | Some("v") if is_output => return self.expression().map(Some),
            None => {
                let value = self.expression()?;
                self.bound.insert(target.to_owned(), value);
                self.last = Some((target.to_owned(), place));
                return Ok(None);
            }
            Some(_) => {}
        }
        Err(self.other(target, place))
    }

    /// Skips the formula for the time of the output; the engine uses the time of an input anyway.
    fn time(&mut self, place: Range<usize>) {
        let from = self.at;
        while !matches!(self.token(), Token::Line | Token::End) {
            self.at += 1;
        }
        let is_plain = matches!(
            self.tokens.get(from..self.at),
            Some([(Token::Name(input), _), (Token::Symbol("."), _), (Token::Name(field), _)])
                if field == "t" && self.bound.contains_key(input)
        );
        if !is_plain {
            self.result.time = Some(place);
        }
    }
}
