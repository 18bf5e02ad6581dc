//! Parts of formulas of ours during the translation.

/// The binding strength of the root of a text, as in our parser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Binding {
    Or,
    And,
    Not,
    Comparison,
    Sum,
    Product,
    Sign,
    Power,
    Atom,
}

/// A part of a formula of ours.
#[derive(Clone, Debug)]
pub(super) struct Term {
    pub(super) text: String,
    pub(super) power: Binding,
}

impl Term {
    pub(super) fn atom(text: String) -> Term {
        Term { text, power: Binding::Atom }
    }

    pub(super) fn new(text: String, power: Binding) -> Term {
        Term { text, power }
    }

    /// The text, in parentheses when it binds less than `least`.
    pub(super) fn at_least(&self, least: Binding) -> String {
        if self.power < least { format!("({})", self.text) } else { self.text.clone() }
    }

    /// The text for a place that accepts any binding.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Whether the term contains a name.
    pub(super) fn mentions(&self, name: &str) -> bool {
        self.text.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == name)
    }
}
