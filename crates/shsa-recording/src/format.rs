//! The formats of recordings in one table: their names, the endings and the first bytes of their files, and whether they can be
//! read.

use super::can::{asc, blf, candump};
use super::extract::Naming;
use super::{dataflash, influx, mcap, mdf, nmea, parquet, rosbag, signalk, sqlite, ulog};
use std::path::Path;

/// The format of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MCAP.
    Mcap,
    /// Bags of ROS 2 in SQLite files.
    Rosbag2,
    /// Bags of ROS 1, version 2.0.
    Bag,
    /// Logs of PX4.
    Ulog,
    /// Logs of ArduPilot.
    DataFlash,
    /// Logs of ArduPilot as text.
    DataFlashText,
    /// Logs of ArduPilot and MAVLink, printed by `mavlogdump`.
    Mavlogdump,
    /// Frames of a CAN bus, written by Vector's tools.
    Blf,
    /// Frames of a CAN bus, written by Vector's tools as text.
    Asc,
    /// Frames of a CAN bus, written by `candump`.
    Candump,
    /// ASAM MDF 4.
    Mdf,
    /// Apache Parquet.
    Parquet,
    /// NMEA 0183.
    Nmea,
    /// Deltas of Signal K.
    SignalK,
    /// InfluxDB line protocol.
    Influx,
    /// Observations, one per line.
    JsonLines,
    /// Tables of text.
    Csv,
}

/// The properties of a format.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The format.
    pub format: Format,
    /// The name of the format.
    pub name: &'static str,
    /// The endings of its files; formats may share an ending.
    pub endings: &'static [&'static str],
    /// The feature of this crate that reads the format; `None`: it is always read.
    pub feature: Option<&'static str>,
    /// Whether that feature is on.
    pub is_on: bool,
    /// How sources name topics of the format.
    pub(super) naming: Naming,
    /// Whether a file with these first bytes certainly has this format.
    is: fn(&[u8]) -> bool,
}

/// All formats. Where several fit the first bytes of a file, the first one counts.
pub const FORMATS: &[Row] = &[
    Row {
        format: Format::Mcap,
        name: "MCAP",
        endings: &["mcap"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: |head| head.starts_with(mcap::MAGIC),
    },
    Row {
        format: Format::Rosbag2,
        name: "ROS 2 bag in SQLite",
        endings: &["db3"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: |head| head.starts_with(sqlite::MAGIC),
    },
    Row {
        format: Format::Bag,
        name: "ROS 1 bag, version 2.0",
        endings: &["bag"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: |head| head.starts_with(rosbag::MAGIC),
    },
    Row {
        format: Format::Ulog,
        name: "ULog",
        endings: &["ulg"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: |head| head.starts_with(ulog::MAGIC),
    },
    Row {
        format: Format::DataFlash,
        name: "DataFlash log",
        endings: &["bin"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: |head| head.starts_with(&dataflash::binary::MAGIC),
    },
    Row {
        format: Format::Blf,
        name: "CAN frames, BLF",
        endings: &["blf"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: |head| head.starts_with(blf::MAGIC),
    },
    Row {
        format: Format::Mdf,
        name: "MDF 4",
        endings: &["mf4", "mdf"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: |head| mdf::MAGICS.iter().any(|magic| head.starts_with(magic)),
    },
    Row {
        format: Format::Parquet,
        name: "Parquet",
        endings: &["parquet"],
        feature: None,
        is_on: true,
        naming: Naming::File,
        is: |head| head.starts_with(parquet::MAGIC),
    },
    Row {
        format: Format::Nmea,
        name: "NMEA 0183",
        endings: &["nmea", "log"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: nmea::is_log,
    },
    Row {
        format: Format::DataFlashText,
        name: "DataFlash log as text",
        endings: &["log"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: dataflash::text::is_log,
    },
    Row {
        format: Format::Mavlogdump,
        name: "mavlogdump",
        endings: &["log"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: dataflash::dump::is_log,
    },
    Row {
        format: Format::Asc,
        name: "CAN frames, ASC",
        endings: &["asc"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: asc::is_log,
    },
    Row {
        format: Format::Candump,
        name: "CAN frames, candump",
        endings: &["log"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: candump::is_log,
    },
    Row {
        format: Format::Influx,
        name: "InfluxDB line protocol",
        endings: &["lp"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: influx::is_log,
    },
    Row {
        format: Format::JsonLines,
        name: "JSON lines",
        endings: &["jsonl", "ndjson", "json"],
        feature: None,
        is_on: true,
        naming: Naming::Signal,
        is: |_| false,
    },
    Row {
        format: Format::SignalK,
        name: "Signal K deltas",
        endings: &["jsonl", "log"],
        feature: None,
        is_on: true,
        naming: Naming::Topic,
        is: signalk::is_log,
    },
    Row {
        format: Format::Csv,
        name: "table of text",
        endings: &["csv", "tsv", "txt"],
        feature: None,
        is_on: true,
        naming: Naming::File,
        is: |_| false,
    },
];

/// Packed files and archives that are not read here, by their first bytes: the name, and how to unpack them.
const PACKED: [(&[u8], &str, &str); 6] = [
    (b"\xfd7zXZ\0", "a file packed by xz", "unpack it first: xz -d FILE"),
    (b"\x04\x22\x4d\x18", "a file packed by LZ4", "unpack it first: lz4 -d FILE"),
    (b"BZh", "a file packed by bzip2", "unpack it first: bzip2 -d FILE"),
    (b"PK\x03\x04", "a ZIP archive", "unpack it first: unzip FILE"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", "unpack it first: 7z x FILE"),
    (b"Rar!\x1a\x07", "a RAR archive", "unpack it first: unrar x FILE"),
];

/// What follows the size of the blocks in a file packed by bzip2: the begin of a block, or the end of an empty file.
const BZIP2: [&[u8]; 2] = [b"1AY&SY", b"\x17\x72\x45\x38\x50\x90"];

/// The name of a format that is not read here, and how to convert it, by the first bytes of a file.
pub(super) fn conversion(head: &[u8]) -> Option<(&'static str, &'static str)> {
    let how = "convert it to MDF 4 with Python's asammdf: MDF('old.mdf').convert('4.10').save('new.mf4')";
    if mdf::OLD_MAGICS.iter().any(|magic| head.starts_with(magic)) {
        return Some(("MDF 3 and before", how));
    }
    // A text may begin with the letters of bzip2.
    let is_whole = |magic: &[u8]| {
        magic != b"BZh" || head.get(4..).is_some_and(|rest| BZIP2.iter().any(|magic| rest.starts_with(magic)))
    };
    let found = PACKED.iter().find(|(magic, ..)| head.starts_with(magic) && is_whole(magic));
    found.map(|(_, name, how)| (*name, *how))
}

/// How many first bytes of a file decide its format.
pub(super) const HEAD: u64 = 4_096;

/// The first bytes, which decide the format.
pub(super) fn head(bytes: &[u8]) -> &[u8] {
    bytes.get(..HEAD as usize).unwrap_or(bytes)
}

/// The format of a file by its first bytes where they are decisive, else by the ending of its name; `None` when neither decides.
pub(super) fn format_of(name: &Path, head: &[u8]) -> Option<&'static Row> {
    if let Some(certain) = FORMATS.iter().find(|row| (row.is)(head)) {
        return Some(certain);
    }
    match by_ending(name) {
        // A bag that is cut within its first line, or another file.
        Some(row) if row.format == Format::Bag => rosbag::MAGIC.starts_with(head).then_some(row),
        None => {
            let first = head.iter().find(|byte| !byte.is_ascii_whitespace());
            FORMATS.iter().find(|row| row.format == Format::JsonLines && first == Some(&b'{'))
        }
        known => known,
    }
}

/// The first format with the ending of this file.
pub(super) fn by_ending(file: &Path) -> Option<&'static Row> {
    let ending = file.extension()?.to_str()?.to_ascii_lowercase();
    FORMATS.iter().find(|row| row.endings.contains(&ending.as_str()))
}

/// The formats of lines with the ending of this file, one of which it may have; none where its first bytes or its ending are
/// decisive.
pub(super) fn of_lines(name: &Path, head: &[u8]) -> Vec<&'static Row> {
    let is_of_lines = |row: &&Row| {
        let format = row.format;
        matches!(format, Format::Nmea | Format::DataFlashText | Format::Asc | Format::Candump)
            || matches!(format, Format::Mavlogdump | Format::Influx | Format::SignalK)
    };
    let is_open =
        FORMATS.iter().all(|row| !(row.is)(head)) && by_ending(name).as_ref().is_some_and(is_of_lines);
    let ending = name.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let has_ending = |row: &&Row| is_open && row.endings.contains(&ending.as_str());
    FORMATS.iter().filter(is_of_lines).filter(has_ending).collect()
}

/// The known formats for errors: `JSON lines (.jsonl, .ndjson, .json), ...`.
pub(super) fn known() -> String {
    let described = |row: &Row| {
        let endings: Vec<String> = row.endings.iter().map(|ending| format!(".{ending}")).collect();
        format!("{} ({})", row.name, endings.join(", "))
    };
    FORMATS.iter().map(described).collect::<Vec<_>>().join("; ")
}
