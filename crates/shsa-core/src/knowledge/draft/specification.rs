//! A temporal specification as it is written.

use super::Text;
use alloc::format;
use alloc::string::String;

/// A condition over time that must hold.
#[derive(Clone, Debug)]
pub struct SpecificationDraft {
    /// Where or since when the condition must hold; absent: always.
    pub when: Option<Text>,
    /// What must hold.
    pub what: Requirement,
}

/// What a specification requires, once its `when` has held.
#[derive(Clone, Debug)]
pub enum Requirement {
    /// A condition, for a time beyond `when`.
    Always(Text, Option<Text>),
    /// A condition at some time, at most this much later.
    Eventually(Text, Text),
}

impl SpecificationDraft {
    /// All texts, in the order of their meaning.
    pub fn texts(&self) -> impl Iterator<Item = &Text> {
        let (what, span) = match &self.what {
            Requirement::Always(what, span) => (what, span.as_ref()),
            Requirement::Eventually(what, span) => (what, Some(span)),
        };
        self.when.iter().chain([what]).chain(span)
    }

    /// The specification as a text: `when W, eventually P within 2 s`.
    #[must_use]
    pub fn text(&self) -> String {
        let when = self.when.as_ref().map(|when| format!("when {}, ", when.text)).unwrap_or_default();
        match &self.what {
            Requirement::Always(what, None) => format!("{when}always {}", what.text),
            Requirement::Always(what, Some(span)) => format!("{when}always {} for {}", what.text, span.text),
            Requirement::Eventually(what, span) => {
                format!("{when}eventually {} within {}", what.text, span.text)
            }
        }
    }

    /// The same texts, to change them.
    pub fn texts_mut(&mut self) -> impl Iterator<Item = &mut Text> {
        let (what, span) = match &mut self.what {
            Requirement::Always(what, span) => (what, span.as_mut()),
            Requirement::Eventually(what, span) => (what, Some(span)),
        };
        self.when.iter_mut().chain([what]).chain(span)
    }
}
