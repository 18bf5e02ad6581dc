//! The tree of a YAML text, each node with its place; JSON is a part of YAML 1.2 and can be read with it.
//!
//! Bounded against hostile texts: nesting and the copies of aliases are limited, so that time and space are linear in the text.

use granit_parser::{ErrorKind, Event, Parser, ScalarStyle, ScanError, Span};
use shsa_core::knowledge::{Diagnostic, Place, Text};
use std::collections::{BTreeMap, BTreeSet};
use std::mem::replace;

use super::lines::Lines;
use super::{cut, problem};

/// The deepest nesting of lists and mappings, for block and flow style separately.
pub(crate) const MAX_DEPTH: usize = 64;
/// How much of a line is searched for tabs.
const MAX_INDENT: usize = 1_000;
/// The most keys that are compared pairwise, without sorting.
const FEW: usize = 12;
/// The most values of a model; each takes about a hundred bytes.
const MAX_NODES: usize = 4_000_000;
/// The most nodes that all aliases together may copy.
const MAX_COPIED: usize = 10_000;
/// The most nodes that are kept for aliases; nested anchors count again.
const MAX_KEPT: usize = 100_000;

/// A value of the text.
#[derive(Clone, Debug)]
pub struct Node {
    /// The place of the value in the text.
    pub place: Place,
    /// The value.
    pub value: Value,
}

/// The kinds of values.
#[derive(Clone, Debug)]
pub enum Value {
    /// Nothing, or `null`.
    Null,
    /// A word, a number, or a text in quotes.
    Scalar(Text),
    /// A list.
    List(Vec<Node>),
    /// A mapping, in the order of the text.
    Map(Vec<(Text, Node)>),
    /// A mapping that is read from its place when needed; never in a tree of [`read`].
    Unread,
}

/// The result of reading a text.
#[derive(Default)]
pub struct Tree {
    /// `None` when the text is empty or broken.
    pub root: Option<Node>,
    /// The starts of scalars whose text differs from the source (escapes, folded lines); they get no spans.
    pub rewritten: BTreeSet<u32>,
    /// The problems of the text as YAML.
    pub problems: Vec<Diagnostic>,
}

/// Reads one document; the first syntax error ends the reading.
#[must_use]
pub fn read(source: &str) -> Tree {
    let mut options = granit_parser::Options::default();
    options.flow_nesting_limit = MAX_DEPTH;
    options.block_nesting_limit = MAX_DEPTH;
    let mut builder = Builder {
        source,
        lines: Lines::new(source),
        open: Vec::new(),
        anchors: BTreeMap::new(),
        made: 0,
        kept: 0,
        copied: 0,
        tree: Tree::default(),
    };
    for event in Parser::new_from_str_with_options(source, options) {
        let go_on = match event {
            Ok((event, span)) => builder.event(event, span),
            Err(error) => builder.broken(&error),
        };
        if !go_on {
            break;
        }
    }
    builder.tree
}

/// A list or mapping that is still open.
struct Open {
    from: u32,
    anchor: usize,
    /// The number of nodes before it.
    before: usize,
    children: Children,
}

enum Children {
    List(Vec<Node>),
    Map { entries: Vec<(Text, Node)>, key: Key },
}

/// The state of a mapping between two events.
enum Key {
    Missing,
    Read(Text),
    /// The value belongs to a key that was reported.
    Refused,
}

struct Builder<'a> {
    source: &'a str,
    lines: Lines<'a>,
    open: Vec<Open>,
    /// Anchored nodes with their sizes, if small enough to be copied.
    anchors: BTreeMap<usize, (Node, usize)>,
    made: usize,
    kept: usize,
    copied: usize,
    tree: Tree,
}

impl Builder<'_> {
    /// Takes one event; returns whether to continue.
    fn event(&mut self, event: Event, span: Span) -> bool {
        let place = place(&span);
        if self.made >= MAX_NODES {
            self.refuse(place, &format!("more than {MAX_NODES} values"), "is this a model?");
            return false;
        }
        match event {
            Event::DocumentStart(..) if self.tree.root.is_some() => {
                let message = "a second document begins here";
                let help = "a model is one document: remove the `---`";
                self.tree.problems.push(problem(place, message, Some(help)));
                return false;
            }
            Event::Scalar(text, style, anchor, _) => {
                let node = self.scalar(&text, style, place);
                self.finish(node, anchor, self.made);
            }
            Event::SequenceStart(_, anchor, _) => self.begin(place, anchor, Children::List(Vec::new())),
            Event::MappingStart(_, anchor, _) => {
                self.begin(place, anchor, Children::Map { entries: Vec::new(), key: Key::Missing });
            }
            Event::SequenceEnd | Event::MappingEnd => self.end(place),
            Event::Alias(anchor) => return self.alias(anchor, place),
            _ => {}
        }
        true
    }

    fn begin(&mut self, place: Place, anchor: usize, children: Children) {
        self.open.push(Open { from: place.from, anchor, before: self.made, children });
    }

    fn end(&mut self, end: Place) {
        let Some(open) = self.open.pop() else { return };
        let place = Place { from: open.from, to: end.to.max(open.from) };
        let value = match open.children {
            Children::List(items) => Value::List(items),
            Children::Map { entries, .. } => {
                let entries = match self.is_in_braces(open.from) {
                    true => cut::joined(self.source, entries, &mut self.tree.problems),
                    false => entries,
                };
                Value::Map(without_duplicates(entries, &self.lines, &mut self.tree.problems))
            }
        };
        self.finish(Node { place, value }, open.anchor, open.before);
    }

    fn is_in_braces(&self, from: u32) -> bool {
        self.source.as_bytes().get(from as usize) == Some(&b'{')
    }

    /// The value that a comma has cut in the mapping that is read.
    fn cut(&self) -> Option<Diagnostic> {
        let maps = self.open.iter().rev().filter(|open| self.is_in_braces(open.from));
        let mut entries = maps.filter_map(|open| match &open.children {
            Children::Map { entries, .. } => Some(entries),
            Children::List(_) => None,
        });
        cut::broken(self.source, entries.next()?)
    }

    /// Adds a complete node to its parent; `before` is the number of nodes before its first.
    fn finish(&mut self, node: Node, anchor: usize, before: usize) {
        self.made += 1;
        let size = self.made - before;
        if anchor > 0 && size <= MAX_COPIED && self.kept + size <= MAX_KEPT {
            self.kept += size;
            self.anchors.insert(anchor, (node.clone(), size));
        }
        match self.open.last_mut().map(|open| &mut open.children) {
            None => self.tree.root = Some(node),
            Some(Children::List(items)) => items.push(node),
            Some(Children::Map { entries, key }) => match replace(key, Key::Missing) {
                Key::Read(name) => entries.push((name, node)),
                Key::Refused => {}
                Key::Missing => match key_of(node) {
                    Ok(name) => *key = Key::Read(name),
                    Err(place) => {
                        *key = Key::Refused;
                        let message = "this key is not a word";
                        self.tree.problems.push(problem(place, message, Some("a key is written `name:`")));
                    }
                },
            },
        }
    }

    fn scalar(&mut self, text: &str, style: ScalarStyle, place: Place) -> Node {
        let plain = style == ScalarStyle::Plain;
        if plain && matches!(text, "" | "~" | "null" | "Null" | "NULL") {
            return Node { place, value: Value::Null };
        }
        let text = Text {
            text: text.trim().to_owned(),
            place: narrowed(self.source, text.trim(), place, &mut self.tree.rewritten),
        };
        Node { place, value: Value::Scalar(text) }
    }

    fn alias(&mut self, anchor: usize, place: Place) -> bool {
        let copy = self.anchors.get(&anchor).filter(|(_, size)| self.copied + size <= MAX_COPIED).cloned();
        let Some((node, size)) = copy else {
            let message = "this alias repeats itself or too much";
            let help = format!("aliases may copy {MAX_COPIED} values in all: write the values out");
            self.refuse(place, message, &help);
            return false;
        };
        self.copied += size;
        self.made += size - 1;
        self.finish(node, 0, self.made);
        true
    }

    /// Reports why the whole text is not read.
    fn refuse(&mut self, place: Place, message: &str, help: &str) {
        self.tree.problems.push(problem(place, message, Some(help)));
        self.tree.root = None;
    }

    fn broken(&mut self, error: &ScanError) -> bool {
        let at = offset(error.marker().byte_offset().unwrap_or(0).min(self.source.len()));
        let message = match error.kind() {
            ErrorKind::RecursionLimitExceeded => format!("nested more than {MAX_DEPTH} levels deep"),
            _ => format!("this is no YAML: {}", error.info()),
        };
        let indented_by_tab =
            self.lines.part(at as usize, MAX_INDENT, 1).1.trim_start_matches(' ').starts_with('\t');
        let help = indented_by_tab.then_some("indent with blanks, not with tabs");
        let problem = match self.cut() {
            Some(cut) => {
                self.tree.problems.retain(|it| it.place.from < cut.place.from);
                cut
            }
            None => problem(Place { from: at, to: at }, &message, help),
        };
        self.tree.problems.push(problem);
        self.tree.root = None;
        false
    }
}

/// The place of the text without quotes, when the source holds the text unchanged.
pub(crate) fn narrowed(source: &str, text: &str, place: Place, rewritten: &mut BTreeSet<u32>) -> Place {
    let written = source.get(place.from as usize..place.to as usize).unwrap_or("");
    match written.find(text) {
        Some(at) => {
            let from = place.from + offset(at);
            Place { from, to: from + offset(text.len()) }
        }
        None => {
            rewritten.insert(place.from);
            place
        }
    }
}

/// Reports duplicate keys and drops the later ones.
pub(crate) fn without_duplicates(
    mut entries: Vec<(Text, Node)>,
    lines: &Lines,
    problems: &mut Vec<Diagnostic>,
) -> Vec<(Text, Node)> {
    if entries.len() <= FEW {
        let is_new = |at: usize| entries[..at].iter().all(|(name, _)| name.text != entries[at].0.text);
        if (1..entries.len()).all(is_new) {
            return entries;
        }
    }
    let mut order: Vec<usize> = (0..entries.len()).collect();
    order.sort_by(|&a, &b| entries[a].0.text.cmp(&entries[b].0.text).then(a.cmp(&b)));
    let mut first = order.first().copied().unwrap_or(0);
    let mut doubled = BTreeSet::new();
    for &next in order.iter().skip(1) {
        let (earlier, later) = (&entries[first].0, &entries[next].0);
        if earlier.text == later.text {
            let line = lines.number(earlier.place.from as usize);
            let message = format!("`{}` is given twice", later.text);
            let help = format!("it is given in line {line} already: keep one");
            problems.push(problem(later.place, &message, Some(&help)));
            doubled.insert(next);
        } else {
            first = next;
        }
    }
    let mut index = 0;
    entries.retain(|_| {
        index += 1;
        !doubled.contains(&(index - 1))
    });
    entries
}

fn key_of(node: Node) -> Result<Text, Place> {
    match node.value {
        Value::Scalar(text) => Ok(text),
        _ => Err(node.place),
    }
}

fn place(span: &Span) -> Place {
    let from = offset(span.start.byte_offset().unwrap_or(0));
    Place { from, to: offset(span.end.byte_offset().unwrap_or(0)).max(from) }
}

/// The byte offsets of a source of at most [`super::MAX_BYTES`] fit.
pub(crate) fn offset(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}
