//! Amounts of faults for a signal without a declared value error, whose tolerance is declared at a relation.

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

/// The smallest detected bias is this many amounts.
const TIMES: f64 = 2.0;

/// Without a detected bias: this share of the values' range, with which the search begins as well.
const SHARE_OF_RANGE: f64 = 0.01;

/// The faults for which amounts are wanted.
pub struct AmountSpec<'a> {
    /// The signals with faults.
    pub signals: &'a [SignalId],
    /// The number of moments at which each fault begins.
    pub onsets: usize,
    /// The duration of a fault; `None`: a quarter of the longest session.
    pub duration: Option<Span>,
    /// The number of threads; `None`: one for each core.
    pub threads: Option<NonZeroUsize>,
    /// The receiver of progress.
    pub progress: &'a dyn Progress,
}

/// The amount that replaces the value error that a signal does not declare, in its unit: half of the smallest bias that is
/// detected in the recording, so that twice the amount is detected; without a detected bias, a hundredth of the values' range. A
/// signal with constant values has no amount.
///
/// # Errors
/// When a run panicked.
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
