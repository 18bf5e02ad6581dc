//! The terminal: permanent lines, and where it can be drawn a picture below them.

use crate::Decision;
use shsa_core::engine::{EventKind, Severity};
use shsa_core::time::Time;
use std::io::{self, IsTerminal, Write};
use terminal_size::{Height, Width, terminal_size};

/// The kind of a text, which determines its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ink {
    #[default]
    /// As it is.
    Plain,
    /// Of little weight.
    Faint,
    /// Of much weight.
    Strong,
    /// What works.
    Good,
    /// What may not work.
    Warning,
    /// What does not work.
    Bad,
    /// An obstacle in a scan.
    Echo,
}

/// One character and its ink.
pub type Cell = (char, Ink);
/// Texts in one line, each with its ink.
pub type Line = Vec<(String, Ink)>;

/// The length of a bar in characters.
const BAR_LENGTH: usize = 10;
/// The full scale of a bar, metres.
const BAR_RANGE: f64 = 3.2;
/// Columns between the two parts of a picture.
const GAP: usize = 2;
/// The width of a terminal for a picture, and what its height needs beyond the picture.
const NEEDED_COLUMNS: u16 = 80;
const NEEDED_ROWS: usize = 4;

/// The colour of a decision.
#[must_use]
pub fn ink_of(kind: EventKind) -> Ink {
    match kind.severity() {
        Severity::Info => Ink::Good,
        Severity::Warning => Ink::Warning,
        Severity::Error => Ink::Bad,
    }
}

/// The terminal, or its replacement.
pub struct Terminal {
    live: bool,
    quiet: bool,
    colour: bool,
    /// The number of the picture's rows on the terminal.
    drawn: usize,
}

impl Terminal {
    /// `live` draws the picture if the terminal allows it; `quiet` suppresses all output.
    #[must_use]
    pub fn new(live: bool, quiet: bool) -> Terminal {
        let terminal = io::stdout().is_terminal();
        Terminal { live: live && terminal && !quiet, quiet, colour: terminal && is_wanted(), drawn: 0 }
    }

    /// Whether there is a picture.
    #[must_use]
    pub fn is_live(&self) -> bool {
        self.live
    }

    /// Writes a permanent line.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn event(&mut self, time: Time, kind: &str, ink: Ink, text: &str) -> io::Result<()> {
        let lines = wrap(text, self.width().saturating_sub(26));
        let head = format!("{:>8.2} s  {kind:<12}", time.seconds());
        let mut out = String::new();
        for (index, line) in lines.iter().enumerate() {
            let left = if index == 0 { self.paint(&head, ink) } else { " ".repeat(22) };
            out.push_str(&format!("{left}  {line}\x1b[K\n"));
        }
        self.print_line(&out)
    }

    /// Writes a decision as a permanent line.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn decided(&mut self, decision: &Decision) -> io::Result<()> {
        let subject = decision.signal.as_ref().or(decision.variable.as_ref());
        let mut text = format!("{}: {}", subject.map_or("", String::as_str), decision.because);
        if let Some(substitution) = &decision.substitution {
            text.push_str(&format!("; now from {substitution}"));
        }
        self.event(decision.time, decision.kind.name(), ink_of(decision.kind), &text)
    }

    /// Writes lines as they are.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn print_line(&mut self, text: &str) -> io::Result<()> {
        if self.quiet {
            return Ok(());
        }
        let above = self.to_top();
        let text = if self.live { text.to_string() } else { text.replace("\x1b[K", "") };
        let clear = if self.live { "\x1b[J" } else { "" };
        self.drawn = 0;
        write(&format!("{above}{clear}{text}"))
    }

    /// Draws the picture anew if there is room for it: cells, and the lines beside them.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn draw(&mut self, map: &[Vec<Cell>], side: &[Line]) -> io::Result<()> {
        if !self.live || !fits(map.len()) {
            return Ok(());
        }
        let blank = Line::new();
        let mut out = self.to_top();
        for (row, cells) in map.iter().enumerate() {
            let texts = side.get(row).unwrap_or(&blank).iter();
            let line: String = texts.map(|(text, ink)| self.paint(text, *ink)).collect();
            out.push_str(&format!("{}{:GAP$}{line}\x1b[K\n", self.paint_cells(cells), ""));
        }
        self.drawn = map.len();
        write(&out)
    }

    /// Leaves the last picture on the terminal.
    pub fn leave_picture(&mut self) {
        self.drawn = 0;
    }

    fn to_top(&self) -> String {
        if self.drawn > 0 { format!("\x1b[{}A\r", self.drawn) } else { String::new() }
    }

    /// The columns beside a picture of this width.
    #[must_use]
    pub fn beside(&self, columns: usize) -> usize {
        self.width().saturating_sub(columns + GAP)
    }

    fn width(&self) -> usize {
        terminal_size().map_or(120, |(Width(columns), _)| usize::from(columns))
    }

    fn paint(&self, text: &str, ink: Ink) -> String {
        let code = match ink {
            Ink::Plain => return text.to_string(),
            Ink::Faint => 2,
            Ink::Strong => 1,
            Ink::Good => 32,
            Ink::Warning => 33,
            Ink::Bad => 31,
            Ink::Echo => 36,
        };
        if self.colour { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_string() }
    }

    fn paint_cells(&self, cells: &[Cell]) -> String {
        let same = cells.chunk_by(|a, b| a.1 == b.1);
        same.map(|run| self.paint(&run.iter().map(|cell| cell.0).collect::<String>(), run[0].1)).collect()
    }
}

/// Whether nobody has switched colours off (<https://no-color.org>).
fn is_wanted() -> bool {
    std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

fn write(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

fn fits(rows: usize) -> bool {
    let is_enough = |(Width(columns), Height(height)): (Width, Height)| {
        columns >= NEEDED_COLUMNS && usize::from(height) >= rows + NEEDED_ROWS
    };
    terminal_size().is_none_or(is_enough)
}

/// A name, a bar in eighths of a character, and the number.
#[must_use]
pub fn bar(name: &str, metres: Option<f64>, ink: Ink) -> Line {
    const PARTS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let share = (metres.unwrap_or(0.0) / BAR_RANGE).clamp(0.0, 1.0);
    let eighths = (share * (8 * BAR_LENGTH) as f64).round() as usize;
    let filled = format!("{}{}", "█".repeat(eighths / 8), PARTS[eighths % 8]);
    let number = metres.map_or("   -".to_string(), |metres| format!("{metres:>4.2}"));
    vec![
        (format!("  {name:<6}"), Ink::Plain),
        (format!("{filled:<BAR_LENGTH$}"), ink),
        (format!(" {number} m"), Ink::Plain),
    ]
}

/// Wraps text into lines of at most `width` characters, unless a word is longer.
#[must_use]
pub fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().map_or(0, |line| line.chars().count());
        if line > 0 && line + 1 + word.chars().count() > width {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            line.push_str(if line.is_empty() { "" } else { " " });
            line.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_grow_by_eighths() {
        let text = |metres| bar("x", metres, Ink::Plain)[1].0.trim_end().to_string();
        assert_eq!(text(Some(BAR_RANGE / 2.0)), "█████");
        assert_eq!(text(Some(BAR_RANGE / 80.0 * 3.0)), "▍");
        assert_eq!(text(Some(9.0)), "██████████");
        assert_eq!(text(None), "");
    }

    #[test]
    fn long_text_is_wrapped_between_words() {
        assert_eq!(wrap("one two three four", 9), ["one two", "three", "four"]);
        assert_eq!(wrap("unbreakable", 4), ["unbreakable"]);
    }
}
