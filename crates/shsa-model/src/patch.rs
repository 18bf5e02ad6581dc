//! A change applied to the text of a model: all other text stays as written, with comments and layout.
//!
//! The result is read again and must give the changed model; otherwise there is no result.

use shsa_core::knowledge::{Draft, Text};
use std::ops::Range;

use super::layout;
use super::live::{Live, Written};
use super::report::Report;
use super::tree::{self, Node, Value};
use super::write::{self, plain_or_quoted};

/// The text of a model after a change, which is written as for `shsa replay --reload`.
///
/// A change without an entry leaves the text as it is.
///
/// # Errors
/// The problems of the model or of the change, and a layout of the model without a place for the change.
///
/// ```
/// use shsa_model::{live::Written, patch::patched};
///
/// let text = "shsa: 1\nvariables:\n  speed: { unit: m/s }  # of the car\n";
/// let change = Written { name: "change", text: "variables: { speed: { unit: m/s, max_rate: 6 m/s^2 } }" };
/// let patched = patched(Written { name: "car.yaml", text }, change).unwrap();
/// assert_eq!(patched, "shsa: 1\nvariables:\n  speed: { unit: m/s, max_rate: 6 m/s^2 }  # of the car\n");
/// ```
pub fn patched(model: Written<'_>, change: Written<'_>) -> Result<String, Report> {
    let (mut live, _) = Live::load(model)?;
    if is_nothing(change.text) {
        return Ok(model.text.to_owned());
    }
    live.change(change)?;
    let text = Edits::of(model.text, change.text).map(|edits| edits.applied(model.text));
    match text {
        Some(text) if says(&text, model.name, live.draft()) => Ok(text),
        _ => {
            let message = "this change cannot be put into the text as it is laid out";
            let help = "write the entries that it changes in block style, one key a line";
            Err(Report::whole(model.name, message.to_owned(), help))
        }
    }
}

/// Whether a change has comments at most, as one has that found nothing to change.
fn is_nothing(change: &str) -> bool {
    change.lines().map(str::trim).all(|line| line.is_empty() || line.starts_with('#'))
}

/// Whether a text gives the expected draft, in any order.
fn says(text: &str, name: &str, expected: &Draft) -> bool {
    let value = |draft: &Draft| serde_json::from_str::<serde_json::Value>(&write::json(draft)).ok();
    let is_same = super::read(text, name).is_ok_and(|read| value(&read.draft) == value(expected));
    is_same && super::load(text, name).report.ok()
}

/// A range of the text and its replacement.
struct Edit {
    from: usize,
    to: usize,
    with: String,
}

/// All edits that a change makes to a text.
struct Edits<'t> {
    text: &'t str,
    edits: Vec<Edit>,
    /// The text that is added at the end.
    sections: String,
}

impl<'t> Edits<'t> {
    /// `None` when the model or the change is no mapping of sections.
    fn of(text: &'t str, change: &str) -> Option<Edits<'t>> {
        let (model, change) = (tree::read(text).root?, tree::read(change).root?);
        let mut edits = Edits { text, edits: Vec::new(), sections: String::new() };
        let sections = entries(&model)?;
        for (section, node) in entries(&change)? {
            let present = sections.iter().find(|(known, _)| known.text == section.text);
            match present.map(|(_, node)| node).filter(|node| entries(node).is_some_and(|it| !it.is_empty()))
            {
                Some(present) => edits.merge(present, entries(node)?, false),
                None => edits.section(&section.text, entries(node)?),
            }
        }
        Some(edits)
    }

    /// Puts entries into a mapping that has some; `is_whole` removes all entries that are not named.
    fn merge(&mut self, present: &Node, wanted: &[(Text, Node)], is_whole: bool) {
        let known = entries(present).unwrap_or_default();
        let is_flow = self.is_flow(present);
        let find =
            |entries: &'_ [(Text, Node)], name: &str| entries.iter().position(|(key, _)| key.text == name);
        let goes = |(key, _): &(Text, Node)| match find(wanted, &key.text).and_then(|at| wanted.get(at)) {
            Some((_, new)) => matches!(new.value, Value::Null),
            None => is_whole,
        };
        let Some(first) = known.iter().position(|entry| !goes(entry)).or_else(|| (!is_flow).then_some(0))
        else {
            let place = present.place.from as usize..self.end(present);
            return self.push(place, braced(wanted));
        };
        for (name, new) in wanted.iter().filter(|(_, new)| !matches!(new.value, Value::Null)) {
            match find(known, &name.text).and_then(|at| known.get(at)) {
                Some((_, old)) => self.replace(old, new, is_flow),
                None => self.add(present, name, new, is_flow),
            }
        }
        for (at, _) in known.iter().enumerate().filter(|(_, entry)| goes(entry)) {
            let place = if is_flow { self.beside(known, at, first) } else { self.lines(known.get(at)) };
            place.into_iter().for_each(|place| self.push(place, String::new()));
        }
    }

    fn push(&mut self, place: Range<usize>, with: String) {
        self.edits.push(Edit { from: place.start, to: place.end, with });
    }

    fn replace(&mut self, old: &Node, new: &Node, is_flow: bool) {
        match (&old.value, &new.value) {
            (Value::Map(known), Value::Map(wanted)) if !known.is_empty() => self.merge(old, wanted, true),
            _ if written(old, true) == written(new, true) => {}
            _ => {
                self.push(self.start(old.place.from)..self.end(old), written(new, is_flow));
            }
        }
    }

    /// Adds an entry after the last one of a mapping: in its brackets, or in a line of its own.
    fn add(&mut self, present: &Node, name: &Text, new: &Node, is_flow: bool) {
        let Some((key, last)) = entries(present).and_then(<[_]>::last) else { return };
        let end = self.end(last);
        let entry = format!("{}: {}", plain_or_quoted(&name.text, true), written(new, is_flow));
        match is_flow {
            true => self.push(end..end, format!(", {entry}")),
            false => {
                let line = self.line_end(end);
                self.push(line..line, format!("\n{}{entry}", self.indent(key)));
            }
        }
    }

    /// An entry in brackets with the comma that goes with it; `first` is the first entry that stays.
    fn beside(&self, known: &[(Text, Node)], at: usize, first: usize) -> Option<Range<usize>> {
        let (key, old) = known.get(at)?;
        match at < first {
            true => Some(self.start(key.place.from)..self.start(known.get(at + 1)?.0.place.from)),
            false => Some(self.end(&known.get(at.checked_sub(1)?)?.1)..self.end(old)),
        }
    }

    /// The lines of an entry.
    fn lines(&self, entry: Option<&(Text, Node)>) -> Option<Range<usize>> {
        let (key, old) = entry?;
        let before = self.text.get(..key.place.from as usize)?;
        let end = self.line_end(self.end(old)) + 1;
        Some(before.rfind('\n').map_or(0, |at| at + 1)..end.min(self.text.len()))
    }

    fn section(&mut self, name: &str, wanted: &[(Text, Node)]) {
        self.sections += &format!("\n{name}:\n");
        for (name, node) in wanted {
            self.sections += &format!("  {}: {}\n", plain_or_quoted(&name.text, true), written(node, false));
        }
    }

    /// The text with all edits made, the last ones first, so that places stay valid.
    fn applied(mut self, text: &str) -> String {
        // Of several additions at one place, the first comes first.
        self.edits.reverse();
        self.edits.sort_by_key(|edit| std::cmp::Reverse(edit.from));
        let mut text = text.to_owned();
        for Edit { from, to, with } in &self.edits {
            text.replace_range(*from..*to, with);
        }
        if !self.sections.is_empty() && !text.ends_with('\n') {
            text.push('\n');
        }
        text + &self.sections
    }

    fn is_flow(&self, node: &Node) -> bool {
        layout::is_flow(self.text, node)
    }

    fn start(&self, from: u32) -> usize {
        layout::start(self.text, from)
    }

    fn end(&self, node: &Node) -> usize {
        layout::end_of(self.text, node)
    }

    fn line_end(&self, at: usize) -> usize {
        self.text.get(at..).and_then(|rest| rest.find('\n')).map_or(self.text.len(), |length| at + length)
    }

    /// The blanks before a key in its line.
    fn indent(&self, key: &Text) -> &'t str {
        let before = self.text.get(..key.place.from as usize).unwrap_or_default();
        let line = self.text.get(before.rfind('\n').map_or(0, |at| at + 1)..).unwrap_or_default();
        line.get(..line.len() - line.trim_start_matches(' ').len()).unwrap_or_default()
    }
}

fn entries(node: &Node) -> Option<&[(Text, Node)]> {
    match &node.value {
        Value::Map(entries) => Some(entries),
        _ => None,
    }
}

/// A value in one line; `inside` brackets, fewer texts may stand without quotes.
fn written(node: &Node, inside: bool) -> String {
    match &node.value {
        Value::Null | Value::Unread => "null".to_owned(),
        Value::Scalar(text) => plain_or_quoted(&text.text, inside),
        Value::List(items) => {
            let items: Vec<String> = items.iter().map(|item| written(item, true)).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Map(entries) => braced(entries),
    }
}

/// Entries in brackets, without those whose value is null.
fn braced(entries: &[(Text, Node)]) -> String {
    let entries = entries.iter().filter(|(_, node)| !matches!(node.value, Value::Null));
    let entries = entries
        .map(|(key, node)| format!("{}: {}", plain_or_quoted(&key.text, true), written(node, true)))
        .collect::<Vec<_>>();
    if entries.is_empty() { "{}".to_owned() } else { format!("{{ {} }}", entries.join(", ")) }
}
