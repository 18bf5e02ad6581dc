//! Writes a small Parquet file for tests, with its descriptions field by field.

/// A field of a structure: its number, its kind, its bytes.
struct Field(i16, u8, Vec<u8>);

/// A number in groups of seven bits.
fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

fn whole(number: i16, value: i64) -> Field {
    Field(number, 6, varint(value.cast_unsigned() << 1))
}

fn text(number: i16, value: &str) -> Field {
    Field(number, 8, [varint(value.len() as u64), value.as_bytes().to_vec()].concat())
}

fn structure(number: i16, fields: &[Field]) -> Field {
    Field(number, 12, written(fields))
}

/// A list of at most 14 structures.
fn list(number: i16, items: &[Vec<u8>]) -> Field {
    Field(number, 9, [vec![(items.len() as u8) << 4 | 12], items.concat()].concat())
}

fn written(fields: &[Field]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for Field(number, kind, content) in fields {
        bytes.push(*kind);
        bytes.extend(varint(number.cast_unsigned().into()).iter().map(|byte| byte << 1));
        bytes.extend(content);
    }
    bytes.push(0);
    bytes
}

/// An uncompressed page: its head and its content.
fn page(kind: i64, about: Field, content: &[u8]) -> Vec<u8> {
    let length = content.len() as i64;
    let head = written(&[whole(1, kind), whole(2, length), whole(3, length), about]);
    [head, content.to_vec()].concat()
}

/// A data page of this many values in this encoding.
fn data(values: i64, encoding: i64, content: &[u8]) -> Vec<u8> {
    let about = structure(5, &[whole(1, values), whole(2, encoding), whole(3, 3), whole(4, 3)]);
    page(0, about, content)
}

/// A column: the elements of the schema, the kind of its values, its pages and how many of them are a dictionary.
type Column = (Vec<Vec<u8>>, i64, Vec<Vec<u8>>, usize);

fn columns() -> [Column; 4] {
    let element = |fields: &[Field]| written(fields);
    let bytes = |parts: &[&[u8]]| parts.concat();
    let since = 1_700_000_000_000_000_i64;
    let times: Vec<u8> = (0..3).flat_map(|second| (since + second * 1_000_000).to_le_bytes()).collect();
    // Microseconds, in UTC.
    let unit = structure(2, &[structure(2, &[])]);
    let moment = structure(10, &[structure(8, &[Field(1, 1, Vec::new()), unit])]);
    let time = element(&[whole(1, 2), whole(3, 0), text(4, "time"), moment]);
    // 1.5, missing, 2.5: by a dictionary.
    let dictionary = page(
        2,
        structure(7, &[whole(1, 2), whole(2, 0)]),
        &bytes(&[&1.5_f64.to_le_bytes(), &2.5_f64.to_le_bytes()]),
    );
    let numbers = data(3, 8, &[2, 0, 0, 0, 3, 0b101, 1, 3, 0b10]);
    let speed = element(&[whole(1, 5), whole(3, 1), text(4, "v [m/s]")]);
    let names = data(3, 0, b"\x01\0\0\0a\x02\0\0\0bc\x01\0\0\0d");
    let name = element(&[whole(1, 6), whole(3, 0), text(4, "name"), whole(6, 0)]);
    // [1, 2], [], [3]: repetition levels, definition levels, values.
    let lists = bytes(&[
        &[3, 0b10, 3, 0b11_01_11_11, 0],
        &1_f32.to_le_bytes(),
        &2_f32.to_le_bytes(),
        &3_f32.to_le_bytes(),
    ]);
    let about = [whole(1, 4), whole(2, 1), whole(3, 3), whole(4, 0), whole(5, 3), whole(6, 2)];
    let lists = page(3, structure(8, &about), &lists);
    let ranges = vec![
        element(&[whole(3, 1), text(4, "ranges"), whole(5, 1), whole(6, 3)]),
        element(&[whole(3, 2), text(4, "list"), whole(5, 1)]),
        element(&[whole(1, 4), whole(3, 1), text(4, "element")]),
    ];
    [
        (vec![time], 2, vec![data(3, 0, &times)], 0),
        (vec![speed], 5, vec![dictionary, numbers], 1),
        (vec![name], 6, vec![names], 0),
        (ranges, 4, vec![lists], 0),
    ]
}

/// Three rows, a second apart: `time`, `v [m/s]` (1.5, missing, 2.5), `name` (a, bc, d) and `ranges` ([1, 2], missing, [3]).
pub(in super::super) fn small() -> Vec<u8> {
    table(3, &columns())
}

/// Columns of microseconds since 1970, UTC, of equal length, some of which are missing.
pub(in super::super) fn moments(columns: &[(&str, &[Option<i64>])]) -> Vec<u8> {
    let column = |(name, times): &(&str, &[Option<i64>])| -> Column {
        let unit = structure(2, &[structure(2, &[])]);
        let moment = structure(10, &[structure(8, &[Field(1, 1, Vec::new()), unit])]);
        let about = written(&[whole(1, 2), whole(3, 1), text(4, name), moment]);
        let level = |(at, time): (usize, &Option<i64>)| u8::from(time.is_some()) << at;
        let levels = times.chunks(8).map(|eight| eight.iter().enumerate().map(level).sum::<u8>());
        let levels = [varint((times.len().div_ceil(8) << 1 | 1) as u64), levels.collect()].concat();
        let known = times.iter().flatten().flat_map(|time| time.to_le_bytes()).collect();
        let content = [(levels.len() as u32).to_le_bytes().to_vec(), levels, known].concat();
        (vec![about], 2, vec![data(times.len() as i64, 0, &content)], 0)
    };
    let rows = columns.first().map_or(0, |column| column.1.len());
    table(rows as i64, &columns.iter().map(column).collect::<Vec<_>>())
}

fn table(rows: i64, columns: &[Column]) -> Vec<u8> {
    let mut file = b"PAR1".to_vec();
    let mut chunks = Vec::new();
    for (_, kind, pages, dictionaries) in columns {
        let begin = file.len() as i64;
        let data = begin + pages.iter().take(*dictionaries).map(Vec::len).sum::<usize>() as i64;
        let length: usize = pages.iter().map(Vec::len).sum();
        file.extend(pages.concat());
        let mut about =
            vec![whole(1, *kind), whole(4, 0), whole(5, rows), whole(7, length as i64), whole(9, data)];
        if *dictionaries > 0 {
            about.push(whole(11, begin));
        }
        chunks.push(written(&[whole(2, begin), structure(3, &about)]));
    }
    let root = written(&[text(4, "schema"), whole(5, columns.len() as i64)]);
    let schema: Vec<Vec<u8>> =
        [vec![root], columns.iter().flat_map(|column| column.0.clone()).collect()].concat();
    let group = written(&[list(1, &chunks), whole(2, 0), whole(3, rows)]);
    let description = written(&[whole(1, 2), list(2, &schema), whole(3, rows), list(4, &[group])]);
    let length = description.len() as u32;
    [&file[..], &description, &length.to_le_bytes(), b"PAR1"].concat()
}
