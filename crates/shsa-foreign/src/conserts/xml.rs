//! Elements of an XML text with their attributes: what `.model` files are made of. Texts between elements are passed over.

use shsa_core::knowledge::{Place, Text};
use shsa_model::reader::Reader;

/// How deeply elements may nest.
const MAX_DEPTH: usize = 64;
/// How many elements a file may have.
const MAX_ELEMENTS: usize = 200_000;

/// An element.
pub(super) struct Element {
    pub(super) name: String,
    pub(super) place: Place,
    pub(super) attributes: Vec<(String, Text)>,
    pub(super) children: Vec<Element>,
}

impl Element {
    /// The value of an attribute.
    pub(super) fn get(&self, name: &str) -> Option<&Text> {
        self.attributes.iter().find(|(own, _)| own == name).map(|(_, value)| value)
    }

    /// The children of a name, in order.
    pub(super) fn all<'e>(&'e self, name: &'e str) -> impl Iterator<Item = &'e Element> {
        self.children.iter().filter(move |child| child.name == name)
    }
}

/// The root element; `None`, with a reported problem, where the text is malformed. Time: linear in the text.
pub(super) fn read(reader: &mut Reader, source: &str) -> Option<Element> {
    let mut open: Vec<Element> = Vec::new();
    let mut root = None;
    let (mut at, mut made) = (0, 0);
    while let Some(start) = source[at..].find('<').map(|found| at + found) {
        let rest = &source[start..];
        if let Some(end) = skipped(rest) {
            let Some(end) = end else { return broken(reader, start, "this never ends") };
            at = start + end;
            continue;
        }
        let Some((tag, after)) = tag(source, start) else {
            return broken(reader, start, "this element is broken");
        };
        at = after;
        made += 1;
        if open.len() >= MAX_DEPTH || made > MAX_ELEMENTS {
            return broken(reader, start, "too many elements, or nested too deeply");
        }
        let is_closed = match tag {
            Tag::Close(name) if open.last().is_some_and(|element| element.name == name) => true,
            Tag::Close(_) => return broken(reader, start, "this closes what is not open"),
            Tag::Open(element, is_empty) => {
                open.push(element);
                is_empty
            }
        };
        if is_closed && let Some(element) = open.pop() {
            match open.last_mut() {
                Some(parent) => parent.children.push(element),
                None if root.is_none() => root = Some(element),
                None => return broken(reader, start, "a second root"),
            }
        }
    }
    match open.last() {
        Some(element) => broken(reader, element.place.from as usize, "this is never closed"),
        None if root.is_none() => broken(reader, 0, "no element"),
        None => root,
    }
}

fn broken(reader: &mut Reader, at: usize, message: &str) -> Option<Element> {
    let at = u32::try_from(at).unwrap_or(u32::MAX);
    reader.note(Place { from: at, to: at }, message, "the file must be well-formed XML");
    None
}

/// How long a declaration or comment is, if this is one; the inner `None`: it never ends.
fn skipped(rest: &str) -> Option<Option<usize>> {
    let until = |end: &str| Some(rest.find(end).map(|at| at + end.len()));
    if rest.starts_with("<!--") {
        until("-->")
    } else if rest.starts_with("<?") {
        until("?>")
    } else if rest.starts_with("<!") {
        until(">")
    } else {
        None
    }
}

enum Tag {
    Open(Element, bool),
    Close(String),
}

/// The tag that begins at `start`, and where it ends.
fn tag(source: &str, start: usize) -> Option<(Tag, usize)> {
    let mut at = start + 1;
    let is_close = source[at..].starts_with('/');
    at += usize::from(is_close);
    let name = word(source, &mut at)?;
    let mut element = Element { name, place: place(start, at), attributes: Vec::new(), children: Vec::new() };
    loop {
        at += source[at..].len() - source[at..].trim_start().len();
        let rest = &source[at..];
        if rest.starts_with("/>") && !is_close {
            return Some((Tag::Open(element, true), at + 2));
        }
        if rest.starts_with('>') {
            let tag = if is_close { Tag::Close(element.name) } else { Tag::Open(element, false) };
            return Some((tag, at + 1));
        }
        let key = word(source, &mut at)?;
        let rest = source[at..].strip_prefix('=')?;
        let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let length = rest[1..].find(quote)?;
        let from = at + 2;
        let text = unescaped(&source[from..from + length]);
        element.attributes.push((key, Text { text, place: place(from, from + length) }));
        at = from + length + 1;
    }
}

fn word(source: &str, at: &mut usize) -> Option<String> {
    let rest = &source[*at..];
    let is_part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':');
    let length = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
    *at += length;
    (length > 0).then(|| rest[..length].to_owned())
}

fn place(from: usize, to: usize) -> Place {
    let offset = |at| u32::try_from(at).unwrap_or(u32::MAX);
    Place { from: offset(from), to: offset(to) }
}

/// The text with its character references replaced; unknown ones stay as they are.
fn unescaped(text: &str) -> String {
    let mut read = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('&') {
        read.push_str(&rest[..at]);
        rest = &rest[at..];
        let known = rest.find(';').and_then(|end| Some((reference(&rest[1..end])?, end + 1)));
        let (c, length) = known.unwrap_or(('&', 1));
        read.push(c);
        rest = &rest[length..];
    }
    read + rest
}

fn reference(name: &str) -> Option<char> {
    match name {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        _ => {
            let number = name.strip_prefix('#')?;
            let code = match number.strip_prefix('x') {
                Some(digits) => u32::from_str_radix(digits, 16),
                None => number.parse(),
            };
            char::from_u32(code.ok()?)
        }
    }
}
