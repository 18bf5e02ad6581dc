//! JSON (RFC 8259) gone through once: where the wanted values stand; nothing is built and nothing is copied.
//!
//! Beyond the standard only the words `NaN`, `Infinity` and `-Infinity` are numbers, as Python and JavaScript libraries
//! write them: a sensor that says so is readable, and its value is invalid.

use std::ops::Range;

/// Deeper nesting is refused: it would cost stack.
pub(crate) const DEPTH_MAX: usize = 64;

/// Where a text stops to be JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Broken {
    /// Byte, counted from 0.
    pub(crate) at: usize,
    /// What would have been right there.
    pub(crate) expected: &'static str,
}

/// What a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Null,
    False,
    True,
    Number,
    /// Its place is that of what stands between the quotes.
    Text,
    List,
    Object,
}

/// Where a value stands in the text, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) kind: Kind,
    pub(crate) from: usize,
    pub(crate) to: usize,
}

impl Place {
    pub(crate) fn range(self) -> Range<usize> {
        self.from..self.to
    }

    /// What stands there; nothing when the place is of another text.
    pub(crate) fn of(self, text: &str) -> &str {
        text.get(self.range()).unwrap_or("")
    }
}

/// Is told of every value on the way.
pub(crate) trait Visitor {
    /// What is known of a value on the way to its members.
    type Node: Copy;
    /// The node of an object's member; its name as it stands between the quotes. `None`: neither it nor anything in it
    /// is of interest.
    fn member(&mut self, of: Self::Node, name: &str) -> Option<Self::Node>;
    /// The node of a list's element.
    fn element(&mut self, of: Self::Node, index: usize) -> Option<Self::Node>;
    /// A value of interest begins.
    fn enter(&mut self, node: Self::Node);
    /// It has ended.
    fn leave(&mut self, node: Self::Node, place: Place);
}

/// Whether a text is JSON if it is anything: else it is a plain number or word.
pub(crate) fn is_likely(text: &str) -> bool {
    text.trim_ascii_start().starts_with(['{', '[', '"'])
}

/// Goes through a text that must be one JSON value.
pub(crate) fn walk<V: Visitor>(text: &str, root: V::Node, visitor: &mut V) -> Result<(), Broken> {
    let mut walker = Walker { text, at: 0, visitor };
    walker.value(Some(root), 0)?;
    walker.blanks();
    if walker.at < text.len() { Err(walker.broken("the end")) } else { Ok(()) }
}

struct Walker<'a, V> {
    text: &'a str,
    at: usize,
    visitor: &'a mut V,
}

impl<V: Visitor> Walker<'_, V> {
    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn broken(&self, expected: &'static str) -> Broken {
        Broken { at: self.at, expected }
    }

    fn blanks(&mut self) {
        while let Some(b' ' | b'\n' | b'\r' | b'\t') = self.peek() {
            self.at += 1;
        }
    }

    /// Steps over this byte if it is there.
    fn eat(&mut self, byte: u8) -> bool {
        let is_there = self.peek() == Some(byte);
        self.at += usize::from(is_there);
        is_there
    }

    fn value(&mut self, node: Option<V::Node>, depth: usize) -> Result<(), Broken> {
        self.blanks();
        if let Some(node) = node {
            self.visitor.enter(node);
        }
        let from = self.at;
        let kind = match self.peek() {
            Some(b'{') => self.object(node, depth)?,
            Some(b'[') => self.list(node, depth)?,
            Some(b'"') => self.text()?,
            Some(b't') => self.word("true", Kind::True)?,
            Some(b'f') => self.word("false", Kind::False)?,
            Some(b'n') => self.word("null", Kind::Null)?,
            Some(b'N') => self.word("NaN", Kind::Number)?,
            Some(b'I') => self.word("Infinity", Kind::Number)?,
            Some(b'-' | b'0'..=b'9') => self.number()?,
            _ => return Err(self.broken("a value")),
        };
        let quote = usize::from(kind == Kind::Text);
        if let Some(node) = node {
            self.visitor.leave(node, Place { kind, from: from + quote, to: self.at - quote });
        }
        Ok(())
    }

    fn object(&mut self, node: Option<V::Node>, depth: usize) -> Result<Kind, Broken> {
        self.opened(depth)?;
        if self.eat(b'}') {
            return Ok(Kind::Object);
        }
        loop {
            self.blanks();
            let from = self.at + 1;
            if self.peek() != Some(b'"') {
                return Err(self.broken("a name in quotes"));
            }
            self.text()?;
            let name = self.text.get(from..self.at - 1).unwrap_or("");
            let member = node.and_then(|node| self.visitor.member(node, name));
            self.blanks();
            if !self.eat(b':') {
                return Err(self.broken("a colon"));
            }
            self.value(member, depth + 1)?;
            if self.closed(b'}', "a comma or a closing brace")? {
                return Ok(Kind::Object);
            }
        }
    }

    fn list(&mut self, node: Option<V::Node>, depth: usize) -> Result<Kind, Broken> {
        self.opened(depth)?;
        if self.eat(b']') {
            return Ok(Kind::List);
        }
        let mut index = 0;
        loop {
            let element = node.and_then(|node| self.visitor.element(node, index));
            self.value(element, depth + 1)?;
            index += 1;
            if self.closed(b']', "a comma or a closing bracket")? {
                return Ok(Kind::List);
            }
        }
    }

    fn opened(&mut self, depth: usize) -> Result<(), Broken> {
        if depth >= DEPTH_MAX {
            return Err(self.broken("no deeper nesting"));
        }
        self.at += 1;
        self.blanks();
        Ok(())
    }

    /// Whether the list or object ends here; else it goes on behind a comma.
    fn closed(&mut self, by: u8, expected: &'static str) -> Result<bool, Broken> {
        self.blanks();
        let closed = self.eat(by);
        if closed || self.eat(b',') { Ok(closed) } else { Err(self.broken(expected)) }
    }

    fn word(&mut self, word: &str, kind: Kind) -> Result<Kind, Broken> {
        if !self.text.get(self.at..).is_some_and(|rest| rest.starts_with(word)) {
            return Err(self.broken("a value"));
        }
        self.at += word.len();
        Ok(kind)
    }

    fn text(&mut self) -> Result<Kind, Broken> {
        self.at += 1;
        loop {
            match self.peek() {
                Some(b'"') => break,
                Some(b'\\') => self.escape()?,
                Some(0..=0x1f) => return Err(self.broken("no control character in a text")),
                Some(_) => self.at += 1,
                None => return Err(self.broken("a closing quote")),
            }
        }
        self.at += 1;
        Ok(Kind::Text)
    }

    fn escape(&mut self) -> Result<(), Broken> {
        self.at += 1;
        let digits = match self.peek() {
            Some(b'"' | b'\\' | b'/' | b'b' | b'f' | b'n' | b'r' | b't') => 0,
            Some(b'u') => 4,
            _ => return Err(self.broken("an escaped character")),
        };
        self.at += 1;
        for _ in 0..digits {
            if !self.peek().is_some_and(|byte| byte.is_ascii_hexdigit()) {
                return Err(self.broken("four hexadecimal digits"));
            }
            self.at += 1;
        }
        Ok(())
    }

    fn number(&mut self) -> Result<Kind, Broken> {
        if self.eat(b'-') && self.peek() == Some(b'I') {
            return self.word("Infinity", Kind::Number);
        }
        if !self.eat(b'0') {
            self.digits()?;
        }
        if self.eat(b'.') {
            self.digits()?;
        }
        if self.eat(b'e') || self.eat(b'E') {
            let _sign = self.eat(b'+') || self.eat(b'-');
            self.digits()?;
        }
        Ok(Kind::Number)
    }

    fn digits(&mut self) -> Result<(), Broken> {
        let from = self.at;
        while self.peek().is_some_and(|byte| byte.is_ascii_digit()) {
            self.at += 1;
        }
        if self.at == from { Err(self.broken("a digit")) } else { Ok(()) }
    }
}

/// The places of the elements of a list, told one after the other to `each`, which says whether to go on.
pub(crate) fn elements(text: &str, list: Place, mut each: impl FnMut(usize, Place) -> bool) {
    struct Elements<F>(F, usize, bool);
    impl<F: FnMut(usize, Place) -> bool> Visitor for Elements<F> {
        /// Whether it is the list itself.
        type Node = bool;
        fn member(&mut self, _of: bool, _name: &str) -> Option<bool> {
            None
        }
        fn element(&mut self, of: bool, index: usize) -> Option<bool> {
            self.1 = index;
            (of && self.2).then_some(false)
        }
        fn enter(&mut self, _node: bool) {}
        fn leave(&mut self, node: bool, place: Place) {
            if !node && self.2 {
                self.2 = (self.0)(self.1, place);
            }
        }
    }
    let shifted = |index, place: Place| {
        each(index, Place { kind: place.kind, from: place.from + list.from, to: place.to + list.from })
    };
    // It is a part of a text that has been gone through: it cannot be broken.
    let _walked = walk(list.of(text), true, &mut Elements(shifted, 0, true));
}

/// What a text between quotes means; a half of a surrogate pair alone becomes the replacement character.
pub(crate) fn unescaped(raw: &str) -> std::borrow::Cow<'_, str> {
    if !raw.contains('\\') {
        return raw.into();
    }
    let mut text = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some((before, escape)) = rest.split_once('\\') {
        text.push_str(before);
        rest = unescape(escape, &mut text);
    }
    text.push_str(rest);
    text.into()
}

/// Appends what one escape means; gives what stands behind it.
fn unescape<'a>(escape: &'a str, text: &mut String) -> &'a str {
    let mut rest = escape.chars();
    let simple = match rest.next() {
        Some('b') => '\u{8}',
        Some('f') => '\u{c}',
        Some('n') => '\n',
        Some('r') => '\r',
        Some('t') => '\t',
        Some('u') => return unescape_hexadecimal(rest.as_str(), text),
        Some(other) => other,
        None => return "",
    };
    text.push(simple);
    rest.as_str()
}

fn unescape_hexadecimal<'a>(digits: &'a str, text: &mut String) -> &'a str {
    let unit = |digits: &str| u16::from_str_radix(digits.get(..4).unwrap_or(""), 16).ok();
    let (first, rest) = (unit(digits).unwrap_or(0xfffd), digits.get(4..).unwrap_or(""));
    let second = rest.strip_prefix("\\u").and_then(unit).filter(|_| (0xd800..0xdc00).contains(&first));
    if let Some(Ok(character)) = second.and_then(|second| char::decode_utf16([first, second]).next()) {
        text.push(character);
        return rest.get(6..).unwrap_or("");
    }
    text.push(char::from_u32(u32::from(first)).unwrap_or(char::REPLACEMENT_CHARACTER));
    rest
}

/// Appends a text in quotes.
pub(crate) fn push_quoted(text: &str, to: &mut String) {
    to.push('"');
    for character in text.chars() {
        match character {
            '"' => to.push_str("\\\""),
            '\\' => to.push_str("\\\\"),
            '\n' => to.push_str("\\n"),
            '\0'..='\u{1f}' => to.push_str(&format!("\\u{:04x}", u32::from(character))),
            _ => to.push(character),
        }
    }
    to.push('"');
}
