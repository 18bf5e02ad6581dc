//! Operands of Python expressions: numbers, variables with their fields, elements of lists, and calls of functions.

use super::expression::{Parsed, Parser};
use super::functions::{self, Arguments};
use super::python::{STATEMENTS, Trouble};
use super::term::{Binding, Term};
use super::tokens::Token;
use std::ops::Range;

impl Parser<'_> {
    pub(super) fn postfixed(&mut self) -> Parsed {
        let mut of = self.primary()?;
        while self.take("[") {
            self.note_vector(&of);
            let inside = self.index()?;
            of = self.sized(Term::atom(format!("{}[{inside}]", of.at_least(Binding::Atom))))?;
        }
        Ok(of)
    }

    fn note_vector(&mut self, of: &Term) {
        if self.names.inputs.iter().any(|(_, ours)| *ours == of.text) {
            self.result.vectors.insert(of.text.clone());
        }
    }

    /// The index between `[` and `]`, in our notation.
    fn index(&mut self) -> Result<String, Trouble> {
        let from = if self.is(":") { None } else { Some(self.place_in_list()?) };
        let text = if self.take(":") {
            let to = if self.is("]") { String::new() } else { self.place_in_list()? };
            format!("{}..{to}", from.unwrap_or_default())
        } else {
            from.unwrap_or_default()
        };
        if self.is(",") || self.is(":") {
            return Err(self.trouble("only one place, or a range without a step, can be taken out of a list"));
        }
        self.expect("]")?;
        Ok(text)
    }

    fn place_in_list(&mut self) -> Result<String, Trouble> {
        if self.is("-") {
            return Err(self.trouble("a place counted from the end can not be taken over"));
        }
        Ok(self.expression()?.text)
    }

    fn primary(&mut self) -> Parsed {
        match self.token().clone() {
            Token::Number(number) => {
                self.at += 1;
                Ok(Term::atom(number))
            }
            Token::Name(name) => self.named(&name),
            Token::Symbol("(") => {
                self.at += 1;
                let inner = self.expression()?;
                if self.is(",") {
                    return Err(self.trouble("a tuple is no number"));
                }
                if !self.is(")") {
                    return Err(self.stray());
                }
                self.at += 1;
                Ok(inner)
            }
            Token::Symbol("[" | "{") => Err(self.trouble("a list is no number here")),
            Token::Text => Err(self.trouble("a text is no number")),
            Token::Symbol("^" | "&" | "|" | "~" | "@" | "!" | "<<" | ">>") => Err(self.stray()),
            _ => Err(self.unexpected("a number or a name is missing")),
        }
    }

    /// A variable with its field, a constant, or a function with its arguments.
    fn named(&mut self, name: &str) -> Parsed {
        let place = self.place();
        self.at += 1;
        if let Some(term) = self.bound.get(name).cloned() {
            return self.value_of(name, term, place);
        }
        let mut path = name.to_owned();
        while self.take(".") {
            path = self.name()?;
        }
        if self.is("(") || (path == "interval" && self.is("[")) {
            return self.call(&path, place);
        }
        if let Some(constant) = functions::constant(&path) {
            return Ok(constant);
        }
        let message = match self.names.output {
            Some(output) if output == name => format!("`{name}` is the output itself"),
            _ if STATEMENTS.contains(&name) || name == "yield" => format!("`{name}` can not be taken over"),
            _ => format!("`{name}` is no input of this relation"),
        };
        Err(Trouble::new(place, message))
    }

    /// An input or a local variable: itself, its `.v`, or a method of a list.
    fn value_of(&mut self, name: &str, term: Term, place: Range<usize>) -> Parsed {
        self.result.used.extend(
            self.names
                .inputs
                .iter()
                .filter(|(_, ours)| term.mentions(ours))
                .map(|(_, ours)| (*ours).to_owned()),
        );
        while self.take(".") {
            let at = self.place();
            let field = self.name()?;
            match field.as_str() {
                "v" => {}
                "t" => {
                    let message = format!("the time of `{name}` can not be computed with");
                    return Err(Trouble::new(at, message));
                }
                method if self.take("(") => {
                    self.expect(")")?;
                    self.note_vector(&term);
                    let arguments = Arguments { terms: vec![term], is_list: true };
                    return functions::call(method, &arguments, false)
                        .map_err(|message| Trouble::new(at, message));
                }
                _ => return Err(Trouble::new(at, format!("`.{field}` can not be taken over"))),
            }
        }
        if self.is("(") {
            return Err(Trouble::new(place, format!("`{name}` is a variable and is called like a function")));
        }
        Ok(term)
    }

    fn call(&mut self, name: &str, place: Range<usize>) -> Parsed {
        let end = if self.take("(") { ")" } else { "]" };
        self.at += usize::from(end == "]");
        let list =
            if end == ")" && (self.is("[") || self.is("(") && self.is_tuple()) { self.list()? } else { None };
        let arguments = match list {
            Some(terms) => {
                self.expect(")")?;
                Arguments { terms, is_list: false }
            }
            None => {
                let terms = self.terms(end)?;
                Arguments { is_list: terms.len() == 1, terms }
            }
        };
        if let [of] = arguments.terms.as_slice()
            && functions::takes_list(name)
        {
            let of = of.clone();
            self.note_vector(&of);
        }
        let term = functions::call(name, &arguments, self.names.plain_angles)
            .map_err(|message| Trouble::new(place, message))?;
        self.sized(term)
    }

    /// Whether the bracket that opens here directly contains a comma.
    fn is_tuple(&self) -> bool {
        let mut open = 0_usize;
        for (token, _) in self.tokens.iter().skip(self.at) {
            match token {
                Token::Symbol("(" | "[" | "{") => open += 1,
                Token::Symbol(")" | "]" | "}") => {
                    open -= 1;
                    if open == 0 {
                        return false;
                    }
                }
                Token::Symbol(",") if open == 1 => return true,
                Token::End => return false,
                _ => {}
            }
        }
        false
    }

    /// `[a, b]` or `(a, b)` as the only argument; `None`, with no word taken, when more follows.
    fn list(&mut self) -> Result<Option<Vec<Term>>, Trouble> {
        let before = self.at;
        let end = if self.is("[") { "]" } else { ")" };
        self.at += 1;
        let terms = self.terms(end)?;
        if self.is(")") {
            return Ok(Some(terms));
        }
        self.at = before;
        Ok(None)
    }

    fn terms(&mut self, end: &str) -> Result<Vec<Term>, Trouble> {
        let mut terms = Vec::new();
        while !self.take(end) {
            terms.push(self.expression()?);
            if !self.is(end) && !self.take(",") {
                return Err(self.stray());
            }
        }
        Ok(terms)
    }
}
