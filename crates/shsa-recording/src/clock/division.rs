//! Where the clock of a file was set, and which samples have wrong times.

use super::receptions::{Receptions, Signal};
use super::times::{steps, wrong};
use super::{Step, Suspicion};
use shsa_core::time::Span;
use std::collections::BTreeSet;

/// The number of samples after a step of one signal that show whether the others stepped, too.
const NEIGHBOURS: usize = 8;

/// A file split where its clock was set. Samples are named by their places in the order of the file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Division {
    /// The step before each piece; `None` before the first.
    pub(crate) steps: Vec<Option<Step>>,
    /// The samples with a wrong time.
    pub(crate) strays: BTreeSet<usize>,
    /// For each piece but the first: where it begins, and the samples from there on that are late ones of the piece before.
    cuts: Vec<(usize, Vec<usize>)>,
}

impl Division {
    /// Whether all samples are of one piece.
    pub(crate) fn is_whole(&self) -> bool {
        self.cuts.is_empty() && self.strays.is_empty()
    }

    /// The pieces of all samples, as [`Division::piece_of`] gives them.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = Option<usize>> {
        let mut piece = 0;
        (0..).map(move |place| {
            while self.cuts.get(piece).is_some_and(|(begin, _)| *begin <= place) {
                piece += 1;
            }
            self.of(piece, place)
        })
    }

    /// The piece of a sample; `None` when its time is wrong.
    pub(crate) fn piece_of(&self, place: usize) -> Option<usize> {
        self.of(self.cuts.partition_point(|(begin, _)| *begin <= place), place)
    }

    /// The piece of a sample that comes behind the begin of this piece.
    fn of(&self, piece: usize, place: usize) -> Option<usize> {
        if self.strays.contains(&place) {
            return None;
        }
        let of_last = piece.checked_sub(1).and_then(|last| self.cuts.get(last));
        let is_late = of_last.is_some_and(|(_, late)| late.binary_search(&place).is_ok());
        Some(piece - usize::from(is_late))
    }
}

/// A step of one signal, by places in the file.
struct Found {
    wanted: usize,
    /// The first sample of the signal after the step, and the last one before it.
    place: usize,
    before: usize,
    /// Behind the samples that show whether the other signals stepped, too.
    until: usize,
    step: Step,
}

/// Splits a file.
///
/// Time: O(samples), for each signal whose clock may have been set once more; each time that goes back adds the samples that it
/// passes. Memory: the steps and the wrong times.
pub(crate) fn divide(all: &(impl Receptions + ?Sized)) -> Division {
    let mut division = Division { steps: vec![None], ..Division::default() };
    let mut suspicion = Suspicion::default();
    all.each(|_, wanted, received| suspicion.see(wanted, received));
    suspicion.signals.sort_unstable();
    let mut found: Vec<Found> = Vec::new();
    for wanted in suspicion.signals {
        let mut own = all.signal(wanted, &BTreeSet::new());
        let strays: BTreeSet<usize> = wrong(&own).into_iter().filter_map(|at| own.place(at)).collect();
        if !strays.is_empty() {
            own = all.signal(wanted, &strays);
        }
        division.strays.extend(strays);
        let of_step = |(at, step): (usize, Step)| {
            let before = at.checked_sub(1).and_then(|before| own.place(before)).unwrap_or(0);
            let until = own.place(at + NEIGHBOURS).map_or(all.count(), |place| place + 1);
            Some(Found { wanted, place: own.place(at)?, before, until, step })
        };
        found.extend(steps(&own).into_iter().filter_map(of_step));
    }
    found.sort_by_key(|found| (found.place, found.wanted));
    division.cut(&found, all);
    division
}

impl Division {
    /// Begins a piece at each step, except for those that another signal has shown already.
    fn cut(&mut self, found: &[Found], all: &(impl Receptions + ?Sized)) {
        let mut last: Option<&Found> = None;
        for next in found {
            let is_reported = |shown: &Found| {
                next.before < if shown.wanted == next.wanted { shown.place } else { shown.until }
            };
            if last.is_some_and(is_reported) {
                continue;
            }
            if let Some(late) = neighbours(all, next) {
                self.steps.push(Some(next.step));
                self.cuts.push((next.place, late));
                last = Some(next);
            }
        }
    }
}

/// The samples behind a step whose times continue those before it; `None` when most do, as then the clock of the file did not
/// step.
fn neighbours(all: &(impl Receptions + ?Sized), found: &Found) -> Option<Vec<usize>> {
    let half = Span((found.step.to - found.step.from).abs().0 / 2);
    let (mut now, mut others, mut late) = (found.step.to, 0_usize, Vec::new());
    for place in found.place..found.until {
        let Some((wanted, received)) = all.at(place) else { break };
        if wanted == found.wanted {
            now = received;
            continue;
        }
        others += 1;
        if (received - now).abs() > half {
            late.push(place);
        }
    }
    (2 * late.len() <= others).then_some(late)
}
