//! Lines with limits: the output stands still while the input goes on.

use crate::learning::form::{deviation, root_mean_square};
use crate::learning::least_squares::solve;
use crate::order::mean;

/// Rounds in which the limits are found.
const ROUNDS: usize = 12;

/// The share of the range at either end that the first line leaves out.
const MARGIN: f64 = 0.08;

/// The fewest samples at a limit, of all samples.
const STANDING: usize = 10;

/// The spread of the output at a limit, as a multiple of the error between the limits, at most; the line spreads further there. The
/// share of the range that counts as no error.
const SPREAD: f64 = 2.0;
const NO_ERROR: f64 = 1e-3;

/// The spread of the output at a limit, as a share of the spread of the line there, at most.
const STILL: f64 = 0.5;

/// Slope, offset, lower and upper limit of a saturated line. The fit alternates between the line through the values between the
/// limits, and the means of the values beyond. A limit at which too few samples stand is infinite; `None` where both are.
pub(crate) fn fit(columns: &[Vec<f64>], target: &[f64], is_used: impl Fn(usize) -> bool) -> Option<Vec<f64>> {
    let rows: Vec<usize> = (0..target.len()).filter(|row| is_used(*row)).collect();
    let least = (STANDING * rows.len()).div_ceil(target.len().max(1)).max(1);
    let used = Used { columns, target, rows, least };
    let ends = used.ends();
    let margin = MARGIN * (ends.1 - ends.0);
    let (mut low, mut high) = (ends.0 + margin, ends.1 - margin);
    let mut line = used.line(|row| low < target[row] && target[row] < high)?;
    for _ in 0..ROUNDS {
        let at = |row: usize| used.on_line(&line, row);
        let (below, above) = (used.beyond(|row| at(row) < low), used.beyond(|row| at(row) > high));
        low = below.map_or(ends.0, |it| mean(&it));
        high = above.map_or(ends.1, |it| mean(&it));
        line = used.line(|row| low < at(row) && at(row) < high)?;
    }
    let at = |row: usize| used.on_line(&line, row);
    let noise = used.spread(|row| (low < at(row) && at(row) < high).then(|| target[row] - at(row)));
    let most = SPREAD * noise.max(NO_ERROR * (ends.1 - ends.0));
    let stands_low = used.stands(&line, low, most, |row| at(row) < low);
    let stands_high = used.stands(&line, high, most, |row| at(row) > high);
    let low = if stands_low { low } else { f64::NEG_INFINITY };
    let high = if stands_high { high } else { f64::INFINITY };
    if !(low < high && (stands_low || stands_high)) {
        return None;
    }
    let line = used.line(|row| low < at(row) && at(row) < high)?;
    Some(vec![line[0], line[1], low, high])
}

/// The rows at the lower limit, between the limits, and at the upper one.
pub(crate) fn pieces(columns: &[Vec<f64>], numbers: &[f64]) -> [Vec<usize>; 3] {
    let mut pieces = [const { Vec::new() }; 3];
    if let ([input, ..], [slope, offset, low, high]) = (columns, numbers) {
        for (row, value) in input.iter().enumerate() {
            let at = slope * value + offset;
            let piece = usize::from(at >= *low) + usize::from(at > *high);
            pieces[piece].push(row);
        }
    }
    pieces
}

/// The samples that are used.
struct Used<'a> {
    columns: &'a [Vec<f64>],
    target: &'a [f64],
    rows: Vec<usize>,
    /// The fewest samples at a limit.
    least: usize,
}

impl Used<'_> {
    /// The smallest and the largest value of the target.
    fn ends(&self) -> (f64, f64) {
        let values = self.rows.iter().map(|row| self.target[*row]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(it), high.max(it)))
    }

    /// The line through the used samples that are chosen.
    fn line(&self, is_chosen: impl Fn(usize) -> bool) -> Option<Vec<f64>> {
        let mut chosen = vec![false; self.target.len()];
        self.rows.iter().for_each(|row| chosen[*row] = is_chosen(*row));
        solve(self.columns, self.target, |row| chosen[row])
    }

    fn on_line(&self, line: &[f64], row: usize) -> f64 {
        self.columns.iter().zip(line).map(|(column, number)| column[row] * number).sum()
    }

    /// The values beyond a limit, when they are enough.
    fn beyond(&self, is_beyond: impl Fn(usize) -> bool) -> Option<Vec<f64>> {
        let own: Vec<f64> =
            self.rows.iter().filter(|row| is_beyond(**row)).map(|row| self.target[*row]).collect();
        (own.len() >= self.least).then_some(own)
    }

    fn spread(&self, error: impl Fn(usize) -> Option<f64>) -> f64 {
        root_mean_square(&self.rows.iter().filter_map(|row| error(*row)).collect::<Vec<f64>>())
    }

    /// Whether the output stands at a limit while the input goes on.
    fn stands(&self, line: &[f64], limit: f64, most: f64, is_beyond: impl Fn(usize) -> bool) -> bool {
        if self.beyond(&is_beyond).is_none() {
            return false;
        }
        let output = self.spread(|row| is_beyond(row).then(|| self.target[row] - limit));
        let rows = self.rows.iter().filter(|row| is_beyond(**row));
        let input = deviation(rows.map(|row| self.on_line(line, *row)));
        output <= most && most <= input && output <= STILL * input
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave from 0 to 100, as an input with its constant column, and what a line with limits makes of it.
    fn wave(limited: impl Fn(f64) -> f64) -> (Vec<Vec<f64>>, Vec<f64>) {
        let input: Vec<f64> = (0..1000).map(|at| 50.0 + 50.0 * (0.05 * f64::from(at)).sin()).collect();
        let noise = |at: usize| 0.1 * ((at * 7919 % 101) as f64 / 50.0 - 1.0);
        let target = input.iter().enumerate().map(|(at, it)| limited(*it) + noise(at)).collect();
        (vec![input, vec![1.0; 1000]], target)
    }

    #[track_caller]
    fn check(limited: impl Fn(f64) -> f64, expected: Option<[f64; 4]>) {
        let (columns, target) = wave(limited);
        let found = fit(&columns, &target, |_| true);
        let is_near = |(one, other): (&f64, &f64)| one == other || (one - other).abs() < 0.1;
        let alike = match (&found, &expected) {
            (Some(found), Some(expected)) => found.iter().zip(expected).all(is_near),
            (None, None) => true,
            _ => false,
        };
        assert!(alike, "{found:?}");
    }

    #[test]
    fn a_limit_is_where_the_output_stands() {
        check(|it| it.clamp(20.0, 70.0), Some([1.0, 0.0, 20.0, 70.0]));
        check(|it| (1.3 * it).min(90.0), Some([1.3, 0.0, f64::NEG_INFINITY, 90.0]));
        check(|it| (2.0 - it).max(-60.0), Some([-1.0, 2.0, -60.0, f64::INFINITY]));
    }

    #[test]
    fn the_end_of_what_was_seen_is_no_limit() {
        check(|it| it, None);
    }

    #[test]
    fn where_the_input_stands_too_is_no_limit() {
        let (mut columns, mut target) = wave(|it| it);
        columns[0].extend([104.0; 300]);
        columns[1].extend([1.0; 300]);
        target.extend([103.0; 300]);
        assert_eq!(fit(&columns, &target, |_| true), None);
    }

    #[test]
    fn a_limit_that_few_samples_support_is_none() {
        check(|it| it.min(99.99), None);
    }

    #[test]
    fn each_row_is_of_one_piece() {
        let columns = [vec![0.0, 5.0, 2.0, 9.0], vec![1.0; 4]];
        assert_eq!(pieces(&columns, &[1.0, 0.0, 1.0, 6.0]), [vec![0], vec![1, 2], vec![3]]);
        assert_eq!(pieces(&columns, &[1.0, 0.0, f64::NEG_INFINITY, 6.0]), [vec![], vec![0, 1, 2], vec![3]]);
    }
}
