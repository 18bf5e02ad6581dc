//! Linear combinations of signals of one unit.

use crate::learning::form::fit;
use crate::learning::shape::{Relation, Shape};
use crate::learning::signal::{Part, Seen};
use crate::learning::{MOST_UNEXPLAINED, WORTH};
use nalgebra::{DMatrix, DVector};

/// Terms of a sum.
const MOST_TERMS: usize = 6;

/// Sets that are extended from four terms on.
const KEPT_LARGE: usize = 200;

/// Of more signals, sums are extended from the best few of each size.
const ALL_SUBSETS: usize = 20;
const KEPT: usize = 30;

/// The smallest sum that leaves little of the target unexplained, with as many terms as improve it enough.
pub(crate) fn of(
    seen: &Seen<'_>,
    signals: &[usize],
    target: usize,
    is_same: &dyn Fn(usize, usize) -> bool,
) -> Option<Relation> {
    let inputs: Vec<usize> = signals
        .iter()
        .copied()
        .filter(|it| *it != target && seen.is_addable(*it, target) && !is_same(*it, target))
        .collect();
    let moments = Moments::new(seen, target, &inputs)?;
    let keeps = if inputs.len() > ALL_SUBSETS { KEPT } else { usize::MAX };
    let mut chosen: Vec<Vec<usize>> = vec![Vec::new()];
    let mut best: Option<Relation> = None;
    for _ in 0..MOST_TERMS {
        let mut grown = grown(&chosen, &inputs, is_same);
        grown.sort();
        grown.dedup();
        let mut rated: Vec<(f64, Vec<usize>)> =
            grown.into_iter().filter_map(|terms| Some((moments.left(&inputs, &terms)?, terms))).collect();
        rated.sort_by(|one, other| one.0.total_cmp(&other.0));
        let is_large = rated.first().is_some_and(|it| it.1.len() >= 4);
        rated.truncate(if is_large { keeps.min(KEPT_LARGE) } else { keeps });
        let Some((_, terms)) = rated.first() else { break };
        let found = fit(seen, target, terms, &Shape::Sum).filter(|it| it.score.worst() <= MOST_UNEXPLAINED);
        if let Some(found) = found {
            let is_worth = best.as_ref().is_none_or(|best: &Relation| {
                found.score.fitted < WORTH * best.score.fitted
                    && found.score.unseen < WORTH * best.score.unseen
            });
            if is_worth {
                best = Some(found);
            }
        }
        chosen = rated.into_iter().map(|(_, terms)| terms).collect();
    }
    best.filter(|it| it.inputs.len() > 1)
}

/// Sets with one more term, in order.
fn grown(chosen: &[Vec<usize>], inputs: &[usize], is_same: &dyn Fn(usize, usize) -> bool) -> Vec<Vec<usize>> {
    let mut grown = Vec::new();
    for terms in chosen {
        for input in inputs {
            if terms.iter().any(|it| it == input || is_same(*it, *input)) {
                continue;
            }
            let mut terms = terms.clone();
            terms.push(*input);
            terms.sort_unstable();
            grown.push(terms);
        }
    }
    grown
}

/// Products of the target and all inputs over the moments before the unseen part, without their means.
struct Moments {
    together: DMatrix<f64>,
}

impl Moments {
    fn new(seen: &Seen<'_>, target: usize, inputs: &[usize]) -> Option<Moments> {
        let all: Vec<usize> = inputs.iter().copied().chain([target]).collect();
        let clock = seen.slowest(all.iter().copied());
        let rows: Vec<usize> = (0..clock.times.len())
            .filter(|row| {
                clock.parts[*row] != Part::Unseen && all.iter().all(|it| clock.values[*it][*row].is_finite())
            })
            .collect();
        if rows.len() <= all.len() {
            return None;
        }
        let centred: Vec<Vec<f64>> = all
            .iter()
            .map(|signal| {
                let own: Vec<f64> = rows.iter().map(|row| clock.values[*signal][*row]).collect();
                let (mean, size) =
                    (crate::order::mean(&own), crate::order::variance(&own).sqrt().max(f64::MIN_POSITIVE));
                own.into_iter().map(|it| (it - mean) / size).collect()
            })
            .collect();
        let together = DMatrix::from_fn(all.len(), all.len(), |one, other| {
            centred[one].iter().zip(&centred[other]).map(|(one, other)| one * other).sum::<f64>()
                / rows.len() as f64
        });
        Some(Moments { together })
    }

    /// The share of the target's variance that a set of terms leaves unexplained.
    fn left(&self, inputs: &[usize], terms: &[usize]) -> Option<f64> {
        let places: Vec<usize> =
            terms.iter().filter_map(|term| inputs.iter().position(|input| input == term)).collect();
        let target = self.together.nrows() - 1;
        let normal = DMatrix::from_fn(places.len(), places.len(), |one, other| {
            self.together[(places[one], places[other])]
        });
        let right = DVector::from_fn(places.len(), |one, _| self.together[(places[one], target)]);
        Some(1.0 - right.dot(&normal.cholesky()?.solve(&right)))
    }
}
