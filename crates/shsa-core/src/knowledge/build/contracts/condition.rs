//! Conditions in words: `fresh and sound`, `lidar or (sonar and camera)`, `2 of (a, b, c)`.

use crate::expression::Problem;
use crate::knowledge::contract::Condition;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::Range;

/// The longest condition in bytes.
const MAX_TEXT: usize = 4_096;
/// The deepest nesting of parentheses.
const MAX_DEPTH: usize = 16;

/// Words of conditions, which are no names.
pub(super) const WORDS: [&str; 4] = ["and", "or", "of", ALWAYS];
/// The condition that needs nothing.
const ALWAYS: &str = "always";

/// Reads a condition; `leaf` resolves a name.
pub(super) fn read(text: &str, leaf: &dyn Fn(&str) -> Option<Condition>) -> Result<Condition, Problem> {
    if text.len() > MAX_TEXT {
        let problem = Problem::error(0..text.len(), format!("a condition has at most {MAX_TEXT} bytes"));
        return Err(problem.with_help("split it into several guarantees"));
    }
    let mut reader = Reader { text, at: 0, leaf };
    let condition = reader.joined(0)?;
    match reader.peek() {
        None => Ok(condition),
        Some(_) => {
            let span = reader.next_span();
            let problem = Problem::error(span, "nothing can follow here");
            Err(problem.with_help("join names by `and` or `or`"))
        }
    }
}

/// Whether a text can be the name of a leaf.
pub(super) fn is_name(name: &str) -> bool {
    let begins = name.starts_with(|c: char| c.is_alphabetic());
    begins && name.chars().all(is_part) && !WORDS.contains(&name)
}

fn is_part(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '-' | '.')
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    leaf: &'a dyn Fn(&str) -> Option<Condition>,
}

impl<'a> Reader<'a> {
    /// The next word or sign.
    fn peek(&self) -> Option<&'a str> {
        self.text.get(self.next_span()).filter(|token| !token.is_empty())
    }

    fn next_span(&self) -> Range<usize> {
        let rest = self.text.get(self.at..).unwrap_or("");
        let start = self.at + (rest.len() - rest.trim_start().len());
        let rest = rest.trim_start();
        let word = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        let sign = rest.chars().next().map_or(0, char::len_utf8);
        start..start + if word == 0 { sign } else { word }
    }

    fn take(&mut self, token: &str) -> bool {
        let found = self.peek() == Some(token);
        if found {
            self.at = self.next_span().end;
        }
        found
    }

    fn error(&self, message: &str, help: &str) -> Problem {
        let Range { start, end } = self.next_span();
        Problem::error(start..end.max(start), String::from(message)).with_help(help)
    }

    /// Parts that are all joined by `and`, or all by `or`.
    fn joined(&mut self, depth: usize) -> Result<Condition, Problem> {
        let first = self.part(depth)?;
        let (by, other) = match self.peek() {
            Some("and") => ("and", "or"),
            Some("or") => ("or", "and"),
            _ => return Ok(first),
        };
        let mut parts = Vec::from([first]);
        while self.take(by) {
            parts.push(self.part(depth)?);
        }
        if self.peek() == Some(other) {
            let help = "put what belongs together into parentheses: `a or (b and c)`";
            return Err(self.error("`and` and `or` stand side by side", help));
        }
        Ok(if by == "and" { Condition::All(parts) } else { Condition::Any(parts) })
    }

    fn part(&mut self, depth: usize) -> Result<Condition, Problem> {
        if self.take("(") {
            if depth == MAX_DEPTH {
                return Err(
                    self.error("this condition is nested too deeply", "split it into several guarantees")
                );
            }
            let inner = self.joined(depth + 1)?;
            return if self.take(")") { Ok(inner) } else { Err(self.error("a `)` is missing", "close it")) };
        }
        let span = self.next_span();
        let word =
            self.peek().ok_or_else(|| self.error("a name is missing", "name what is asked or observed"))?;
        self.at = span.end;
        if word == ALWAYS {
            return Ok(Condition::All(Vec::new()));
        }
        match word.parse::<u32>() {
            Ok(count) => self.several(count, span, depth),
            Err(_) => (self.leaf)(word)
                .ok_or_else(|| Problem::error(span, format!("`{word}` is neither asked nor observed here"))),
        }
    }

    /// `of (a, b, c)` behind a number.
    fn several(&mut self, count: u32, span: Range<usize>, depth: usize) -> Result<Condition, Problem> {
        if !(self.take("of") && self.take("(")) || depth == MAX_DEPTH {
            return Err(self.error("`of (` is missing behind the number", "write it like `2 of (a, b, c)`"));
        }
        let mut parts = Vec::from([self.joined(depth + 1)?]);
        while self.take(",") {
            parts.push(self.joined(depth + 1)?);
        }
        if !self.take(")") {
            return Err(self.error("a `)` is missing", "write it like `2 of (a, b, c)`"));
        }
        let most = u32::try_from(parts.len()).unwrap_or(u32::MAX);
        if count == 0 || count > most {
            let problem = Problem::error(span, format!("{count} of {most} is no choice"));
            return Err(problem.with_help(format!("write a number from 1 to {most}")));
        }
        Ok(Condition::AtLeast(count, parts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::{String, ToString};

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let leaf =
            |name: &str| ["a", "b", "c", "d"].iter().position(|known| *known == name).map(Condition::Asked);
        let described = match read(text, &leaf) {
            Ok(condition) => written(&condition),
            Err(problem) => problem.to_string(),
        };
        assert_eq!(described, expected, "{text}");
    }

    fn written(condition: &Condition) -> String {
        let joined = |parts: &[Condition], by: &str| parts.iter().map(written).collect::<Vec<_>>().join(by);
        match condition {
            Condition::All(parts) => std::format!("({})", joined(parts, " and ")),
            Condition::Any(parts) => std::format!("({})", joined(parts, " or ")),
            Condition::AtLeast(count, parts) => std::format!("{count}({})", joined(parts, ", ")),
            Condition::Asked(at) => ["a", "b", "c", "d"][*at].to_string(),
            Condition::Watched(_) => String::new(),
        }
    }

    #[test]
    fn conditions_are_read_as_they_are_spoken() {
        check("a", "a");
        check("always", "()");
        check(" a and b and c", "(a and b and c)");
        check("a or (b and c)", "(a or (b and c))");
        check("2 of (a, b or c, d) and a", "(2(a, (b or c), d) and a)");
        check(
            "a and b or c",
            "error at 8..10: `and` and `or` stand side by side (put what belongs together into parentheses: `a or (b and c)`)",
        );
        check("a and e", "error at 6..7: `e` is neither asked nor observed here");
        check("a and", "error at 5..5: a name is missing (name what is asked or observed)");
        check("3 of (a, b)", "error at 0..1: 3 of 2 is no choice (write a number from 1 to 2)");
        check("(a", "error at 2..2: a `)` is missing (close it)");
        check("a b", "error at 2..3: nothing can follow here (join names by `and` or `or`)");
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_a_condition_or_an_error(text in "[abcde0-9(),andorf ]{0,40}|\\PC{0,40}") {
            let leaf = |name: &str| (name.len() < 2).then_some(Condition::Asked(0));
            if let Err(problem) = read(&text, &leaf) {
                proptest::prop_assert!(problem.span.end <= text.len() && text.is_char_boundary(problem.span.start));
            }
        }
    }
}
