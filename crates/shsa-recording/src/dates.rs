//! The order of days and months in dates: one for all tables of a call, as one of them may show what the others leave open.

use super::files::{File, open, without_packing};
use super::format::Format;
use super::{ReadOptions, RecordingError, table, zones};

/// The options with the order of dates that all tables have in common, where none is given. What is compressed is not looked into: that
/// would take as long as reading it.
///
/// # Errors
/// A zone of a file that is not read.
pub(super) fn decided(options: &ReadOptions, files: &[File]) -> Result<ReadOptions, RecordingError> {
    zones::checked(options, files)?;
    let is_plain_table =
        |file: &&File| file.row.format == Format::Csv && without_packing(&file.path) == file.path;
    let dates = || {
        let tables =
            files.iter().filter(is_plain_table).filter_map(|file| open(&file.path, &options.files).ok());
        tables.flat_map(|mut opened| table::dates(&mut opened.input, options)).collect::<Vec<String>>()
    };
    let date_order = options.date_order.or_else(|| table::clock::order_of_all(&dates()));
    Ok(ReadOptions { date_order, ..options.clone() })
}
