//! Which signals carry the same measurement, found by where they come from: never by what they are called.
//!
//! Two signals from the same field of the same messages are one measurement, whatever they are converted to; an element of a
//! list is a part of the list. Each is derived from the other as far as evidence goes, so that none bears witness for the
//! other. How a source is written is documented with the readers of recordings; here only what follows the field counts.

use super::index::Index;
use super::{IdVec, Signal, SignalId};
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// A signal that was found to be derived from another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Found {
    pub(super) signal: SignalId,
    pub(super) origin: SignalId,
    /// Whether it is the same measurement; else it is a part of it.
    pub(super) is_same: bool,
}

/// Signals that are one witness.
#[derive(Clone, Debug, Default)]
pub(super) struct Witnesses {
    /// The signal that stands for each that has the same source, ascending by the second.
    same: Vec<(SignalId, SignalId)>,
}

impl Witnesses {
    /// The signal that stands for this one.
    pub(super) fn of(&self, signal: SignalId) -> SignalId {
        let found = self.same.binary_search_by_key(&signal, |&(_, same)| same);
        found.ok().and_then(|at| self.same.get(at)).map_or(signal, |&(first, _)| first)
    }

    /// Each signal that another stands for, behind that one.
    pub(super) fn all(&self) -> &[(SignalId, SignalId)] {
        &self.same
    }

    pub(super) fn is_empty(&self) -> bool {
        self.same.is_empty()
    }
}

/// Adds to each signal what it is found to be derived from, unless the model says so already or it would go round in a
/// circle. Time: n log n for n signals, and their derivations for each that is found.
pub(super) fn derive(signals: &mut IdVec<SignalId, Signal>) -> (Witnesses, Vec<Found>) {
    let field = |id: SignalId| field(&signals[id]);
    let index = Index::new(signals.len(), field);
    let mut groups = index.repeated(field);
    groups.retain(|&(first, _)| !field(first).is_empty());
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
    let whole = |id: SignalId| whole(&signals[id], |part| index.find(part, field));
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

/// Whether a signal is derived from another, over whichever others.
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

/// A source without what does not change the values: the flag, the time, the slash before a topic. A source that is the
/// signal's own name, as none was given, is taken as it is: names may hold anything.
fn field(signal: &Signal) -> &str {
    let source = signal.source.as_str();
    if source == signal.name {
        return source;
    }
    let text = source.trim();
    let text = text.strip_suffix("!changed").map_or(text, str::trim_end);
    let text = text.rsplit_once('@').map_or(text, |(field, _)| field.trim_end());
    if text.contains('#') { text.strip_prefix('/').unwrap_or(text) } else { text }
}

/// The signal that carries the whole of which this one is an element: `position` for `position[1]`.
fn whole(signal: &Signal, find: impl Fn(&str) -> Option<SignalId>) -> Option<SignalId> {
    if signal.source == signal.name {
        return None;
    }
    let mut text = field(signal);
    while let Some((rest, element)) = text.strip_suffix(']').and_then(|open| open.rsplit_once('[')) {
        let is_place = !element.is_empty() && element.bytes().all(|byte| byte.is_ascii_digit());
        if !is_place && !element.contains('=') {
            return None;
        }
        text = rest.trim_end();
        if let Some(whole) = find(text) {
            return Some(whole);
        }
    }
    None
}
