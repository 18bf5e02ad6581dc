//! How texts look: colours of a terminal, its width, and aligned tables.

use shsa_format::text;

/// How a text looks.
///
/// # Example
/// ```
/// use shsa_report::{Paint, Style};
///
/// assert_eq!(Style::PLAIN.paint(Paint::Red, "no"), "no");
/// let terminal = Style { colour: true, width: Some(24) };
/// assert_eq!(terminal.paint(Paint::Red, "no"), "\x1b[31mno\x1b[0m");
/// assert_eq!(terminal.wrapped("one line that is too long", 2), "  one line that is too\n  long");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// Whether colours are written, as escape sequences of a terminal.
    pub colour: bool,
    /// The width of the terminal in characters, at which sentences are wrapped; `None` for one line each.
    pub width: Option<usize>,
}

/// A colour of the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paint {
    /// What is wrong.
    Red,
    /// What is well.
    Green,
    /// What is doubtful.
    Yellow,
    /// Headings.
    Bold,
}

impl Style {
    /// Without colours and without wrapping: for files and pipes.
    pub const PLAIN: Style = Style { colour: false, width: None };

    /// The text in a colour, if there are colours.
    #[must_use]
    pub fn paint(self, paint: Paint, text: &str) -> String {
        if !self.colour {
            return text.to_owned();
        }
        let code = match paint {
            Paint::Red => 31,
            Paint::Green => 32,
            Paint::Yellow => 33,
            Paint::Bold => 1,
        };
        format!("\x1b[{code}m{text}\x1b[0m")
    }

    /// The text in the colour of a verdict.
    #[must_use]
    pub fn verdict(self, verdict: &str, text: &str) -> String {
        match verdict {
            "healthy" => self.paint(Paint::Green, text),
            "failed" | "silent" => self.paint(Paint::Red, text),
            "suspect" => self.paint(Paint::Yellow, text),
            _ => text.to_owned(),
        }
    }

    /// Rows with aligned columns below a heading, which is emphasised; the caller formats numbers.
    #[must_use]
    pub fn table(self, head: &[&str], rows: Vec<Vec<String>>) -> String {
        let head: Vec<String> = head.iter().map(|cell| self.paint(Paint::Bold, cell)).collect();
        text::table(&head, rows)
    }

    /// The text wrapped to the width, each line indented by this many blanks.
    #[must_use]
    pub fn wrapped(self, text: &str, indent: usize) -> String {
        let room = self.width.map_or(usize::MAX, |width| width.saturating_sub(indent).max(20));
        let mut lines: Vec<String> = Vec::new();
        for word in text.split(' ') {
            match lines.last_mut().filter(|line| line.chars().count() + 1 + word.chars().count() <= room) {
                Some(line) => *line = format!("{line} {word}"),
                None => lines.push(word.to_owned()),
            }
        }
        let indented: Vec<String> = lines.iter().map(|line| format!("{:indent$}{line}", "")).collect();
        indented.join("\n")
    }
}
