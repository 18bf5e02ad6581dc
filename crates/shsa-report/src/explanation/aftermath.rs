//! The consequences of a decision: later decisions about the signal, its verdict at the end, and its needs.

use super::inquiry::is_about;
use super::{Explanation, Item, MOST_LISTED, item};
use crate::events::is_accusation;
use shsa_core::engine::{Event, EventKind};
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::monitor::ResidualState;
use shsa_core::time::Time;
use shsa_core::trust::Verdict;
use shsa_format::event;
use shsa_format::text::counted;
use shsa_format::words;
use std::collections::BTreeSet;

impl<'a> Explanation<'a> {
    /// The decisions about the signal after the explained one, and its verdict at the end.
    pub(super) fn aftermath(&self) -> Vec<Item> {
        let mut items: Vec<Item> = Vec::new();
        if let Some(later) = &self.inquiry.later {
            let conflicts = later.evidence.comparisons.iter().filter(|each| each.is_conflict()).count();
            let (time, verdict) = (self.about.words.time(later.evidence.time), later.evidence.verdict);
            let verdict = event::verdict(later.evidence.absence, verdict);
            let count = counted(conflicts, "comparison");
            items.push(item(format!("At {time} this decision stood: {verdict}, {count} against it.")));
        }
        let next: Vec<&Event> = self.later_events().map(|(_, event)| event).collect();
        for event in next.iter().take(MOST_LISTED) {
            let (time, kind) = (self.about.words.time(event.time), event.kind.name());
            items.push(Item { text: format!("{time} {kind}"), notes: vec![words::reasons(&event.because)] });
        }
        if next.len() > MOST_LISTED {
            items.push(item(format!("and {} more", counted(next.len() - MOST_LISTED, "decision"))));
        }
        items.extend(self.at_end().map(item));
        items
    }

    /// Decisions about the signal after the explained one, with their numbers from 0.
    pub(super) fn later_events(&self) -> impl Iterator<Item = (usize, &'a Event)> {
        let (run, signal) = (&self.inquiry.run, &self.inquiry.signal);
        let time = self.time();
        let after = self.inquiry.focus.event.map_or(0, |number| number + 1);
        let described = run.events_with_models().enumerate().skip(after);
        described
            .filter(move |(_, (known, event))| event.time >= time && is_about(known, event, signal))
            .map(|(number, (_, event))| (number, event))
    }

    fn at_end(&self) -> Option<String> {
        let end = &self.inquiry.end.as_ref()?.evidence;
        if self.about.event.is_none() && end.time <= self.time() {
            return None;
        }
        let time = self.about.words.time(end.time);
        let verdict = event::verdict(end.absence, end.verdict);
        if !matches!(end.verdict, Verdict::Suspect | Verdict::Failed) && end.absence.is_none() {
            return Some(format!("At the end, {time}, it is {verdict}."));
        }
        let left = end.comparisons.iter().filter(|each| {
            matches!(each.residual_state, ResidualState::Conflict | ResidualState::Undecided)
                && each.explained_by.is_empty()
        });
        let why = match (left.count(), end.clean_since) {
            _ if end.absence.is_some() => "no usable value comes".to_owned(),
            (0, Some(since)) => format!(
                "all agree since {}, and {} of that are asked",
                self.about.words.time(since),
                words::span(end.probation)
            ),
            (0, None) if end.stands_still => "it still has the value with which it was accused".to_owned(),
            (0, None) => "no independent witness supports it".to_owned(),
            (1, _) => "one comparison still disagrees".to_owned(),
            (count, _) => format!("{count} comparisons still disagree"),
        };
        Some(format!("At the end, {time}, it is {verdict} and not trusted again: {why}."))
    }

    pub(super) fn needs(&self) -> Vec<Item> {
        let described: Vec<(usize, &KnowledgeBase, &Event)> = self.need_events();
        if described.is_empty() {
            return self.unmoved().into_iter().map(item).collect();
        }
        let shown = |(_, known, event): &(usize, &KnowledgeBase, &Event)| {
            let variable = event.variable.map_or("", |variable| &known.variables()[variable].name);
            let variable = event.need.map_or(variable, |need| known.need_name(need));
            let source = event.substitution.as_ref().map(words::served_by);
            let source = source.map_or(String::new(), |source| format!(", now from {source}"));
            let (time, kind) = (self.about.words.time(event.time), event.kind.name());
            Item {
                text: format!("{time} {variable} {kind}{source}"),
                notes: vec![words::reasons(&event.because)],
            }
        };
        described.iter().take(MOST_LISTED).map(shown).collect()
    }

    /// Decisions about needs because of the signal, until the episode ends.
    pub(super) fn need_events(&self) -> Vec<(usize, &'a KnowledgeBase, &'a Event)> {
        if !self.about.is_accused() {
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
        let described = run.events_with_models().enumerate();
        described
            .filter(|(_, (_, event))| is_of_it(event))
            .map(|(number, (known, event))| (number, known, event))
            .collect()
    }

    fn unmoved(&self) -> Vec<String> {
        let needs = &self.inquiry.focus.needs;
        let described = needs.iter().take(MOST_LISTED).map(|(need, status)| {
            let name = &self.about.words.knowledge.needs()[*need].signal;
            match &status.source {
                Some(source) => format!("{name} went on from {}.", words::served_by(source)),
                None => format!("{name} was served by nothing."),
            }
        });
        let more = needs.len().saturating_sub(MOST_LISTED);
        let more = (more > 0).then(|| format!("and {}", counted(more, "more need")));
        if self.about.is_accused() { described.chain(more).collect() } else { Vec::new() }
    }
}
