//! Texts for people: aligned tables, counts, times.

/// Rows with aligned columns, two spaces between them, below a head; the caller formats numbers.
#[must_use]
pub fn table(head: &[impl AsRef<str>], mut rows: Vec<Vec<String>>) -> String {
    rows.insert(0, head.iter().map(|cell| cell.as_ref().to_owned()).collect());
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| shown_width(cell)).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let padding = |cell: &str, width: usize| " ".repeat(width.saturating_sub(shown_width(cell)));
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(cell, &width)| format!("{cell}{}", padding(cell, width))).collect();
        cells.join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// The number of visible characters of a text, without the codes of its colour.
fn shown_width(text: &str) -> usize {
    let mut in_colour = false;
    let shown = |character: &char| {
        let hidden = in_colour || *character == '\x1b';
        in_colour = hidden && *character != 'm';
        !hidden
    };
    text.chars().filter(shown).count()
}

/// `1 need`, `2 needs`.
#[must_use]
pub fn counted(count: usize, one: &str) -> String {
    format!("{count} {one}{}", if count == 1 { "" } else { "s" })
}

/// A time to two or three digits; `unknown` when it is not a number.
#[must_use]
pub fn seconds(value: f64) -> String {
    let (scaled, unit) = match value {
        _ if value.is_nan() => return "unknown".to_owned(),
        _ if value < 1e-6 => (value * 1e9, "ns"),
        _ if value < 1e-3 => (value * 1e6, "us"),
        _ if value < 1.0 => (value * 1e3, "ms"),
        _ => (value, "s"),
    };
    let digits = usize::from(scaled < 9.95);
    format!("{scaled:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_for_people() {
        let times = [3.04e-8, 9.99e-6, 1.5e-3, 0.123, 2.0, f64::NAN].map(seconds);
        assert_eq!(times, ["30 ns", "10 us", "1.5 ms", "123 ms", "2.0 s", "unknown"]);
    }
}
