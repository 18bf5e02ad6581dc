//! What a file contains, as it is told.

use super::Warning;
use shsa_core::time::{Span, Time};
use std::path::PathBuf;

/// The content of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileInfo {
    /// The file.
    pub file: PathBuf,
    /// The name of the format.
    pub format: &'static str,
    /// Its topics by name.
    pub topics: Vec<TopicInfo>,
    /// Warnings about the file.
    pub warnings: Vec<Warning>,
    /// Whether a part of the file is lost.
    pub degraded: bool,
}

/// One topic, table or signal of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopicInfo {
    /// The name; for a table the file's name without extension.
    pub name: String,
    /// The text that means only this topic in a source: `sensor_accel[1]`, `room[sensor=T1]`.
    pub source: String,
    /// The message type; for a table its columns; for JSON lines the kind of its first value.
    pub kind: String,
    /// Messages, rows or lines.
    pub count: usize,
    /// The mean rate by reception; `None` for fewer than two messages, or where they all have the same time.
    pub rate_hz: Option<f64>,
    /// The first and the last reception.
    pub span: Option<(Time, Time)>,
    /// The longest time between two receptions.
    pub longest_gap: Option<Span>,
    /// The fields of its messages.
    pub fields: Vec<FieldInfo>,
    /// Why its messages cannot be read; `None` where they can.
    pub unreadable: Option<String>,
}

/// One field of a topic.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FieldInfo {
    /// The path, as a source names it.
    pub path: String,
    /// The unit, where the format has one.
    pub unit: Option<String>,
    /// `number`, `list`, `interval`, `text`; empty where no value was seen.
    pub kind: &'static str,
    /// An example of a value.
    pub sample: Option<String>,
    /// Whether the times of the messages are taken from it.
    pub is_clock: bool,
}
