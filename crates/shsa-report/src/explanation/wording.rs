//! Descriptions of comparisons and ways.

use shsa_core::engine::{Comparison, NoValue, Side};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, SignalId, SignalSet};
use shsa_core::monitor::{Absence, ResidualState, Tendency};
use shsa_core::time::{Span, Time};
use shsa_format::words;

/// The most names in a list; further ones are only counted.
const MOST_NAMED: usize = 6;

/// Describes the elements of a model; times count from the beginning of a run.
#[derive(Clone, Copy)]
pub(super) struct Words<'a> {
    pub(super) knowledge: &'a KnowledgeBase,
    pub(super) first: Time,
}

impl<'a> Words<'a> {
    pub(super) fn signal(&self, signal: SignalId) -> &'a str {
        &self.knowledge.signals()[signal].name
    }

    /// The names of signals in file order: `a, b and c`.
    pub(super) fn signals(&self, signals: &SignalSet) -> String {
        let names: Vec<&str> = signals.iter().map(|signal| self.signal(signal)).collect();
        listed(&names)
    }

    /// A time from the beginning: `20.450 s`.
    pub(super) fn time(&self, time: Time) -> String {
        format!("{:.3} s", (time - self.first).seconds())
    }

    pub(super) fn way(&self, side: &Side) -> String {
        side.way.describe(self.knowledge)
    }

    /// The two values and their result in one line.
    pub(super) fn comparison(&self, comparison: &Comparison) -> String {
        let variable = &self.knowledge.variables()[comparison.variable].name;
        let (own, other) = (self.way(&comparison.own), self.way(&comparison.other));
        let values = comparison.disagreed.or(comparison.compared.map(|(own, other, _)| (own, other)));
        let values = values.filter(|_| comparison.residual_state != ResidualState::Unknown);
        match values {
            Some((one, two)) => {
                let (one, two) = (self.interval(comparison, one), self.interval(comparison, two));
                format!("{variable}: {own} said {one}, {other} said {two}")
            }
            None => format!("{variable}: {own} against {other}"),
        }
    }

    fn interval(&self, comparison: &Comparison, value: Interval) -> String {
        words::interval(self.knowledge, comparison.variable, value)
    }

    /// How many of the recent comparisons have this result, and since when.
    pub(super) fn counted(&self, comparison: &Comparison) -> String {
        let (disagree, all) = comparison.counts;
        let since = comparison.onset.map_or(String::new(), |onset| format!(", since {}", self.time(onset)));
        if let Some((tendency, ahead)) = comparison.together {
            return format!(
                "{}{since}: each alone may be chance",
                self.together(comparison, tendency, ahead)
            );
        }
        match comparison.residual_state {
            ResidualState::Unknown => "nothing to compare of late".to_owned(),
            ResidualState::Agree => {
                let last = comparison
                    .compared
                    .map_or(String::new(), |(.., time)| format!(", the last one about {}", self.time(time)));
                format!("all {all} recent comparisons agree{last}")
            }
            ResidualState::Undecided => {
                format!("{disagree} of {all} recent comparisons disagree{since}: too few to count")
            }
            ResidualState::Conflict => format!("{disagree} of {all} recent comparisons disagree{since}"),
        }
    }

    /// The joint result of many comparisons.
    fn together(&self, comparison: &Comparison, tendency: Tendency, ahead: f64) -> String {
        let by = words::difference(self.knowledge, comparison.variable, ahead.abs());
        match tendency {
            Tendency::Drift if ahead < 0.0 => format!("the first has said {by} less on average"),
            Tendency::Drift => format!("the first has said {by} more on average"),
            Tendency::Noise => "the two scatter against each other".to_owned(),
            Tendency::Skew => "the two show the same at different times".to_owned(),
            Tendency::Calm | Tendency::Building => "the two differ".to_owned(),
        }
    }

    /// The signals that each side rests on, unless the names of the ways already tell them.
    pub(super) fn rests_on(&self, comparison: &Comparison) -> Option<String> {
        let is_plain = |side: &Side| side.way.direct().is_some() && side.rests_on.len() == 1;
        if is_plain(&comparison.own) && is_plain(&comparison.other) {
            return None;
        }
        let (own, other) = (self.signals(&comparison.own.rests_on), self.signals(&comparison.other.rests_on));
        Some(format!("the first rests on {own}, the second on {other}"))
    }

    /// Why a comparison is no evidence about the signal.
    pub(super) fn why_silent(&self, comparison: &Comparison, at: Time) -> String {
        if !comparison.explained_by.is_empty() {
            let failed = self.signals(&comparison.explained_by);
            return format!("it does not count: {failed} is part of it, and has failed or is forbidden");
        }
        if comparison.residual_state == ResidualState::Agree {
            return "it agrees, but both rest on the signal: this is no evidence".to_owned();
        }
        let sides = [&comparison.own, &comparison.other];
        if let Some((signal, why)) = sides.into_iter().find_map(|side| side.without_value) {
            let name = self.signal(signal);
            return match why {
                NoValue::Never => format!("{name} had not given a value yet"),
                NoValue::Absent(Absence::Silent) => format!("{name} was silent"),
                NoValue::Absent(Absence::Invalid | Absence::OutOfRange) => {
                    format!("{name} gave no possible value")
                }
            };
        }
        let oldest = sides.into_iter().min_by_key(|side| side.newest.map(|(time, _)| time));
        let Some(oldest) = oldest else { return String::new() };
        let way = self.way(oldest);
        match oldest.newest {
            None => format!(
                "{way} had given no value: its inputs were not there together, or the condition of a relation did not hold"
            ),
            Some((time, _)) if at - time > Span::from_millis(100) => {
                format!("{way} had last given a value {} before", words::span(at - time))
            }
            Some(_) => "the two had not been compared of late".to_owned(),
        }
    }
}

/// `a, b and c`; of many names the first ones, and the number of others.
pub(super) fn listed(names: &[&str]) -> String {
    match names {
        [] => "nothing".to_owned(),
        [only] => (*only).to_owned(),
        [first @ .., last] if names.len() <= MOST_NAMED => format!("{} and {last}", first.join(", ")),
        _ => format!("{} and {} more", names[..MOST_NAMED].join(", "), names.len() - MOST_NAMED),
    }
}
