//! The layout of the text of a model: two blanks for each level, one between a key and its value, comments kept.
//!
//! The result is read again and must give the same model; otherwise there is no result.

use std::collections::BTreeMap;

use super::live::Written;
use super::report::Report;
use super::tree::{self, Node, Value};

/// The number of blanks for each level.
const STEP: usize = 2;
/// Characters between two elements of a line, which the layout may change.
const BETWEEN: [char; 4] = [' ', '\t', ':', ','];

/// The text of a model in the standard layout. A second layout changes nothing. Time: O(n log n).
///
/// # Errors
/// A text that cannot be read, or that would give another model after the layout.
///
/// ```
/// use shsa_model::{layout::laid_out, live::Written};
///
/// let text = "shsa: 1\nvariables:\n    speed: {unit: m/s}  # of the car\n";
/// let laid_out = laid_out(Written { name: "car.yaml", text }).unwrap();
/// assert_eq!(laid_out, "shsa: 1\nvariables:\n  speed: { unit: m/s }  # of the car\n");
/// ```
pub fn laid_out(model: Written<'_>) -> Result<String, Report> {
    super::read(model.text, model.name)?;
    // YAML reads every line break as a line feed.
    let spaced = spaced(&model.text.replace("\r\n", "\n"));
    let text = indented(&spaced);
    match (tree::read(model.text).root, tree::read(&text).root) {
        (Some(Node { value: Value::Null | Value::Scalar(_), .. }), _) => {
            let message = "this text is no model: a model is a mapping";
            Err(Report::whole(model.name, message.to_owned(), "write it like `shsa: 1`"))
        }
        (Some(before), Some(after)) if is_same(&before, &after) => Ok(text),
        _ => {
            let message = "this text would not say the same in another layout";
            Err(Report::whole(
                model.name,
                message.to_owned(),
                "leave it as it is, or write it in simpler YAML",
            ))
        }
    }
}

fn is_same(one: &Node, other: &Node) -> bool {
    match (&one.value, &other.value) {
        (Value::Null, Value::Null) => true,
        (Value::Scalar(one), Value::Scalar(other)) => one.text == other.text,
        (Value::List(one), Value::List(other)) => {
            one.len() == other.len() && one.iter().zip(other).all(|(one, other)| is_same(one, other))
        }
        (Value::Map(one), Value::Map(other)) => {
            let mut pairs = one.iter().zip(other);
            one.len() == other.len()
                && pairs.all(|(one, other)| one.0.text == other.0.text && is_same(&one.1, &other.1))
        }
        _ => false,
    }
}

/// A text with one blank at each gap between two elements of a line.
fn spaced(text: &str) -> String {
    let Some(root) = tree::read(text).root else { return text.to_owned() };
    let mut gaps = Gaps { text, gaps: BTreeMap::new() };
    gaps.visit(&root);
    let mut spaced = text.to_owned();
    for ((from, to), with) in gaps.gaps.into_iter().rev() {
        spaced.replace_range(from..to, with);
    }
    spaced
}

/// The gaps of a text with their new content.
struct Gaps<'t> {
    text: &'t str,
    gaps: BTreeMap<(usize, usize), &'static str>,
}

impl Gaps<'_> {
    fn visit(&mut self, node: &Node) {
        match &node.value {
            Value::Map(entries) => {
                let places = entries.iter().map(|(key, value)| {
                    let key = start(self.text, key.place.from)..end_of_scalar(self.text, key.place.to);
                    (key.start, key.end, start_of(self.text, value), end_of(self.text, value))
                });
                let places: Vec<_> = places.collect();
                for &(_, key_end, value, _) in &places {
                    self.colon(node, key_end, value);
                }
                let items = places.iter().map(|&(key, _, _, end)| (key, end));
                self.brackets(node, &items.collect::<Vec<_>>(), " ");
                entries.iter().for_each(|(_, value)| self.visit(value));
            }
            Value::List(items) => {
                let places = items.iter().map(|item| (start_of(self.text, item), end_of(self.text, item)));
                let places: Vec<_> = places.collect();
                self.brackets(node, &places, "");
                items.iter().for_each(|item| self.visit(item));
            }
            Value::Null | Value::Scalar(_) | Value::Unread => {}
        }
    }

    /// The gap between a key and its value; in block style, an alignment over several lines stays.
    fn colon(&mut self, node: &Node, from: usize, to: usize) {
        let is_aligned = self.text.get(from..to).is_some_and(|it| it.starts_with(": "));
        if is_flow(self.text, node) || !is_aligned {
            self.gap(from, to, ": ");
        }
    }

    /// The gaps in brackets: after the opening one, between the items, and before the closing one.
    fn brackets(&mut self, node: &Node, items: &[(usize, usize)], inner: &'static str) {
        if !is_flow(self.text, node) {
            return;
        }
        let (open, close) = (node.place.from as usize + 1, (node.place.to as usize).saturating_sub(1));
        let (Some(&(first, _)), Some(&(_, last))) = (items.first(), items.last()) else {
            return self.gap(open, close, "");
        };
        self.gap(open, first, inner);
        self.gap(last, close, inner);
        for pair in items.windows(2) {
            if let [(_, end), (next, _)] = pair {
                self.gap(*end, *next, ", ");
            }
        }
    }

    /// A gap with a comment or an anchor stays; of a gap that continues in the next line, the comma stays.
    fn gap(&mut self, from: usize, to: usize, with: &'static str) {
        let between = if from <= to { self.text.get(from..to) } else { None };
        if let Some((line, _)) = between.and_then(|it| it.split_once('\n')) {
            return match line.trim_matches([' ', '\t']) {
                "," if line != "," => self.gap(from, from + line.len(), ","),
                _ => {}
            };
        }
        if between.is_some_and(|it| it != with && it.chars().all(|it| BETWEEN.contains(&it))) {
            self.gaps.insert((from, to), with);
        }
    }
}

/// The indentation of a line.
#[derive(Clone, Copy)]
enum Line {
    /// The line begins with a key or an item, which moves to this column.
    At(usize),
    /// The line continues an element of an earlier line, and moves with that line.
    GoesOn,
}

/// A text whose lines are indented by their level.
fn indented(text: &str) -> String {
    let Some(root) = tree::read(text).root else { return text.to_owned() };
    let mut levels = Levels { text, starts: starts(text), lines: BTreeMap::new() };
    levels.visit(&root, 0);
    let lines: Vec<&str> = text.lines().collect();
    // The next key or item below each line: its new and its old column.
    let mut next = (0, 0);
    let mut below = vec![next; lines.len()];
    for (number, (line, below)) in lines.iter().zip(&mut below).enumerate().rev() {
        if let Some(Line::At(column)) = levels.lines.get(&number) {
            next = (*column, indent(line));
        }
        *below = next;
    }
    let mut out = String::with_capacity(text.len());
    let (mut moved, mut blank) = (0, 0);
    for (number, (line, below)) in lines.iter().zip(below).enumerate() {
        let own = indent(line);
        let rest = line.get(own..).unwrap_or_default();
        let line = match levels.lines.get(&number) {
            Some(Line::GoesOn) => shifted(line, own, moved),
            Some(Line::At(column)) => {
                moved = *column as isize - own as isize;
                format!("{}{}", " ".repeat(*column), rest.trim_end())
            }
            None if rest.trim().is_empty() => {
                blank = usize::from(!out.is_empty());
                continue;
            }
            // A comment belongs to the next element or, where it is indented further, to the previous one.
            None if own > below.1 => shifted(line.trim_end(), own, moved),
            None => format!("{}{}", " ".repeat(below.0), rest.trim_end()),
        };
        out += &"\n".repeat(std::mem::take(&mut blank));
        out += &line;
        out.push('\n');
    }
    out
}

/// A continued line moves as far as the line where its element begins; blanks in it stay.
fn shifted(line: &str, own: usize, moved: isize) -> String {
    if line.trim().is_empty() {
        return line.to_owned();
    }
    let column = own.saturating_add_signed(moved);
    format!("{}{}", " ".repeat(column), line.get(own..).unwrap_or_default())
}

/// The levels of the lines of a text.
struct Levels<'t> {
    text: &'t str,
    /// The start of each line.
    starts: Vec<usize>,
    lines: BTreeMap<usize, Line>,
}

impl Levels<'_> {
    fn visit(&mut self, node: &Node, column: usize) {
        let is_block = !is_flow(self.text, node);
        match &node.value {
            Value::Map(entries) if is_block => {
                for (key, value) in entries {
                    self.begin(start(self.text, key.place.from), column);
                    self.visit(value, column + STEP);
                }
            }
            Value::List(items) if is_block => {
                for item in items {
                    let at = start_of(self.text, item);
                    self.begin(at, column);
                    self.visit(item, column + self.behind_sign(at).unwrap_or(STEP));
                }
            }
            _ => {
                let (from, to) = (self.line(node.place.from as usize), self.line(end_of(self.text, node)));
                let behind = self.starts.get(to).is_some_and(|start| *start == end_of(self.text, node));
                for number in from + 1..=to.saturating_sub(usize::from(behind)) {
                    self.lines.entry(number).or_insert(Line::GoesOn);
                }
            }
        }
    }

    /// An element begins here: its line is indented when only the sign of an item precedes it.
    fn begin(&mut self, at: usize, column: usize) {
        let line = self.line(at);
        let before = self.starts.get(line).and_then(|start| self.text.get(*start..at)).unwrap_or_default();
        let is_first = before.chars().all(|it| it == ' ' || it == '-');
        if is_first {
            self.lines.entry(line).or_insert(Line::At(column));
        }
    }

    /// The distance from the sign of an item in the same line.
    fn behind_sign(&self, at: usize) -> Option<usize> {
        let before = self.text.get(..at)?;
        let blanks = before.len() - before.trim_end_matches(' ').len();
        before.trim_end_matches(' ').ends_with('-').then_some(blanks + 1)
    }

    fn line(&self, at: usize) -> usize {
        self.starts.partition_point(|start| *start <= at).saturating_sub(1)
    }
}

fn starts(text: &str) -> Vec<usize> {
    let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
    [0].into_iter().chain(ends.map(|(at, _)| at + 1)).collect()
}

fn indent(line: &str) -> usize {
    line.len() - line.trim_start_matches(' ').len()
}

pub(super) fn is_flow(text: &str, node: &Node) -> bool {
    text.get(node.place.from as usize..).is_some_and(|rest| rest.starts_with(['{', '[']))
}

/// The start of a text, its quote included.
pub(super) fn start(text: &str, from: u32) -> usize {
    let from = from as usize;
    let is_quoted = text.get(..from).is_some_and(|before| before.ends_with(['"', '\'']));
    from - usize::from(is_quoted)
}

/// The end of a text, its quote included.
pub(super) fn end_of_scalar(text: &str, to: u32) -> usize {
    let to = to as usize;
    to + usize::from(text.get(to..).is_some_and(|rest| rest.starts_with(['"', '\''])))
}

fn start_of(text: &str, node: &Node) -> usize {
    match node.value {
        Value::Scalar(_) => start(text, node.place.from),
        _ => node.place.from as usize,
    }
}

/// The end of a value, its quote included.
pub(super) fn end_of(text: &str, node: &Node) -> usize {
    let last = match &node.value {
        Value::Map(entries) if !is_flow(text, node) => entries.last().map(|(_, node)| node),
        Value::List(items) if !is_flow(text, node) => items.last(),
        _ => None,
    };
    match (last, &node.value) {
        (Some(last), _) => end_of(text, last),
        (None, Value::Scalar(_)) => end_of_scalar(text, node.place.to),
        (None, _) => node.place.to as usize,
    }
}
