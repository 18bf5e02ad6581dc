//! Tables that are written are read again.

use super::*;

#[test]
fn an_empty_table_is_a_table() {
    let mut file = Vec::new();
    ParquetWriter::new(&mut file, &[("a", Kind::Number)], &[]).unwrap().finish().unwrap();
    assert!(file.starts_with(MAGIC) && file.ends_with(MAGIC));
}

#[test]
fn numbers_are_written_as_thrift_says() {
    // The examples of the specification: 150 is 0x96 0x01; -1 is 1, 1 is 2 by zigzag.
    assert_eq!(thrift::varint(150), [0x96, 0x01]);
    assert_eq!(Struct::default().i32(1, -1).i64(3, 1).into_bytes(), [0x15, 1, 0x26, 2, 0]);
    let many = List::of_i32(&[0; 15]);
    assert_eq!(&Struct::default().list(2, many).into_bytes()[..4], [0x29, 0xf5, 15, 0]);
}
