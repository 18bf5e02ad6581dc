//! A target and other signals at few moments, to test candidates before a fit.

use crate::learning::form::{deviation, root_mean_square};
use crate::learning::least_squares::solve;
use crate::learning::signal::{Part, Seen};

/// A column of which others leave less than this share is a combination of them.
const DEPENDENT: f64 = 1e-9;

/// The least share of the moments at which each of two is chosen: fewer show no choice, and may be outliers of one alone.
const LEAST_TAKEN: f64 = 0.02;

/// The target and the other signals at some moments of the slowest of them.
pub(crate) struct Rows {
    pub(crate) target: Vec<f64>,
    values: Vec<(usize, Vec<f64>)>,
    moves: f64,
}

impl Rows {
    /// At most so many moments before the unseen part, at which all have values; `None` where these are few, or the target stands.
    pub(crate) fn new(seen: &Seen<'_>, target: usize, others: &[usize], moments: usize) -> Option<Rows> {
        let clock = seen.slowest(others.iter().copied().chain([target]));
        let is_known = |row: &usize| {
            clock.parts[*row] != Part::Unseen
                && others
                    .iter()
                    .chain([&target])
                    .all(|it| clock.values[*it].get(*row).is_some_and(|it| it.is_finite()))
        };
        let rows: Vec<usize> = (0..clock.times.len()).filter(is_known).collect();
        let every = rows.len().div_ceil(moments).max(1);
        let rows: Vec<usize> = rows.into_iter().step_by(every).collect();
        let of = |signal: usize| rows.iter().map(|row| clock.values[signal][*row]).collect::<Vec<f64>>();
        let target = of(target);
        let moves = deviation(target.iter().copied());
        let values = others.iter().map(|it| (*it, of(*it))).collect();
        (rows.len() >= 20 && moves > 0.0).then_some(Rows { target, values, moves })
    }

    /// The values of one of the others.
    pub(crate) fn value(&self, signal: usize) -> &[f64] {
        self.values.iter().find(|it| it.0 == signal).map_or(&[], |it| &it.1)
    }

    /// The product of signals with their powers.
    pub(crate) fn of(&self, powers: &[(usize, i8)]) -> Vec<f64> {
        let mut product = vec![1.0; self.target.len()];
        for (signal, power) in powers {
            let value = self.value(*signal);
            product.iter_mut().zip(value).for_each(|(product, it)| *product *= it.powi(i32::from(*power)));
        }
        product
    }

    /// The share that these columns and a constant leave.
    pub(crate) fn left(&self, columns: &[Vec<f64>], chosen: &[usize]) -> f64 {
        let ones = vec![1.0; self.target.len()];
        let used: Vec<Vec<f64>> = chosen.iter().map(|it| columns[*it].clone()).chain([ones]).collect();
        let Some(numbers) = solve(&used, &self.target, |_| true) else { return f64::INFINITY };
        let predicted =
            |row: usize| used.iter().zip(&numbers).map(|(it, number)| it[row] * number).sum::<f64>();
        let left: Vec<f64> = (0..self.target.len()).map(|row| self.target[row] - predicted(row)).collect();
        root_mean_square(&left) / self.moves
    }

    /// The target beside these columns and a constant. Time: O(columns^2 * moments).
    pub(crate) fn beside(&self, columns: Vec<Vec<f64>>) -> Beside {
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for column in [vec![1.0; self.target.len()]].into_iter().chain(columns) {
            let (before, own) = (length(&column), without(&basis, column));
            let after = length(&own);
            if after > DEPENDENT * before {
                basis.push(own.into_iter().map(|it| it / after).collect());
            }
        }
        let unit = self.moves * (self.target.len() as f64).sqrt();
        let rest = without(&basis, self.target.iter().map(|it| it / unit).collect());
        Beside { basis, rest }
    }

    /// The columns that alone leave least, in their order.
    pub(crate) fn nearest(&self, columns: &[Vec<f64>], most: usize) -> Vec<usize> {
        let mut rated: Vec<(f64, usize)> =
            (0..columns.len()).map(|it| (self.left(columns, &[it]), it)).collect();
        rated.sort_by(|one, other| one.0.total_cmp(&other.0));
        rated.truncate(most);
        let mut kept: Vec<usize> = rated.into_iter().map(|it| it.1).collect();
        kept.sort_unstable();
        kept
    }

    /// The share of the target that no function of a signal explains: from the differences of neighbours in the order of its values.
    pub(crate) fn scatter(&self, signal: usize) -> f64 {
        let pairs = self.value(signal).iter().copied().zip(self.target.iter().copied());
        let mut pairs: Vec<(f64, f64)> = pairs.collect();
        pairs.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
        let apart: Vec<f64> = pairs.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
        root_mean_square(&apart) / (2.0_f64.sqrt() * self.moves)
    }

    /// Whether a multiple of a column leaves less than this share of the target.
    pub(crate) fn is_multiple(&self, column: &[f64], most_left: f64) -> bool {
        let (together, size) = self
            .target
            .iter()
            .zip(column)
            .fold((0.0, 0.0), |(together, size), (own, it)| (together + own * it, size + it * it));
        let left = self.target.iter().zip(column).map(|(own, it)| (own - together / size * it).powi(2));
        (left.sum::<f64>() / self.target.len() as f64).sqrt() < most_left * self.moves
    }

    /// The spread of the target's differences from a function of two, as a share.
    pub(crate) fn apart(&self, one: usize, other: usize, of: fn(f64, f64) -> f64) -> f64 {
        let pairs = self.value(one).iter().zip(self.value(other));
        let apart = self.target.iter().zip(pairs).map(|(own, (one, other))| own - of(*one, *other));
        deviation(apart) / self.moves
    }

    /// Whether a choice between two takes each of them in at least a share of the moments: else it is one of them.
    pub(crate) fn takes_both(&self, one: usize, other: usize, of: fn(f64, f64) -> f64) -> bool {
        let pairs = || self.value(one).iter().zip(self.value(other));
        let takes_first = |(one, other): &(&f64, &f64)| of(**one, **other) == **one;
        let (first, all) = (pairs().filter(takes_first).count() as f64, pairs().count() as f64);
        first >= LEAST_TAKEN * all && all - first >= LEAST_TAKEN * all
    }
}

/// What some columns leave of the target: a further column is tried beside them without a new fit.
pub(crate) struct Beside {
    /// The columns, at right angles to each other and of length 1.
    basis: Vec<Vec<f64>>,
    /// What they leave, in such a unit that the whole target has a length of 1.
    rest: Vec<f64>,
}

impl Beside {
    /// The share that the columns leave.
    pub(crate) fn left(&self) -> f64 {
        length(&self.rest)
    }

    /// The share that they leave together with a further one. Time: O(columns * moments).
    pub(crate) fn left_with(&self, column: &[f64]) -> f64 {
        let own = without(&self.basis, column.to_vec());
        let size = length(&own);
        if size <= DEPENDENT * length(column) {
            return self.left();
        }
        let explained = product(&self.rest, &own) / size;
        (product(&self.rest, &self.rest) - explained * explained).max(0.0).sqrt()
    }
}

/// A column without what columns at right angles to each other explain of it.
fn without(basis: &[Vec<f64>], mut column: Vec<f64>) -> Vec<f64> {
    for other in basis {
        let share = product(&column, other);
        column.iter_mut().zip(other).for_each(|(own, it)| *own -= share * it);
    }
    column
}

fn product(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

fn length(column: &[f64]) -> f64 {
    product(column, column).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_is_one_of_which_both_are_taken() {
        for percent in 0..=100_u32 {
            let one: Vec<f64> = (0..1_000).map(|row| f64::from(u32::from(row % 100 < percent))).collect();
            let rows =
                Rows { target: one.clone(), values: vec![(3, one), (7, vec![0.5; 1_000])], moves: 1.0 };
            let is_choice = (2..=98).contains(&percent);
            assert_eq!(rows.takes_both(3, 7, f64::max), is_choice, "{percent} %");
            assert_eq!(rows.takes_both(7, 3, f64::min), is_choice, "{percent} %");
        }
    }
}
