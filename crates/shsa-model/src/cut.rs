//! Values that a comma has cut: inside `{ }` YAML ends a plain value at each comma, also within parentheses.

use super::problem;
use super::tree::{Node, Value, offset};
use shsa_core::knowledge::{Diagnostic, Place, Text};

/// How far the rest of a value is searched.
const MAX_VALUE: usize = 10_000;

const MESSAGE: &str = "inside `{ }` a comma ends a value, also within parentheses";

/// The entries of a mapping in braces, with each value or name that commas have cut in one piece again. Each is a problem, which
/// replaces those of its pieces. Linear.
pub(super) fn joined(
    source: &str,
    entries: Vec<(Text, Node)>,
    problems: &mut Vec<Diagnostic>,
) -> Vec<(Text, Node)> {
    let mut whole = Vec::with_capacity(entries.len());
    let mut until = 0;
    for (name, node) in entries {
        if name.place.from < until {
            continue;
        }
        let found = cut(source, &name, &node).and_then(|cut| all_of(source, cut.place.from));
        let Some(place) = found else {
            whole.push((name, node));
            continue;
        };
        until = place.to;
        problems.retain(|it| !(place.from..place.to).contains(&it.place.from));
        let text = written(source, place);
        problems.push(problem(place, MESSAGE, Some(&format!("put it in quotes: {}", quoted(text)))));
        whole.push(match node.value {
            Value::Null => entry(source, place),
            _ => (name, scalar(text, place)),
        });
    }
    whole
}

/// The problem of a mapping in braces that cannot be read after a value which a comma has cut.
pub(super) fn broken(source: &str, entries: &[(Text, Node)]) -> Option<Diagnostic> {
    let (name, node) = entries.last()?;
    let cut = cut(source, name, node)?;
    Some(problem(cut.place, MESSAGE, Some("put the whole value in quotes: `key: \"max(a, b)\"`")))
}

/// The value, or the name without a value, whose parentheses do not close.
fn cut<'t>(source: &str, name: &'t Text, node: &'t Node) -> Option<&'t Text> {
    let text = match &node.value {
        Value::Null => name,
        Value::Scalar(text) => text,
        _ => return None,
    };
    let before = source.as_bytes().get((text.place.from as usize).checked_sub(1)?)?;
    let opened = text.text.matches(['(', '[']).count();
    let is_open = opened > text.text.matches([')', ']']).count();
    (is_open && !matches!(before, b'"' | b'\'')).then_some(text)
}

/// The place from a first piece to the comma or the brace after the last one; `None` where its parentheses do not close there.
fn all_of(source: &str, from: u32) -> Option<Place> {
    let rest = source.get(from as usize..)?;
    let mut depth = 0_usize;
    for (at, letter) in rest.char_indices().take(MAX_VALUE) {
        match letter {
            '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.checked_sub(1)?,
            '{' | '"' | '#' => return None,
            '}' if depth > 0 => return None,
            ',' | '}' if depth == 0 => {
                let to = from + offset(rest.get(..at)?.trim_end().len());
                return Some(Place { from, to });
            }
            _ => {}
        }
    }
    None
}

fn written(source: &str, place: Place) -> &str {
    source.get(place.from as usize..place.to as usize).unwrap_or("")
}

fn quoted(text: &str) -> String {
    match text.split_once("): ") {
        Some((name, value)) => format!("`\"{name})\": \"{value}\"`"),
        None => format!("`\"{text}\"`"),
    }
}

fn scalar(text: &str, place: Place) -> Node {
    Node { place, value: Value::Scalar(Text { text: text.to_owned(), place }) }
}

/// A name with its value, both in one piece.
fn entry(source: &str, place: Place) -> (Text, Node) {
    let text = written(source, place);
    let at = text.find("): ").map_or(text.len(), |at| at + 1);
    let (name, value) = text.split_at(at);
    let value = value.trim_start_matches(':').trim_start();
    let end = |text: &str| place.from + offset(text.len());
    let node = if value.is_empty() {
        Node { place, value: Value::Null }
    } else {
        scalar(value, Place { from: place.to - offset(value.len()), to: place.to })
    };
    (Text { text: name.to_owned(), place: Place { from: place.from, to: end(name) } }, node)
}
