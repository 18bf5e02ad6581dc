//! For how long signals were not trusted, and needs not served.

use shsa_core::engine::{Event, EventKind};
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalId};
use shsa_core::time::{Span, Time};
use shsa_format::drive::Run;
use shsa_format::words;
use std::collections::BTreeMap;

/// A time in which a signal was not trusted.
#[derive(Clone, Debug)]
pub(super) struct Episode {
    /// The run, from 0.
    pub(super) run: usize,
    pub(super) from: Time,
    pub(super) length: Span,
    /// Whether it lasts to the end of the last run.
    pub(super) is_open: bool,
    /// Failed, else silent, else suspected.
    pub(super) worst: EventKind,
    /// Why, in words: of the worst.
    pub(super) because: String,
}

impl Episode {
    fn begun(run: usize, event: &Event) -> Episode {
        Episode {
            run,
            from: event.time,
            length: Span::ZERO,
            is_open: true,
            worst: event.kind,
            because: words::reasons(&event.because),
        }
    }

    fn go_on(&mut self, event: &Event) {
        if rank(event.kind) >= rank(self.worst) {
            self.worst = event.kind;
            self.because = words::reasons(&event.because);
        }
    }
}

fn rank(kind: EventKind) -> u8 {
    match kind {
        EventKind::Failed => 2,
        EventKind::Silent => 1,
        _ => 0,
    }
}

/// The episodes of each signal of a model that was accused, in the order of the signals; those of one are in the order of time.
pub(super) fn of_signals(known: &KnowledgeBase, runs: &[Run]) -> BTreeMap<SignalId, Vec<Episode>> {
    histories(runs, |model, event| known.signal(&model.signals()[event.signal?].name))
}

/// The same of relations and specifications, by their names.
pub(super) fn of_relations(runs: &[Run]) -> BTreeMap<String, Vec<Episode>> {
    histories(runs, |model, event| match (event.signal, event.relation) {
        (None, Some(relation)) => Some(format!("relation {}", model.relations()[relation].name)),
        _ => None,
    })
}

fn histories<K: Ord>(
    runs: &[Run],
    of: impl Fn(&KnowledgeBase, &Event) -> Option<K>,
) -> BTreeMap<K, Vec<Episode>> {
    let mut all: BTreeMap<K, Vec<Episode>> = BTreeMap::new();
    for (number, run) in runs.iter().enumerate() {
        for (model, event) in run.events_with_models() {
            let Some(id) = of(model, event) else { continue };
            let episodes = all.entry(id).or_default();
            let open = episodes.last_mut().filter(|it| it.is_open && it.run == number);
            match (open, event.kind) {
                (Some(episode), kind) if kind.accuses() => episode.go_on(event),
                (Some(episode), EventKind::Restored) => {
                    (episode.length, episode.is_open) = (event.time - episode.from, false);
                }
                (None, kind) if kind.accuses() => episodes.push(Episode::begun(number, event)),
                _ => {}
            }
        }
        let is_last = number + 1 == runs.len();
        for episode in all.values_mut().filter_map(|it| it.last_mut()).filter(|it| it.is_open) {
            if episode.run == number {
                (episode.length, episode.is_open) = (run.last - episode.from, is_last);
            }
        }
    }
    all.retain(|_, episodes| !episodes.is_empty());
    all
}

/// How long nothing served a need.
pub(super) fn unserved(known: &KnowledgeBase, runs: &[Run], need: NeedId) -> Span {
    let mut sum = Span::ZERO;
    for run in runs {
        let mut since: Option<Time> = None;
        for (model, event) in run.events_with_models() {
            let is_own = event.need.is_some_and(|of| model.need_name(of) == known.need_name(need));
            match event.kind {
                EventKind::Unhealable if is_own => since = since.or(Some(event.time)),
                EventKind::Substituted | EventKind::Restored if is_own => {
                    sum = sum + since.take().map_or(Span::ZERO, |since| event.time - since);
                }
                _ => {}
            }
        }
        sum = sum + since.map_or(Span::ZERO, |since| run.last - since);
    }
    sum
}
