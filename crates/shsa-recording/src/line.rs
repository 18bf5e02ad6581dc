//! The content of a JSON line as far as an observation needs it. The rest is checked and dropped, so that a line takes no more
//! memory than its own size.

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// The longest line of a text recording, bytes.
pub(super) const LINE_MAX: usize = 1 << 24;

/// The most numbers of a list.
const LIST_MAX: usize = 1 << 20;

/// A line.
pub(super) enum Fields {
    Object {
        signal: Option<Cell>,
        time: Option<Cell>,
        received: Option<Cell>,
        value: Option<Cell>,
    },
    /// A JSON value that is no object.
    Other,
}

/// The value of a field.
pub(super) enum Cell {
    Null,
    Whole(i64),
    Number(f64),
    Text(String),
    /// The numbers; `None`: the list holds something else.
    List(Option<Vec<f64>>),
    Bounds {
        lo: Option<f64>,
        hi: Option<f64>,
    },
    Other,
}

impl Cell {
    /// The number; JSON has no word for not-a-number and the infinities.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Cell::Null => Some(f64::NAN),
            Cell::Whole(whole) => Some(*whole as f64),
            Cell::Number(number) => Some(*number),
            Cell::Text(text) => text.trim().parse().ok(),
            Cell::List(_) | Cell::Bounds { .. } | Cell::Other => None,
        }
    }
}

/// Implements a visitor for any JSON value; `$seq` and `$map` read lists and objects.
macro_rules! visitor {
    ($visitor:ident, $of:ty, $scalar:path, $seq:path, $map:path) => {
        impl<'de> Deserialize<'de> for $of {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<$of, D::Error> {
                deserializer.deserialize_any($visitor)
            }
        }

        struct $visitor;

        impl<'de> Visitor<'de> for $visitor {
            type Value = $of;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("JSON")
            }
            fn visit_unit<E: Error>(self) -> Result<$of, E> {
                Ok($scalar(Cell::Null))
            }
            fn visit_bool<E: Error>(self, _: bool) -> Result<$of, E> {
                Ok($scalar(Cell::Other))
            }
            fn visit_i64<E: Error>(self, whole: i64) -> Result<$of, E> {
                Ok($scalar(Cell::Whole(whole)))
            }
            fn visit_u64<E: Error>(self, whole: u64) -> Result<$of, E> {
                Ok($scalar(i64::try_from(whole).map_or(Cell::Number(whole as f64), Cell::Whole)))
            }
            fn visit_f64<E: Error>(self, number: f64) -> Result<$of, E> {
                Ok($scalar(Cell::Number(number)))
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<$of, E> {
                Ok($scalar(Cell::Text(text.to_owned())))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, all: A) -> Result<$of, A::Error> {
                $seq(all)
            }
            fn visit_map<A: MapAccess<'de>>(self, all: A) -> Result<$of, A::Error> {
                $map(all)
            }
        }
    };
}

/// An element of a list, or a bound.
struct Item(Option<f64>);

visitor!(OfLine, Fields, no_object, pass_items, fields);
visitor!(OfCell, Cell, Cell::from, list, bounds);
visitor!(OfItem, Item, Item::from, pass_items, pass_fields);

fn no_object(_: Cell) -> Fields {
    Fields::Other
}

impl From<Cell> for Item {
    fn from(cell: Cell) -> Item {
        Item(cell.number())
    }
}

/// JSON values that are neither numbers nor looked for.
trait Passed {
    const PASSED: Self;
}

impl Passed for Fields {
    const PASSED: Fields = Fields::Other;
}

impl Passed for Item {
    const PASSED: Item = Item(None);
}

fn pass_items<'de, T: Passed, A: SeqAccess<'de>>(mut all: A) -> Result<T, A::Error> {
    while all.next_element::<IgnoredAny>()?.is_some() {}
    Ok(T::PASSED)
}

fn pass_fields<'de, T: Passed, A: MapAccess<'de>>(mut all: A) -> Result<T, A::Error> {
    while all.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
    Ok(T::PASSED)
}

/// Where a field occurs twice, the last one counts.
fn fields<'de, A: MapAccess<'de>>(mut all: A) -> Result<Fields, A::Error> {
    let (mut signal, mut time, mut received, mut value) = (None, None, None, None);
    while let Some(key) = all.next_key::<String>()? {
        let field = match key.as_str() {
            "signal" => &mut signal,
            "time_ns" => &mut time,
            "received_ns" => &mut received,
            "value" => &mut value,
            _ => {
                all.next_value::<IgnoredAny>()?;
                continue;
            }
        };
        *field = Some(all.next_value()?);
    }
    Ok(Fields::Object { signal, time, received, value })
}

fn list<'de, A: SeqAccess<'de>>(mut all: A) -> Result<Cell, A::Error> {
    let mut items = Some(Vec::new());
    while let Some(Item(number)) = all.next_element()? {
        match (&mut items, number) {
            (Some(items), Some(_)) if items.len() == LIST_MAX => {
                return Err(A::Error::custom(format!("a list of more than {LIST_MAX} numbers")));
            }
            (Some(items), Some(number)) => items.push(number),
            _ => items = None,
        }
    }
    Ok(Cell::List(items))
}

fn bounds<'de, A: MapAccess<'de>>(mut all: A) -> Result<Cell, A::Error> {
    let (mut lo, mut hi) = (None, None);
    while let Some(key) = all.next_key::<String>()? {
        let bound = match key.as_str() {
            "lo" => &mut lo,
            "hi" => &mut hi,
            _ => {
                all.next_value::<IgnoredAny>()?;
                continue;
            }
        };
        let Item(number) = all.next_value()?;
        *bound = number;
    }
    Ok(Cell::Bounds { lo, hi })
}
