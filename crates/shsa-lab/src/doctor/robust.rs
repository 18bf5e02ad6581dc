//! Fits that a minority of faulty stretches does not spoil.

use crate::learning::solve;
use crate::order::{mean, winsorised};

/// The share of the rows that a fit keeps: faults of up to 20 % of the time, and natural outliers beside them, are left out.
const KEPT: f64 = 0.7;

/// A standard deviation, of Gaussian values, over the root mean square of their inner 70 %.
const OF_KEPT: f64 = 1.0 / 0.557;

/// The rows from which a fit starts, taken evenly; all rows end it.
const FEW: usize = 800;

/// The parts of the time from each of which a fit starts, and the steps of each start.
const PARTS: usize = 8;
const STEPS: usize = 5;

/// Constants with the scale of what they leave.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// The factors of the columns.
    pub(super) numbers: Vec<f64>,
    /// The deviation of what is left, estimated from the inner 70 % of it.
    pub(super) scale: f64,
}

/// The least trimmed squares of rows in the order of time, from several starts: the whole and each part of the time. `is_used` tells
/// which rows may be fitted to; `None` where they are too few, or columns are dependent.
///
/// P. Rousseeuw, K. Van Driessen, "Computing LTS regression for large data sets", Data Mining and Knowledge Discovery 12 (2006),
/// doi:10.1007/s10618-005-0024-4. Time: O(rows * columns^2), some dozen times.
pub(super) fn fit(columns: &[Vec<f64>], target: &[f64], is_used: &dyn Fn(usize) -> bool) -> Option<Fit> {
    let rows: Vec<usize> = (0..target.len()).filter(|row| is_used(*row)).collect();
    if columns.is_empty() {
        let left: Vec<f64> = rows.iter().map(|row| target[*row]).collect();
        return Some(Fit { numbers: Vec::new(), scale: inner_deviation(&left) });
    }
    let few: Vec<usize> = rows.iter().copied().step_by(rows.len().div_ceil(FEW).max(1)).collect();
    let of_few = |of: &[f64]| few.iter().map(|row| of[*row]).collect::<Vec<f64>>();
    let (some, own): (Vec<Vec<f64>>, Vec<f64>) =
        (columns.iter().map(|it| of_few(it)).collect(), of_few(target));
    let all: Vec<usize> = (0..few.len()).collect();
    let starts = std::iter::once(all.as_slice()).chain(all.chunks(few.len().div_ceil(PARTS).max(1)));
    let from = |start: &[usize]| {
        let (first, last) = (*start.first()?, *start.last()?);
        let numbers = solve(&some, &own, |row| first <= row && row <= last)?;
        concentrated(&some, &own, &all, numbers)
    };
    let best = starts.filter_map(from).min_by(|one, other| one.scale.total_cmp(&other.scale))?;
    if few.len() == rows.len() && few.len() == target.len() {
        Some(best)
    } else {
        concentrated(columns, target, &rows, best.numbers)
    }
}

/// The scale of [`fit`] from one start in few steps, for comparisons of forms; infinite where there is none.
pub(super) fn scale_at_once(columns: &[Vec<f64>], target: &[f64]) -> f64 {
    let rows: Vec<usize> = (0..target.len()).collect();
    let numbers = if columns.is_empty() { Some(Vec::new()) } else { solve(columns, target, |_| true) };
    numbers.and_then(|it| concentrated(columns, target, &rows, it)).map_or(f64::INFINITY, |it| it.scale)
}

/// From one start: the rows that are left least are fitted again, until nothing changes.
fn concentrated(columns: &[Vec<f64>], target: &[f64], rows: &[usize], mut numbers: Vec<f64>) -> Option<Fit> {
    let mut scale = f64::INFINITY;
    for _ in 0..STEPS {
        let offs: Vec<f64> = rows.iter().map(|row| left(columns, target, &numbers, *row).abs()).collect();
        let most = inner(&mut offs.clone())?;
        let mut kept = vec![false; target.len()];
        rows.iter().zip(&offs).filter(|it| *it.1 <= most).for_each(|(row, _)| kept[*row] = true);
        if columns.is_empty() {
            return Some(Fit { numbers, scale: inner_deviation(target) });
        }
        numbers = solve(columns, target, |row| kept[row])?;
        let now = inner_deviation(
            &rows.iter().map(|row| self::left(columns, target, &numbers, *row)).collect::<Vec<_>>(),
        );
        if now >= 0.995 * scale {
            scale = scale.min(now);
            break;
        }
        scale = now;
    }
    scale.is_finite().then_some(Fit { numbers, scale })
}

/// What a row leaves.
pub(super) fn left(columns: &[Vec<f64>], target: &[f64], numbers: &[f64], row: usize) -> f64 {
    target[row] - columns.iter().zip(numbers).map(|(column, number)| column[row] * number).sum::<f64>()
}

/// The size up to which values are kept. Time: O(n).
fn inner(sizes: &mut [f64]) -> Option<f64> {
    let rank = (KEPT * sizes.len() as f64).ceil() as usize;
    if sizes.is_empty() {
        return None;
    }
    let last = rank.clamp(1, sizes.len()) - 1;
    Some(*sizes.select_nth_unstable_by(last, f64::total_cmp).1)
}

/// The deviation from 0 of what is left, by its inner 70 %. Time: O(n).
pub(super) fn inner_deviation(left: &[f64]) -> f64 {
    let mut squares: Vec<f64> = left.iter().map(|it| it * it).collect();
    let Some(most) = inner(&mut squares) else { return 0.0 };
    let kept: Vec<f64> = squares.into_iter().filter(|it| *it <= most).collect();
    OF_KEPT * mean(&kept).sqrt()
}

/// How far values spread, of which a minority may be anything.
pub(super) fn spread(values: &[f64]) -> f64 {
    winsorised(values).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fifth_of_the_time_in_another_unit_moves_no_constant() {
        let x: Vec<f64> = (0..500).map(|at| (f64::from(at) * 0.05).sin()).collect();
        let noise = |at: usize| 0.01 * ((at * 7_919 % 101) as f64 / 50.0 - 1.0);
        let value = |at: usize| 3.0 * x[at] + 2.0 + noise(at);
        let target: Vec<f64> = (0..500)
            .map(|at| if (300..400).contains(&at) { 1_000.0 * value(at) } else { value(at) })
            .collect();
        let found = fit(&[x.clone(), vec![1.0; 500]], &target, &|_| true).unwrap();
        assert!((found.numbers[0] - 3.0).abs() < 0.01 && (found.numbers[1] - 2.0).abs() < 0.01, "{found:?}");
        assert!(found.scale < 0.02, "{found:?}");
    }
}
