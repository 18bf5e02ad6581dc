//! Messages of Protocol Buffers: the fields of types, from file descriptors, and their places in the bytes.
//!
//! Format: <https://protobuf.dev/programming-guides/encoding>; the descriptors are messages of `descriptor.proto`. Only the
//! fields on the path to the wanted one are read; nothing is built.

mod kind;
mod absent;
mod fit;

use crate::MessageError;
use crate::path::{Step, is_text};
use crate::wire::{Fields, Wire, put_bytes};
use absent::{Absent, Presence};
use kind::Kind;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The deepest nesting of types in a path or a descriptor.
const DEPTH_MAX: usize = 32;

/// The number of a field's descriptor in that of its type.
const FIELD: u64 = 2;

/// A field of a type.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Member {
    name: String,
    number: u64,
    kind: Kind,
    is_list: bool,
    /// The type of an enumeration.
    enumeration: Option<String>,
    absent: Absent,
}

/// Types by their full names, without a leading dot. A definition is parsed when its type is first asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Types {
    messages: BTreeMap<String, Definition>,
    /// The numbers of the names of enumerations.
    enumerations: BTreeMap<String, BTreeMap<String, i64>>,
}

/// The definition of a type.
#[derive(Clone, Debug)]
struct Definition {
    /// The descriptors of its fields, each with its length.
    fields: Vec<u8>,
    presence: Presence,
    members: OnceLock<Vec<Member>>,
}

/// A value found in a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// A number.
    Number(f64),
    /// A list of numbers.
    Numbers(Vec<f64>),
    /// A text.
    Text(String),
    /// A list of texts.
    Texts(Vec<String>),
    /// Seconds and nanoseconds.
    Time(i64, i64),
}

/// The path to a field.
#[derive(Clone, Debug)]
pub struct Plan {
    /// For each step the field's number, and the wanted element.
    steps: Vec<(u64, Option<usize>)>,
    last: Member,
    /// The path to the field within each element of the list to which the steps lead.
    each: Option<Box<Plan>>,
}

impl Types {
    /// The types of a serialised `FileDescriptorSet`; invalid parts are skipped.
    #[must_use]
    pub fn of_descriptors(set: &[u8]) -> Types {
        let mut types = Types::default();
        for (_, file) in Fields::of(set).filter(|(number, _)| *number == 1) {
            let Wire::Bytes(file) = file else { continue };
            let package = text(file, 2).unwrap_or_default();
            let presence = Presence::of_file(file);
            for (number, part) in Fields::of(file) {
                match (number, part) {
                    (4, Wire::Bytes(message)) => types.add(&package, message, presence, 0),
                    (5, Wire::Bytes(enumeration)) => types.add_enumeration(&package, enumeration),
                    _ => {}
                }
            }
        }
        types
    }

    fn add(&mut self, scope: &str, message: &[u8], presence: Presence, depth: usize) {
        let Some(name) = text(message, 1).filter(|_| depth < DEPTH_MAX) else { return };
        let name = within(scope, name);
        let presence = presence.of_message(message);
        let mut fields = Vec::new();
        for (number, part) in Fields::of(message) {
            match (number, part) {
                (FIELD, Wire::Bytes(field)) => put_bytes(FIELD, field, &mut fields),
                (3, Wire::Bytes(nested)) => self.add(&name, nested, presence, depth + 1),
                (4, Wire::Bytes(enumeration)) => self.add_enumeration(&name, enumeration),
                _ => {}
            }
        }
        self.messages.insert(name, Definition { fields, presence, members: OnceLock::new() });
    }

    fn add_enumeration(&mut self, scope: &str, enumeration: &[u8]) {
        let Some(name) = text(enumeration, 1) else { return };
        let values = Fields::of(enumeration).filter_map(|(number, value)| match (number, value) {
            (2, Wire::Bytes(value)) => Some((text(value, 1)?, number_of(value, 2).unwrap_or(0) as i64)),
            _ => None,
        });
        let values = values.collect();
        self.enumerations.insert(within(scope, name), values);
    }

    fn members(&self, name: &str) -> Result<&[Member], MessageError> {
        let unknown = || MessageError::UnknownType { name: name.to_owned(), near: None };
        self.messages.get(name).map(Definition::members).ok_or_else(unknown)
    }

    /// Appends the paths of all numbers, texts and lists of them in a type, until there are `at_most`; of a list of messages,
    /// those of the first one.
    pub fn paths(&self, name: &str, from: &str, at_most: usize, paths: &mut Vec<String>) {
        let depth = from.matches('.').count();
        for member in self.members(name).unwrap_or_default() {
            let dot = if from.is_empty() { "" } else { "." };
            let element = if member.is_list && matches!(member.kind, Kind::Message(_)) { "[0]" } else { "" };
            let path = format!("{from}{dot}{}{element}", member.name);
            match &member.kind {
                _ if paths.len() >= at_most => return,
                Kind::Message(inner) if depth < DEPTH_MAX => self.paths(inner, &path, at_most, paths),
                Kind::Message(_) | Kind::Bytes => {}
                _ => paths.push(path),
            }
        }
    }
}

impl PartialEq for Definition {
    fn eq(&self, other: &Definition) -> bool {
        self.members() == other.members()
    }
}

impl Eq for Definition {}

impl Definition {
    fn members(&self) -> &[Member] {
        self.members.get_or_init(|| {
            let fields = Fields::of(&self.fields).filter_map(|(_, field)| match field {
                Wire::Bytes(field) => member(field, self.presence),
                Wire::Number(_) => None,
            });
            fields.collect()
        })
    }
}

/// The full name of what is defined in a package or a type.
fn within(scope: &str, name: String) -> String {
    if scope.is_empty() { name } else { format!("{scope}.{name}") }
}

fn member(field: &[u8], presence: Presence) -> Option<Member> {
    let number = |asked: u64| number_of(field, asked);
    let kind = match number(5)? {
        1 => Kind::Double,
        2 => Kind::Float,
        3 | 5 | 14 => Kind::Signed,
        4 | 8 | 13 => Kind::Unsigned,
        6 => Kind::Fixed64,
        7 => Kind::Fixed32,
        9 => Kind::Text,
        11 => Kind::Message(text(field, 6)?.trim_start_matches('.').to_owned()),
        12 => Kind::Bytes,
        15 => Kind::SignedFixed32,
        16 => Kind::SignedFixed64,
        17 | 18 => Kind::Folded,
        _ => return None,
    };
    let type_name = || text(field, 6).map(|name| name.trim_start_matches('.').to_owned());
    Some(Member {
        name: text(field, 1)?,
        number: number(3)?,
        kind,
        is_list: number(4) == Some(3),
        enumeration: if number(5) == Some(14) { type_name() } else { None },
        absent: Absent::of(field, presence),
    })
}

/// The number in a field of a message; `None` where it is not there.
fn number_of(message: &[u8], asked: u64) -> Option<u64> {
    Fields::of(message).filter(|(number, _)| *number == asked).find_map(|(_, value)| match value {
        Wire::Number(value) => Some(value),
        Wire::Bytes(_) => None,
    })
}

fn text(message: &[u8], asked: u64) -> Option<String> {
    Fields::of(message).filter(|(number, _)| *number == asked).find_map(|(_, value)| match value {
        Wire::Bytes(bytes) => std::str::from_utf8(bytes).ok().map(str::to_owned),
        Wire::Number(_) => None,
    })
}

impl Plan {
    /// The path to a field within a type. Without steps: the field `data`.
    ///
    /// # Errors
    /// The part of the path that does not exist, and the existing ones.
    pub fn new(types: &Types, name: &str, path: &[Step]) -> Result<Plan, MessageError> {
        let data = [Step::Key("data".into())];
        let path = if path.is_empty() { &data } else { path };
        let (mut owner, mut steps, mut last) = (name, Vec::new(), None);
        let mut path = path.iter().peekable();
        while let Some(step) = path.next() {
            let Step::Key(name) = step else { return Err(MessageError::NoList(owner.to_owned())) };
            let members = types.members(owner)?;
            let Some(member) = members.iter().find(|member| member.name == *name) else {
                return Err(MessageError::UnknownField {
                    name: name.clone(),
                    owner: owner.to_owned(),
                    known: members.iter().map(|member| member.name.clone()).collect(),
                });
            };
            let index = path.peek().and_then(|step| step.index()).filter(|_| member.is_list);
            if index.is_some() {
                path.next();
            }
            steps.push((member.number, index));
            match (&member.kind, path.peek()) {
                (_, Some(Step::Each)) if !member.is_list || index.is_some() => {
                    return Err(MessageError::NoList(format!("'{name}'")));
                }
                (Kind::Message(inner), Some(Step::Each)) => {
                    let rest: Vec<Step> = path.skip(1).cloned().collect();
                    let each = Plan::new(types, inner, &rest)?;
                    if each.last.is_list && each.steps.last().is_some_and(|(_, index)| index.is_none()) {
                        return Err(MessageError::List(each.last.name));
                    }
                    return Ok(Plan { steps, last: member.clone(), each: Some(Box::new(each)) });
                }
                (Kind::Message(_), Some(_)) if member.is_list && index.is_none() => {
                    return Err(MessageError::List(name.clone()));
                }
                (Kind::Message(inner), Some(_)) => owner = inner,
                (_, Some(_)) => return Err(MessageError::NoParts(name.clone())),
                (_, None) => last = Some(types.resolved(member)),
            }
        }
        Ok(Plan { steps, last: last.ok_or(MessageError::NoField)?, each: None })
    }

    /// Whether the field is a number or a time.
    #[must_use]
    pub fn is_number(&self) -> bool {
        if let Some(each) = &self.each {
            return each.is_number();
        }
        match &self.last.kind {
            Kind::Message(name) => is_time(name),
            Kind::Text | Kind::Bytes => false,
            _ => true,
        }
    }

    /// The value of the field in a message. Where it is not on the wire, it is zero or empty, its default, or missing, as its
    /// definition says. `None` where it is missing, a message on the path is missing, a list has no such element, or the bytes are
    /// no message. `O(message)`.
    #[must_use]
    pub fn find(&self, message: &[u8]) -> Option<Found> {
        let (last, way) = self.steps.split_last()?;
        let mut message = message;
        for (number, index) in way {
            let of_field = Fields::of(message).filter(|(known, _)| known == number);
            let mut parts = of_field.filter_map(|(_, value)| match value {
                Wire::Bytes(bytes) => Some(bytes),
                Wire::Number(_) => None,
            });
            message = match index {
                Some(index) => parts.nth(*index)?,
                // Of a repeated field, the last one counts.
                None => parts.last()?,
            };
        }
        let values = Fields::of(message).filter(|(known, _)| *known == last.0).map(|(_, value)| value);
        self.of_last(values, last.1)
    }

    fn of_last<'a>(&self, values: impl Iterator<Item = Wire<'a>>, index: Option<usize>) -> Option<Found> {
        if let Some(each) = &self.each {
            return each.of_each(values);
        }
        match &self.last.kind {
            Kind::Bytes => None,
            Kind::Message(name) if is_time(name) => match values.last()? {
                Wire::Bytes(time) => {
                    let part = |asked: u64| {
                        let found = Fields::of(time).filter(|(number, _)| *number == asked).last();
                        found.map_or(0, |(_, value)| if let Wire::Number(it) = value { it as i64 } else { 0 })
                    };
                    Some(Found::Time(part(1), part(2)))
                }
                Wire::Number(_) => None,
            },
            Kind::Message(_) => None,
            Kind::Text => {
                let texts: Vec<String> = values
                    .filter_map(|value| match value {
                        Wire::Bytes(bytes) => Some(String::from_utf8_lossy(bytes).into_owned()),
                        Wire::Number(_) => None,
                    })
                    .collect();
                match (self.last.is_list, index) {
                    (true, Some(index)) => texts.into_iter().nth(index).map(Found::Text),
                    (true, None) => Some(Found::Texts(texts)),
                    (false, _) => {
                        texts.into_iter().next_back().or_else(|| self.last.absent.text()).map(Found::Text)
                    }
                }
            }
            kind if self.last.is_list => match index {
                Some(index) => {
                    let (mut at, mut found) = (0, None);
                    kind.each(values, &mut |number| {
                        found = found.or((at == index).then_some(number));
                        at += 1;
                    })?;
                    found.map(Found::Number)
                }
                None => {
                    let mut numbers = Vec::new();
                    kind.each(values, &mut |number| numbers.push(number))?;
                    Some(Found::Numbers(numbers))
                }
            },
            kind => {
                let mut last = None;
                kind.each(values, &mut |number| last = Some(number))?;
                last.or_else(|| self.last.absent.number()).map(Found::Number)
            }
        }
    }

    /// The field of each element of a list; a number that is missing in one of them has no value.
    fn of_each<'a>(&self, elements: impl Iterator<Item = Wire<'a>>) -> Option<Found> {
        let found = elements.map(|element| match element {
            Wire::Bytes(message) => self.find(message),
            Wire::Number(_) => None,
        });
        if self.last.kind == Kind::Text {
            let text = |found| if let Some(Found::Text(text)) = found { text } else { String::new() };
            return Some(Found::Texts(found.map(text).collect()));
        }
        let number = |found| match found {
            Some(Found::Number(number)) => number,
            Some(Found::Time(seconds, nanoseconds)) => seconds as f64 + nanoseconds as f64 * 1e-9,
            _ => f64::NAN,
        };
        Some(Found::Numbers(found.map(number).collect()))
    }
}

impl Found {
    /// Whether the value is the wanted text: `Some(None)` for a single value, the first matching element of a list.
    #[must_use]
    pub fn says(&self, asked: &str) -> Option<Option<usize>> {
        match self {
            Found::Number(number) => is_text(&number.to_string(), asked).then_some(None),
            Found::Text(text) => is_text(text, asked).then_some(None),
            Found::Numbers(all) => all.iter().position(|it| is_text(&it.to_string(), asked)).map(Some),
            Found::Texts(all) => all.iter().position(|it| is_text(it, asked)).map(Some),
            Found::Time(..) => None,
        }
    }
}

/// Whether a type is a point in time or a duration.
fn is_time(name: &str) -> bool {
    matches!(name, "google.protobuf.Timestamp" | "google.protobuf.Duration")
}

#[cfg(test)]
mod tests;
