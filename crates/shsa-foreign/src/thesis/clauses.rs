//! The words and clauses of a Prolog text, each with its place; no clause is ever run.
//!
//! Read after ISO/IEC 13211-1 as far as facts need it: quoted atoms and strings with their escapes, both kinds of comments,
//! lists. A clause that is no fact is skipped up to its end.

use shsa_core::knowledge::{Place, Text};

use super::notes::Notes;

/// A word of Prolog.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// In lower case, in quotes, or of signs.
    Atom(Text),
    /// In upper case, or `_`.
    Variable(Text),
    Number(Text),
    /// In double quotes or back quotes.
    Text(Text),
    /// One of `( ) [ ] { } , |`.
    Mark(char, Place),
}

impl Token {
    pub(super) fn place(&self) -> Place {
        match self {
            Token::Atom(text) | Token::Variable(text) | Token::Number(text) | Token::Text(text) => text.place,
            Token::Mark(_, place) => *place,
        }
    }

    pub(super) fn is_mark(&self, mark: char) -> bool {
        matches!(self, Token::Mark(own, _) if *own == mark)
    }
}

/// The words of each clause, without its full stop; an unreadable rest is reported.
///
/// Time: linear in the text.
pub(super) fn clauses(notes: &mut Notes, text: &str) -> Vec<Vec<Token>> {
    let mut lexer = Lexer { text, at: 0, notes, clauses: Vec::new(), open: Vec::new() };
    while lexer.step() {}
    if let Some(first) = lexer.open.first() {
        let place = Place { from: first.place().from, to: offset(text.trim_end().len()) };
        lexer.notes.error(place, "this clause does not end", "end it with a full stop");
    }
    lexer.clauses
}

/// Whether a text is Prolog rather than YAML: it begins with a comment, a directive or a fact of Prolog.
pub(in super::super) fn is_prolog(text: &str) -> bool {
    let mut rest = text.trim_start_matches('\u{feff}').trim_start();
    loop {
        if rest.starts_with("%YAML") || rest.starts_with("%TAG") {
            return false;
        }
        if rest.starts_with('%') {
            rest = rest.find('\n').map_or("", |end| &rest[end..]).trim_start();
            if rest.is_empty() {
                return true;
            }
        } else if let Some(comment) = rest.strip_prefix("/*") {
            let Some(end) = comment.find("*/") else { return true };
            rest = comment[end + 2..].trim_start();
            if rest.is_empty() {
                return true;
            }
        } else {
            break;
        }
    }
    if rest.starts_with(":-") {
        return true;
    }
    let length = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let is_atom = rest.starts_with(|c: char| c.is_ascii_lowercase());
    let first_line = rest.lines().next().unwrap_or("");
    is_atom && rest[length..].starts_with('(') && !first_line.contains(": ")
}

const SIGNS: &str = "+-*/\\^<>=~:.?@#&$";

struct Lexer<'a, 'n> {
    text: &'a str,
    at: usize,
    notes: &'n mut Notes,
    clauses: Vec<Vec<Token>>,
    open: Vec<Token>,
}

/// The byte offsets of a text of at most `MAX_BYTES` fit.
fn offset(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}

impl<'a> Lexer<'a, '_> {
    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or("")
    }

    /// Takes the next bytes as a text.
    fn word(&mut self, length: usize) -> Text {
        let text = self.rest().get(..length).unwrap_or("").to_owned();
        let from = self.at;
        self.at += length;
        Text { text, place: Place { from: offset(from), to: offset(self.at) } }
    }

    fn length(&self, is: impl Fn(char) -> bool) -> usize {
        let rest = self.rest();
        rest.find(|c| !is(c)).unwrap_or(rest.len())
    }

    /// Takes one word; returns whether there may be more.
    fn step(&mut self) -> bool {
        let rest = self.rest();
        let Some(first) = rest.chars().next() else { return false };
        if first.is_whitespace() || first == '\u{feff}' {
            self.at += first.len_utf8();
        } else if first == '%' {
            self.at += rest.find('\n').unwrap_or(rest.len());
        } else if let Some(comment) = rest.strip_prefix("/*") {
            self.at += comment.find("*/").map_or(rest.len(), |end| end + 4);
        } else if first == '.' && is_end(&rest[1..]) {
            self.at += 1;
            let clause = std::mem::take(&mut self.open);
            self.clauses.push(clause);
        } else if matches!(first, '\'' | '"' | '`') {
            return self.quoted(first);
        } else {
            self.plain(first);
        }
        true
    }

    fn plain(&mut self, first: char) {
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let sign = usize::from(first == '-' && self.is_term_next());
        let token = if first.is_ascii_digit()
            || sign > 0 && self.rest()[1..].starts_with(|c: char| c.is_ascii_digit())
        {
            let length = sign + number_length(&self.rest()[sign..]);
            Token::Number(self.word(length))
        } else if first.is_uppercase() || first == '_' {
            let length = self.length(is_name);
            Token::Variable(self.word(length))
        } else if first.is_alphabetic() {
            let length = self.length(is_name);
            Token::Atom(self.word(length))
        } else if matches!(first, '!' | ';') {
            // These signs stand alone: a full stop may follow at once.
            Token::Atom(self.word(1))
        } else if SIGNS.contains(first) {
            let length = self.length(|c| SIGNS.contains(c));
            Token::Atom(self.word(length))
        } else {
            let place = self.word(first.len_utf8()).place;
            if !"()[]{},|".contains(first) {
                let message = format!("`{}` has no meaning in Prolog", first.escape_debug());
                self.notes.error(place, message, "write names in quotes");
            }
            Token::Mark(first, place)
        };
        self.open.push(token);
    }

    /// Whether a sign here belongs to a number.
    fn is_term_next(&self) -> bool {
        self.open.last().is_some_and(|token| ['(', '[', ','].iter().any(|mark| token.is_mark(*mark)))
    }

    /// Takes a quoted text; returns whether it is closed.
    fn quoted(&mut self, quote: char) -> bool {
        let from = self.at;
        let Some((content, length, is_rewritten)) = unquoted(self.rest(), quote) else {
            let place = Place { from: offset(from), to: offset(self.text.len()) };
            self.notes.error(
                place,
                format!("this {quote} is not closed"),
                "close it, or write it twice within quotes",
            );
            self.open.clear();
            return false;
        };
        self.at += length;
        let place = Place { from: offset(from + 1), to: offset(self.at - 1) };
        if is_rewritten {
            self.notes.rewritten.insert(place.from);
        }
        let text = Text { text: content, place };
        self.open.push(if quote == '\'' { Token::Atom(text) } else { Token::Text(text) });
        true
    }
}

/// Whether a full stop before this ends a clause.
fn is_end(rest: &str) -> bool {
    rest.is_empty() || rest.starts_with(|c: char| c.is_whitespace() || c == '%')
}

/// Digits, and a fraction or exponent; `0'c` and the like as they are.
fn number_length(text: &str) -> usize {
    let digits = |text: &str| text.find(|c: char| !c.is_ascii_digit() && c != '_').unwrap_or(text.len());
    if let Some(quoted) = text.strip_prefix("0'") {
        return 2 + quoted.chars().next().map_or(0, char::len_utf8);
    }
    let mut length = digits(text);
    if let Some(fraction) = text[length..].strip_prefix('.')
        && digits(fraction) > 0
    {
        length += 1 + digits(fraction);
    }
    if let Some(tail) = text[length..].strip_prefix(['e', 'E']) {
        let signed = tail.strip_prefix(['+', '-']).unwrap_or(tail);
        if digits(signed) > 0 {
            length += 1 + (tail.len() - signed.len()) + digits(signed);
        }
    }
    length
}

/// The content of a quoted text, the length of both with the quotes, and whether the content differs from the source.
fn unquoted(text: &str, quote: char) -> Option<(String, usize, bool)> {
    let mut content = String::new();
    let mut is_rewritten = false;
    let mut chars = text.char_indices().skip(1).peekable();
    while let Some((at, c)) = chars.next() {
        if c == quote {
            if chars.peek().is_none_or(|(_, next)| *next != quote) {
                return Some((content, at + 1, is_rewritten));
            }
            chars.next();
            content.push(quote);
            is_rewritten = true;
        } else if c == '\\' {
            is_rewritten = true;
            let (_, escaped) = chars.next()?;
            match escaped {
                'n' => content.push('\n'),
                't' => content.push('\t'),
                'r' => content.push('\r'),
                'a' | 'b' | 'f' | 'v' | 'e' | 's' => content.push(' '),
                '\n' => {}
                'x' | '0'..='7' => {
                    let radix = if escaped == 'x' { 16 } else { 8 };
                    let mut digits = if escaped == 'x' { String::new() } else { escaped.to_string() };
                    while let Some((_, digit)) = chars.next_if(|(_, c)| c.is_digit(radix)) {
                        digits.push(digit);
                    }
                    chars.next_if(|(_, c)| *c == '\\');
                    let code = u32::from_str_radix(&digits, radix).ok().and_then(char::from_u32);
                    content.push(code.unwrap_or('\u{fffd}'));
                }
                'u' | 'U' => {
                    let count = if escaped == 'u' { 4 } else { 8 };
                    let digits: String = (0..count)
                        .filter_map(|_| chars.next_if(|(_, c)| c.is_ascii_hexdigit()))
                        .map(|(_, c)| c)
                        .collect();
                    let code = u32::from_str_radix(&digits, 16).ok().and_then(char::from_u32);
                    content.push(code.unwrap_or('\u{fffd}'));
                }
                other => content.push(other),
            }
        } else {
            content.push(c);
        }
    }
    None
}
