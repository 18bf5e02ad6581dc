//! The contents of recordings as text.

use crate::scan::text::rate;
use crate::show;
use shsa_core::time::Time;
use shsa_format::text::{counted, seconds};
use shsa_message::stamp::{Notation, written};
use shsa_recording::{FieldInfo, FileInfo, TopicInfo};
use shsa_report::Paint;

/// The most fields that are listed for one topic; further ones are only counted.
const FIELDS_MAX: usize = 40;

pub(super) fn shown(files: &[FileInfo]) -> String {
    files.iter().map(of_file).collect::<Vec<_>>().join("\n\n")
}

fn of_file(file: &FileInfo) -> String {
    let messages: usize = file.topics.iter().map(|topic| topic.count).sum();
    let counts = format!("{}, {}", counted(file.topics.len(), "topic"), counted(messages, "message"));
    let spans = || file.topics.iter().filter_map(|topic| topic.span);
    let span = spans().map(|(from, _)| from).min().zip(spans().map(|(_, to)| to).max());
    let span = span.map_or(String::new(), |(from, to)| {
        format!(", {} from {}", seconds((to - from).seconds()), moment(from))
    });
    let lost = if file.degraded {
        show::style().paint(Paint::Yellow, "; something of it is lost")
    } else {
        String::new()
    };
    let head = format!("{}: {}; {counts}{span}{lost}", file.file.display(), file.format);
    let rows: Vec<Vec<String>> = file.topics.iter().flat_map(of_topic).collect();
    let columns = ["topic and field", "type or unit", "messages", "rate", "longest gap", "example"];
    if rows.is_empty() { head } else { format!("{head}\n{}", show::style().table(&columns, rows)) }
}

/// An epoch as a date; a smaller time in seconds.
fn moment(time: Time) -> String {
    const YEAR_2000: Time = Time(946_684_800_000_000_000);
    if time > YEAR_2000 { written(time, Notation::Rfc3339) } else { format!("{} s", time.seconds()) }
}

fn of_topic(topic: &TopicInfo) -> Vec<Vec<String>> {
    let nothing = || "-".to_owned();
    let unreadable = topic.unreadable.as_ref();
    let mut rows = vec![vec![
        topic.source.clone(),
        // The kind of a table lists its columns, which follow anyway.
        if topic.kind.contains(", ") { "table".to_owned() } else { topic.kind.clone() },
        topic.count.to_string(),
        topic.rate_hz.map_or_else(nothing, rate),
        topic.longest_gap.map_or_else(nothing, |gap| seconds(gap.seconds())),
        unreadable.map_or(String::new(), |unreadable| show::style().paint(Paint::Yellow, unreadable)),
    ]];
    rows.extend(topic.fields.iter().take(FIELDS_MAX).map(of_field));
    let more = topic.fields.len().saturating_sub(FIELDS_MAX);
    rows.extend((more > 0).then(|| vec![format!("  .. and {more} more")]));
    rows
}

fn of_field(field: &FieldInfo) -> Vec<String> {
    let name = if field.path.is_empty() { "(the message itself)" } else { &field.path };
    let unit = field.unit.clone().unwrap_or_default();
    let sample = field.sample.clone().unwrap_or_else(|| "-".to_owned());
    let empty = String::new;
    vec![format!("  {name}"), unit, empty(), empty(), empty(), sample]
}
