//! What a signal shows without any other: silence, and values far outside of all others.

use super::findings::{Chart, Finding};
use super::kind::Kind;
use crate::drafting::{Column, Columns, Facts, Role};
use crate::order::{quantile, sorted};

/// A silence is this many times as long as the longest other gap, and as 99 % of the gaps; and this share of the recording.
const LONGER: f64 = 5.0;
const USUAL: f64 = 20.0;
const LEAST: f64 = 0.005;

/// A silence ranks no higher than this: it is seen without help.
const MOST_RANK: f64 = 2.0;

/// What comes at most this many times as late as usual comes in a rhythm.
const EVEN: f64 = 3.0;

/// A value is impossible where it is outside of the range of all others by so many times the width of it.
const OUTSIDE: f64 = 3.0;

/// The largest share of values that are impossible.
const RARE: f64 = 0.01;

/// The findings of each signal alone; the recording ends at `end`, in seconds. Time: O(n log n) for each.
pub(super) fn all(read: &Columns, facts: &[Option<Facts>], roles: &[Role], end: f64) -> Vec<Finding> {
    let is_measured = |it: &usize| {
        matches!(roles[*it], Role::Signal) && facts[*it].as_ref().is_some_and(|it| it.levels.is_none())
    };
    let measured: Vec<usize> = (0..read.columns.len()).filter(is_measured).collect();
    let mut found: Vec<Finding> =
        measured.iter().filter_map(|it| impossible(*it, &read.columns[*it])).collect();
    let silent = |column: &usize| Some((*column, silence(&read.columns[*column], end)?));
    let silences: Vec<(usize, (f64, f64, f64))> = measured.iter().filter_map(silent).collect();
    for (at, (column, (from_s, to_s, times))) in silences.iter().enumerate() {
        // Fields of one message are silent together: one finding.
        let is_one = |it: &(usize, (f64, f64, f64))| (it.1.0, it.1.1) == (*from_s, *to_s);
        if silences[..at].iter().any(is_one) || !is_heard_of_others(read, &measured, (*from_s, *to_s)) {
            continue;
        }
        let mut signals = vec![*column];
        signals.extend(silences[at + 1..].iter().filter(|it| is_one(it)).map(|it| it.0));
        found.push(Finding::alone(
            signals,
            (*from_s, *to_s),
            Kind::Silent,
            times.min(MOST_RANK),
            Chart::default(),
        ));
    }
    found
}

/// Values outside of all others.
fn impossible(column: usize, of: &Column) -> Option<Finding> {
    let values = sorted(of.signal.points.iter().map(|it| it.1));
    let rare = (RARE * values.len() as f64).floor().max(1.0);
    let (low, high) = (quantile(&values, 0.011)?, quantile(&values, 0.989)?);
    let width = high - low;
    if values.len() < 100 || width <= 0.0 {
        return None;
    }
    let is_outside = |it: &&(f64, f64)| it.1 > high + OUTSIDE * width || it.1 < low - OUTSIDE * width;
    let outside: Vec<(f64, f64)> = of.signal.points.iter().filter(is_outside).copied().collect();
    let (first, last) = (outside.first()?, outside.last()?);
    // All others must be near: else large values are how this quantity moves.
    let inner = values.iter().filter(|it| **it <= high + OUTSIDE * width && **it >= low - OUTSIDE * width);
    let ends = inner.fold((f64::INFINITY, f64::NEG_INFINITY), |ends, it| (ends.0.min(*it), ends.1.max(*it)));
    let whole = ends.1 - ends.0;
    let nearest = outside.iter().map(|it| (ends.0 - it.1).max(it.1 - ends.1)).fold(f64::INFINITY, f64::min);
    let comes_back = comes_back(&of.signal.points, &is_outside);
    if outside.len() as f64 > rare || nearest < OUTSIDE * whole || !comes_back {
        return None;
    }
    let kind = Kind::Impossible(outside.len(), first.1);
    let near = |it: &&(f64, f64)| (it.0 - first.0).abs() <= 10.0 * (last.0 - first.0).max(1.0);
    let shown: Vec<(f64, f64)> = of.signal.points.iter().filter(near).copied().collect();
    let every = shown.len().div_ceil(200).max(1);
    let thin = |it: &(usize, &(f64, f64))| it.0.is_multiple_of(every) || is_outside(&it.1);
    let shown: Vec<(f64, f64)> = shown.iter().enumerate().filter(thin).map(|it| *it.1).collect();
    let chart = Chart { own: shown, ..Chart::default() };
    Some(Finding::alone(vec![column], (first.0, last.0), kind, nearest / whole, chart))
}

/// Whether most values outside have one inside within the next few: a glitch, and no other way in which it moves.
fn comes_back(points: &[(f64, f64)], is_outside: &dyn Fn(&&(f64, f64)) -> bool) -> bool {
    const WITHIN: usize = 4;
    let is_back = |at: usize| {
        points.iter().skip(at + 1).take(WITHIN).any(|it| !is_outside(&it)) || at + 1 == points.len()
    };
    let outside: Vec<usize> = (0..points.len()).filter(|at| is_outside(&&points[*at])).collect();
    2 * outside.iter().filter(|at| is_back(**at)).count() > outside.len()
}

/// The longest silence of a signal that else comes in a rhythm, with how many times as long as any other gap it is.
fn silence(of: &Column, end: f64) -> Option<(f64, f64, f64)> {
    let points = &of.signal.points;
    let last = points.last()?.0;
    let within = |at: &usize| !of.breaks.contains(&(at + 1));
    let mut gaps: Vec<(f64, f64)> = (0..points.len().saturating_sub(1))
        .filter(within)
        .map(|at| (points[at + 1].0 - points[at].0, points[at].0))
        .collect();
    if gaps.len() < 40 {
        return None;
    }
    let lengths = sorted(gaps.iter().map(|it| it.0));
    let (usual, nearly_all) = (quantile(&lengths, 0.5)?, quantile(&lengths, 0.99)?);
    gaps.push((end - last, last));
    gaps.sort_by(|one, other| other.0.total_cmp(&one.0));
    let ((longest, from_s), next) = (*gaps.first()?, gaps.get(1)?.0);
    let is_silence = longest >= LONGER * next && longest >= USUAL * nearly_all && nearly_all <= EVEN * usual;
    let is_long = longest >= LEAST * (end - points.first()?.0);
    (is_silence && is_long).then_some((from_s, from_s + longest, longest / next.max(f64::MIN_POSITIVE)))
}

/// Whether most other signals go on meanwhile: else it is the recording that has a gap.
fn is_heard_of_others(read: &Columns, measured: &[usize], silence: (f64, f64)) -> bool {
    let lasts_s = silence.1 - silence.0;
    let middle = (silence.0 + 0.25 * lasts_s, silence.0 + 0.75 * lasts_s);
    let speaks = |column: &&usize| {
        let points = &read.columns[**column].signal.points;
        let first = points.partition_point(|it| it.0 <= middle.0);
        points.get(first).is_some_and(|it| it.0 < middle.1)
    };
    2 * measured.iter().filter(speaks).count() >= measured.len()
}
