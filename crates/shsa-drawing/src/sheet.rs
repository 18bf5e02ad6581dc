//! The canvas of every drawing: a sheet with its style, escaped texts, short numbers and text widths.

use std::fmt::{Arguments, Write};

/// Fonts that every system has; none is loaded.
const FONTS: &str = "system-ui,-apple-system,\"Segoe UI\",Roboto,\"Helvetica Neue\",Arial,sans-serif";

/// The largest width up to which a drawing shrinks with its page.
const WIDE: f64 = 1400.0;

/// The style of a class of elements: on a light background, and the differences on a dark one.
pub(super) struct Rule {
    /// The name without the prefix `shsa-`.
    pub(super) class: &'static str,
    /// CSS declarations.
    pub(super) light: &'static str,
    /// CSS declarations that replace those of `light`; empty when nothing differs.
    pub(super) dark: &'static str,
}

/// Styles that all kinds of drawings share.
const SHARED: [Rule; 3] = [
    Rule { class: "paper", light: "fill:#fff", dark: "fill:#15181d" },
    Rule { class: "text", light: "fill:#1d232b", dark: "fill:#e4e8ee" },
    Rule { class: "note", light: "fill:#57606a;font-size:12px", dark: "fill:#a0aab5" },
];

/// An SVG under construction; lengths are in pixels, y points down.
pub(super) struct Sheet {
    body: String,
}

impl Sheet {
    /// An empty sheet.
    pub(super) fn new() -> Sheet {
        Sheet { body: String::new() }
    }

    /// Adds elements; texts in them must be escaped.
    pub(super) fn put(&mut self, elements: Arguments<'_>) {
        // Writing into a `String` cannot fail.
        let _ = self.body.write_fmt(elements);
        self.body.push('\n');
    }

    /// Adds a text; `attributes` holds its place and no text of the user.
    pub(super) fn text(&mut self, attributes: Arguments<'_>, text: &str) {
        self.put(format_args!("<text {attributes}>{}</text>", escaped(text)));
    }

    /// The whole SVG, which begins with `<svg`: `kind` is the class of its root; screen readers read `title` and `description`.
    pub(super) fn finish(
        self,
        kind: &str,
        rules: &[Rule],
        (width, height): (f64, f64),
        title: &str,
        description: &str,
    ) -> String {
        // A wide drawing would become too small to read: it keeps its size, and its page scrolls. The style cannot hold this: it
        // is the same for all drawings of a page.
        let shrinks = if width <= WIDE { " style=\"max-width:100%;height:auto\"" } else { "" };
        let (width, height) = (px(width), px(height));
        let mut style = String::new();
        for rule in SHARED.iter().chain(rules) {
            style += &format!(".{kind} .shsa-{}{{{}}}\n", rule.class, rule.light);
        }
        style += "@media (prefers-color-scheme:dark){\n";
        for rule in SHARED.iter().chain(rules).filter(|rule| !rule.dark.is_empty()) {
            style += &format!(".{kind} .shsa-{}{{{}}}\n", rule.class, rule.dark);
        }
        style += "}\n";
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"{kind}\" role=\"img\" aria-label=\"{label}\" \
             width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\"{shrinks}>\n\
             <title>{label}</title>\n<desc>{description}</desc>\n\
             <style>\n.{kind}{{font-family:{FONTS};font-size:13px}}\n{style}</style>\n\
             <rect class=\"shsa-paper\" width=\"{width}\" height=\"{height}\"/>\n{body}</svg>\n",
            label = escaped(title),
            description = escaped(description),
            body = self.body,
        )
    }
}

/// A text for the content of an element or a quoted attribute. Characters that XML forbids become `\u{fffd}`.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for char in text.chars() {
        match char {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\t' | '\n' => safe.push(char),
            char if is_unfit(char) => safe.push('\u{fffd}'),
            char => safe.push(char),
        }
    }
    safe
}

/// Whether XML forbids a character, or the character would change the direction of the text around it.
fn is_unfit(char: char) -> bool {
    char.is_control()
        || matches!(char, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{fffe}' | '\u{ffff}')
}

/// A length or place in pixels with at most one decimal, without `-0`.
pub(super) fn px(value: f64) -> String {
    let tenths = (value * 10.0).round() / 10.0 + 0.0;
    format!("{tenths}")
}

/// The approximate width of a line of text in a sans-serif font of `size` pixels; rather too large than too small.
pub(super) fn width_of(text: &str, size: f64) -> f64 {
    text.chars().map(em).sum::<f64>() * size
}

/// A text of at most about `most` pixels of width; a longer one ends with `…`.
pub(super) fn fitted(text: &str, size: f64, most: f64) -> String {
    if width_of(text, size) <= most {
        return text.to_owned();
    }
    let mut left = most - width_of("…", size);
    let fits = |char: &char| {
        left -= em(*char) * size;
        left >= 0.0
    };
    let kept: String = text.chars().take_while(fits).collect();
    format!("{}…", kept.trim_end())
}

/// The advance of a character as a share of the font's size, between those of Arial and of `DejaVu` Sans.
fn em(char: char) -> f64 {
    match char {
        'i' | 'j' | 'l' | '|' | '\'' | '.' | ',' | ':' | ';' | '!' | 'I' => 0.31,
        ' ' | 'f' | 't' | 'r' | '/' | '(' | ')' | '[' | ']' | '-' => 0.38,
        'm' | 'w' | 'M' | 'W' | '@' | '%' | '…' => 0.92,
        'a'..='z' | '0'..='9' => 0.6,
        'A'..='Z' | '_' => 0.68,
        '+' | '=' | '<' | '>' | '*' | '#' | '~' => 0.7,
        // Ideographs and emoji fill the square.
        '\u{1100}'..='\u{115f}' | '\u{2e80}'..='\u{ffef}' | '\u{1f000}'.. => 1.05,
        _ => 0.66,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_texts_are_escaped() {
        assert_eq!(
            escaped("<a b='\"'>&\u{0}\u{202e}é"),
            "&lt;a b=&#39;&quot;&#39;&gt;&amp;\u{fffd}\u{fffd}é"
        );
    }

    #[test]
    fn lengths_are_short() {
        let lengths: Vec<String> = [0.0, -0.01, 1.25, 99.96, 1e6].map(px).into();
        assert_eq!(lengths, ["0", "0", "1.3", "100", "1000000"]);
    }

    #[test]
    fn long_texts_end_in_an_ellipsis() {
        assert_eq!(fitted("short", 10.0, 100.0), "short");
        let fitted = fitted("a very long name of a signal", 10.0, 100.0);
        assert!(fitted.ends_with('…') && width_of(&fitted, 10.0) <= 100.0, "{fitted}");
    }
}
