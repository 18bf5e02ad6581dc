//! The path of a field within a message: `twist.linear.x`, `/twist/linear/x`, `position[1]`, `position[name=left_wheel]`.

use crate::MessageError;

/// The largest number of steps of a path.
const STEPS_MAX: usize = 32;

/// One step into a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// The member of this name; in a list, the element of this number.
    Key(String),
    /// The element of a list, counted from 0.
    Index(usize),
    /// All elements of a list: what follows is read of each.
    Each,
}

impl Step {
    /// The index that it stands for in a list: `[1]`, or the name `1`.
    #[must_use]
    pub fn index(&self) -> Option<usize> {
        match self {
            Step::Index(index) => Some(*index),
            Step::Key(key) => key.parse().ok(),
            Step::Each => None,
        }
    }
}

/// A condition on a message, or the selection of a list's element: `[NAME=TEXT]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Condition {
    /// The path of the text, from the root of the message.
    pub steps: Vec<Step>,
    /// The wanted text; numbers are compared as numbers.
    pub text: String,
}

/// The path of a field, from the root of the message.
///
/// | text | means |
/// |---|---|
/// | nothing, or `data` | the message itself; its member `data` if it has one |
/// | `twist.linear.x` | members by name |
/// | `/twist/linear/x`, `/list/0` | the same as a JSON pointer (RFC 6901), for names with dots, brackets or blanks |
/// | `position[1]`, `position.1` | the second element |
/// | `tracks[].x` | the member `x` of each element of the list `tracks`: a list |
/// | `position[name=left]` | where `name` is a list: the element of `position` at which `name` has this text |
/// | `value[id=3]` | where `id` is a number or a text: only of messages in which it is this one |
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Path {
    /// The steps from the root; none for the message itself.
    pub steps: Vec<Step>,
    /// The conditions, all of which must hold.
    pub conditions: Vec<Condition>,
}

impl Path {
    /// Parses a path.
    ///
    /// # Errors
    /// The part that does not follow the grammar.
    pub fn parse(text: &str) -> Result<Path, MessageError> {
        let (base, conditions) = split_conditions(text.trim());
        let mut steps = if base == "data" { Vec::new() } else { steps(base)? };
        // All elements of a list, without a member, are the list.
        steps.pop_if(|step| *step == Step::Each);
        if steps.iter().filter(|step| **step == Step::Each).count() > 1 {
            return Err(MessageError::ListOfLists { path: text.to_owned() });
        }
        let conditions = conditions
            .into_iter()
            .map(|(name, text)| Ok(Condition { steps: steps_of_condition(name)?, text: text.to_owned() }));
        Ok(Path { steps, conditions: conditions.collect::<Result<_, MessageError>>()? })
    }
}

fn steps_of_condition(name: &str) -> Result<Vec<Step>, MessageError> {
    if name.is_empty() { Err(MessageError::NamelessCondition) } else { steps(name) }
}

/// The steps to a list, and those within each of its elements; `None` where the path is that of one value.
#[must_use]
pub fn split_each(steps: &[Step]) -> Option<(&[Step], &[Step])> {
    let at = steps.iter().position(|step| *step == Step::Each)?;
    Some((steps.get(..at)?, steps.get(at + 1..)?))
}

/// Splits `[NAME=TEXT]` off the end, in order; brackets without `=` belong to the name: `speed [m/s]`, `position[1]`.
pub(crate) fn split_conditions(mut text: &str) -> (&str, Vec<(&str, &str)>) {
    let mut conditions = Vec::new();
    while let Some((rest, condition)) = text.strip_suffix(']').and_then(|open| open.rsplit_once('[')) {
        let Some((name, asked)) = condition.split_once('=') else { break };
        conditions.push((name.trim(), asked.trim()));
        text = rest.trim_end();
    }
    conditions.reverse();
    (text, conditions)
}

fn steps(text: &str) -> Result<Vec<Step>, MessageError> {
    let mut steps = Vec::new();
    if let Some(pointer) = text.strip_prefix('/') {
        let names = pointer.split('/').map(|name| name.replace("~1", "/").replace("~0", "~"));
        steps.extend(names.map(Step::Key));
    } else if !text.is_empty() {
        text.split('.').try_for_each(|part| push_part(part, text, &mut steps))?;
    }
    if steps.len() > STEPS_MAX {
        return Err(MessageError::LongPath { steps: steps.len(), most: STEPS_MAX });
    }
    Ok(steps)
}

/// Parses `position[1][2]`: the name, then the numbers.
fn push_part(part: &str, path: &str, steps: &mut Vec<Step>) -> Result<(), MessageError> {
    let (name, mut indexes) = part.split_once('[').unwrap_or((part, ""));
    if !name.trim().is_empty() {
        steps.push(Step::Key(name.trim().to_owned()));
    } else if indexes.is_empty() {
        return Err(MessageError::Nameless { path: path.to_owned() });
    }
    while !indexes.is_empty() {
        let (index, rest) = indexes.split_once(']').unwrap_or((indexes, "?"));
        steps.push(match index.trim() {
            "" => Step::Each,
            number => Step::Index(number.parse().map_err(|_| not_an_index(index, name, path))?),
        });
        indexes = match rest.strip_prefix('[') {
            None if rest.is_empty() => rest,
            None => return Err(not_an_index(rest, name, path)),
            Some(rest) => rest,
        };
    }
    Ok(())
}

fn not_an_index(index: &str, name: &str, path: &str) -> MessageError {
    MessageError::NoIndex { index: index.to_owned(), name: name.to_owned(), path: path.to_owned() }
}

/// Whether a found text is the wanted one: the same text, or the same number.
#[must_use]
pub fn is_text(found: &str, asked: &str) -> bool {
    let number = |text: &str| text.parse::<f64>().ok();
    found == asked || number(found).is_some_and(|value| number(asked) == Some(value))
}

/// Whether a found number is the wanted one.
#[must_use]
pub fn is_number(found: f64, asked: &str) -> bool {
    asked.parse() == Ok(found) || found.is_nan() && asked == "NaN"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let show = |steps: &[Step]| -> String {
            let step = |step: &Step| match step {
                Step::Key(key) => format!("<{key}>"),
                Step::Index(index) => format!("#{index}"),
                Step::Each => "*".to_owned(),
            };
            steps.iter().map(step).collect()
        };
        let shown = match Path::parse(text) {
            Err(problem) => format!("error: {problem}"),
            Ok(path) => {
                let condition = |c: &Condition| format!(" where {}={}", show(&c.steps), c.text);
                show(&path.steps) + &path.conditions.iter().map(condition).collect::<String>()
            }
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn the_grammar() {
        check("", "");
        check("data", "");
        check("a", "<a>");
        check("a.b.c", "<a><b><c>");
        check("/a/b~1c/0", "<a><b/c><0>");
        check("/speed [m~1s]", "<speed [m/s]>");
        check("list[1]", "<list>#1");
        check("[0].x[1][2]", "#0<x>#1#2");
        check("tracks[].pose.x", "<tracks>*<pose><x>");
        check("[].x[1]", "*<x>#1");
        check("list[]", "<list>");
        check("position[name=left_wheel]", "<position> where <name>=left_wheel");
        check("value[id=3][header.frame=a b]", "<value> where <id>=3 where <header><frame>=a b");
        check("[id=3]", " where <id>=3");
    }

    #[test]
    fn what_breaks_the_grammar_is_said() {
        check("a..b", "error: `a..b` names nothing between two dots");
        let advice = "or begin with a slash, then brackets belong to the name";
        check("a[b]", &format!("error: `[b` in `a[b]` is no index, write it like a[0]; {advice}"));
        check("a[1]b", &format!("error: `[b` in `a[1]b` is no index, write it like a[0]; {advice}"));
        check(
            "a[].b[].c",
            "error: `a[].b[].c` asks for lists in a list, and a value is one list; name an element, as in a[0]",
        );
        check("a[1", &format!("error: `[?` in `a[1` is no index, write it like a[0]; {advice}"));
        check("a[=3]", "error: a condition names no field; write it like [name=left]");
        check(
            &"a.".repeat(40),
            "error: `a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.` names nothing between two dots",
        );
        check(&["a"; 40].join("."), "error: a path has 40 steps, more than 32");
    }

    #[test]
    fn conditions_compare_texts_and_numbers() {
        assert!(is_text("1", "1.0") && is_text("abc", "abc"));
        assert!(!is_text("10", "1") && !is_text("nan", "1") && !is_text("", "1"));
    }
}
