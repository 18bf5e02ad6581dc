//! How large a fault of a signal is that declares no error of its own, as its tolerance stands at a relation.

use super::kind::Kind;
use super::onset::Recorded;
use super::parallel::Progress;
use super::size::Size;
use super::smallest::{self, Smallest};
use crate::LabError;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::time::Span;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;

/// An amount of this many times stands for the smallest bias that is seen.
const TIMES: f64 = 2.0;

/// Where no bias is seen: this share of how much the values vary, as the search for it begins with.
const SHARE_OF_RANGE: f64 = 0.01;

/// What is known of the faults that are wanted.
pub struct AmountSpec<'a> {
    /// The signals that are to be broken.
    pub signals: &'a [SignalId],
    /// How many moments each fault begins at.
    pub onsets: usize,
    /// How long a fault lasts; `None`: a quarter of the longest session.
    pub duration: Option<Span>,
    /// How many threads; `None`: as many as there are cores.
    pub threads: Option<NonZeroUsize>,
    /// Who hears how far it is.
    pub progress: &'a dyn Progress,
}

/// What takes the place of the error of value that a signal does not declare, in its unit: half of the smallest bias that is seen
/// in the recording, so that twice that is seen; where none is, a hundredth of how much its values vary. Signals whose values are
/// all the same have none.
///
/// # Errors
/// When a run broke off.
pub fn instead(
    knowledge: &KnowledgeBase,
    sessions: &[Recorded<'_>],
    spec: &AmountSpec<'_>,
) -> Result<BTreeMap<SignalId, f64>, LabError> {
    let size = |id: SignalId| {
        let own: Vec<_> = sessions.iter().map(|session| session.own(id)).collect();
        Some((id, Size::of(&knowledge.signals()[id], &own).filter(|size| size.error <= 0.0)?))
    };
    let bare: Vec<(SignalId, Size)> = spec.signals.iter().filter_map(|&id| size(id)).collect();
    if bare.is_empty() {
        return Ok(BTreeMap::new());
    }
    let signals: Vec<SignalId> = bare.iter().map(|(id, _)| *id).collect();
    let longest = sessions.iter().map(Recorded::length).max().unwrap_or_default();
    let spec = smallest::SearchSpec {
        kinds: &[Kind::Bias],
        signals: &signals,
        onsets: spec.onsets,
        seeds: 1,
        duration: spec.duration.unwrap_or(Span(longest.0 / 4)),
        unhealthy: Vec::new(),
        threads: spec.threads,
        progress: spec.progress,
    };
    let smallest = Smallest::find(knowledge, sessions, &spec)?;
    let amount = |(id, size): (SignalId, Size)| {
        let seen = smallest.seen(id, Kind::Bias).map(|(bias, _)| bias / TIMES);
        (id, seen.unwrap_or(SHARE_OF_RANGE * size.range))
    };
    Ok(bare.into_iter().map(amount).collect())
}
