//! The results of a scan as text.

use super::Scan;
use super::matched::Matched;
use super::topic_record::TopicRecord;
use crate::show;
use shsa_bridge::payload::{Content, Leaf};
use shsa_core::observation::RawValue;
use shsa_format::text::{counted, seconds};
use shsa_report::Paint;

/// The most fields that are listed for one topic; further ones are only counted.
const FIELDS_MAX: usize = 40;
/// The most characters of a text that are shown.
const TEXT_MAX: usize = 32;

pub(super) fn shown(scan: &Scan) -> String {
    let count = counted(scan.topics.len(), "topic");
    let mut parts = vec![format!("{}: {count} in {}", scan.bus, seconds(scan.seconds))];
    if scan.topics.is_empty() {
        parts.push("Nothing was published; listen longer with --for.".to_owned());
    } else {
        parts.push(table(scan));
    }
    parts.extend(scan.matched.as_ref().and_then(|matched| rates(scan, matched)));
    parts.extend(scan.matched.as_ref().and_then(|matched| missing(scan, matched)));
    parts.join("\n\n")
}

fn table(scan: &Scan) -> String {
    let mut head = vec!["topic and field", "form", "messages", "rate", "longest gap", "last value"];
    head.extend(scan.matched.as_ref().map(|_| "signal"));
    let mut rows = Vec::new();
    for (topic, topic_record) in &scan.topics {
        let signals = |path: &str| {
            scan.matched
                .as_ref()
                .map(|matched| matched.carried(topic, topic_record, path).join(", "))
                .unwrap_or_default()
        };
        let single =
            topic_record.fields.first().filter(|leaf| topic_record.fields.len() == 1 && leaf.path.is_empty());
        let value = single.map_or_else(|| problem(topic_record), |leaf| content(&leaf.content));
        let mut row = of_topic(topic, topic_record);
        row.extend([value, single.map_or(String::new(), |_| signals(""))]);
        rows.push(row);
        if single.is_none() {
            let fields = topic_record.fields.iter().take(FIELDS_MAX);
            rows.extend(fields.map(|leaf| of_field(leaf, signals(&leaf.path))));
            let more = topic_record.fields.len().saturating_sub(FIELDS_MAX);
            rows.extend((more > 0).then(|| vec![format!("  .. and {more} more")]));
        }
    }
    show::style().table(&head, rows)
}

fn of_topic(topic: &str, topic_record: &TopicRecord) -> Vec<String> {
    let nothing = || "-".to_owned();
    let messages = match topic_record.kept {
        0 => topic_record.count.to_string(),
        kept => format!("{} + {kept} kept", topic_record.count),
    };
    vec![
        topic.to_owned(),
        topic_record.form(),
        messages,
        topic_record.rate_hz().map_or_else(nothing, rate),
        topic_record.longest_gap_s().map_or_else(nothing, seconds),
    ]
}

fn of_field(leaf: &Leaf, signals: String) -> Vec<String> {
    let name = if leaf.path.is_empty() { "(the payload itself)" } else { &leaf.path };
    let mut row = vec![String::new(); 5];
    if let Some(first) = row.first_mut() {
        *first = format!("  {name}");
    }
    row.extend([content(&leaf.content), signals]);
    row
}

fn problem(topic_record: &TopicRecord) -> String {
    let unreadable = topic_record.unreadable.as_ref().filter(|_| topic_record.fields.is_empty());
    unreadable.map_or(String::new(), |unreadable| show::style().paint(Paint::Yellow, &unreadable.to_string()))
}

/// A rate with three digits.
pub(crate) fn rate(hz: f64) -> String {
    let digits = if hz < 9.995 { 2 } else { usize::from(hz < 99.95) };
    format!("{hz:.digits$} Hz")
}

fn content(content: &Content) -> String {
    match content {
        Content::Null => "null".to_owned(),
        Content::Text(text) => {
            let start: String = text.chars().take(TEXT_MAX).filter(|c| !c.is_control()).collect();
            if text.chars().count() > TEXT_MAX { format!("'{start}..'") } else { format!("'{start}'") }
        }
        Content::Value(RawValue::Number(value)) => number(*value),
        Content::Value(RawValue::Interval { lo, hi }) => format!("{} .. {}", number(*lo), number(*hi)),
        Content::Value(RawValue::Vector(values)) => {
            let first: Vec<String> = values.iter().take(3).map(|value| number(*value)).collect();
            let more = if values.len() > 3 { ", .." } else { "" };
            format!("[{}{more}] ({})", first.join(", "), counted(values.len(), "element"))
        }
    }
}

/// A number with its significant digits; an epoch keeps its seconds.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !(1e-4..1e15).contains(&size) {
        return if value.is_finite() && value != 0.0 { format!("{value:.3e}") } else { value.to_string() };
    }
    let decimals = if size >= 1e6 { 0 } else { 5_usize.saturating_sub(size.log10().max(0.0) as usize) };
    let text = format!("{value:.decimals$}");
    if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Signals whose rate differs from the model's by more than a fifth.
fn rates(scan: &Scan, matched: &Matched) -> Option<String> {
    let differs = matched.signals().filter_map(|(id, end)| {
        let signal = &matched.knowledge.signals()[id];
        let (topic_record, declared) = (scan.topics.get(&end.topic)?.rate_hz()?, signal.rate_hz?);
        let is_near = (topic_record / declared - 1.0).abs() <= 0.2;
        (!is_near && matched.good(id) > 0)
            .then(|| vec![format!("  {}", signal.name), rate(declared), rate(topic_record)])
    });
    let rows: Vec<_> = differs.collect();
    (!rows.is_empty()).then(|| show::style().table(&["Other rates than declared", "model", "heard"], rows))
}

fn missing(scan: &Scan, matched: &Matched) -> Option<String> {
    let row = |missing: super::matched::Missing<'_>| {
        vec![format!("  {}", missing.signal), missing.source.to_owned(), missing.because]
    };
    let rows: Vec<_> = matched.missing(&scan.topics).map(row).collect();
    let title = format!("Missing: {} of {}", rows.len(), counted(matched.signals().count(), "signal"));
    Some(if rows.is_empty() {
        show::style()
            .paint(Paint::Green, &format!("All {} are there.", counted(matched.signals().count(), "signal")))
    } else {
        show::style().table(&[&title, "source", "why"], rows)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_what_counts() {
        let shown =
            [0.0, 21.5, 2.916427742982732, -0.0017126, 1795316528.2368, 1e-9, 1e300, f64::NAN].map(number);
        assert_eq!(shown, ["0", "21.5", "2.91643", "-0.00171", "1795316528", "1.000e-9", "1.000e300", "NaN"]);
    }
}
