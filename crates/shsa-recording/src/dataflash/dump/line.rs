//! A line of a dump: the time, the kind and the fields of a message, as text or as JSON.

use shsa_core::time::{Span, Time};
use shsa_message::json::{Kind, Place, Visitor, elements, unescaped, walk};
use shsa_message::moment::{DateOrder, Moment, moment};
use shsa_message::number::float;
use shsa_message::stamp::decimal;
use shsa_message::zone::Zone;
use std::borrow::Cow;

use super::super::super::topic::Value;

const SECOND: Span = Span(1_000_000_000);

/// The length of `2017-09-10 10:49:22.70`.
const DATE_LENGTH: usize = 22;

/// What names the sender where the dump shows it.
const SENDER: [&str; 2] = ["srcSystem", "srcComponent"];

/// The time of a line.
#[derive(Clone, Copy)]
pub(super) enum At {
    /// The date that the clock of a place showed, to the hundredth of a second.
    Shown(Moment),
    /// Seconds since the epoch.
    Epoch(Time),
}

/// A message in a line.
pub(super) struct Message<'a> {
    pub(super) at: At,
    pub(super) name: Cow<'a, str>,
    /// The sender's numbers, where the dump shows them.
    pub(super) tags: Vec<(&'static str, String)>,
    pub(super) fields: Vec<(Cow<'a, str>, Cell<'a>)>,
}

/// The value of a field.
pub(super) enum Cell<'a> {
    Null,
    /// A number or a text without quotes.
    Plain(&'a str),
    Text(Cow<'a, str>),
    /// Numbers, and the text that holds them.
    List(Vec<f64>, &'a str),
}

impl Cell<'_> {
    /// The value, for a field that is a text or not by its definition.
    pub(super) fn value(&self, is_text: bool) -> Value<'_> {
        match self {
            Cell::Null => Value::Missing,
            Cell::Text(text) => Value::Text(text),
            Cell::Plain(text) if is_text => Value::Text(text),
            Cell::Plain("qnan") => Value::Number(f64::NAN),
            Cell::Plain(text) => {
                let whole = text.parse().ok().map(Value::Whole);
                whole.or_else(|| float(text).map(Value::Number)).unwrap_or(Value::Text(text))
            }
            Cell::List(_, text) if is_text => Value::Text(text),
            Cell::List(items, _) => Value::List(items),
        }
    }

    fn text(&self) -> Option<&str> {
        match self {
            Cell::Plain(text) => Some(text),
            Cell::Text(text) => Some(text),
            Cell::Null | Cell::List(..) => None,
        }
    }
}

impl Message<'_> {
    /// The text of a field.
    pub(super) fn text(&self, name: &str) -> Option<&str> {
        self.fields.iter().find(|(known, _)| known == name)?.1.text()
    }

    /// A field that is a whole number.
    pub(super) fn whole(&self, name: &str) -> Option<i64> {
        self.text(name)?.parse().ok()
    }
}

/// The message in a line; `columns` returns the names of the fields of a kind where they are known.
pub(super) fn message<'a, 'k>(
    line: &'a str,
    zone: &Zone,
    columns: impl Fn(&str) -> Option<Vec<&'k str>>,
) -> Option<Message<'a>> {
    let line = line.trim();
    if line.starts_with('{') { of_json(line) } else { of_text(line, zone, columns) }
}

/// Whether a line that cannot be read was one of a message: no other word of the tool, and none about what it could not read
/// itself.
pub(super) fn is_likely(line: &str) -> bool {
    let is_unread = [": BAD_DATA {", ": UNKNOWN_"].iter().any(|kind| line.contains(kind));
    !is_unread && (line.trim_start().starts_with('{') || line.contains(" : ") || line.contains(" {"))
}

/// `2017-09-10 10:49:22.70: IMU {TimeUS : 402644506, GyrX : -0.07}`, and perhaps ` srcSystem=1 srcComponent=1 seq=5`.
fn of_text<'a, 'k>(
    line: &'a str,
    zone: &Zone,
    columns: impl Fn(&str) -> Option<Vec<&'k str>>,
) -> Option<Message<'a>> {
    let (date, rest) = line.split_at_checked(DATE_LENGTH)?;
    let (name, rest) = rest.strip_prefix(": ")?.split_once(" {")?;
    let (body, behind) = rest.rsplit_once('}')?;
    if !is_name(name) {
        return None;
    }
    let mut tags = Vec::new();
    for word in behind.split_whitespace() {
        let (key, number) = word.split_once('=').filter(|(_, it)| it.parse::<u64>().is_ok())?;
        tags.extend(SENDER.iter().filter(|known| **known == key).map(|known| (*known, number.to_owned())));
    }
    let at = moment(date, DateOrder::YearMonthDay, zone)?;
    let known = columns(name).and_then(|columns| known_fields(body, &columns));
    let fields = known.or_else(|| fields(body))?;
    let fields = fields.into_iter().map(|(name, text)| (name.into(), of_word(text))).collect();
    Some(Message { at: At::Shown(at), name: name.into(), tags, fields })
}

fn is_name(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(is_letter)
}

fn is_letter(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// The fields of these names, in this order: then a text may hold what separates fields.
fn known_fields<'a>(body: &'a str, columns: &[&str]) -> Option<Vec<(&'a str, &'a str)>> {
    let mut rest = body;
    let mut found = Vec::with_capacity(columns.len());
    for (index, column) in columns.iter().enumerate() {
        let value = rest.strip_prefix(column)?.strip_prefix(" : ")?;
        let next = columns.get(index + 1);
        let end = next.map_or(Some(value.len()), |next| value.find(&format!(", {next} : ")))?;
        found.push((&rest[..column.len()], &value[..end]));
        rest = value.get(end + 2..).unwrap_or_default();
    }
    Some(found)
}

/// The fields that a line itself tells apart.
fn fields(body: &str) -> Option<Vec<(&str, &str)>> {
    let mut found = Vec::new();
    let mut rest = Some(body).filter(|body| !body.is_empty());
    while let Some(field) = rest {
        let (name, value) = field.split_once(" : ").filter(|(name, _)| is_name(name))?;
        let end = value.match_indices(", ").map(|(at, _)| at).find(|at| is_field(&value[at + 2..]));
        found.push((name, end.map_or(value, |end| &value[..end])));
        rest = end.map(|end| &value[end + 2..]);
    }
    Some(found)
}

/// Whether a text begins as a field does: `Roll : `.
fn is_field(text: &str) -> bool {
    let length = text.bytes().take_while(|byte| is_letter(*byte)).count();
    length > 0 && text[length..].starts_with(" : ")
}

/// A word of a text: `[1, 2]` and `array('h', [1, 2])` are lists.
fn of_word(text: &str) -> Cell<'_> {
    let inner = text.strip_prefix("array(").and_then(|rest| rest.strip_suffix(')'));
    let list = inner.and_then(|inner| Some(inner.split_once(", ")?.1)).unwrap_or(text);
    let items = list.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let items = items.map(|items| items.split(',').map(|item| float(item.trim())).collect::<Option<_>>());
    items.flatten().map_or(Cell::Plain(text), |items| Cell::List(items, text))
}

/// `{"meta": {"type": "IMU", "timestamp": 1505040562.709132}, "data": {"TimeUS": 402644506, "GyrX": -0.07}}`.
fn of_json(line: &str) -> Option<Message<'_>> {
    let mut members = Members::default();
    walk(line, Node::Root, &mut members).ok().filter(|()| members.has_data)?;
    let meta = |name: &str| members.meta.iter().find(|(known, _)| known == name).map(|(_, place)| *place);
    let kind = meta("type").filter(|place| place.kind == Kind::Text)?;
    let time = meta("timestamp").filter(|place| place.kind == Kind::Number)?;
    let at = At::Epoch(decimal(time.of(line), SECOND)?);
    let tag = |name: &&'static str| Some((*name, meta(name)?.of(line).to_owned()));
    let tags = SENDER.iter().filter_map(tag).collect();
    let fields = members.data.into_iter().map(|(name, place)| (name.into(), of_place(line, place))).collect();
    Some(Message { at, name: unescaped(kind.of(line)), tags, fields })
}

fn of_place(line: &str, place: Place) -> Cell<'_> {
    match place.kind {
        Kind::Number => Cell::Plain(place.of(line)),
        Kind::True => Cell::Plain("1"),
        Kind::False => Cell::Plain("0"),
        Kind::Text => Cell::Text(unescaped(place.of(line))),
        Kind::List => list(line, place),
        Kind::Null | Kind::Object => Cell::Null,
    }
}

fn list(line: &str, place: Place) -> Cell<'_> {
    let mut items = Some(Vec::new());
    elements(line, place, |_, item| {
        let number = if item.kind == Kind::Number { float(item.of(line)) } else { None };
        items = items.take().zip(number).map(|(mut items, number)| {
            items.push(number);
            items
        });
        items.is_some()
    });
    items.map_or(Cell::Null, |items| Cell::List(items, place.of(line)))
}

/// What a line of JSON has in its two objects.
#[derive(Default)]
struct Members {
    meta: Vec<(String, Place)>,
    data: Vec<(String, Place)>,
    has_data: bool,
}

/// A value of a line of JSON.
#[derive(Clone, Copy)]
enum Node {
    Root,
    Meta,
    Data,
    OfMeta(usize),
    OfData(usize),
}

/// Where a member is until its end is known.
const OPEN: Place = Place { kind: Kind::Null, from: 0, to: 0 };

impl Visitor for Members {
    type Node = Node;

    fn member(&mut self, of: Node, name: &str) -> Option<Node> {
        match (of, name) {
            (Node::Root, "meta") => Some(Node::Meta),
            (Node::Root, "data") => Some(Node::Data),
            (Node::Meta, _) => {
                self.meta.push((unescaped(name).into_owned(), OPEN));
                Some(Node::OfMeta(self.meta.len() - 1))
            }
            (Node::Data, _) => {
                self.data.push((unescaped(name).into_owned(), OPEN));
                Some(Node::OfData(self.data.len() - 1))
            }
            _ => None,
        }
    }

    fn element(&mut self, _of: Node, _index: usize) -> Option<Node> {
        None
    }

    fn enter(&mut self, _node: Node) {}

    fn leave(&mut self, node: Node, place: Place) {
        match node {
            Node::Root | Node::Meta => {}
            Node::Data => self.has_data = place.kind == Kind::Object,
            Node::OfMeta(at) => set(&mut self.meta, at, place),
            Node::OfData(at) => set(&mut self.data, at, place),
        }
    }
}

fn set(members: &mut [(String, Place)], at: usize, place: Place) {
    if let Some(member) = members.get_mut(at) {
        member.1 = place;
    }
}
