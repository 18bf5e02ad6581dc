//! Reads nodes of the tree as expected values, and reports the others.

use shsa_core::knowledge::{Bounds, Diagnostic, Place, PropertyDrafts, Severity, Text};
use shsa_core::unit::nearest;
use std::fmt::Display;

use super::problem;
use super::tree::{Node, Value};

/// The most problems of the shape that are kept; more do not help the user.
const MAX_PROBLEMS: usize = 10_000;

/// Collects the problems of a whole model.
#[derive(Default)]
pub struct Reader {
    /// The problems so far.
    pub problems: Vec<Diagnostic>,
}

/// The values of a mapping whose keys are fixed.
pub struct Fields<'n> {
    entries: &'n [(Text, Node)],
}

impl<'n> Fields<'n> {
    /// The values of a mapping whose keys are checked elsewhere.
    pub fn of(entries: &'n [(Text, Node)]) -> Self {
        Fields { entries }
    }

    /// The value of a key; `None` when it is absent or null.
    pub fn get(&self, key: &str) -> Option<&'n Node> {
        let found = self.entries.iter().find(|(name, _)| name.text == key);
        found.map(|(_, node)| node).filter(|node| !matches!(node.value, Value::Null))
    }
}

impl Reader {
    /// Adds an error at a node.
    pub fn wrong(&mut self, node: &Node, message: &str, help: &str) {
        self.note(node.place, message, help);
    }

    /// Adds a warning.
    pub fn warn(&mut self, place: Place, message: &str, help: &str) {
        self.report(Diagnostic { severity: Severity::Warning, ..problem(place, message, Some(help)) });
    }

    /// Adds an error.
    pub fn note(&mut self, place: Place, message: &str, help: &str) {
        self.report(problem(place, message, Some(help)));
    }

    /// Adds a finding.
    pub fn report(&mut self, found: Diagnostic) {
        if self.problems.len() < MAX_PROBLEMS {
            self.problems.push(found);
        }
    }

    /// The entries of a mapping with free names; none for null. `what` names the expected value, `example` shows it.
    pub fn entries<'n>(&mut self, node: &'n Node, what: &str, example: impl Display) -> &'n [(Text, Node)] {
        match &node.value {
            Value::Map(entries) => entries,
            Value::Null | Value::Unread => &[],
            _ => {
                self.expected(node, what, example);
                &[]
            }
        }
    }

    /// A mapping with fixed keys; an unknown key is reported with the nearest known one.
    pub fn fields<'n>(&mut self, node: &'n Node, what: &str, keys: &[&str], example: &str) -> Fields<'n> {
        self.fields_of(node, what, keys.iter().copied(), example)
    }

    /// As [`Reader::fields`], with the keys of a table.
    pub fn fields_of<'n, 'k>(
        &mut self,
        node: &'n Node,
        what: &str,
        keys: impl Iterator<Item = &'k str> + Clone,
        example: &str,
    ) -> Fields<'n> {
        let entries = self.entries(node, what, example);
        let is_known = |name: &Text| keys.clone().any(|key| key == name.text);
        for (name, _) in entries.iter().filter(|(name, _)| !is_known(name)) {
            let known = format!("known keys here: {}", keys.clone().collect::<Vec<_>>().join(", "));
            let help = match nearest(&name.text, keys.clone()) {
                Some(near) => format!("did you mean `{near}`? {known}"),
                None => known,
            };
            self.note(name.place, &format!("unknown key `{}`", name.text), &help);
        }
        Fields { entries }
    }

    /// A word, a number or a quantity.
    pub fn text(&mut self, node: &Node, what: &str, example: impl Display) -> Option<Text> {
        match &node.value {
            Value::Scalar(text) => Some(text.clone()),
            _ => {
                self.expected(node, what, example);
                None
            }
        }
    }

    /// One value, or a list of the lowest and the highest.
    pub fn bounds(&mut self, node: &Node, what: &str, example: impl Display) -> Option<Bounds> {
        match &node.value {
            Value::Scalar(text) => Some(Bounds::One(text.clone())),
            _ => self.pair(node, what, example).map(|(lo, hi)| Bounds::Two(lo, hi)),
        }
    }

    /// A list of the lowest and the highest value.
    pub fn pair(&mut self, node: &Node, what: &str, example: impl Display) -> Option<(Text, Text)> {
        if let Value::List(items) = &node.value
            && let [Node { value: Value::Scalar(lo), .. }, Node { value: Value::Scalar(hi), .. }] =
                items.as_slice()
        {
            return Some((lo.clone(), hi.clone()));
        }
        self.expected(node, what, example);
        None
    }

    /// A list of names; a single name is a list of one.
    pub fn names(&mut self, node: &Node, what: &str, example: impl Display + Copy) -> Vec<Text> {
        match &node.value {
            Value::Scalar(name) => vec![name.clone()],
            Value::List(items) => {
                items.iter().filter_map(|item| self.text(item, "a name", example)).collect()
            }
            _ => {
                self.expected(node, what, example);
                Vec::new()
            }
        }
    }

    /// Named numbers.
    pub fn properties(&mut self, node: Option<&Node>) -> PropertyDrafts {
        let example = "{ accuracy: 0.9 }";
        let entries = node.map_or(&[][..], |node| self.entries(node, "named numbers", example));
        let read = |(name, node): &(Text, Node)| Some((name.clone(), self.text(node, "a number", example)?));
        entries.iter().filter_map(read).collect()
    }

    fn expected(&mut self, node: &Node, what: &str, example: impl Display) {
        let found = match &node.value {
            Value::Null => "nothing",
            Value::Scalar(_) => "one value",
            Value::List(_) => "a list",
            Value::Map(_) | Value::Unread => "a mapping",
        };
        self.wrong(node, &format!("expected {what}, found {found}"), &format!("write it like `{example}`"));
    }
}

/// Reads the values of one mapping by their keys.
pub struct Keys<'r, 'n> {
    /// Gets the problems.
    pub reader: &'r mut Reader,
    /// The mapping.
    pub fields: Fields<'n>,
}

impl Keys<'_, '_> {
    /// The word or quantity of a key; `what` names the expected value, `example` shows it.
    pub fn text(&mut self, key: &str, what: &str, example: &str) -> Option<Text> {
        let node = self.fields.get(key)?;
        self.reader.text(node, what, format_args!("{key}: {example}"))
    }

    /// The time of a key.
    pub fn span(&mut self, key: &str) -> Option<Text> {
        self.text(key, "a time", "300 ms")
    }
}
