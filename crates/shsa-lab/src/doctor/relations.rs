//! Relations that may hold: of two signals, found here; of more, and of rates, as they are learned without what is masked.

use super::check::{Check, Data, ONE, scale_of_few, window_s};
use super::likely::{self, Likely};
use crate::LabError;
use crate::campaign::Progress;
use crate::campaign::parallel::on_all_cores;
use crate::drafting::Columns;
use crate::learning::{Relation, Score, Shape, Signal, learn_sessions};

/// A delay is one where it leaves this share of what no delay leaves.
const WORTH: f64 = 0.9;

/// Rounds of the golden-section search for a delay.
const ROUNDS: usize = 12;
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The parts of the time, of which each two neighbours are left out once, so that a fault in them spoils no relation.
const PARTS: usize = 5;

/// With more signals than these, relations are learned from the whole time only.
const FEW: usize = 16;

/// The most values of a signal from which relations are learned, taken evenly: their search looks at 2000 moments.
const MOST_VALUES: usize = 4_000;

/// The longest window of a rate or a mean as a share of the time: a longer one tells little of when.
const LONGEST_WINDOW: f64 = 0.02;

/// With more signals than these, only the first ones are tried.
const MOST: usize = 40;

/// The relations of likely pairs. Time: O(signals^2), with bounded moments each.
///
/// # Errors
/// When a thread panics.
pub(super) fn pairs(
    data: &Data,
    own: &[usize],
    extent: (f64, f64),
    progress: &dyn Progress,
) -> Result<Vec<Relation>, LabError> {
    let likely = likely::pairs(&data.curves, own, extent);
    let step_s = likely::step_s(extent.1 - extent.0);
    on_all_cores(likely.len(), None, progress, "pairs of signals", |at| pair(data, likely[at], step_s))
}

/// The line between two signals, with the delay that leaves least.
fn pair(data: &Data, likely: Likely, step_s: f64) -> Relation {
    let line = |lag_s: f64| relation(likely.target, vec![likely.input], Shape::Line { lag_s });
    let leaves = |lag_s: f64| scale_of_few(data, &line(lag_s));
    let (mut low, mut high) = (likely.lag_s - step_s, likely.lag_s + step_s);
    let (mut left, mut right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut of_left, mut of_right) = (leaves(left), leaves(right));
    for _ in 0..ROUNDS {
        if of_left > of_right {
            (low, left, of_left) = (left, right, of_right);
            right = low + GOLDEN * (high - low);
            of_right = leaves(right);
        } else {
            (high, right, of_right) = (right, left, of_left);
            left = high - GOLDEN * (high - low);
            of_left = leaves(left);
        }
    }
    let lag_s = 0.5 * (low + high);
    let lag_s = if leaves(lag_s) < WORTH * leaves(0.0) { lag_s } else { 0.0 };
    let have_turns = [likely.target, likely.input].iter().all(|it| data.turns[*it].is_some());
    if have_turns { relation(likely.target, vec![likely.input], Shape::Equal { lag_s }) } else { line(lag_s) }
}

fn relation(target: usize, inputs: Vec<usize>, shape: Shape) -> Relation {
    let score = Score { fitted: 0.0, chosen: 0.0, unseen: 0.0 };
    Relation { target, inputs, shape, numbers: Vec::new(), window_s: None, score }
}

/// Whether the two sides of a check are equal but for an offset.
pub(super) fn is_equal(check: &Check) -> bool {
    match (&check.relation.shape, &check.relation.numbers[..]) {
        (Shape::Equal { .. }, _) => true,
        (Shape::Line { .. }, [factor, _]) => (factor - 1.0).abs() < ONE,
        _ => false,
    }
}

/// Relations of three and more, and rates, among one signal of each set that pairs connect.
///
/// # Errors
/// When a thread panics.
pub(super) fn larger(
    read: &Columns,
    data: &Data,
    own: &[usize],
    checks: &[Check],
    progress: &dyn Progress,
) -> Result<Vec<Relation>, LabError> {
    let mut chosen = representatives(own, checks);
    chosen.truncate(MOST);
    let masks: Vec<(f64, f64)> = chosen.iter().flat_map(|it| data.masks[*it].iter().copied()).collect();
    let mut joints: Vec<f64> =
        data.joints.iter().copied().chain(masks.iter().map(|it| 0.5 * (it.0 + it.1))).collect();
    joints.sort_by(f64::total_cmp);
    let end =
        read.columns.iter().filter_map(|it| it.signal.points.last()).fold(0.0_f64, |end, it| end.max(it.0));
    let outs = if chosen.len() <= FEW { PARTS } else { 1 };
    let mut found: Vec<Relation> = Vec::new();
    for out in 0..outs {
        let part = end / PARTS as f64;
        let (from, to) = ((out as f64 - 1.0) * part, (out as f64 + 1.0) * part);
        let hole = (out > 0).then_some((from, to));
        let signal = |column: &usize| {
            let own = &read.columns[*column].signal;
            let is_out =
                |time: f64| data.masks[*column].iter().chain(&hole).any(|it| it.0 <= time && time <= it.1);
            let every = own.points.len().div_ceil(MOST_VALUES).max(1);
            let points = own.points.iter().step_by(every).filter(|it| !is_out(it.0)).copied().collect();
            Signal { name: own.name.clone(), unit: own.unit.clone(), points }
        };
        let signals: Vec<Signal> = chosen.iter().map(signal).collect();
        let mut joints: Vec<f64> = joints.iter().copied().chain(hole.map(|it| 0.5 * (it.0 + it.1))).collect();
        joints.sort_by(f64::total_cmp);
        let learned = learn_sessions(&signals, &joints, progress)?;
        let is_short = |it: &Relation| window_s(&it.shape) <= LONGEST_WINDOW * end;
        for relation in learned.relations.into_iter().filter_map(as_check).filter(is_short) {
            let inputs: Vec<usize> = relation.inputs.iter().map(|it| chosen[*it]).collect();
            let relation = Relation { target: chosen[relation.target], inputs, ..relation };
            let is_new = |known: &Relation| known.signals() != relation.signals();
            if found.iter().all(is_new) && checks.iter().all(|it| is_new(&it.relation)) {
                found.push(relation);
            }
        }
    }
    Ok(found)
}

/// A learned relation as a check, if its form is evidence: one that any curve would fit is none.
fn as_check(relation: Relation) -> Option<Relation> {
    match (&relation.shape, relation.window_s) {
        (Shape::Integral, Some(window_s)) => Some(Relation {
            target: relation.inputs[0],
            inputs: vec![relation.target],
            shape: Shape::Rate { window_s },
            ..relation
        }),
        (
            Shape::Equal { .. }
            | Shape::Line { .. }
            | Shape::Mean { .. }
            | Shape::Rate { .. }
            | Shape::Product(_)
            | Shape::Projected { .. }
            | Shape::Sum
            | Shape::Terms(_)
            | Shape::Follower { .. }
            | Shape::Largest
            | Shape::Smallest,
            _,
        ) => Some(relation),
        _ => None,
    }
}

/// One signal of each set that pairs connect: the one with the closest checks.
fn representatives(own: &[usize], checks: &[Check]) -> Vec<usize> {
    let mut closest: Vec<(f64, usize)> = own
        .iter()
        .map(|signal| {
            let shares = checks.iter().filter(|it| it.relation.signals().contains(signal)).map(|it| it.share);
            (shares.fold(f64::INFINITY, f64::min), *signal)
        })
        .collect();
    closest.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    let mut taken: Vec<usize> = Vec::new();
    let mut chosen = Vec::new();
    for (_, signal) in closest {
        if taken.contains(&signal) {
            continue;
        }
        let mut open = vec![signal];
        while let Some(one) = open.pop() {
            if taken.contains(&one) {
                continue;
            }
            taken.push(one);
            let near = checks.iter().map(|it| it.relation.signals()).filter(|it| it.contains(&one));
            open.extend(near.flatten());
        }
        chosen.push(signal);
    }
    chosen.sort_unstable();
    chosen
}
