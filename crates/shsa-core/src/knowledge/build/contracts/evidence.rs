//! Evidence in words: `age at most 300 ms`, `value of /battery/temperature at most 60 degC`, `verdict healthy`, `told`.

use super::super::problems::Problems;
use super::super::quantity::{self, Kind};
use super::words::{Bound, piece, range};
use crate::interval::Interval;
use crate::knowledge::draft::Text;
use crate::knowledge::{EvidenceSource, KnowledgeBase, Measure, SignalId, Subject, VariableId, Watched};
use crate::time::Span;
use crate::unit::{Dimension, Unit};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// Examples of evidence, as help after an error.
const EXAMPLES: &str = "write `age at most 300 ms`, `value of /battery/temperature at most 60 degC`, `verdict healthy` or `told`";
/// The words before the time for which an observation counts.
const MAX_AGE: &str = " no older than ";

/// Reads a piece of evidence of a contract.
pub(super) fn watched(
    problems: &mut Problems,
    knowledge: &KnowledgeBase,
    subject: Subject,
    (name, text): &(Text, Text),
) -> Option<Watched> {
    let (observed, age) = match text.text.split_once(MAX_AGE) {
        Some((observed, age)) => (observed.trim_end_matches([',', ' ']), Some(age)),
        None => (text.text.as_str(), None),
    };
    let max_age = age.and_then(|age| quantity::span(problems, &piece(text, age)));
    let name = name.text.clone();
    if observed.trim() == "told" {
        return Some(Watched { name, source: EvidenceSource::Attested, within: None, max_age });
    }
    let words = Words::read(problems, text, observed)?;
    let source = words.source(problems, knowledge, subject, text)?;
    let within = words.within(problems, knowledge, subject, source, text)?;
    let usual = || words.usual_age(knowledge, source);
    Some(Watched { name, source, within, max_age: max_age.or_else(usual) })
}

/// A measure, the signal that it is about, and its bound.
struct Words<'t> {
    measure: Measure,
    of: Option<&'t str>,
    bound: &'t str,
}

impl<'t> Words<'t> {
    fn read(problems: &mut Problems, text: &Text, observed: &'t str) -> Option<Words<'t>> {
        let observed = observed.trim();
        let (word, rest) = observed.split_once(' ').unwrap_or((observed, ""));
        let Some((_, measure)) = Measure::NAMES.into_iter().find(|(name, _)| *name == word) else {
            let known = Measure::NAMES.map(|(name, _)| name).join(", ");
            let message = format!("`{word}` is nothing that can be observed");
            problems.error(text, message, format!("known: {known}, told; {EXAMPLES}"));
            return None;
        };
        let rest = rest.trim();
        let (of, bound) = match rest.strip_prefix("of ") {
            Some(rest) => rest.trim().split_once(' ').map(|(of, bound)| (Some(of), bound))?,
            None => (None, rest),
        };
        Some(Words { measure, of, bound: bound.trim() })
    }

    fn source(
        &self,
        problems: &mut Problems,
        knowledge: &KnowledgeBase,
        subject: Subject,
        text: &Text,
    ) -> Option<EvidenceSource> {
        let measure = self.measure;
        if let Some(of) = self.of {
            let specified = || knowledge.specifications().iter().map(|it| it.variable);
            let is_it = |variable: &VariableId| knowledge.variables()[*variable].name == of;
            if let (Measure::Verdict, Some(variable)) = (measure, specified().find(is_it)) {
                return Some(EvidenceSource::Specification(variable));
            }
            return Some(EvidenceSource::Signal(signal(problems, knowledge, &piece(text, of))?, measure));
        }
        match subject {
            Subject::Signal(signal) => Some(EvidenceSource::Signal(signal, measure)),
            Subject::Relation(_) | Subject::Need(_) => Some(EvidenceSource::Source(measure)),
            Subject::Platform | Subject::Healer => {
                let message = format!("`{}` does not say of which signal", text.text);
                problems.error(
                    text,
                    message,
                    format!("write `{} of /signal {}`", measure.name(), self.bound),
                );
                None
            }
        }
    }

    /// The range; `Some(None)` for a verdict, which has none.
    fn within(
        &self,
        problems: &mut Problems,
        knowledge: &KnowledgeBase,
        subject: Subject,
        source: EvidenceSource,
        text: &Text,
    ) -> Option<Option<Interval>> {
        if matches!(source, EvidenceSource::Specification(_)) {
            if self.bound == "holds" {
                return Some(Some(Interval::point(1.0)));
            }
            let message = format!("`{}` is no verdict of a specification", self.bound);
            problems.error(text, message, "write `verdict of NAME holds`");
            return None;
        }
        if self.measure == Measure::Verdict {
            if matches!(self.bound, "healthy" | "is healthy") {
                return Some(None);
            }
            problems.error(
                text,
                format!("`{}` is no verdict that could be evidence", self.bound),
                "write `verdict healthy`",
            );
            return None;
        }
        let ends = match Bound::read(self.bound) {
            Some(Bound::AtMost(high)) => [None, Some(high)],
            Some(Bound::AtLeast(low)) => [Some(low), None],
            Some(Bound::Between(low, high)) => [Some(low), Some(high)],
            Some(Bound::Is(value)) => [Some(value), Some(value)],
            _ => {
                problems.error(text, format!("`{}` is no bound of a number", self.bound), EXAMPLES);
                return None;
            }
        };
        let unit = unit(knowledge, subject, source);
        let kind = if self.measure == Measure::Value { Kind::Value } else { Kind::Difference };
        let (range, dimension) = range(problems, text, ends, unit.as_ref(), kind)?;
        let wanted = match self.measure {
            Measure::Rate => Some(Dimension::FREQUENCY),
            Measure::Age => Some(Dimension::TIME),
            Measure::Agreement | Measure::Availability => Some(Dimension::PLAIN),
            Measure::Width | Measure::Value | Measure::Verdict => None,
        };
        if wanted.is_some_and(|wanted| wanted != dimension) {
            let help = match self.measure {
                Measure::Rate => "write a frequency like `at least 5 Hz`",
                Measure::Age => "write a time like `at most 300 ms`",
                _ => "write a share like `at least 90 %`",
            };
            problems.error(text, format!("`{}` is no {}", self.bound, self.measure.name()), help);
            return None;
        }
        Some(Some(range))
    }

    /// A value counts as long as its signal may be silent.
    fn usual_age(&self, knowledge: &KnowledgeBase, source: EvidenceSource) -> Option<Span> {
        match source {
            EvidenceSource::Signal(signal, Measure::Value | Measure::Width) => {
                knowledge.signals()[signal].timeout
            }
            _ => None,
        }
    }
}

/// The unit in which values and widths count.
fn unit(knowledge: &KnowledgeBase, subject: Subject, source: EvidenceSource) -> Option<Unit> {
    let of = |signal: SignalId| knowledge.signals()[signal].variable;
    let variable = match (source, subject) {
        (EvidenceSource::Signal(signal, Measure::Value | Measure::Width), _) => Some(of(signal)),
        (EvidenceSource::Source(Measure::Value | Measure::Width), Subject::Need(need)) => {
            Some(knowledge.needs()[need].variable)
        }
        (EvidenceSource::Source(Measure::Value | Measure::Width), Subject::Relation(relation)) => {
            match knowledge.relations()[relation].outputs.as_slice() {
                [only] => Some(*only),
                _ => None,
            }
        }
        _ => None,
    };
    variable.and_then(|variable| knowledge.variables()[variable].unit.clone())
}

/// The signal of a name; an unknown one is reported.
pub(super) fn signal(problems: &mut Problems, knowledge: &KnowledgeBase, name: &Text) -> Option<SignalId> {
    let found = knowledge.signal(&name.text);
    if found.is_none() {
        let known = || knowledge.signals().iter().map(|signal| signal.name.as_str()).collect::<Vec<_>>();
        let count = knowledge.signals().len();
        problems.unknown(name, "signal", count, known, &String::from("declare it under `signals`"));
    }
    found
}
