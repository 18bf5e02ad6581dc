//! The picture of an instance as lines of text: needs, signals, decisions.

use super::board::Board;
use serde_json::{Value, json};
use shsa_core::engine::EventKind;
use shsa_core::time::Span;
use shsa_format::text::seconds;
use shsa_format::words::long_span;
use shsa_report::{Paint, Style, paint_of};

/// Below this many rows each list keeps its first lines only.
const LEAST: usize = 3;

/// The room for a picture, in characters.
#[derive(Clone, Copy)]
pub(super) struct Size {
    pub(super) columns: usize,
    pub(super) rows: usize,
}

impl Size {
    /// A file or a pipe.
    pub(super) const UNLIMITED: Size = Size { columns: usize::MAX, rows: usize::MAX };
}

/// What is drawn, and how it looks.
pub(super) struct Picture<'a> {
    pub(super) board: &'a Board,
    pub(super) style: Style,
}

impl Picture<'_> {
    /// The lines of the picture, none longer than the room. `lost` is why there is nothing new.
    pub(super) fn lines(&self, lost: Option<&str>, size: Size) -> Vec<String> {
        let mut lines = vec![self.head(lost), String::new()];
        let (mut needs, signals, decisions) = (self.needs(), self.signals(), self.decisions());
        needs.extend(self.learned());
        // Needs come first; what is left is shared by signals and decisions.
        let room = size.rows.saturating_sub(lines.len());
        let for_needs = needs.len().min(room);
        let rest = room.saturating_sub(for_needs + 2);
        let for_decisions = decisions.len().min(rest / 2).max(LEAST.min(rest));
        let for_signals = signals.len().min(rest.saturating_sub(for_decisions));
        let for_decisions = decisions.len().min(rest.saturating_sub(for_signals));
        lines.extend(shortened(needs, for_needs));
        for (list, room) in [(signals, for_signals), (decisions, for_decisions)] {
            if room > 0 {
                lines.push(String::new());
                lines.extend(shortened(list, room));
            }
        }
        lines.truncate(size.rows);
        lines.iter().map(|line| cut(line, size.columns)).collect()
    }

    fn head(&self, lost: Option<&str>) -> String {
        let Picture { board, style } = self;
        let head = board.head();
        let age = board.age().map_or_else(String::new, |age| format!(", {} ago", seconds(age.as_secs_f64())));
        let name = format!("{} (shsa {})", word(&head["name"]), word(&head["version"]));
        let link = match (lost, &head["link"]) {
            (Some(why), _) => style.paint(Paint::Red, &format!("not reachable{age}: {why}")),
            (None, Value::Null) => "in one process".to_owned(),
            (None, link) if link["up"] == true => style.paint(Paint::Green, "bus connected"),
            (None, link) => {
                style.paint(Paint::Red, &format!("bus not connected: {}", word(&link["because"])))
            }
        };
        format!("{}  {}  {link}", style.paint(Paint::Bold, &name), clock(&head["time_ns"]))
    }

    fn needs(&self) -> Vec<String> {
        let board = self.board;
        let mut rows = Vec::new();
        for model in board.models() {
            for (need, row) in board.rows(model, "needs") {
                let value = board.row(model, "values", need).unwrap_or(&Value::Null);
                let tolerance = board.row(model, "tolerance", need).unwrap_or(&Value::Null);
                rows.push(vec![
                    word(&row["signal"]),
                    interval(value, &row["unit"]),
                    self.quality(&word(&row["quality"])),
                    row["assurance"]["level"].as_str().unwrap_or("-").to_owned(),
                    age(&value[2], board.head()),
                    tolerance["survives"]
                        .as_u64()
                        .map_or_else(|| "-".to_owned(), |losses| losses.to_string()),
                    row["longest_gap_s"].as_f64().map_or_else(|| "-".to_owned(), seconds),
                    word(&row["source"]),
                ]);
            }
        }
        self.table(&["need", "value", "quality", "level", "age", "survives", "longest gap", "source"], rows)
    }

    /// The signals that are not healthy come first.
    fn signals(&self) -> Vec<String> {
        let Picture { board, style } = self;
        let mut rows: Vec<(u8, Vec<String>)> = Vec::new();
        for model in board.models() {
            for (signal, row) in board.rows(model, "signals") {
                let verdict = word(&row["verdict"]);
                let reading = board.row(model, "readings", signal).unwrap_or(&Value::Null);
                let symptom = row["symptom"].as_str().map_or_else(String::new, |it| format!(", {it}"));
                let cells = vec![
                    signal.to_owned(),
                    word(&row["variable"]),
                    style.verdict(&verdict, &format!("{verdict}{symptom}")),
                    interval(reading, &row["unit"]),
                    age(&reading[2], board.head()),
                    reading[3].as_u64().map_or_else(|| "-".to_owned(), |count| count.to_string()),
                ];
                rows.push((urgency(&verdict), cells));
            }
        }
        rows.sort_by_key(|(urgency, _)| *urgency);
        let rows = rows.into_iter().map(|(_, cells)| cells).collect();
        self.table(&["signal", "variable", "verdict", "value", "age", "accepted"], rows)
    }

    /// What the instance learns of slow variables; no line where it learns nothing.
    fn learned(&self) -> Vec<String> {
        let board = self.board;
        let learned = board.models().flat_map(|model| board.rows(model, "learned"));
        let rows: Vec<Vec<String>> = learned
            .map(|(variable, row)| {
                let bounds = |lo: &Value, hi: &Value| interval(&json!([lo, hi]), &row["unit"]);
                let range = bounds(&row["range"][0], &row["range"][1]);
                let left = row["limit_in_s"].as_f64().map(Span::from_seconds);
                let left = left.map_or_else(|| "-".to_owned(), long_span);
                vec![variable.to_owned(), bounds(&row["lo"], &row["hi"]), range, word(&row["state"]), left]
            })
            .collect();
        let head = ["learned", "value", "range", "state", "leaves it in"];
        let table = if rows.is_empty() { Vec::new() } else { self.table(&head, rows) };
        let gap = (!table.is_empty()).then(String::new);
        gap.into_iter().chain(table).collect()
    }

    fn decisions(&self) -> Vec<String> {
        let Picture { board, style } = self;
        let described = |event: &Value| {
            let subject =
                ["signal", "relation", "need", "variable"].iter().find_map(|key| event[key].as_str());
            let kind = word(&event["kind"]);
            let kind = EventKind::named(&kind).map_or(kind.clone(), |it| style.paint(paint_of(it), &kind));
            vec![clock(&event["time_ns"]), kind, subject.unwrap_or("-").to_owned(), word(&event["because"])]
        };
        let rows: Vec<Vec<String>> = board.decisions().map(described).collect();
        if rows.is_empty() {
            return vec!["No decision yet.".to_owned()];
        }
        self.table(&["decided at", "what", "of", "because"], rows)
    }

    fn table(&self, head: &[&str], rows: Vec<Vec<String>>) -> Vec<String> {
        if rows.is_empty() {
            return vec![format!("{}: none", head.first().copied().unwrap_or_default())];
        }
        self.style.table(head, rows).lines().map(str::to_owned).collect()
    }

    fn quality(&self, quality: &str) -> String {
        let style = self.style;
        match quality {
            "Good" => style.paint(Paint::Green, quality),
            "Bad" => style.paint(Paint::Red, quality),
            _ => style.paint(Paint::Yellow, quality),
        }
    }
}

/// The first lines, and the number of the others in the last one.
fn shortened(mut lines: Vec<String>, room: usize) -> Vec<String> {
    let more = (lines.len() + 1).saturating_sub(room);
    if lines.len() > room && room > 0 {
        lines.truncate(room - 1);
        lines.push(format!("and {more} more"));
    }
    lines
}

/// A line without what does not fit; codes of colours have no width.
fn cut(line: &str, columns: usize) -> String {
    let (mut shown, mut width, mut in_code) = (String::new(), 0, false);
    for character in line.chars() {
        in_code = in_code || character == '\x1b';
        if !in_code {
            width += 1;
        }
        if in_code || width <= columns {
            shown.push(character);
        }
        in_code = in_code && character != 'm';
    }
    shown
}

fn urgency(verdict: &str) -> u8 {
    match verdict {
        "failed" => 0,
        "silent" => 1,
        "suspect" => 2,
        "unknown" => 3,
        _ => 4,
    }
}

fn word(value: &Value) -> String {
    value.as_str().unwrap_or("-").to_owned()
}

/// `1.20..1.28 m`, with as many digits as the width makes sense of.
fn interval(row: &Value, unit: &Value) -> String {
    let (Some(lo), Some(hi)) = (row[0].as_f64(), row[1].as_f64()) else { return "-".to_owned() };
    let unit = unit.as_str().map_or_else(String::new, |unit| format!(" {unit}"));
    let width = hi - lo;
    let digits = if width > 0.0 { (1.0 - width.log10().floor()).clamp(0.0, 9.0) as usize } else { 3 };
    if lo == hi { format!("{lo:.digits$}{unit}") } else { format!("{lo:.digits$}..{hi:.digits$}{unit}") }
}

/// How old a time is, by the clock of the instance.
fn age(time: &Value, head: &Value) -> String {
    match (time.as_i64(), head["time_ns"].as_i64()) {
        (Some(time), Some(now)) => seconds((now.saturating_sub(time)).max(0) as f64 / 1e9),
        _ => "-".to_owned(),
    }
}

/// The time of day, UTC.
fn clock(time: &Value) -> String {
    let Some(time) = time.as_i64() else { return "-".to_owned() };
    let seconds = time.div_euclid(1_000_000_000);
    let (millis, day) = (time.rem_euclid(1_000_000_000) / 1_000_000, seconds.rem_euclid(86_400));
    format!("{:02}:{:02}:{:02}.{millis:03}", day / 3600, day / 60 % 60, day % 60)
}
