//! How needs were served in a replay, and the errors of their values relative to a run without faults.

use super::Part;
use shsa_core::engine::{Publication, PublishedValue, Quality};
use shsa_core::knowledge::{KnowledgeBase, Need, NeedId};
use shsa_core::time::{Span, Time};
use shsa_format::drive::Run;
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

/// The error of one run's values relative to another run.
#[derive(Clone, Copy, Default)]
pub(super) struct Difference {
    count: u64,
    squares: f64,
    pub(super) most: f64,
}

impl Difference {
    pub(super) fn rms(&self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }

    fn and(self, other: Difference) -> Difference {
        Difference {
            count: self.count + other.count,
            squares: self.squares + other.squares,
            most: self.most.max(other.most),
        }
    }
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
        error: part
            .clean
            .and_then(|clean| difference(values(run, need), &values(clean, need).collect::<Vec<_>>())),
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

/// The published scalars of a need, by its published name: time, and midpoint of the value.
fn values<'r>(run: &'r Run, need: &'r Need) -> impl Iterator<Item = (Time, f64)> + 'r {
    // The midpoint of an uncertain value is no estimate.
    let of_need = |known: &KnowledgeBase, publication: &Publication| {
        known.needs()[publication.need].signal == need.signal && publication.quality != Quality::Uncertain
    };
    run.publications_with_models(0)
        .filter(move |(known, publication)| of_need(known, publication))
        .filter_map(|(_, publication)| match &publication.value {
            PublishedValue::Scalar(value) => Some((publication.time, value.midpoint())),
            PublishedValue::Vector(_) => None,
        })
}

/// The root mean square and the largest difference to the reference value in force at the same time.
fn difference(values: impl Iterator<Item = (Time, f64)>, reference: &[(Time, f64)]) -> Option<Difference> {
    let mut sum = Difference::default();
    for (time, value) in values {
        let standing = reference.partition_point(|(at, _)| *at <= time);
        let Some((_, expected)) = standing.checked_sub(1).and_then(|at| reference.get(at)) else { continue };
        let error = (value - expected).abs();
        sum = sum.and(Difference { count: 1, squares: error * error, most: error });
    }
    (sum.count > 0).then_some(sum)
}
