//! A single pass through JSON (RFC 8259) that finds the wanted values; nothing is built or copied.
//!
//! Beyond the standard, only the words `NaN`, `Infinity` and `-Infinity` are numbers, as Python and JavaScript libraries write
//! them: such a value of a sensor is readable, and invalid.

use super::scanner::{Flaw, Scanner};
use super::text::unescaped;
use crate::path::Step;
use std::ops::Range;

/// Deeper nesting is refused: it would cost stack.
const DEPTH_MAX: usize = 64;

/// The place where a text is no longer JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Broken {
    /// The byte, counted from 0.
    pub at: usize,
    /// What is expected at that place.
    pub expected: &'static str,
}

/// The kind of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `null`.
    Null,
    /// `false`.
    False,
    /// `true`.
    True,
    /// A number, also `NaN` and the infinities.
    Number,
    /// A text; its place is between the quotes.
    Text,
    /// A list.
    List,
    /// An object.
    Object,
}

/// The place of a value in the text, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The kind of the value.
    pub kind: Kind,
    /// The first byte.
    pub from: usize,
    /// The byte behind the value.
    pub to: usize,
}

impl Place {
    /// The bytes of the value.
    #[must_use]
    pub fn range(self) -> Range<usize> {
        self.from..self.to
    }

    /// The place of a value from its first byte to its last one, quotes among them.
    pub(super) fn between(kind: Kind, from: usize, to: usize) -> Place {
        let quote = usize::from(kind == Kind::Text);
        Place { kind, from: from + quote, to: to - quote }
    }

    /// The first byte of the value, and the byte behind it, quotes among them.
    pub(super) fn outside(self) -> Range<usize> {
        let quote = usize::from(self.kind == Kind::Text);
        self.from - quote..self.to + quote
    }

    /// The text of the value; empty when the place belongs to another text.
    #[must_use]
    pub fn of(self, text: &str) -> &str {
        text.get(self.range()).unwrap_or("")
    }
}

/// Receives the values of a pass.
pub trait Visitor {
    /// The state of a value that its members need.
    type Node: Copy;
    /// The node of an object's member, with the name as between the quotes. `None`: neither the member nor its contents are
    /// wanted.
    fn member(&mut self, of: Self::Node, name: &str) -> Option<Self::Node>;
    /// The node of a list's element.
    fn element(&mut self, of: Self::Node, index: usize) -> Option<Self::Node>;
    /// A wanted value begins.
    fn enter(&mut self, node: Self::Node);
    /// A wanted value has ended.
    fn leave(&mut self, node: Self::Node, place: Place);
}

/// Whether a text looks like JSON; otherwise it is a plain number or word.
#[must_use]
pub fn is_likely(text: &str) -> bool {
    text.trim_ascii_start().starts_with(['{', '[', '"'])
}

/// Passes through a text that must be one JSON value. `O(bytes)`; no allocation.
///
/// # Errors
/// The place where the text is no longer JSON.
pub fn walk<V: Visitor>(text: &str, root: V::Node, visitor: &mut V) -> Result<(), Broken> {
    let mut walker = Walker { scanner: Scanner::new(text), visitor };
    walker.value(Some(root), 0)?;
    walker.scanner.blanks();
    if walker.scanner.at < text.len() { Err(walker.broken("the end")) } else { Ok(()) }
}

struct Walker<'a, V> {
    scanner: Scanner<'a>,
    visitor: &'a mut V,
}

impl<V: Visitor> Walker<'_, V> {
    fn broken(&self, expected: &'static str) -> Broken {
        Broken { at: self.scanner.at, expected }
    }

    fn value(&mut self, node: Option<V::Node>, depth: usize) -> Result<(), Broken> {
        self.scanner.blanks();
        if let Some(node) = node {
            self.visitor.enter(node);
        }
        let from = self.scanner.at;
        let kind = match self.scanner.peek() {
            Some(b'{') => self.object(node, depth)?,
            Some(b'[') => self.list(node, depth)?,
            _ => scalar(&mut self.scanner).map_err(|expected| self.broken(expected))?,
        };
        if let Some(node) = node {
            self.visitor.leave(node, Place::between(kind, from, self.scanner.at));
        }
        Ok(())
    }

    fn object(&mut self, node: Option<V::Node>, depth: usize) -> Result<Kind, Broken> {
        self.opened(depth)?;
        if self.scanner.eat(b'}') {
            return Ok(Kind::Object);
        }
        loop {
            self.scanner.blanks();
            let from = self.scanner.at + 1;
            if self.scanner.peek() != Some(b'"') {
                return Err(self.broken("a name in quotes"));
            }
            self.scanner.quoted().map_err(|flaw| self.broken(expected(flaw)))?;
            let name = self.scanner.text.get(from..self.scanner.at - 1).unwrap_or("");
            let member = node.and_then(|node| self.visitor.member(node, name));
            self.scanner.blanks();
            if !self.scanner.eat(b':') {
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
        if self.scanner.eat(b']') {
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
        self.scanner.at += 1;
        self.scanner.blanks();
        Ok(())
    }

    /// Whether the list or object ends here; otherwise steps over a comma.
    fn closed(&mut self, by: u8, expected: &'static str) -> Result<bool, Broken> {
        self.scanner.blanks();
        let closed = self.scanner.eat(by);
        if closed || self.scanner.eat(b',') { Ok(closed) } else { Err(self.broken(expected)) }
    }
}

/// Steps over a value that is neither a list nor an object; or returns what is expected instead. Inlined, as each value of a
/// message passes here.
#[inline(always)]
pub(super) fn scalar(scanner: &mut Scanner<'_>) -> Result<Kind, &'static str> {
    match scanner.peek() {
        Some(b'"') => scanner.quoted().map(|_| Kind::Text).map_err(expected),
        Some(b'0'..=b'9') => scanner.number().map(|()| Kind::Number).map_err(expected),
        Some(b'-') => {
            if scanner.text.as_bytes().get(scanner.at + 1) == Some(&b'I') {
                scanner.at += 1;
                return word(scanner, "Infinity", Kind::Number);
            }
            scanner.number().map(|()| Kind::Number).map_err(expected)
        }
        Some(b't') => word(scanner, "true", Kind::True),
        Some(b'f') => word(scanner, "false", Kind::False),
        Some(b'n') => word(scanner, "null", Kind::Null),
        Some(b'N') => word(scanner, "NaN", Kind::Number),
        Some(b'I') => word(scanner, "Infinity", Kind::Number),
        _ => Err("a value"),
    }
}

#[inline(never)]
fn word(scanner: &mut Scanner<'_>, word: &str, kind: Kind) -> Result<Kind, &'static str> {
    let rest = scanner.text.get(scanner.at..);
    if !rest.is_some_and(|rest| rest.starts_with(word)) {
        return Err("a value");
    }
    scanner.at += word.len();
    Ok(kind)
}

fn expected(instead_of: Flaw) -> &'static str {
    match instead_of {
        Flaw::Control => "no control character in a text",
        Flaw::Unclosed => "a closing quote",
        Flaw::Escape(_) => "an escaped character",
        Flaw::HexDigit(_) => "four hexadecimal digits",
        Flaw::Digit => "a digit",
    }
}

/// The place of the value at a path within another; `None` where there is none. Of members of the same name, the last one counts.
#[must_use]
pub fn descend(text: &str, from: Place, steps: &[Step]) -> Option<Place> {
    /// How many steps lead to a value, and its place.
    struct Way<'s>(&'s [Step], Option<Place>);
    impl Visitor for Way<'_> {
        /// The number of steps that lead here.
        type Node = usize;
        fn member(&mut self, of: usize, name: &str) -> Option<usize> {
            let Step::Key(key) = self.0.get(of)? else { return None };
            (key == name || name.contains('\\') && *key == unescaped(name)).then_some(of + 1)
        }
        fn element(&mut self, of: usize, index: usize) -> Option<usize> {
            let asked = match self.0.get(of)? {
                Step::Index(asked) => Some(*asked),
                Step::Key(key) => key.parse().ok(),
                Step::Each => None,
            };
            (asked == Some(index)).then_some(of + 1)
        }
        fn enter(&mut self, node: usize) {
            if node < self.0.len() {
                self.1 = None;
            }
        }
        fn leave(&mut self, node: usize, place: Place) {
            if node == self.0.len() {
                self.1 = Some(place);
            }
        }
    }
    // What is within the quotes of a text is no JSON of its own.
    if steps.is_empty() || !matches!(from.kind, Kind::Object | Kind::List) {
        return steps.is_empty().then_some(from);
    }
    let mut way = Way(steps, None);
    // What is within a valid text is valid, so the pass cannot fail.
    let _walked = walk(from.of(text), 0, &mut way);
    way.1.map(|place| Place { kind: place.kind, from: place.from + from.from, to: place.to + from.from })
}

/// Passes the places of a list's elements to `each`, which returns whether to go on.
pub fn elements(text: &str, list: Place, mut each: impl FnMut(usize, Place) -> bool) {
    struct Elements<F>(F, usize, bool);
    impl<F: FnMut(usize, Place) -> bool> Visitor for Elements<F> {
        /// Whether the node is the list itself.
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
    // The list is part of a valid text, so the pass cannot fail.
    let _walked = walk(list.of(text), true, &mut Elements(shifted, 0, true));
}
