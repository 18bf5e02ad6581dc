//! The description at the end of a Parquet file: its columns, and the places of their values.
//!
//! Format: <https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift>.

use super::bytes::Bytes;
use super::thrift::Struct;

/// The most columns, and the most row groups, that are accepted.
const PARTS_MAX: usize = 1 << 16;

/// The physical type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Physical {
    Bool,
    I32,
    I64,
    /// Nanoseconds of the day and the number of the day.
    I96,
    F32,
    F64,
    /// A length and that many bytes.
    Bytes,
    /// This many bytes.
    Fixed(usize),
}

/// The logical type of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meaning {
    /// The value as it is stored.
    Plain,
    /// An unsigned whole number.
    Unsigned,
    /// A floating-point number of 16 bits.
    Half,
    /// A whole number of fractions, with how many of them are one.
    Decimal(f64),
    /// A time since 1970, with the nanoseconds of one step; whether it is in UTC, or in the local time of the writer.
    Moment { step_ns: i64, is_utc: bool },
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    /// The path, with dots.
    pub(super) name: String,
    pub(super) physical: Physical,
    pub(super) meaning: Meaning,
    /// The definition level at which there is a value.
    pub(super) defined: u32,
    /// The repetition level: above 0 the column is a list.
    pub(super) repeated: u32,
}

/// The values of a column in a row group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chunk {
    pub(super) codec: i64,
    /// Whether the values of all pages are compressed, also of those that say they are not.
    pub(super) is_always_packed: bool,
    pub(super) begin: u64,
    pub(super) end: u64,
}

/// A row group.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Group {
    pub(super) rows: u64,
    /// The chunks, one for each column; `None`: it is in another file, or missing.
    pub(super) chunks: Vec<Option<Chunk>>,
}

/// The description of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Description {
    pub(super) columns: Vec<Column>,
    pub(super) groups: Vec<Group>,
}

impl Description {
    /// Parses the bytes at the end of a file; `None` where they are no description.
    pub(super) fn read(bytes: &[u8]) -> Option<Description> {
        let file = Struct::read(&mut Bytes(bytes))?;
        let mut elements = file.structures(2);
        let root = elements.next()?;
        let mut columns = Vec::new();
        let top = Level { name: String::new(), defined: 0, repeated: 0, is_item: false, depth: 0 };
        for _ in 0..root.whole(5)?.min(PARTS_MAX as i64) {
            below(&mut elements, &top, &mut columns)?;
        }
        let is_always_packed = file.text(6).is_some_and(|writer| packs_always(&writer));
        let groups = file.structures(4).take(PARTS_MAX).map(|group| Group {
            rows: group.whole(3).and_then(|rows| u64::try_from(rows).ok()).unwrap_or(0),
            chunks: group.structures(1).map(|column| chunk(column, is_always_packed)).collect(),
        });
        let groups: Vec<Group> = groups.collect();
        let fits = groups.iter().all(|group| group.chunks.len() == columns.len());
        fits.then_some(Description { columns, groups })
    }
}

/// The elements above an element of the schema.
struct Level {
    name: String,
    defined: u32,
    repeated: u32,
    /// Whether the element is the item of a list; its name has no meaning then.
    is_item: bool,
    depth: usize,
}

/// Adds an element with those below it.
fn below<'s>(
    elements: &mut impl Iterator<Item = &'s Struct<'s>>,
    above: &Level,
    columns: &mut Vec<Column>,
) -> Option<()> {
    let element = elements.next()?;
    let (name, repetition) = (element.text(4)?, element.whole(3).unwrap_or(0));
    let children = element.whole(5).unwrap_or(0);
    // The repeated group between a list and its items has a name of the writer's choice.
    let is_list = repetition == 2 && children > 0;
    let name = match (above.name.as_str(), is_list || above.is_item) {
        ("", _) => name,
        (above, true) => above.to_owned(),
        (above, false) => format!("{above}.{name}"),
    };
    let level = Level {
        name,
        defined: above.defined + u32::from(repetition > 0),
        repeated: above.repeated + u32::from(repetition == 2),
        is_item: is_list && children == 1,
        depth: above.depth + 1,
    };
    if children > 0 {
        if level.depth > 16 || columns.len() > PARTS_MAX {
            return None;
        }
        return (0..children).try_for_each(|_| below(elements, &level, columns));
    }
    let Level { name, defined, repeated, .. } = level;
    columns.push(Column { name, physical: physical(element)?, meaning: meaning(element), defined, repeated });
    Some(())
}

fn physical(element: &Struct<'_>) -> Option<Physical> {
    Some(match element.whole(1)? {
        0 => Physical::Bool,
        1 => Physical::I32,
        2 => Physical::I64,
        3 => Physical::I96,
        4 => Physical::F32,
        5 => Physical::F64,
        6 => Physical::Bytes,
        7 => Physical::Fixed(usize::try_from(element.whole(2)?).ok()?),
        _ => return None,
    })
}

/// The meaning by the logical type, or by the converted type of older writers.
fn meaning(element: &Struct<'_>) -> Meaning {
    let decimal = |scale: i64| Meaning::Decimal(10_f64.powi(i32::try_from(scale).unwrap_or(0)));
    if let Some(logical) = element.structure(10) {
        if let Some(moment) = logical.structure(8) {
            let unit = |field| moment.structure(2).is_some_and(|unit| unit.structure(field).is_some());
            let step_ns = if unit(1) {
                1_000_000
            } else if unit(2) {
                1_000
            } else {
                1
            };
            return Meaning::Moment { step_ns, is_utc: moment.bool(1).unwrap_or(false) };
        }
        if logical.structure(15).is_some() && element.whole(2) == Some(2) {
            return Meaning::Half;
        }
        if let Some(number) = logical.structure(5) {
            return decimal(number.whole(1).unwrap_or(0));
        }
        if logical.structure(10).is_some_and(|number| number.bool(2) == Some(false)) {
            return Meaning::Unsigned;
        }
    }
    match (element.whole(6), element.whole(1)) {
        (Some(5), _) => decimal(element.whole(7).unwrap_or(0)),
        (Some(9), _) => Meaning::Moment { step_ns: 1_000_000, is_utc: true },
        (Some(10), _) => Meaning::Moment { step_ns: 1_000, is_utc: true },
        (Some(11..=14), _) => Meaning::Unsigned,
        // The file does not say in which zone the time is.
        (_, Some(3)) => Meaning::Moment { step_ns: 1, is_utc: false },
        _ => Meaning::Plain,
    }
}

/// Whether a writer compresses each page, whatever the page says: Arrow before 3.0 (ARROW-10353).
fn packs_always(writer: &str) -> bool {
    let version = writer.strip_prefix("parquet-cpp-arrow version ");
    let major = version.and_then(|version| version.split('.').next()?.parse::<u32>().ok());
    major.is_some_and(|major| major < 3) || writer.starts_with("parquet-cpp version ")
}

fn chunk(column: &Struct<'_>, is_always_packed: bool) -> Option<Chunk> {
    if column.text(1).is_some() {
        return None;
    }
    let data = column.structure(3)?;
    let place = |field| data.whole(field).and_then(|at| u64::try_from(at).ok());
    let pages = place(9)?;
    let begin = place(11).filter(|dictionary| (1..pages).contains(dictionary)).unwrap_or(pages);
    Some(Chunk { codec: data.whole(4)?, is_always_packed, begin, end: begin.checked_add(place(7)?)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_versions_of_arrow_always_compress() {
        assert!(packs_always("parquet-cpp-arrow version 2.0.0-SNAPSHOT"));
        assert!(packs_always("parquet-cpp version 1.5.1"));
        assert!(!packs_always("parquet-cpp-arrow version 3.0.0"));
        assert!(!packs_always("parquet-mr version 1.10.0"));
    }
}
