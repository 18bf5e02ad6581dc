//! Small bags of ROS 2 in SQLite files, as the tests and the fuzz target write them: pages of 512 bytes.

const PAGE: usize = 512;

/// A value of a row.
pub(super) enum Cell<'a> {
    Null,
    Whole(i64),
    Text(&'a str),
    Blob(&'a [u8]),
}

fn varint(number: u64) -> Vec<u8> {
    let mut bytes = vec![(number & 0x7f) as u8];
    let mut rest = number >> 7;
    while rest > 0 {
        bytes.insert(0, (rest & 0x7f) as u8 | 0x80);
        rest >>= 7;
    }
    bytes
}

fn row(number: u64, cells: &[Cell<'_>]) -> Vec<u8> {
    let (mut kinds, mut body) = (Vec::new(), Vec::new());
    for cell in cells {
        let (kind, bytes) = match cell {
            Cell::Null => (0, Vec::new()),
            Cell::Whole(number) => (6, number.to_be_bytes().to_vec()),
            Cell::Text(text) => (13 + 2 * text.len() as u64, text.as_bytes().to_vec()),
            Cell::Blob(bytes) => (12 + 2 * bytes.len() as u64, bytes.to_vec()),
        };
        kinds.extend(varint(kind));
        body.extend(bytes);
    }
    let payload = [varint(kinds.len() as u64 + 1), kinds, body].concat();
    [varint(payload.len() as u64), varint(number), payload].concat()
}

/// A page of a table: a head of the file in front of the first one, then the cells from the end on.
fn page(is_first: bool, kind: u8, cells: &[Vec<u8>], right: Option<u32>) -> Vec<u8> {
    let mut bytes = vec![0; PAGE];
    let start = if is_first { 100 } else { 0 };
    if is_first {
        bytes[..16].copy_from_slice(b"SQLite format 3\0");
        bytes[16..18].copy_from_slice(&(PAGE as u16).to_be_bytes());
        bytes[18..20].copy_from_slice(&[1, 1]);
    }
    bytes[start] = kind;
    bytes[start + 3..start + 5].copy_from_slice(&(cells.len() as u16).to_be_bytes());
    let mut place = start + 8;
    if let Some(right) = right {
        bytes[place..place + 4].copy_from_slice(&right.to_be_bytes());
        place += 4;
    }
    let mut end = PAGE;
    for cell in cells {
        end -= cell.len();
        bytes[end..end + cell.len()].copy_from_slice(cell);
        bytes[place..place + 2].copy_from_slice(&(end as u16).to_be_bytes());
        place += 2;
    }
    assert!(place <= end, "too much for a page");
    bytes
}

/// A bag of one topic `/speed` of `std_msgs/msg/Float64` with these messages, three on a page.
pub(super) fn bag(messages: &[(i64, f64)]) -> Vec<u8> {
    let message = |(number, (time, value)): (usize, &(i64, f64))| {
        let data = [&[0, 1, 0, 0][..], &value.to_le_bytes()].concat();
        row(number as u64 + 1, &[Cell::Null, Cell::Whole(1), Cell::Whole(*time), Cell::Blob(&data)])
    };
    let rows: Vec<Vec<u8>> = messages.iter().enumerate().map(message).collect();
    let leaves: Vec<Vec<u8>> = rows.chunks(3).map(|rows| page(false, 13, rows, None)).collect();
    let child = |number: usize| 4 + number as u32;
    let inner = (0..leaves.len() - 1)
        .map(|number| [&child(number).to_be_bytes()[..], &varint(3 * number as u64 + 3)].concat());
    let table = |name: &'static str, root: i64| {
        [Cell::Text("table"), Cell::Text(name), Cell::Text(name), Cell::Whole(root), Cell::Text("")]
    };
    let master = page(true, 13, &[row(1, &table("topics", 2)), row(2, &table("messages", 3))], None);
    let topic = row(
        1,
        &[
            Cell::Null,
            Cell::Text("/speed"),
            Cell::Text("std_msgs/msg/Float64"),
            Cell::Text("cdr"),
            Cell::Text(""),
        ],
    );
    let topics = page(false, 13, &[topic], None);
    let root = page(false, 5, &inner.collect::<Vec<_>>(), Some(child(leaves.len() - 1)));
    [master, topics, root, leaves.concat()].concat()
}
