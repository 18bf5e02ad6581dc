//! One way with its composed certificates and their assessment.

use super::{MOST_EVALUATIONS, Refused};
use crate::assurance::{Admitted, Assessment, Composition, Evaluation, Verdict};
use crate::substitution::Way;
use crate::time::{Span, Time};
use crate::trust::Trust;

/// One way.
#[derive(Debug)]
pub(super) struct Assessed {
    pub(super) way: Way,
    pub(super) trust: Trust,
    pub(super) composition: Composition,
    pub(super) evaluation: Evaluation,
    pub(super) assessment: Assessment,
    /// Since when the verdict is open.
    pub(super) open_since: Option<Time>,
    /// Whether the demands were met before the verdict became open.
    pub(super) has_held: bool,
    pub(super) admitted: Option<Admitted>,
    /// Whether evidence has changed since the assessment.
    pub(super) is_stale: bool,
    pub(super) is_kept: bool,
    /// Whether the way may serve. A way that may not is kept only while it still serves, and counts for no level.
    pub(super) is_candidate: bool,
    /// Whether the way would serve if it met the demands.
    pub(super) is_preferred: bool,
    /// Whether the refusal is not reported yet.
    pub(super) is_news: bool,
    /// When the refusal was last reported.
    pub(super) reported: Option<Time>,
}

impl Assessed {
    pub(super) fn new(way: Way, trust: Trust, composition: Composition) -> Assessed {
        let evaluation = composition.evaluation();
        Assessed {
            assessment: composition.assess(&evaluation),
            trust,
            way,
            composition,
            evaluation,
            open_since: None,
            has_held: false,
            admitted: None,
            is_stale: true,
            is_kept: true,
            is_candidate: true,
            is_preferred: false,
            is_news: true,
            reported: None,
        }
    }

    pub(super) fn assess(&mut self, now: Time) {
        self.is_stale = false;
        let before = self.assessment.verdict;
        self.assessment = self.composition.assess(&self.evaluation);
        match self.assessment.verdict {
            Verdict::Open => {
                self.has_held |= before == Verdict::Holds;
                self.open_since.get_or_insert(now);
            }
            _ => (self.open_since, self.has_held) = (None, false),
        }
        self.is_news |= before == Verdict::Holds;
    }

    /// When the refusal has to be reported.
    pub(super) fn report_due_at(&self, grace: Span) -> Option<Time> {
        match self.assessment.verdict {
            _ if !self.is_news || !self.is_preferred => None,
            Verdict::Holds => None,
            Verdict::Open => self.open_since.map(|since| since + grace + Span(1)),
            Verdict::Circular | Verdict::Refused => Some(Time::MIN),
        }
    }

    pub(super) fn refused(&self) -> Refused {
        Refused {
            way: self.way.clone(),
            verdict: self.assessment.verdict,
            lacking: self.composition.why(&self.evaluation, MOST_EVALUATIONS),
        }
    }

    /// Until when the way may go on although its verdict is open.
    pub(super) fn lapses(&self, grace: Span) -> Option<Time> {
        self.open_since.filter(|_| self.has_held).map(|since| since + grace)
    }
}
