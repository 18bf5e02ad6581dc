//! Writes tables as Apache Parquet, for pandas, Polars, DuckDB and whatever else reads columns.
//!
//! `rows -> columns of a row group -> pages -> description at the end`
//!
//! Format: <https://parquet.apache.org/docs/file-format/>. Every column is optional. Numbers and times are stored plainly, texts by
//! a dictionary; nothing is compressed. Files are read by [`shsa_recording`], too.

mod column;
mod thrift;

use crate::table::{Cell, Kind, Rows};
use column::{Chunk, Values};
use std::io::{self, Write};
use thrift::{Binary, List, Struct};

/// The rows of a group: so many are kept in memory.
const GROUP: usize = 1 << 16;

const MAGIC: &[u8; 4] = b"PAR1";

/// Writes a table. Memory does not grow with its length, but for about 100 bytes a column of each 65,536 rows.
///
/// # Example
/// ```
/// use shsa_format::parquet::ParquetWriter;
/// use shsa_format::table::{Cell, Kind, Rows};
///
/// let mut file = Vec::new();
/// let columns = [("signal", Kind::Text), ("value", Kind::Number)];
/// let mut writer = ParquetWriter::new(&mut file, &columns, &[("model", "car.yaml")])?;
/// writer.row(&[Cell::Text("/gps"), Cell::Number(1.5)])?;
/// writer.row(&[Cell::Text("/gps"), Cell::Missing])?;
/// writer.finish()?;
/// assert!(file.starts_with(b"PAR1") && file.ends_with(b"PAR1"));
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct ParquetWriter<W> {
    output: W,
    /// The bytes written so far.
    written: u64,
    names: Vec<String>,
    about: Vec<(String, String)>,
    values: Vec<Values>,
    /// The rows of the present group, and of all groups before.
    rows: usize,
    rows_before: usize,
    groups: Vec<Group>,
}

/// A row group that is written.
#[derive(Debug)]
struct Group {
    rows: usize,
    chunks: Vec<Chunk>,
}

impl<W: Write> ParquetWriter<W> {
    /// Begins a table with these columns. `about` are facts about it, by names.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn new(
        mut output: W,
        columns: &[(&str, Kind)],
        about: &[(&str, &str)],
    ) -> io::Result<ParquetWriter<W>> {
        output.write_all(MAGIC)?;
        Ok(ParquetWriter {
            output,
            written: MAGIC.len() as u64,
            names: columns.iter().map(|(name, _)| (*name).to_owned()).collect(),
            about: about.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect(),
            values: columns.iter().map(|(_, kind)| Values::new(*kind)).collect(),
            rows: 0,
            rows_before: 0,
            groups: Vec::new(),
        })
    }

    /// Ends the table.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn finish(&mut self) -> io::Result<()> {
        if self.rows > 0 {
            self.end_group()?;
        }
        let description = self.description().into_bytes();
        self.output.write_all(&description)?;
        self.output.write_all(&(description.len() as u32).to_le_bytes())?;
        self.output.write_all(MAGIC)?;
        self.output.flush()
    }

    fn end_group(&mut self) -> io::Result<()> {
        let mut chunks = Vec::with_capacity(self.values.len());
        for values in &mut self.values {
            let (bytes, chunk) = values.take(self.written);
            self.output.write_all(&bytes)?;
            self.written += bytes.len() as u64;
            chunks.push(chunk);
        }
        let rows = std::mem::take(&mut self.rows);
        self.rows_before += rows;
        self.groups.push(Group { rows, chunks });
        Ok(())
    }

    /// The structure `FileMetaData`.
    fn description(&self) -> Struct {
        let root = Struct::default().text(4, "table").i32(5, self.names.len() as i32);
        let columns = self.names.iter().zip(&self.values).map(|(name, values)| values.schema(name));
        let about = self.about.iter().map(|(name, text)| Struct::default().text(1, name).text(2, text));
        Struct::default()
            .i32(1, 2)
            .list(2, List::of_structs(std::iter::once(root).chain(columns)))
            .i64(3, self.rows_before as i64)
            .list(4, List::of_structs(self.groups.iter().map(|group| self.group(group))))
            .list(5, List::of_structs(about))
            .binary(6, Binary(concat!("shsa ", env!("CARGO_PKG_VERSION")).as_bytes()))
    }

    /// The structure `RowGroup`.
    fn group(&self, group: &Group) -> Struct {
        let chunks = group.chunks.iter().zip(&self.names).map(|(chunk, name)| chunk.description(name));
        let size: u64 = group.chunks.iter().map(|chunk| chunk.size).sum();
        Struct::default().list(1, List::of_structs(chunks)).i64(2, size as i64).i64(3, group.rows as i64)
    }
}

impl<W: Write> Rows for ParquetWriter<W> {
    fn row(&mut self, cells: &[Cell<'_>]) -> io::Result<()> {
        let cells = cells.iter().copied().chain(std::iter::repeat(Cell::Missing));
        self.values.iter_mut().zip(cells).for_each(|(values, cell)| values.push(cell));
        self.rows += 1;
        if self.rows == GROUP { self.end_group() } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests;
