//! The answer in sections: what was decided, what spoke against the signal and for it, who else it could have been,
//! what would have cleared it, and what came of it.

use super::inquiry::{Inquiry, Snapshot, is_about, is_accusation};
use super::words::{Words, listed};
use crate::replay::Source;
use shsa_core::diagnosis::Component;
use shsa_core::diagnosis::Verdict;
use shsa_core::diagnosis::candidates as diagnosis;
use shsa_core::engine::{Comparison, Event, EventKind, Evidence, Rival, span_text};
use shsa_core::knowledge::{KnowledgeBase, SignalSet, VariableId};
use shsa_core::monitor::{ResidualState, Symptom};
use shsa_core::time::Time;
use shsa_format::event;
use shsa_format::text::counted;
use std::collections::BTreeSet;

/// No rival is likelier than another when only their number matters.
const EQUAL_PRIOR: f64 = 0.01;

/// So many comparisons are listed in a section, and events in what came later.
const MOST_LISTED: usize = 12;

/// A part of the answer.
pub(super) struct Section {
    pub(super) title: &'static str,
    pub(super) items: Vec<Item>,
}

/// A statement with what stands behind it.
pub(super) struct Item {
    pub(super) text: String,
    pub(super) notes: Vec<String>,
}

/// An inquiry with the names of its model.
pub(super) struct Explanation<'a> {
    pub(super) inquiry: &'a Inquiry,
    pub(super) words: Words<'a>,
    /// The decision; `None` when a moment without one is explained.
    pub(super) event: Option<&'a Event>,
}

fn item(text: impl Into<String>) -> Item {
    Item { text: text.into(), notes: Vec::new() }
}

impl<'a> Explanation<'a> {
    pub(super) fn new(inquiry: &'a Inquiry, source: &'a Source) -> Explanation<'a> {
        let knowledge = known(inquiry, source, &inquiry.focus);
        let words = Words { knowledge, first: inquiry.run.first };
        let event = inquiry.focus.event.and_then(|number| inquiry.run.events.get(number));
        Explanation { inquiry, words, event }
    }

    pub(super) fn evidence(&self) -> &'a Evidence {
        &self.inquiry.focus.evidence
    }

    pub(super) fn time(&self) -> Time {
        self.event.map_or(self.evidence().time, |event| event.time)
    }

    /// What was decided, or thought, and when.
    pub(super) fn headline(&self) -> String {
        let (signal, time) = (&self.inquiry.signal, self.words.time(self.time()));
        let Some(event) = self.event else {
            let verdict = event::verdict(self.evidence().absence, self.evidence().verdict);
            return format!("{signal} was {verdict} at {time}: no decision about it stood");
        };
        let symptom = event.symptom.filter(|symptom| *symptom != Symptom::Silent);
        let symptom = symptom.map_or(String::new(), |symptom| format!(", {}", symptom.name()));
        match (event.signal, event.kind) {
            (None, kind) => {
                let need =
                    event.variable.map_or("", |variable| &self.words.knowledge.variables()[variable].name);
                format!("{need} was {} at {time}, after what was decided about {signal}", kind.name())
            }
            (_, EventKind::Suspected) => format!("{signal} was suspected at {time}{symptom}"),
            (_, EventKind::Failed) => format!("{signal} was found to have failed at {time}{symptom}"),
            (_, EventKind::Silent) => format!("{signal} fell silent at {time}"),
            (_, EventKind::Restored) => format!("{signal} was trusted again at {time}"),
            (_, kind) => format!("{signal}: {} at {time}", kind.name()),
        }
    }

    pub(super) fn sections(&self) -> Vec<Section> {
        let mut sections = vec![
            Section { title: "In plain words", items: self.plain() },
            Section { title: "What spoke against it", items: self.compared(Speaks::Against) },
            Section { title: "What spoke for it", items: self.compared(Speaks::For) },
            Section { title: "What had nothing to say", items: self.compared(Speaks::Not) },
        ];
        if self.is_accused() {
            sections.push(Section { title: "Who else it could have been", items: self.rivals() });
            let items = self.would_clear().into_iter().map(item).collect();
            sections.push(Section { title: "What would have cleared it", items });
        }
        sections.push(Section { title: "What came of it", items: self.aftermath() });
        sections.push(Section { title: "The needs", items: self.needs() });
        sections.retain(|section| !section.items.is_empty());
        sections
    }

    pub(super) fn is_accused(&self) -> bool {
        self.event.is_some_and(is_accusation)
    }

    pub(super) fn conflicts(&self) -> impl Iterator<Item = &'a Comparison> {
        self.evidence().comparisons.iter().filter(|each| each.is_conflict())
    }

    pub(super) fn supports(&self) -> impl Iterator<Item = &'a Comparison> {
        self.evidence().comparisons.iter().filter(|each| each.is_support())
    }

    /// Signals that nothing tells from the accused.
    fn untold(&self) -> Vec<&'a Rival> {
        self.evidence().rivals.iter().filter(|rival| rival.explains_all()).collect()
    }

    fn plain(&self) -> Vec<Item> {
        let all = self.evidence().comparisons.len();
        let (against, speaks_for) = (self.conflicts().count(), self.supports().count());
        let signal = &self.inquiry.signal;
        let parts = match all {
            0 => {
                format!("No comparison speaks about {signal}: nothing else in the model knows what it says.")
            }
            _ => format!(
                "Of {} that {signal} is part of, {against} spoke against it and {speaks_for} for it.",
                counted(all, "comparison")
            ),
        };
        let mut items = vec![item(parts)];
        items.extend(self.reason().map(item));
        if let Some(event) = self.event {
            items.push(item(format!("The engine said: {}.", event.because)));
        }
        items
    }

    /// Why this verdict follows.
    fn reason(&self) -> Option<String> {
        let signal = &self.inquiry.signal;
        let untold: Vec<&str> = self.untold().iter().map(|rival| self.words.signal(rival.signal)).collect();
        let is_compared = self.conflicts().next().is_some();
        match (
            self.event.filter(|event| event.signal.is_some()).map(|event| event.kind),
            self.evidence().verdict,
        ) {
            (Some(EventKind::Failed), _) if is_compared && untold.is_empty() => {
                Some(format!("Of all signals in these disagreements, {signal} alone is part of each."))
            }
            (Some(EventKind::Suspected), _) if !untold.is_empty() => {
                Some(format!("Nothing tells it from {}, so it is only suspected.", listed(&untold)))
            }
            (None, Verdict::Unknown) => {
                Some("No independent witness spoke about it. That is not health.".to_owned())
            }
            (None, Verdict::Healthy) => Some(
                "At least one independent witness agreed with it, and nothing disagreed enough to count."
                    .to_owned(),
            ),
            _ => None,
        }
    }

    fn compared(&self, speaks: Speaks) -> Vec<Item> {
        let chosen: Vec<&Comparison> =
            self.evidence().comparisons.iter().filter(|each| Speaks::of(each) == speaks).collect();
        let mut items: Vec<Item> = chosen
            .iter()
            .take(MOST_LISTED)
            .map(|each| {
                let notes = match speaks {
                    Speaks::Not => vec![self.words.why_silent(each, self.evidence().time)],
                    _ => [self.words.counted(each)].into_iter().chain(self.words.rests_on(each)).collect(),
                };
                Item { text: self.words.comparison(each), notes }
            })
            .collect();
        if chosen.len() > MOST_LISTED {
            items.push(item(format!("and {} more", counted(chosen.len() - MOST_LISTED, "comparison"))));
        }
        items
    }

    fn rivals(&self) -> Vec<Item> {
        let mut items: Vec<Item> =
            self.evidence().rivals.iter().take(MOST_LISTED).map(|rival| self.rival(rival)).collect();
        items.extend(self.without().map(item));
        items
    }

    /// Whether another signal could be to blame alone, and why not.
    fn rival(&self, rival: &Rival) -> Item {
        let (name, signal) = (self.words.signal(rival.signal), &self.inquiry.signal);
        let text = match (rival.verdict, rival.explains_all()) {
            (Verdict::Failed, _) => format!("{name}: it has failed, too"),
            (_, true) => format!("{name}: not ruled out, it is part of every disagreement with {signal}"),
            (_, false) => format!("{name}: ruled out as the only culprit"),
        };
        let mut notes = Vec::new();
        if let Some(first) = rival.not_in.first().and_then(|&at| self.evidence().comparisons.get(at)) {
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

    /// How many others would have to be faulty instead.
    fn without(&self) -> Option<String> {
        let sets = &self.evidence().otherwise;
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
            format!("If it is sound, at least {} others lie at once, such as {names}", liars.len())
        })
    }

    /// What would have told the signal from the others, or spoken for it.
    pub(super) fn would_clear(&self) -> Vec<String> {
        let (evidence, signal) = (self.evidence(), &self.inquiry.signal);
        if self.conflicts().next().is_none() {
            let absent =
                self.event.and_then(|event| event.symptom).is_some_and(|it| it != Symptom::Inconsistent);
            return if absent { vec![format!("Possible values of {signal}, in time.")] } else { Vec::new() };
        }
        let untold = self.untold();
        let mut lines: Vec<String> = self.unheard(&untold);
        let variable = self.variable();
        if untold.is_empty() {
            lines.extend(self.nearest_rival());
        } else {
            let names: Vec<&str> = untold.iter().map(|rival| self.words.signal(rival.signal)).collect();
            lines.push(format!(
                "A further witness of {variable} that rests neither on {signal} nor on {}: whichever it agrees with is \
                 cleared. `shsa analyze` ranks what could be added.",
                listed(&names)
            ));
        }
        lines.push(format!(
            "To be trusted again it must {}agree in every comparison for {}.",
            if evidence.stands_still { "move and " } else { "" },
            span_text(evidence.probation)
        ));
        lines
    }

    /// Which comparisons more would have had to agree, so that another signal explained the rest as well.
    fn nearest_rival(&self) -> Option<String> {
        let rivals = self.evidence().rivals.iter().filter(|rival| rival.verdict != Verdict::Failed);
        let nearest = rivals.min_by_key(|rival| rival.not_in.len())?;
        let comparison = |&at: &usize| self.evidence().comparisons.get(at);
        let others = nearest.not_in.iter().filter_map(comparison).map(|each| self.words.way(&each.other));
        let others: BTreeSet<String> = others.collect();
        let others: Vec<&str> = others.iter().map(String::as_str).collect();
        Some(format!(
            "Had it agreed with {}, {} alone would have explained the rest as well, and it would only have been suspected.",
            listed(&others),
            self.words.signal(nearest.signal)
        ))
    }

    /// Comparisons that are in the model and would have told the signal from others, had they had anything to say.
    fn unheard(&self, untold: &[&Rival]) -> Vec<String> {
        let of_signal = self.evidence().comparisons.iter().filter(|each| {
            let is_unknown = each.relationship == ResidualState::Unknown && each.bears_witness;
            is_unknown && !untold.iter().any(|rival| each.signals.contains(rival.signal))
        });
        let of_rivals = untold.iter().flat_map(|rival| &rival.unheard);
        let told = |each: &Comparison| {
            let (what, why) =
                (self.words.comparison(each), self.words.why_silent(each, self.evidence().time));
            format!("A comparison that the model has: {what}; but {why}.")
        };
        of_signal.chain(of_rivals).take(3).map(told).collect()
    }

    fn variable(&self) -> &'a str {
        let variable = self.evidence().variable(self.words.knowledge);
        &self.words.knowledge.variables()[variable].name
    }

    /// The decisions about the signal after the one that is explained, and how it stands at the end.
    fn aftermath(&self) -> Vec<Item> {
        let mut items: Vec<Item> = Vec::new();
        if let Some(later) = &self.inquiry.later {
            let conflicts = later.evidence.comparisons.iter().filter(|each| each.is_conflict()).count();
            let (time, verdict) = (self.words.time(later.evidence.time), later.evidence.verdict);
            let verdict = event::verdict(later.evidence.absence, verdict);
            let count = counted(conflicts, "comparison");
            items.push(item(format!("At {time} this decision stood: {verdict}, {count} against it.")));
        }
        let next: Vec<&Event> = self.later_events().map(|(_, event)| event).collect();
        for event in next.iter().take(MOST_LISTED) {
            let (time, kind) = (self.words.time(event.time), event.kind.name());
            items.push(Item { text: format!("{time} {kind}"), notes: vec![event.because.clone()] });
        }
        if next.len() > MOST_LISTED {
            items.push(item(format!("and {} more", counted(next.len() - MOST_LISTED, "decision"))));
        }
        items.extend(self.at_end().map(item));
        items
    }

    /// Decisions about the signal after the one that is explained, with their numbers from 0.
    pub(super) fn later_events(&self) -> impl Iterator<Item = (usize, &'a Event)> {
        let (run, signal) = (&self.inquiry.run, &self.inquiry.signal);
        let time = self.time();
        let after = self.inquiry.focus.event.map_or(0, |number| number + 1);
        let told = run.told_events().enumerate().skip(after);
        told.filter(move |(_, (known, event))| event.time >= time && is_about(known, event, signal))
            .map(|(number, (_, event))| (number, event))
    }

    fn at_end(&self) -> Option<String> {
        let end = &self.inquiry.end.as_ref()?.evidence;
        if self.event.is_none() && end.time <= self.time() {
            return None;
        }
        let time = self.words.time(end.time);
        let verdict = event::verdict(end.absence, end.verdict);
        if !matches!(end.verdict, Verdict::Suspect | Verdict::Failed) && end.absence.is_none() {
            return Some(format!("At the end, {time}, it is {verdict}."));
        }
        let left = end.comparisons.iter().filter(|each| {
            matches!(each.relationship, ResidualState::Conflict | ResidualState::Undecided)
                && each.explained_by.is_empty()
        });
        let why = match (left.count(), end.clean_since) {
            _ if end.absence.is_some() => "nothing usable comes".to_owned(),
            (0, Some(since)) => format!(
                "all agree since {}, and {} of that are asked",
                self.words.time(since),
                span_text(end.probation)
            ),
            (0, None) if end.stands_still => "it still says what it said when it was accused".to_owned(),
            (0, None) => "no independent witness speaks for it".to_owned(),
            (1, _) => "one comparison still disagrees".to_owned(),
            (count, _) => format!("{count} comparisons still disagree"),
        };
        Some(format!("At the end, {time}, it is {verdict} and not trusted again: {why}."))
    }

    fn needs(&self) -> Vec<Item> {
        let told: Vec<(usize, &KnowledgeBase, &Event)> = self.need_events();
        if told.is_empty() {
            return self.unmoved().into_iter().map(item).collect();
        }
        let shown = |(_, known, event): &(usize, &KnowledgeBase, &Event)| {
            let variable = event.variable.map_or("", |variable| &known.variables()[variable].name);
            let variable = event.need.map_or(variable, |need| known.need_name(need));
            let source =
                event.substitution.as_ref().map_or(String::new(), |source| format!(", now from {source}"));
            let (time, kind) = (self.words.time(event.time), event.kind.name());
            Item { text: format!("{time} {variable} {kind}{source}"), notes: vec![event.because.clone()] }
        };
        told.iter().take(MOST_LISTED).map(shown).collect()
    }

    /// What was decided about needs because of the signal, until the episode is over.
    pub(super) fn need_events(&self) -> Vec<(usize, &'a KnowledgeBase, &'a Event)> {
        if !self.is_accused() {
            return Vec::new();
        }
        let run = &self.inquiry.run;
        let mut episode: Vec<Time> = vec![self.time()];
        let (mut until, mut is_over) = (Time::MAX, false);
        for (_, event) in self.later_events() {
            if is_over && is_accusation(event) {
                until = event.time;
                break;
            }
            is_over |= event.kind == EventKind::Restored;
            episode.push(event.time);
        }
        let of_need = |event: &Event| event.signal.is_none();
        let touched: BTreeSet<VariableId> = run
            .events
            .iter()
            .filter(|event| of_need(event) && episode.contains(&event.time))
            .filter_map(|event| event.variable)
            .collect();
        let since = self.time();
        let is_of_it = |event: &Event| {
            of_need(event)
                && since <= event.time
                && event.time < until
                && event.variable.is_some_and(|variable| touched.contains(&variable))
        };
        let told = run.told_events().enumerate();
        told.filter(|(_, (_, event))| is_of_it(event))
            .map(|(number, (known, event))| (number, known, event))
            .collect()
    }

    fn unmoved(&self) -> Vec<String> {
        let needs = &self.inquiry.focus.needs;
        let told = needs.iter().take(MOST_LISTED).map(|(need, status)| {
            let name = &self.words.knowledge.needs()[*need].signal;
            match &status.source {
                Some(source) => format!("{name} went on from {source}."),
                None => format!("{name} was served by nothing."),
            }
        });
        let more = needs.len().saturating_sub(MOST_LISTED);
        let more = (more > 0).then(|| format!("and {}", counted(more, "more need")));
        if self.is_accused() { told.chain(more).collect() } else { Vec::new() }
    }
}

/// The knowledge base to which the ids of a snapshot belong.
pub(super) fn known<'a>(inquiry: &'a Inquiry, source: &'a Source, snapshot: &Snapshot) -> &'a KnowledgeBase {
    source.eras.get(snapshot.era).map_or(inquiry.run.engine.knowledge(), |era| &era.knowledge)
}

/// On which side a comparison speaks.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Speaks {
    Against,
    For,
    Not,
}

impl Speaks {
    pub(super) fn of(comparison: &Comparison) -> Speaks {
        match comparison.relationship {
            _ if !comparison.explained_by.is_empty() => Speaks::Not,
            ResidualState::Conflict | ResidualState::Undecided => Speaks::Against,
            ResidualState::Agree if comparison.bears_witness => Speaks::For,
            ResidualState::Agree | ResidualState::Unknown => Speaks::Not,
        }
    }
}
