//! How needs were served in a replay.

use super::Part;
use super::errors::Difference;
use shsa_core::knowledge::{Need, NeedId};
use shsa_core::time::Span;
use shsa_format::words;

/// The record of a need.
#[derive(Clone)]
pub(super) struct NeedReport {
    pub(super) id: NeedId,
    pub(super) published: u64,
    pub(super) longest_gap: Span,
    /// Whether there was always a value within the need's greatest age.
    pub(super) met: bool,
    pub(super) source: Option<String>,
    pub(super) widest: f64,
    /// The error relative to the run without the injected faults.
    pub(super) error: Option<Difference>,
}

pub(super) fn need_report(part: &Part<'_>, id: NeedId, need: &Need, is_one_of_several: bool) -> NeedReport {
    let run = part.run;
    let of_name = |(_, known): &(NeedId, &Need)| known.signal == need.signal;
    // A session may end before the change of the model that added the need.
    let Some((own, _)) = run.engine.knowledge().needs().enumerate().find(of_name) else {
        let (published, longest_gap, widest) = (0, Span::ZERO, 0.0);
        return NeedReport { id, published, longest_gap, met: true, source: None, widest, error: None };
    };
    let status = run.engine.need_status(own);
    let to_end = status.last.map_or(run.last - run.first, |last| run.last - last);
    let longest_gap = status.longest_gap.max(to_end);
    // With several sessions, one may end before any value is due.
    let is_over = status.published == 0 && is_one_of_several && part.duration() <= need.max_age;
    NeedReport {
        id,
        published: status.published,
        longest_gap,
        met: is_over || status.published > 0 && longest_gap <= need.max_age,
        source: status.source.as_ref().map(words::served_by),
        widest: status.widest,
        error: part.errors.and_then(|errors| errors.of(&need.signal)),
    }
}

/// The reports of one need, joined over all sessions; the source is that of the last session.
pub(super) fn together(needs_of: &[Vec<NeedReport>], at: usize) -> Option<NeedReport> {
    let mut of_need = needs_of.iter().filter_map(|needs| needs.get(at));
    let first = of_need.next()?.clone();
    Some(of_need.fold(first, |sum, next| NeedReport {
        id: next.id,
        published: sum.published + next.published,
        longest_gap: sum.longest_gap.max(next.longest_gap),
        met: sum.met && next.met,
        source: next.source.clone(),
        widest: sum.widest.max(next.widest),
        error: match (sum.error, next.error) {
            (Some(one), Some(other)) => Some(one.and(other)),
            (one, other) => one.or(other),
        },
    }))
}
