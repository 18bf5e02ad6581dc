//! How long each need had no spare, by the signals that were lost, and what the replacement of a signal changes.

use super::history::{Episode, of_signals};
use shsa_core::analysis::{Options, Tolerance, tolerances};
use shsa_core::knowledge::{Id, IdVec, KnowledgeBase, NeedId, SignalId, SignalSet};
use shsa_core::time::{Span, Time};
use shsa_format::drive::Run;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The most combinations of lost signals that are analysed.
const MOST: usize = 256;

/// How much was left of a need.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Redundancy {
    /// The losses that it survives with all signals there; `None` where nothing is known of it, or it rests on no signal.
    pub(super) survives: Option<usize>,
    /// How long it could bear no further loss though it can with all signals there.
    pub(super) bare: Span,
}

/// The redundancy of all needs over time.
pub(super) struct Found {
    pub(super) needs: IdVec<NeedId, Redundancy>,
    /// How many combinations were not analysed.
    pub(super) left_out: usize,
    restored: BTreeMap<SignalId, Span>,
}

impl Found {
    /// By how much the times of all needs without a spare, or without a source, are shorter without the losses of a signal.
    pub(super) fn restored_by(&self, signal: SignalId) -> Span {
        self.restored.get(&signal).copied().unwrap_or(Span::ZERO)
    }
}

/// Looks at each combination of signals that were lost together, the longest first.
pub(super) fn redundancy(known: &KnowledgeBase, runs: &[Run], options: Options) -> Found {
    let mut answers: BTreeMap<Vec<SignalId>, IdVec<NeedId, Tolerance>> = BTreeMap::new();
    let mut look = |lost: &[SignalId]| -> IdVec<NeedId, usize> {
        let found = answers.entry(lost.to_vec()).or_insert_with(|| {
            let set: SignalSet = lost.iter().copied().collect();
            tolerances(known, &set, options)
        });
        IdVec::filled(known.needs().len(), |need| left(&found[need]))
    };
    let full = look(&[]);
    let mut needs = IdVec::filled(known.needs().len(), |need| Redundancy {
        survives: full[need].checked_sub(1),
        bare: Span::ZERO,
    });
    let mut restored: BTreeMap<SignalId, Span> = BTreeMap::new();
    let mut times: Vec<(Vec<SignalId>, Span)> = lost_together(known, runs).into_iter().collect();
    times.sort_by_key(|(_, time)| Reverse(*time));
    let left_out = times.len().saturating_sub(MOST);
    for (lost, time) in times.into_iter().take(MOST) {
        let now = look(&lost);
        // Bare is what survives no loss, though with all signals it would; gone is worse than bare.
        let missing = |left: &IdVec<NeedId, usize>, need: NeedId| {
            2_usize.min(full[need]).saturating_sub(left[need].min(2)) as i32
        };
        for need in needs_of(known) {
            if missing(&now, need) > 0 {
                needs[need].bare = needs[need].bare + time;
            }
        }
        for signal in &lost {
            let others: Vec<SignalId> = lost.iter().copied().filter(|it| it != signal).collect();
            let without = look(&others);
            let gained = needs_of(known).filter(|&need| missing(&without, need) < missing(&now, need));
            let count = gained.count() as i64;
            let sum = restored.entry(*signal).or_insert(Span::ZERO);
            *sum = *sum + time.times(count);
        }
    }
    Found { needs, left_out, restored }
}

fn needs_of(known: &KnowledgeBase) -> impl Iterator<Item = NeedId> + use<> {
    (0..known.needs().len()).map(NeedId::from_index)
}

/// 0 where a need is not known, else one more than the losses that it survives.
fn left(tolerance: &Tolerance) -> usize {
    match tolerance.survives {
        _ if !tolerance.known => 0,
        Some(survives) => survives + 1,
        None => usize::MAX,
    }
}

/// For how long each combination of signals was not trusted; the empty one is left out.
fn lost_together(known: &KnowledgeBase, runs: &[Run]) -> BTreeMap<Vec<SignalId>, Span> {
    let histories = of_signals(known, runs);
    let mut times: BTreeMap<Vec<SignalId>, Span> = BTreeMap::new();
    for number in 0..runs.len() {
        let own = |it: &&Episode| it.run == number;
        let mut changes: Vec<(Time, SignalId, bool)> = Vec::new();
        for (&signal, episodes) in &histories {
            for episode in episodes.iter().filter(own) {
                changes.push((episode.from, signal, true));
                changes.push((episode.from + episode.length, signal, false));
            }
        }
        changes.sort_unstable();
        let mut lost: Vec<SignalId> = Vec::new();
        let mut since = Time::MIN;
        for (time, signal, is_lost) in changes {
            if !lost.is_empty() && time > since {
                let sum = times.entry(lost.clone()).or_insert(Span::ZERO);
                *sum = *sum + (time - since);
            }
            since = time;
            lost.retain(|it| *it != signal);
            if is_lost {
                lost.push(signal);
                lost.sort_unstable();
            }
        }
    }
    times
}
