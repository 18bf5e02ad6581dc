//! Texts for people: aligned tables, counts, times.

use std::borrow::Cow;

/// Rows with aligned columns, two spaces between them, below a head; the caller formats numbers. Control characters of cells are
/// written as escapes, but for colours.
#[must_use]
pub fn table(head: &[impl AsRef<str>], mut rows: Vec<Vec<String>>) -> String {
    let clean = |cell: &mut String| {
        if cell.contains(char::is_control) {
            *cell = decent(cell).replace('\n', "\\n");
        }
    };
    rows.iter_mut().flatten().for_each(clean);
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

/// A text from elsewhere, such as a name on a bus or in a recording, for one line of a terminal or a log: control characters are
/// written as escapes, which neither move the cursor nor begin a line.
#[must_use]
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(char::is_control) {
        return Cow::Borrowed(text);
    }
    let written = |c: char| if c.is_control() { c.escape_debug().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(written).collect())
}

/// As [`printable`], for a text of our own that may have colours and lines.
#[must_use]
pub fn decent(text: &str) -> Cow<'_, str> {
    if !text.contains(|c: char| c.is_control() && c != '\n') {
        return Cow::Borrowed(text);
    }
    let (mut decent, mut colour_end) = (String::with_capacity(text.len()), 0);
    for (at, c) in text.char_indices() {
        if c == '\x1b' {
            colour_end = at + colour_code(&text[at..]);
        }
        match at < colour_end || c == '\n' {
            true => decent.push(c),
            false => decent.push_str(&printable(c.encode_utf8(&mut [0; 4]))),
        }
    }
    Cow::Owned(decent)
}

/// The length of the code of a colour with which a text begins, or 0.
fn colour_code(text: &str) -> usize {
    let Some(parameters) = text.strip_prefix("\x1b[") else { return 0 };
    let end = parameters.find(|c: char| !c.is_ascii_digit() && c != ';');
    end.filter(|end| parameters[*end..].starts_with('m')).map_or(0, |end| end + 3)
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
    fn what_comes_from_elsewhere_moves_no_cursor() {
        assert_eq!(printable("a/b \u{e4}"), "a/b \u{e4}");
        assert_eq!(printable("a\x1b]0;x\x07\nfailed b\r"), "a\\u{1b}]0;x\\u{7}\\nfailed b\\r");
        assert_eq!(
            decent("\x1b[31;1mred\x1b[0m\n and \x1b[2J\x07"),
            "\x1b[31;1mred\x1b[0m\n and \\u{1b}[2J\\u{7}"
        );
        assert_eq!(decent("two\nlines"), "two\nlines");
    }

    #[test]
    fn times_are_written_for_people() {
        let times = [3.04e-8, 9.99e-6, 1.5e-3, 0.123, 2.0, f64::NAN].map(seconds);
        assert_eq!(times, ["30 ns", "10 us", "1.5 ms", "123 ms", "2.0 s", "unknown"]);
    }
}
