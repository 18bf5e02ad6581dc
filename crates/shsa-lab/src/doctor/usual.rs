//! What a check usually leaves at each of its rows: by how fast both sides move there, and by how far out both of them are.
//!
//! A form that was fitted to most of the time is an approximation. What it leaves grows with the pace, as no two clocks and responses
//! are equal, and towards values that are rare, where a curve leaves its tangent.

use super::check::{Check, PARTS};
use crate::order::median;

/// Shares of the rows, by their pace or reach: what is usual is found for each of them.
const SHARES: [f64; 8] = [0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 1.0];

/// How far a pace looks to either side, in rows: at once, and for what responds slowly.
const NEIGHBOURS: [usize; 2] = [4, 30];

/// The least parts of the time in which a pace or a reach must be seen: a fault must not be usual at its own one.
const LEAST_PARTS: usize = 4;

/// Or the least times at which it comes back after other parts: a fault stays in one stretch.
const RETURNS: usize = 3;

/// The rows that show what is usual in a part.
const LEAST_ROWS: usize = 3;

/// What is usual where a pace or a reach was seen in few parts of the time only: it grows with this power of it. An error of time grows
/// in proportion to the pace; that of a tangent with the square of the distance (Taylor's theorem).
const OF_PACE: i32 = 1;
const OF_REACH: i32 = 2;

/// The usual difference at each row, at least `least`. Of signals of one kind no value excuses a difference, so that their reach does not
/// count. Time: O(rows log rows).
pub(super) fn of(check: &Check, least: f64) -> Vec<f64> {
    let count = check.times.len();
    let mut usual = vec![least; count];
    for neighbours in NEIGHBOURS {
        let pace =
            |row: usize| pace(&check.target, row, neighbours).min(pace(&check.predicted, row, neighbours));
        let paces: Vec<f64> = (0..count).map(pace).collect();
        By { check, measure: &paces, power: OF_PACE, least }.raise((0..count).collect(), &mut usual);
    }
    if check.is_one_kind {
        return usual;
    }
    let middle = median(check.target.iter().copied());
    // The side that is nearer to the middle counts: a fault takes one of them far out.
    let reach = |row: usize| (check.target[row] - middle).abs().min((check.predicted[row] - middle).abs());
    let reaches: Vec<f64> = (0..count).map(reach).collect();
    let (above, below) =
        (0..count).partition(|row| check.target[*row] + check.predicted[*row] > 2.0 * middle);
    for side in [above, below] {
        By { check, measure: &reaches, power: OF_REACH, least }.raise(side, &mut usual);
    }
    usual
}

/// What is usual by a measure of each row.
struct By<'a> {
    check: &'a Check,
    measure: &'a [f64],
    power: i32,
    least: f64,
}

impl By<'_> {
    /// Raises what is usual at some rows to what is usual by the measure.
    fn raise(&self, mut rows: Vec<usize>, usual: &mut [f64]) {
        let scale = self.check.scale;
        rows.sort_by(|one, other| self.measure[*one].total_cmp(&self.measure[*other]).then(one.cmp(other)));
        let (mut from, mut before) = (0, None::<(f64, f64)>);
        for share in SHARES {
            let to = ((share * rows.len() as f64).ceil() as usize).clamp(from, rows.len());
            let own = &rows[from..to];
            from = to;
            let Some(last) = own.last() else { continue };
            let middle = self.measure[own[own.len() / 2]];
            let inner = before.map_or(0.0, |it| it.0).max(0.5 * scale).max(self.least);
            let seen = self.seen_at(own).map(|it| it.max(inner));
            // What is seen in few parts of the time only may be off by more than what is seen often.
            let off = |measure: f64| match (seen, before) {
                (Some(seen), _) => seen,
                (None, Some((off, known))) if known > 0.0 => {
                    off.max(inner) * (measure / known).max(1.0).powi(self.power)
                }
                _ => inner.max(scale),
            };
            own.iter().for_each(|row| usual[*row] = usual[*row].max(off(self.measure[*row])));
            before = Some((off(middle), if seen.is_some() { middle } else { self.measure[*last] }));
        }
    }

    /// The deviation of some rows, by the middle one of the parts of the time; `None` where they are seen in too few parts.
    fn seen_at(&self, rows: &[usize]) -> Option<f64> {
        let size = self.check.times.len().div_ceil(PARTS).max(1);
        let mut squares = [(0_usize, 0.0_f64); PARTS];
        for row in rows {
            let part = &mut squares[row / size];
            *part = (part.0 + 1, part.1 + self.check.off(*row).powi(2));
        }
        let is_seen = squares.map(|it| it.0 >= LEAST_ROWS);
        let visits = usize::from(is_seen[0]) + is_seen.windows(2).filter(|it| !it[0] && it[1]).count();
        let seen: Vec<f64> = squares
            .iter()
            .filter(|it| it.0 >= LEAST_ROWS)
            .map(|(count, sum)| (sum / *count as f64).sqrt())
            .collect();
        (seen.len() >= LEAST_PARTS || visits >= RETURNS).then(|| median(seen.into_iter()))
    }
}

/// The largest change to a value from so many neighbours to either side.
fn pace(values: &[f64], row: usize, neighbours: usize) -> f64 {
    let own = values[row];
    let near = row.saturating_sub(neighbours)..(row + neighbours + 1).min(values.len());
    values[near].iter().map(|it| (it - own).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learning::{Relation, Score, Shape};

    /// A check of two that agree within 0.1 about levels from -1 to 1, but in so many visits, of 40 rows each.
    fn check(visits: usize, target: f64, predicted: f64) -> (Check, Vec<usize>) {
        let is_visit = |row: usize| row % (1_200 / visits) < 40;
        let level = |row: usize| (row as f64 / 9.0).sin();
        let noise = |row: usize| if row.is_multiple_of(2) { 0.05 } else { -0.05 };
        let side = |at: f64, sign: f64| {
            (0..1_200).map(|row| if is_visit(row) { at } else { level(row) + sign * noise(row) }).collect()
        };
        let score = Score { fitted: 0.0, chosen: 0.0, unseen: 0.0 };
        let shape = Shape::Line { lag_s: 0.0 };
        let relation =
            Relation { target: 0, inputs: vec![1], shape, numbers: vec![1.0, 0.0], window_s: None, score };
        let check = Check {
            relation,
            times: (0..1_200).map(f64::from).collect(),
            target: side(target, 1.0),
            predicted: side(predicted, -1.0),
            usual: Vec::new(),
            scale: 0.1,
            share: 0.1,
            is_one_kind: false,
        };
        (check, (0..1_200).filter(|row| is_visit(*row)).collect())
    }

    #[test]
    fn what_both_say_again_and_again_is_usual_and_what_one_says_is_not() {
        for visits in 1..=5 {
            let (both, rows) = check(visits, 10.0, 9.0);
            let usual = of(&both, 1e-9);
            // Those that share their part of the reaches with others are usual as those are.
            let known = rows.iter().filter(|row| usual[**row] >= 0.5).count();
            assert!(visits < 3 || 2 * known >= rows.len(), "{visits} visits: {known}");
            let (one, rows) = check(visits, 10.0, 0.5);
            let usual = of(&one, 1e-9);
            assert!(visits > 2 || rows.iter().all(|row| usual[*row] <= 1.0), "{visits} visits");
        }
    }
}
