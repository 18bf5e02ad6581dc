//! Messages of random definitions, written in both versions by an encoder of these tests.

use super::super::layout::{Body, Layout};
use super::super::{Extent, Plan};
use super::*;
use crate::path::Path;
use proptest::prelude::*;
use std::fmt::Write as _;

/// A field of a type; a message is a type of the list, by its place.
#[derive(Clone, Copy, Debug)]
enum Type {
    Number(&'static str, usize),
    Text,
    Message(usize),
}

/// A value.
#[derive(Clone, Debug)]
enum Value {
    Number(u64, usize),
    Text(Vec<u8>),
    Message(Vec<(Type, Length, Value)>),
    List(Vec<Value>),
}

/// How many values a field has.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Length {
    One,
    Fixed(usize),
    Free,
}

/// What looks random, from a seed (Marsaglia, "Xorshift RNGs", 2003).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, most: usize) -> usize {
        (self.next() >> 16) as usize % most
    }
}

const NUMBERS: [(&str, usize); 8] = [
    ("bool", 1),
    ("uint8", 1),
    ("int16", 2),
    ("uint32", 4),
    ("float32", 4),
    ("int64", 8),
    ("float64", 8),
    ("float64", 8),
];

/// Types of which each refers to later ones only. Those within others begin with a number: a list there could not be told from the
/// size of its message.
fn types(dice: &mut Dice) -> Vec<Vec<(Type, Length)>> {
    let count = 1 + dice.below(4);
    let field = |dice: &mut Dice, of: usize| {
        let kind = match dice.below(5) {
            0 => Type::Text,
            1 | 2 if of + 1 < count => Type::Message(of + 1 + dice.below(count - of - 1)),
            _ => {
                let (name, size) = NUMBERS[dice.below(NUMBERS.len())];
                Type::Number(name, size)
            }
        };
        let length = match dice.below(4) {
            0 => Length::Fixed(1 + dice.below(3)),
            1 => Length::Free,
            _ => Length::One,
        };
        (kind, length)
    };
    let first = (Type::Number("int64", 8), Length::One);
    let fields = |of: usize| {
        let fields: Vec<_> = (0..1 + dice.below(5)).map(|_| field(dice, of)).collect();
        [&vec![first; usize::from(of > 0)][..], &fields].concat()
    };
    (0..count).map(fields).collect()
}

/// The definition of a type in the language of ROS 2.
fn definition(fields: &[(Type, Length)]) -> String {
    let mut text = String::new();
    for (at, (kind, length)) in fields.iter().enumerate() {
        let name = match kind {
            Type::Number(name, _) => (*name).to_owned(),
            Type::Text => "string".to_owned(),
            Type::Message(number) => format!("a/T{number}"),
        };
        let length = match length {
            Length::One => String::new(),
            Length::Fixed(count) => format!("[{count}]"),
            Length::Free => "[]".to_owned(),
        };
        writeln!(text, "{name}{length} f{at}").unwrap();
    }
    text
}

fn message(all: &[Vec<(Type, Length)>], of: usize, dice: &mut Dice) -> Value {
    let one = |kind: Type, dice: &mut Dice| match kind {
        Type::Number(_, size) => Value::Number(dice.next(), size),
        Type::Text => Value::Text((0..dice.below(6)).map(|_| b'a' + dice.below(26) as u8).collect()),
        Type::Message(number) => message(all, number, dice),
    };
    let field = |(kind, length): &(Type, Length)| {
        let value = match length {
            Length::One => one(*kind, dice),
            Length::Fixed(count) => Value::List((0..*count).map(|_| one(*kind, dice)).collect()),
            Length::Free => Value::List((0..dice.below(4)).map(|_| one(*kind, dice)).collect()),
        };
        (*kind, *length, value)
    };
    Value::Message(all[of].iter().map(field).collect())
}

/// Writes values; `change` is `None` in version 1.
struct Writer {
    bytes: Vec<u8>,
    is_big_endian: bool,
    change: Option<Change>,
}

impl Writer {
    fn align(&mut self, to: usize) {
        let to = if self.change.is_some() { to.min(4) } else { to };
        self.bytes.resize(self.bytes.len().next_multiple_of(to), 0);
    }

    fn number(&mut self, number: u64, size: usize) {
        self.align(size);
        let mut bytes = number.to_le_bytes()[..size].to_vec();
        if self.is_big_endian {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
    }

    /// Writes a size ahead of what fills it, in version 2.
    fn sized(&mut self, is_sized: bool, write: impl FnOnce(&mut Writer)) {
        if !is_sized || self.change.is_none() {
            return write(self);
        }
        self.number(0, 4);
        let from = self.bytes.len();
        write(self);
        let size = self.bytes.len() - from;
        let mut head = Writer { bytes: Vec::new(), is_big_endian: self.is_big_endian, change: self.change };
        head.number(size as u64, 4);
        self.bytes[from - 4..from].copy_from_slice(&head.bytes);
    }

    fn value(&mut self, value: &Value, within: Option<Change>) {
        match value {
            Value::Number(number, size) => self.number(*number, *size),
            Value::Text(text) => {
                self.number(text.len() as u64 + 1, 4);
                self.bytes.extend(text);
                self.bytes.push(0);
            }
            Value::Message(fields) => self.message(fields, within, within),
            Value::List(_) => unreachable!("a list is written with its field"),
        }
    }

    fn field(&mut self, kind: Type, length: Length, value: &Value, within: Option<Change>) {
        let Value::List(items) = value else { return self.value(value, within) };
        self.sized(!matches!(kind, Type::Number(..)), |writer| {
            if length == Length::Free {
                writer.number(items.len() as u64, 4);
            }
            items.iter().for_each(|item| writer.value(item, within));
        });
    }

    fn message(&mut self, fields: &[(Type, Length, Value)], change: Option<Change>, within: Option<Change>) {
        self.sized(change != Some(Change::Final), |writer| {
            if change != Some(Change::Mutable) {
                fields.iter().for_each(|(kind, length, value)| writer.field(*kind, *length, value, within));
                return;
            }
            // In another order than the definition's.
            for (number, (kind, length, value)) in fields.iter().enumerate().rev() {
                writer.numbered(number as u64, *kind, *length, value, within);
            }
        });
    }

    fn numbered(&mut self, number: u64, kind: Type, length: Length, value: &Value, within: Option<Change>) {
        let (is_big_endian, change) = (self.is_big_endian, self.change);
        let mut alone = Writer { bytes: Vec::new(), is_big_endian, change };
        alone.field(kind, length, value, within);
        let size = alone.bytes.len() as u64;
        // A list of anything but numbers begins with its size, and so does a text.
        let is_sized = length != Length::One && !matches!(kind, Type::Number(..));
        let code = match (kind, length) {
            (Type::Number(_, size), Length::One) if number.is_multiple_of(2) => {
                u64::from(size.trailing_zeros())
            }
            (Type::Text, Length::One) => 5,
            _ if is_sized => 5,
            _ => 4,
        };
        self.number(code << 28 | number, 4);
        if code == 4 {
            self.number(size, 4);
        }
        self.bytes.extend(alone.bytes);
    }
}

/// A message with its header.
fn encoded(value: &Value, is_big_endian: bool, version: Option<(Change, Change)>) -> Vec<u8> {
    let number = match version.map(|(change, _)| change) {
        None => 0,
        Some(Change::Final) => 6,
        Some(Change::Appendable) => 8,
        Some(Change::Mutable) => 10,
    };
    let Value::Message(fields) = value else { unreachable!("a message") };
    let change = version.map(|(change, _)| change);
    let mut writer = Writer { bytes: Vec::new(), is_big_endian, change };
    writer.message(fields, change, version.map(|(_, within)| within));
    [&[0, number + u8::from(!is_big_endian), 0, 0][..], &writer.bytes].concat()
}

const CHANGES: [Change; 3] = [Change::Final, Change::Appendable, Change::Mutable];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn both_versions_of_a_message_hold_the_same(seed in 1_u64.., order in any::<bool>(), cut in any::<usize>()) {
        let mut dice = Dice(seed);
        let all = types(&mut dice);
        let mut known = Types::beside(Types::standard());
        for (number, fields) in all.iter().enumerate() {
            known.add(&format!("a/msg/T{number}"), &definition(fields));
        }
        let value = message(&all, 0, &mut dice);
        let first = encoded(&value, order, None);
        let extent = Extent::new(&known, Layout::Cdr, "a/msg/T0").unwrap();
        prop_assert!(extent.fits(Body::cdr(&first).unwrap()));
        let mut found = Vec::new();
        for change in CHANGES {
            for within in CHANGES {
                let mut second = encoded(&value, order, Some((change, within)));
                prop_assert!(is_version_2(&second));
                let readings = readings(&known, "a/msg/T0", &second);
                prop_assert!(readings.contains(&first), "{:?} {:?}", all, second);
                let is_read = recode(&known, "a/msg/T0", &second, &mut found);
                prop_assert_eq!(is_read, readings.len() == 1);
                prop_assert!(!is_read || found == first);
                // Without messages within, there is one way.
                prop_assert!(is_read || all.len() > 1);
                second.extend([0; 3]);
                prop_assert_eq!(recode(&known, "a/msg/T0", &second, &mut found), is_read);
                second.push(0);
                prop_assert!(!recode(&known, "a/msg/T0", &second, &mut found) || found != first);
                // No bytes make it panic, and what is found fits the definition.
                let at = 4 + cut % (second.len() - 4);
                second[at] ^= 1 << (seed % 8);
                second.truncate(second.len() - cut % 3);
                if recode(&known, "a/msg/T0", &second, &mut found) {
                    prop_assert!(extent.fits(Body::cdr(&found).unwrap()));
                }
            }
        }
    }
}

#[test]
fn a_message_that_means_two_things_is_none() {
    let mut types = Types::beside(Types::standard());
    types.add("a/msg/A", "a/B b\n");
    types.add("a/msg/B", "uint8[] c\n");
    let mut found = Vec::new();
    // Six bytes, or a message of six bytes with a list of two.
    assert!(!recode(&types, "a/msg/A", b"\0\x07\0\x02\x06\0\0\0\x02\0\0\0\x01\x02\0\0", &mut found));
    assert!(recode(&types, "a/msg/A", b"\0\x07\0\x02\x06\0\0\0\x03\0\0\0\x01\x02\0\0", &mut found));
    assert_eq!(found, b"\0\x01\0\0\x06\0\0\0\x03\0\0\0\x01\x02");
}

/// As Fast DDS writes a type that may be appended to: the size of the message, then of each message and list of texts within.
#[test]
fn a_message_of_each_kind_as_the_standard_shows_it() {
    let mut types = Types::beside(Types::standard());
    types.add("a/msg/A", "uint8 a\nfloat64 x\nstring[] s\n");
    #[track_caller]
    fn check(types: &Types, message: &[u8]) {
        let mut found = Vec::new();
        assert!(recode(types, "a/msg/A", message, &mut found));
        let plan =
            |path: &str| Plan::new(types, Layout::Cdr, "a/msg/A", &Path::parse(path).unwrap().steps).unwrap();
        let body = Body::cdr(&found).unwrap();
        assert_eq!(plan("x").value(body, None).unwrap(), shsa_core::observation::RawValue::Number(1.5));
        assert_eq!(plan("s[0]").text(body).unwrap(), "b");
    }
    let list = b"\x0a\0\0\0\x01\0\0\0\x02\0\0\0b\0";
    let number = 1.5_f64.to_le_bytes();
    check(&types, &[&b"\0\x07\0\0\x01\0\0\0"[..], &number, list].concat());
    check(&types, &[&b"\0\x09\0\x02\x1a\0\0\0\x01\0\0\0"[..], &number, list, b"\0\0"].concat());
    let mutable = [
        &b"\0\x0b\0\0\x2a\0\0\0\0\0\0\0\x01\0\0\0\x01\0\0\x30"[..],
        &number,
        b"\x02\0\0\x40\x0e\0\0\0",
        list,
    ];
    check(&types, &mutable.concat());
}
