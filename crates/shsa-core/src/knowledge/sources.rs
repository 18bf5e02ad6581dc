//! Finds signals of the same measurement by their sources, never by their names.
//!
//! Two signals from the same field of the same messages are one measurement, whatever their conversion; an element of a list is a
//! part of the list. Each is derived from the other for the evidence, so that neither is a witness about the other. [The
//! parts](super::SourceParts) of a source tell these cases apart.

use super::index::Index;
use super::{IdVec, Signal, SignalId};
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// A signal that is derived from another because of its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Found {
    pub(super) signal: SignalId,
    pub(super) origin: SignalId,
    /// Whether both are the same measurement; else the signal is a part of the other.
    pub(super) is_same: bool,
}

/// Signals that are one witness together.
#[derive(Clone, Debug, Default)]
pub(super) struct Witnesses {
    /// Pairs of a representing signal and another of the same source, ascending by the second.
    same: Vec<(SignalId, SignalId)>,
}

impl Witnesses {
    /// The signal that represents this one.
    pub(super) fn of(&self, signal: SignalId) -> SignalId {
        let found = self.same.binary_search_by_key(&signal, |&(_, same)| same);
        found.ok().and_then(|at| self.same.get(at)).map_or(signal, |&(first, _)| first)
    }

    /// Pairs of a representing signal and another of the same source.
    pub(super) fn all(&self) -> &[(SignalId, SignalId)] {
        &self.same
    }

    pub(super) fn is_empty(&self) -> bool {
        self.same.is_empty()
    }
}

/// Adds the found origins to each signal, except where the model names them already or a cycle would follow. Time: n log n for n
/// signals, and their derivations for each found signal.
pub(super) fn derive(signals: &mut IdVec<SignalId, Signal>) -> (Witnesses, Vec<Found>) {
    let measurement = |id: SignalId| signals[id].measurement();
    let index = Index::new(signals.len(), measurement);
    let mut groups = index.repeated(measurement);
    groups.retain(|&(first, _)| !measurement(first).is_empty());
    groups.sort_unstable();
    let mut found = Vec::new();
    let mut same = Vec::new();
    for group in groups.chunk_by(|one, other| one.0 == other.0) {
        let all = || group.iter().take(1).map(|&(first, _)| first).chain(group.iter().map(|&(_, id)| id));
        let is_derived = |&id: &SignalId| all().any(|other| other != id && is_from(signals, id, other));
        let Some(first) = all().find(|id| !is_derived(id)).or_else(|| all().next()) else { continue };
        let others = || all().filter(|&other| other != first);
        same.extend(others().map(|other| (first, other)));
        found.extend(others().map(|signal| Found { signal, origin: first, is_same: true }));
    }
    same.sort_unstable_by_key(|&(_, signal)| signal);
    let witnesses = Witnesses { same };
    let whole = |id: SignalId| signals[id].lists().find_map(|list| index.find(list, measurement));
    let parts = signals.ids().filter_map(|id| Some((id, whole(id)?)));
    found.extend(parts.map(|(signal, whole)| Found { signal, origin: witnesses.of(whole), is_same: false }));
    found.retain(|it| !signals[it.signal].derived_from.contains(&it.origin));
    found.retain(|it| {
        let is_sound = it.signal != it.origin && !is_from(signals, it.origin, it.signal);
        if is_sound {
            let origins = &mut signals[it.signal].derived_from;
            origins.push(it.origin);
            origins.sort_unstable();
        }
        is_sound
    });
    found.sort_unstable_by_key(|it| (it.signal, it.origin));
    (witnesses, found)
}

/// Whether a signal is derived from another, directly or not.
fn is_from(signals: &IdVec<SignalId, Signal>, signal: SignalId, origin: SignalId) -> bool {
    let (mut open, mut seen) = (Vec::from([signal]), BTreeSet::new());
    while let Some(next) = open.pop() {
        for &before in &signals[next].derived_from {
            if before == origin {
                return true;
            }
            if seen.insert(before) {
                open.push(before);
            }
        }
    }
    false
}
