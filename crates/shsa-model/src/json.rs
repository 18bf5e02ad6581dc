//! JSON texts as the same tree as YAML: first checked as a whole, then read piece by piece.
//!
//! The large sections of a model are not kept as trees: [`Json::entries`] reads one entry after the other.

use shsa_core::knowledge::{BodyDraft, Diagnostic, Place, PropertyDrafts, RelationDraft, Text};
use shsa_message::json::unescaped;
use std::collections::BTreeSet;

use super::cursor::{Broken, Cursor, Quoted};
use super::lines::Lines;
use super::tree::{self, Node, Value, offset};

/// The sections that are read entry by entry.
const SECTIONS: [&str; 3] = ["variables", "relations", "signals"];

/// The most properties of a relation of the usual form.
const MOST_PROPERTIES: usize = 8;

/// A relation as it was read.
pub(crate) enum Entry {
    /// Of the usual form.
    Usual(RelationDraft),
    /// A relation of any other form, with its name.
    Other((Text, Node)),
}

/// A text that is JSON.
pub(crate) struct Json<'a> {
    source: &'a str,
    lines: Lines<'a>,
    /// As [`tree::Tree::rewritten`].
    pub(crate) rewritten: BTreeSet<u32>,
    pub(crate) problems: Vec<Diagnostic>,
}

/// Whether a text begins as a JSON object does: with `{` and a quoted key.
pub(crate) fn is_likely(source: &str) -> bool {
    let inner = Cursor::new(source).rest().strip_prefix('{');
    inner.is_some_and(|inner| inner.trim_start().starts_with('"'))
}

/// Checks the text of an object and reads it, except for the entries of its large sections: these are [`Value::Unread`].
///
/// # Errors
/// The first place at which the text is no JSON or holds too much.
///
/// Time: linear in the text. Space: the values that are read, at most a few million.
pub(crate) fn read(source: &str) -> Result<(Node, Json<'_>), Broken> {
    let mut cursor = Cursor::new(source);
    let from = cursor.place();
    let mut parts = Vec::new();
    cursor.object(|cursor, key| {
        let begin = cursor.place();
        let unread = cursor.is_object() && SECTIONS.contains(&cursor.inner(key));
        if unread {
            cursor.skip_section()?
        } else {
            cursor.skip(2)?
        }
        parts.push((key, Place { from: begin, to: cursor.place() }, unread));
        Ok(())
    })?;
    let place = Place { from, to: cursor.place() };
    cursor.end()?;
    let (rewritten, problems) = (BTreeSet::new(), Vec::new());
    let mut json = Json { source, lines: Lines::new(source), rewritten, problems };
    let mut entries = Vec::new();
    for (key, place, unread) in parts {
        let mut at = cursor.moved_to(place.from);
        let value = if unread { Node { place, value: Value::Unread } } else { json.node(&mut at)? };
        entries.push((json.text(&cursor, key), value));
    }
    let value = json.map(entries);
    Ok((Node { place, value }, json))
}

impl Json<'_> {
    /// Reads the entries of an unread mapping one by one. A duplicate key comes twice.
    pub(crate) fn entries(&mut self, place: Place, take: &mut dyn FnMut(&(Text, Node))) {
        let read = Cursor::new(self.source).moved_to(place.from).object(|cursor, key| {
            let key = self.text(cursor, key);
            take(&(key, self.node(cursor)?));
            Ok(())
        });
        debug_assert!(read.is_ok(), "the text was checked as a whole");
    }

    /// As [`Json::entries`] for relations: relations of the usual form (see [`Json::usual_relation`]) come as drafts.
    pub(crate) fn relations(&mut self, place: Place, take: &mut dyn FnMut(Entry)) {
        let read = Cursor::new(self.source).moved_to(place.from).object(|cursor, key| {
            let name = self.text(cursor, key);
            match self.usual_relation(cursor, &name) {
                Some(relation) => take(Entry::Usual(relation)),
                None => take(Entry::Other((name, self.node(cursor)?))),
            }
            Ok(())
        });
        debug_assert!(read.is_ok(), "the text was checked as a whole");
    }

    /// Reads a relation of the usual form, `{"output": "a", "inputs": ["b"], "properties": {"cost": 2}}` with no other and no
    /// duplicate key, into a draft without a tree. This halves the allocations, since a large model consists mostly of such
    /// relations. `None` for any other value, with the cursor still before it.
    fn usual_relation(&mut self, cursor: &mut Cursor, name: &Text) -> Option<RelationDraft> {
        let (mut output, mut inputs, mut properties) = (None, None, None);
        let mut ahead = *cursor;
        let read = ahead.object(|at, key| {
            let is_new = match at.inner(key) {
                "output" => output.replace(self.usual_text(at)?).is_none(),
                "inputs" => {
                    let mut names = Vec::new();
                    at.list(|at| {
                        names.push(self.usual_text(at)?);
                        Ok(())
                    })?;
                    inputs.replace(names).is_none()
                }
                "properties" => {
                    let mut read = Vec::new();
                    at.object(|at, key| {
                        let name = self.text(at, key);
                        read.push((name, self.usual_text(at)?));
                        Ok(())
                    })?;
                    properties.replace(read).is_none()
                }
                _ => false,
            };
            if is_new { Ok(()) } else { Err(Broken::unusual()) }
        });
        let properties: PropertyDrafts = properties.unwrap_or_default();
        let is_new = |at: usize| properties[..at].iter().all(|(name, _)| name.text != properties[at].0.text);
        if read.is_err() || properties.len() > MOST_PROPERTIES || !(1..properties.len()).all(is_new) {
            return None;
        }
        let body = BodyDraft::Structure { outputs: vec![output?], inputs: inputs.unwrap_or_default() };
        let (directions, condition, error) = (None, None, None);
        *cursor = ahead;
        Some(RelationDraft {
            name: name.clone(),
            body,
            directions,
            condition,
            error,
            learn: Vec::new(),
            properties,
        })
    }

    /// Reads a text or a number.
    fn usual_text(&mut self, cursor: &mut Cursor) -> Result<Text, Broken> {
        match self.node(cursor)?.value {
            Value::Scalar(text) => Ok(text),
            _ => Err(Broken::unusual()),
        }
    }

    fn node(&mut self, cursor: &mut Cursor) -> Result<Node, Broken> {
        let from = cursor.place();
        let value = match cursor.peek() {
            Some(b'{') => {
                let mut entries = Vec::new();
                cursor.object(|cursor, key| {
                    let key = self.text(cursor, key);
                    entries.push((key, self.node(cursor)?));
                    Ok(())
                })?;
                self.map(entries)
            }
            Some(b'[') => {
                let mut items = Vec::new();
                cursor.list(|cursor| {
                    items.push(self.node(cursor)?);
                    Ok(())
                })?;
                Value::List(items)
            }
            Some(b'"') => {
                let quoted = cursor.string()?;
                Value::Scalar(self.text(cursor, quoted))
            }
            _ => match cursor.word()? {
                "null" => Value::Null,
                word => {
                    let place = Place { from, to: cursor.place() };
                    Value::Scalar(Text { text: word.to_owned(), place })
                }
            },
        };
        Ok(Node { place: Place { from, to: cursor.place() }, value })
    }

    fn map(&mut self, entries: Vec<(Text, Node)>) -> Value {
        Value::Map(tree::without_duplicates(entries, &self.lines, &mut self.problems))
    }

    /// The text between quotes, without blanks at its ends, with its place.
    fn text(&mut self, cursor: &Cursor, quoted: Quoted) -> Text {
        let inner = cursor.inner(quoted);
        if quoted.escaped {
            let unescaped = unescaped(inner);
            let text = unescaped.trim();
            let place = tree::narrowed(self.source, text, quoted.place, &mut self.rewritten);
            return Text { text: text.to_owned(), place };
        }
        let is_letter = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_graphic);
        let bare = is_letter(inner.as_bytes().first()) && is_letter(inner.as_bytes().last());
        let text = if bare { inner } else { inner.trim() };
        let before = if bare { 0 } else { inner.len() - inner.trim_start().len() };
        let from = if text.is_empty() { quoted.place.from } else { quoted.place.from + 1 + offset(before) };
        Text { text: text.to_owned(), place: Place { from, to: from + offset(text.len()) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn escapes_are_what_another_reader_makes_of_them(
            text in any::<String>(), every in any::<bool>(), slash in any::<bool>(),
        ) {
            let unit = |unit: u16| format!("\\u{unit:04x}");
            let all = || text.encode_utf16().map(unit).collect::<String>();
            let written = if every { format!("\"{}\"", all()) } else { serde_json::to_string(&text).unwrap() };
            let written = if slash { written.replace('/', "\\/") } else { written };
            let expected: String = serde_json::from_str(&written).unwrap();
            let quoted = Cursor::new(&written).string().unwrap();
            prop_assert_eq!(unescaped(Cursor::new(&written).inner(quoted)), expected);
        }

        #[test]
        fn what_is_json_is_what_another_reader_takes(text in "[\\[\\]{}\",:0-9eE+.\\\\u\\-a-f tn\n]{0,12}") {
            let text = format!("{{\"a\":{text}}}");
            let ours = read(&text).map(|_| ()).map_err(|broken| broken.message);
            let theirs = serde_json::from_str::<serde::de::IgnoredAny>(&text);
            prop_assert_eq!(ours.is_ok(), theirs.is_ok(), "{} {:?}", text, ours);
        }
    }
}
