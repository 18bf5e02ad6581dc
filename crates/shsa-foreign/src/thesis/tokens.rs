//! The words of a piece of Python, each with its place.

use std::ops::Range;

use super::python::Trouble;

/// The longest piece of Python in bytes; no longer text could become a formula of ours.
pub(super) const MAX_TEXT: usize = 20_000;

/// A word of Python.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// In the notation of our formulas.
    Number(String),
    Name(String),
    Text,
    Symbol(&'static str),
    /// The end of a statement; never between brackets.
    Line,
    End,
}

/// Longer symbols first.
const SYMBOLS: [&str; 48] = [
    "**=", "//=", ">>=", "<<=", "...", "**", "//", "<<", ">>", "<=", ">=", "==", "!=", "->", "+=", "-=",
    "*=", "/=", "%=", "&=", "|=", "^=", "@=", ":=", "<", ">", "=", "+", "-", "*", "/", "%", "(", ")", "[",
    "]", "{", "}", ",", ":", ".", "^", "&", "|", "~", "@", "!", ";",
];

/// All words, then [`Token::End`]. Time: linear in the text.
pub(super) fn tokens(text: &str) -> Result<Vec<(Token, Range<usize>)>, Trouble> {
    if text.len() > MAX_TEXT {
        return Err(Trouble::new(0..0, format!("the code has more than {MAX_TEXT} bytes")));
    }
    let mut lexer = Lexer { text, at: 0, open: 0, found: Vec::new() };
    while let Some(first) = lexer.rest().chars().next() {
        lexer.step(first)?;
    }
    let end = text.len();
    lexer.found.push((Token::End, end..end));
    Ok(lexer.found)
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
    /// The number of open brackets.
    open: usize,
    found: Vec<(Token, Range<usize>)>,
}

impl<'a> Lexer<'a> {
    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or("")
    }

    fn push(&mut self, token: Token, length: usize) {
        self.found.push((token, self.at..self.at + length));
        self.at += length;
    }

    fn step(&mut self, first: char) -> Result<(), Trouble> {
        let rest = self.rest();
        match first {
            '\n' | ';' => {
                if self.open == 0 && !matches!(self.found.last(), None | Some((Token::Line, _))) {
                    self.push(Token::Line, 1);
                } else {
                    self.at += 1;
                }
            }
            _ if first.is_whitespace() => self.at += first.len_utf8(),
            '#' => self.at += rest.find('\n').unwrap_or(rest.len()),
            '\\' if rest.starts_with("\\\n") => self.at += 2,
            '"' | '\'' => return self.string(first),
            _ if first.is_ascii_digit() || is_fraction(rest) => return self.number(),
            _ if first.is_alphabetic() || first == '_' => {
                let length = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
                self.push(Token::Name(rest[..length].to_owned()), length);
            }
            _ => return self.symbol(first),
        }
        Ok(())
    }

    fn symbol(&mut self, first: char) -> Result<(), Trouble> {
        let Some(symbol) = SYMBOLS.iter().find(|symbol| self.rest().starts_with(**symbol)) else {
            let place = self.at..self.at + first.len_utf8();
            return Err(Trouble::new(place, format!("`{}` is no Python", first.escape_debug())));
        };
        match *symbol {
            "(" | "[" | "{" => self.open += 1,
            ")" | "]" | "}" => self.open = self.open.saturating_sub(1),
            _ => {}
        }
        self.push(Token::Symbol(symbol), symbol.len());
        Ok(())
    }

    fn string(&mut self, quote: char) -> Result<(), Trouble> {
        let mut escaped = false;
        for (at, c) in self.rest().char_indices().skip(1) {
            if c == quote && !escaped {
                self.push(Token::Text, at + 1);
                return Ok(());
            }
            escaped = c == '\\' && !escaped;
        }
        Err(Trouble::new(self.at..self.text.len(), "a string is not closed".to_owned()))
    }

    fn number(&mut self) -> Result<(), Trouble> {
        let rest = self.rest();
        let digits = |text: &str| text.find(|c: char| !c.is_ascii_digit() && c != '_').unwrap_or(text.len());
        let mut length = digits(rest);
        if rest[length..].starts_with('.') {
            length += 1 + digits(&rest[length + 1..]);
        }
        if let Some(tail) = rest[length..].strip_prefix(['e', 'E']) {
            let signed = tail.strip_prefix(['+', '-']).unwrap_or(tail);
            if digits(signed) > 0 {
                length += 1 + (tail.len() - signed.len()) + digits(signed);
            }
        }
        let written = rest[..length].replace('_', "");
        let is_longer = rest[length..].starts_with(|c: char| c.is_alphanumeric() || c == '_');
        if is_longer || !written.parse::<f64>().is_ok_and(f64::is_finite) {
            let message = "only decimal numbers can be taken over".to_owned();
            return Err(Trouble::new(self.at..self.at + length.max(1), message));
        }
        let whole = if written.starts_with('.') { format!("0{written}") } else { written };
        self.push(
            Token::Number(whole.strip_suffix('.').unwrap_or(&whole).replace(".e", "e").replace(".E", "e")),
            length,
        );
        Ok(())
    }
}

fn is_fraction(text: &str) -> bool {
    text.strip_prefix('.').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
}
