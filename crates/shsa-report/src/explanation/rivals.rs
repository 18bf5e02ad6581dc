//! The rivals: other signals that may be faulty instead; and what would have cleared the signal.

use super::wording::listed;
use super::{EvidenceInWords, Item, MOST_LISTED, item};
use shsa_core::diagnosis::candidates as diagnosis;
use shsa_core::engine::{Comparison, Rival};
use shsa_core::knowledge::SignalSet;
use shsa_core::monitor::{ResidualState, Symptom};
use shsa_core::trust::Component;
use shsa_core::trust::Verdict;
use shsa_format::text::counted;
use shsa_format::words;
use std::collections::BTreeSet;

/// An equal probability for every rival, because only their number matters here.
const EQUAL_PRIOR: f64 = 0.01;

impl<'a> EvidenceInWords<'a> {
    /// Signals that no evidence distinguishes from the accused.
    pub(super) fn undistinguished(&self) -> Vec<&'a Rival> {
        self.evidence.rivals.iter().filter(|rival| rival.explains_all()).collect()
    }

    pub(super) fn rivals(&self) -> Vec<Item> {
        let mut items: Vec<Item> =
            self.evidence.rivals.iter().take(MOST_LISTED).map(|rival| self.rival(rival)).collect();
        items.extend(self.without().map(item));
        items
    }

    /// Whether another signal alone could be faulty, and why not.
    fn rival(&self, rival: &Rival) -> Item {
        let (name, signal) = (self.words.signal(rival.signal), self.signal);
        let text = match (rival.verdict, rival.explains_all()) {
            (Verdict::Failed, _) => format!("{name}: it has failed, too"),
            (_, true) => format!("{name}: not ruled out, it is part of every disagreement with {signal}"),
            (_, false) => format!("{name}: ruled out as the only culprit"),
        };
        let mut notes = Vec::new();
        if let Some(first) = rival.not_in.first().and_then(|&at| self.evidence.comparisons.get(at)) {
            let count = counted(rival.not_in.len(), "disagreement");
            let (own, other) = (self.words.way(&first.own), self.words.way(&first.other));
            notes.push(format!("{count} with {signal} would be left, such as {own} against {other}"));
        }
        if let Some(first) = rival.supported.first() {
            let (own, other) = (self.words.way(&first.own), self.words.way(&first.other));
            let count = rival.supported.len();
            let speak = if count == 1 { "speaks" } else { "speak" };
            let count = counted(count, "comparison");
            notes.push(format!("{count} without {signal} {speak} for it, such as {own} with {other}"));
        }
        Item { text, notes }
    }

    /// The number of other signals that would have to be faulty if the accused one were sound.
    fn without(&self) -> Option<String> {
        let sets = &self.evidence.otherwise;
        if sets.is_empty() || sets.iter().any(SignalSet::is_empty) {
            return None;
        }
        let signals = |set: &SignalSet| set.iter().map(Component::Signal).collect();
        let conflict = |set| diagnosis::Comparison {
            one: signals(set),
            other: BTreeSet::new(),
            agrees: false,
            conditions: BTreeSet::new(),
        };
        let conflicts: Vec<diagnosis::Comparison> = sets.iter().map(conflict).collect();
        let parts = diagnosis::explain(&conflicts, |_| EQUAL_PRIOR);
        if parts.iter().any(|part| part.is_cut_off) {
            return None;
        }
        let best = parts.iter().filter_map(|part| part.candidates.first());
        let liars: SignalSet = best
            .flat_map(|candidate| &candidate.components)
            .filter_map(|component| match component {
                Component::Signal(signal) => Some(*signal),
                Component::Cause(_) | Component::Relation(_) => None,
            })
            .collect();
        (liars.len() > 1).then(|| {
            let names = self.words.signals(&liars);
            format!("If it is sound, at least {} others are faulty at once, such as {names}", liars.len())
        })
    }

    /// The evidence that would have distinguished the signal from the others, or supported it.
    pub(super) fn would_clear(&self) -> Vec<String> {
        let (evidence, signal) = (self.evidence, self.signal);
        if self.conflicts().next().is_none() {
            let absent =
                self.event.and_then(|event| event.symptom).is_some_and(|it| it != Symptom::Inconsistent);
            return if absent { vec![format!("Possible values of {signal}, in time.")] } else { Vec::new() };
        }
        let undistinguished = self.undistinguished();
        let mut lines: Vec<String> = self.without_result(&undistinguished);
        let variable = self.variable();
        if undistinguished.is_empty() {
            lines.extend(self.nearest_rival());
        } else {
            let names: Vec<&str> =
                undistinguished.iter().map(|rival| self.words.signal(rival.signal)).collect();
            lines.push(format!(
                "A further witness of {variable} that rests neither on {signal} nor on {}: whichever it agrees with is \
                 cleared. `shsa analyze` ranks what could be added.",
                listed(&names)
            ));
        }
        lines.push(format!(
            "To be trusted again it must {}agree in every comparison for {}.",
            if evidence.stands_still { "move and " } else { "" },
            words::span(evidence.probation)
        ));
        lines
    }

    /// The further agreements with which another signal alone would have explained the rest as well.
    fn nearest_rival(&self) -> Option<String> {
        let rivals = self.evidence.rivals.iter().filter(|rival| rival.verdict != Verdict::Failed);
        let nearest = rivals.min_by_key(|rival| rival.not_in.len())?;
        let comparison = |&at: &usize| self.evidence.comparisons.get(at);
        let others = nearest.not_in.iter().filter_map(comparison).map(|each| self.words.way(&each.other));
        let others: BTreeSet<String> = others.collect();
        let others: Vec<&str> = others.iter().map(String::as_str).collect();
        Some(format!(
            "Had it agreed with {}, {} alone would have explained the rest as well, and it would only have been suspected.",
            listed(&others),
            self.words.signal(nearest.signal)
        ))
    }

    /// Comparisons of the model that would have distinguished the signal from others, if they had had a result.
    fn without_result(&self, undistinguished: &[&Rival]) -> Vec<String> {
        let of_signal = self.evidence.comparisons.iter().filter(|each| {
            let is_unknown = each.residual_state == ResidualState::Unknown && each.bears_witness;
            is_unknown && !undistinguished.iter().any(|rival| each.signals.contains(rival.signal))
        });
        let of_rivals = undistinguished.iter().flat_map(|rival| &rival.without_result);
        let described = |each: &Comparison| {
            let (what, why) = (self.words.comparison(each), self.words.why_silent(each, self.evidence.time));
            format!("A comparison that the model has: {what}; but {why}.")
        };
        of_signal.chain(of_rivals).take(3).map(described).collect()
    }

    fn variable(&self) -> &'a str {
        let variable = self.evidence.variable(self.words.knowledge);
        &self.words.knowledge.variables()[variable].name
    }
}
