//! The drawing: the values of the variable's ways, their disagreements, and the decisions.

use super::Explanation;
use super::tracks::{Track, Tracks, half_window};
use crate::Source;
use shsa_core::alignment::Sample;
use shsa_core::engine::{Evidence, Options};
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::time::{Span, Time};
use shsa_drawing::{Axis, Band, Mark, Slice, Timeline};
use shsa_format::drive::{Given, Run};
use std::collections::BTreeMap;

/// The most variables that are drawn on a page.
const MOST_DRAWN: usize = 4;

/// How to read the times in the drawing.
const NOTE: &str = "bands stand at the time of which the values tell, marks at the time of the decision";

/// Ends the replay early.
struct Seen;

/// Repeats a run, and draws some variables around the explained moment.
///
/// `window` is the length of the shown time; without one, as much as it takes to see the reason of the decision.
pub(super) fn drawings(
    explanation: &Explanation<'_>,
    source: &Source,
    variables: &[VariableId],
    window: Option<Span>,
) -> Vec<Timeline> {
    let (evidence, era) = (explanation.about.evidence, explanation.inquiry.focus.era);
    let at = explanation.time();
    let mut tracks: Vec<Tracks> = Vec::new();
    let mut until = Time::MAX;
    let _: Result<Run, Seen> =
        Run::of(&source.eras, source.span, Options::default(), |run, given: Given<'_>| {
            run.give(given);
            if run.past.len() < era {
                return Ok(());
            }
            if tracks.is_empty() {
                let half =
                    window.map_or_else(|| half_window(&run.engine, evidence), |window| Span(window.0 / 2));
                let (from, to) = ((at - half).max(run.first), at + half);
                until = to + half;
                tracks =
                    variables.iter().map(|&variable| Tracks::new(evidence, variable, (from, to))).collect();
            }
            if run.past.len() > era || run.last > until {
                return Err(Seen);
            }
            tracks.iter_mut().for_each(|tracks| tracks.look(&run.engine));
            Ok(())
        });
    tracks.iter_mut().map(|tracks| timeline(explanation, tracks)).collect()
}

/// The variable with the most evidence against the signal, then the others with conflicts.
pub(super) fn variables(evidence: &Evidence, knowledge: &KnowledgeBase) -> Vec<VariableId> {
    let first = evidence.variable(knowledge);
    let mut conflicts: BTreeMap<VariableId, usize> = BTreeMap::new();
    for comparison in evidence.comparisons.iter().filter(|each| each.is_conflict()) {
        *conflicts.entry(comparison.variable).or_default() += 1;
    }
    conflicts.remove(&first);
    let mut others: Vec<(VariableId, usize)> = conflicts.into_iter().collect();
    others.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    [first].into_iter().chain(others.into_iter().map(|(variable, _)| variable)).take(MOST_DRAWN).collect()
}

fn timeline(explanation: &Explanation<'_>, tracks: &mut Tracks) -> Timeline {
    let (words, signal) = (explanation.about.words, &explanation.inquiry.signal);
    let variable = &words.knowledge.variables()[tracks.variable];
    let unit = variable.unit.as_ref().map_or(String::new(), |unit| format!(" ({unit})"));
    let seconds = |time: Time| (time - words.first).seconds();
    let stretches = tracks.stretches();
    let end = explanation.inquiry.run.last.min(tracks.to);
    let mut notes = vec![NOTE.to_owned()];
    if let (true, Some(turn)) = (tracks.bring_beside(variable), variable.wraps) {
        let turn = shsa_format::words::difference(words.knowledge, tracks.variable, turn);
        notes.push(format!("after {turn} values are the same again: bands go on beyond it"));
    }
    if tracks.left_out > 0 {
        let more = shsa_format::text::counted(tracks.left_out, "more way");
        notes.push(format!("{more} of knowing {} not drawn", variable.name));
    }
    Timeline {
        title: format!("{}: {}", variable.name, explanation.headline()),
        span: (seconds(tracks.from), seconds(end)),
        y: Axis { label: format!("{}{unit}", variable.name), ..Axis::default() },
        bands: tracks.tracks.iter().map(|track| band(explanation, track, tracks.variable)).collect(),
        shaded: stretches.iter().map(|each| (seconds(each.from), seconds(each.to))).collect(),
        shade: format!("comparisons with {signal} disagree"),
        marks: marks(explanation),
        notes,
    }
}

fn band(explanation: &Explanation<'_>, track: &Track, variable: VariableId) -> Band {
    let words = explanation.about.words;
    let unit = words.knowledge.variables()[variable].unit.as_ref();
    let shown = |value: f64| unit.map_or(value, |unit| unit.from_si(value));
    let slice = |sample: &Sample| {
        // A value is drawn at the middle of its validity.
        let (from, to) = (sample.validity.from - words.first, sample.validity.to - words.first);
        Slice {
            at: f64::midpoint(from.seconds(), to.seconds()),
            low: shown(sample.value.lo()),
            high: shown(sample.value.hi()),
        }
    };
    Band {
        name: track.source.name(words.knowledge),
        is_accused: track.is_accused,
        slices: track.samples.iter().map(slice).collect(),
    }
}

/// Marks of the onset, the decision, and later decisions about the signal.
fn marks(explanation: &Explanation<'_>) -> Vec<Mark> {
    let seconds = |time: Time| (time - explanation.about.words.first).seconds();
    let mark = |name: &str, time: Time| Mark { at: seconds(time), name: name.to_owned() };
    let onset = explanation.about.conflicts().filter_map(|each| each.onset).min();
    let onset = onset.filter(|_| explanation.about.event.is_some()).map(|onset| mark("onset", onset));
    let name = explanation.about.event.map_or("asked", |event| event.kind.name());
    let later = explanation.later_events().filter(|_| explanation.about.event.is_some());
    let later = later.map(|(_, event)| mark(event.kind.name(), event.time));
    onset.into_iter().chain([mark(name, explanation.time())]).chain(later).collect()
}
