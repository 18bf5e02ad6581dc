//! The layout of a table: the separator, the names and units of its columns, and the form of its numbers.

use super::cells::{COLUMNS_MAX, Split, is_open, split};
use super::line::Line;
use crate::stamp::split_unit;
use shsa_core::unit::Unit;
use std::borrow::Cow;

/// The separator of columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Separator {
    /// This character.
    Character(char),
    /// Any number of blanks and tabs.
    Blanks,
}

impl Separator {
    /// Splits a row.
    pub(super) fn split(self, text: &str) -> Split<'_> {
        match self {
            Separator::Character(character) => split(text, character),
            // Numbers and most names have only blanks of ASCII between them, which are found sooner.
            Separator::Blanks if text.is_ascii() => words(text.split_ascii_whitespace()),
            Separator::Blanks => words(text.split_whitespace()),
        }
    }

    /// Whether a quote of a row is not closed; blanks are within no quotes.
    pub(super) fn is_open(self, text: &str) -> bool {
        match self {
            Separator::Character(character) => is_open(text, character),
            Separator::Blanks => false,
        }
    }

    fn cells(self, text: &str) -> Vec<Cow<'_, str>> {
        self.split(text).cells().unwrap_or_default()
    }
}

fn words<'a>(words: impl Iterator<Item = &'a str>) -> Split<'a> {
    Split::Cells(words.take(COLUMNS_MAX + 1).map(Cow::Borrowed).collect())
}

/// A table's layout, from its first lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) separator: Separator,
    /// The names of the columns with their units, `speed [m/s]`; a column without a name gets its number.
    pub(crate) headers: Vec<String>,
    /// The units in a line of their own.
    pub(crate) units: Vec<Option<String>>,
    /// The number of lines before the names that are neither comments nor blank: what a logger writes about itself.
    pub(crate) preamble: usize,
    /// The number of lines before the first row.
    pub(crate) lines: usize,
    /// Whether rows have a first cell that the header lacks.
    pub(crate) has_index: bool,
    /// Whether numbers are written like `1,5`.
    pub(crate) has_decimal_commas: bool,
}

/// Whether a line is a comment, or a header after a `#`.
pub(super) fn is_comment(text: &str) -> bool {
    text.trim_start().starts_with('#')
}

pub(super) fn is_number(cell: &str) -> bool {
    let cell = cell.trim();
    cell.parse::<f64>().is_ok() || cell.contains(',') && cell.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// `1,5`, but not `a,b`, and no blank.
pub(super) fn is_decimal_comma(cell: &str) -> bool {
    let cell = cell.trim();
    cell.split_once(',').is_some_and(|(whole, rest)| {
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        let whole = whole.strip_prefix(['-', '+']).unwrap_or(whole);
        let (fraction, exponent) = rest.split_once(['e', 'E']).unwrap_or((rest, "0"));
        (digits(whole) || whole.is_empty())
            && digits(fraction)
            && digits(exponent.strip_prefix(['-', '+']).unwrap_or(exponent))
    })
}

impl Layout {
    /// The layout of a file with these first lines; `None` where none of them is a row of names.
    pub(super) fn of(head: &[Line]) -> Option<Layout> {
        let lines: Vec<(usize, &str)> = head.iter().map(|line| line.text.as_str()).enumerate().collect();
        let lines: Vec<(usize, &str)> =
            lines.into_iter().filter(|(_, text)| !text.trim().is_empty()).collect();
        let preamble = preamble(&lines);
        let lines = lines.get(preamble..).unwrap_or_default();
        let plain = lines.iter().position(|(_, text)| !is_comment(text));
        let at = match plain {
            // Names after a `#`, with rows of numbers below.
            Some(plain) if looks_like_data(lines.get(plain)?.1) => {
                named_by_comment(lines, plain).unwrap_or(plain)
            }
            Some(plain) => plain,
            None => 0,
        };
        let &(line, text) = lines.get(at)?;
        let text = uncommented(text);
        let below: Vec<&str> = lines.iter().skip(at + 1).map(|(_, text)| *text).collect();
        let separator = separator(text, &below);
        let mut layout = Layout {
            separator,
            headers: separator.cells(text).iter().map(|cell| cell.trim().to_owned()).collect(),
            units: Vec::new(),
            preamble,
            lines: line + 1,
            has_index: false,
            has_decimal_commas: false,
        };
        if let Some(units) = layout.units(&below) {
            layout.units = units;
            layout.lines = lines.get(at + 1).map_or(layout.lines, |(line, _)| line + 1);
        }
        layout.look_at_rows(head.get(layout.lines..).unwrap_or_default());
        Some(layout)
    }

    /// The units in the line below the names.
    fn units(&self, below: &[&str]) -> Option<Vec<Option<String>>> {
        let line = below.first()?;
        let cells = self.separator.cells(uncommented(line));
        let is_row = |text: &&&str| self.separator.cells(text).iter().any(|cell| is_number(cell));
        let are_units = cells.len() == self.headers.len()
            && !cells.iter().any(|cell| is_number(cell))
            && below.get(1).filter(is_row).is_some()
            && (is_comment(line) || cells.iter().any(|cell| is_unit(cell)));
        let unit = |cell: &Cow<'_, str>| {
            let unit = cell.trim().trim_matches(['[', ']', '(', ')']).trim().to_owned();
            (!unit.is_empty() && unit != "-").then_some(unit)
        };
        are_units.then(|| cells.iter().map(unit).collect())
    }

    /// Sets the properties that only rows show.
    fn look_at_rows(&mut self, rows: &[Line]) {
        let rows: Vec<Vec<Cow<'_, str>>> = rows
            .iter()
            .map(|line| line.text.as_str())
            .filter(|text| !text.trim().is_empty() && !is_comment(text))
            .map(|text| self.separator.cells(text))
            .collect();
        let is_blank = |cell: Option<&Cow<'_, str>>| cell.is_none_or(|cell| cell.trim().is_empty());
        let is_longer =
            |cells: &Vec<Cow<'_, str>>| cells.len() == self.headers.len() + 1 && !is_blank(cells.last());
        let has_index = rows.first().is_some_and(is_longer) && rows.iter().take(3).all(is_longer);
        let numbers = || rows.iter().flatten();
        let is_decimal_point =
            |cell: &Cow<'_, str>| cell.matches('.').count() == 1 && cell.trim().parse::<f64>().is_ok();
        self.has_decimal_commas = self.separator != Separator::Character(',')
            && numbers().any(|cell| is_decimal_comma(cell))
            && !numbers().any(is_decimal_point);
        self.has_index = has_index;
        if has_index {
            self.headers.insert(0, String::new());
            if !self.units.is_empty() {
                self.units.insert(0, None);
            }
        }
        // Separators at the end of every line make no columns.
        while self.headers.last().is_some_and(String::is_empty)
            && rows.iter().all(|cells| is_blank(cells.get(self.headers.len() - 1)))
        {
            self.headers.pop();
        }
        for (at, header) in self.headers.iter_mut().enumerate() {
            if header.is_empty() {
                *header = format!("column {}", at + 1);
            }
        }
    }

    /// The unit of a column, from its header or the line below the header.
    pub(super) fn unit(&self, column: usize) -> Option<String> {
        let stated = self.units.get(column).cloned().flatten();
        stated.or_else(|| split_unit(self.headers.get(column)?).1.map(str::to_owned))
    }
}

/// A line without the `#` at its start.
fn uncommented(text: &str) -> &str {
    text.trim_start().trim_start_matches('#').trim_start()
}

/// How many lines stand before the names, although they are neither comments nor blank: the line `sep=;` of Excel, or what a logger
/// writes about itself. The latter have another number of cells than the names, which all lines behind the names have.
fn preamble(lines: &[(usize, &str)]) -> usize {
    let Some((_, first)) = lines.first() else { return 0 };
    if first.trim_start().starts_with("sep=") {
        return 1;
    }
    // The last line may be cut short.
    let Some((_, row)) = lines.iter().rev().nth(1).filter(|_| !is_comment(first)) else { return 0 };
    let separator = separator(row, &[]);
    let width = |text: &str| separator.cells(text).len();
    let cells = width(row);
    let alike = lines.iter().rev().skip(1).take_while(|(_, text)| width(text) == cells).count();
    let names = lines.len() - 1 - alike;
    let has_names =
        lines.get(names).is_some_and(|(_, text)| !separator.cells(text).iter().any(|it| is_number(it)));
    if cells > 1 && alike > 2 && width(first) + 1 < cells && has_names { names } else { 0 }
}

/// Whether most cells of a line are numbers.
fn looks_like_data(text: &str) -> bool {
    let cells = separator(text, &[]).cells(text);
    let numbers = cells.iter().filter(|cell| is_number(cell)).count();
    cells.len() > 1 && 2 * numbers > cells.len()
}

/// The first comment before a row with as many cells, none of which is a number.
fn named_by_comment(lines: &[(usize, &str)], row: usize) -> Option<usize> {
    let (_, text) = lines.get(row)?;
    let separator = separator(text, &[]);
    let cells = separator.cells(text).len();
    let is_header = |(_, text): &(usize, &str)| {
        let names = separator.cells(uncommented(text));
        names.len() == cells && !names.iter().any(|name| is_number(name))
    };
    lines.iter().take(row).position(is_header)
}

/// The separator of a line: the most frequent one; blanks where there is none and the lines below have as many cells.
fn separator(text: &str, below: &[&str]) -> Separator {
    let count = |separator: char| text.matches(separator).count();
    let most =
        [',', ';', '\t', '|'].into_iter().rev().max_by_key(|separator| count(*separator)).unwrap_or(',');
    let words = text.split_whitespace().count();
    let are_alike = below.iter().take(3).all(|line| uncommented(line).split_whitespace().count() == words);
    let are_blanks = count(most) == 0 && words > 1 && are_alike;
    if are_blanks { Separator::Blanks } else { Separator::Character(most) }
}

fn is_unit(cell: &str) -> bool {
    let cell = cell.trim();
    let bare = cell.trim_matches(['[', ']', '(', ')']).trim();
    !cell.is_empty() && (bare.len() < cell.len() || Unit::parse(bare).is_ok())
}
