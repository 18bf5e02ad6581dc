//! Stretches in which a check is violated: what it leaves there stands far outside of what it leaves in the remaining time.
//!
//! Windows of many lengths are compared with all others of their length: by their mean square and by their mean. A few of them count
//! where the largest of the remaining time is smaller by a factor. The factor is larger where the remaining time has few independent windows, and
//! where its own windows differ much from each other. So no distribution is assumed, and nothing is said of a residual that
//! wanders.

use super::check::Check;
use crate::order::median;
use std::ops::Range;

/// The least factor between a stretch and the rest, where the rest has at least so many independent windows; with fewer, the factor
/// grows with the root of what is missing. From the sound recordings of the tests and of `docs/doctor.md`: no finding in 95 % of them.
const LEAST_FACTOR: f64 = 2.0;
const MANY: f64 = 60.0;
const FEWEST: f64 = 6.0;

/// The factor is at least this power of the ratio between the largest and the middle window of the rest.
const OF_TAIL: f64 = 0.5;

/// The most stretches, and the most of the time in them.
const MOST: usize = 4;
const MOST_TIME: f64 = 0.25;

/// The shortest window as a share of the time and in rows, and the longest one: a single value proves nothing, as all residuals have
/// tails.
const SHORTEST: f64 = 0.004;
const LEAST_ROWS: f64 = 6.0;
const LONGEST: f64 = 0.2;

/// A stretch reaches as far as the windows have this share of its peak.
const SHARE: f64 = 0.25;

/// A stretch of a check.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    /// Its rows.
    pub(super) rows: Range<usize>,
    /// How many times as large as needed it is; at least 1.
    pub(super) strength: f64,
    /// How many times as large as in the remaining time it is.
    pub(super) times: f64,
}

/// The violated stretches of a check, the strongest first; none overlaps another. Time: O(rows log rows).
pub(super) fn of(check: &Check, joints: &[f64]) -> Vec<Stretch> {
    let count = check.times.len();
    let beside: Vec<f64> = (0..count).map(|row| check.off(row) / check.usual[row]).collect();
    let sums = Sums::of(&beside);
    let longest = (LONGEST * count as f64) as usize;
    let mut found: Vec<Stretch> = Vec::new();
    let shortest = (SHORTEST * count as f64).ceil().max(LEAST_ROWS) as usize;
    let mut length = shortest;
    while length <= longest {
        let starts: Vec<usize> = (0..=count - length).step_by((length / 4).max(1)).collect();
        let is_whole = |at: &usize| {
            let ends = [*at, at + length - 1].map(|row| joints.partition_point(|it| *it <= check.times[row]));
            ends[0] == ends[1]
        };
        let starts: Vec<usize> =
            if joints.is_empty() { starts } else { starts.into_iter().filter(is_whole).collect() };
        let windows = |of: &dyn Fn(usize) -> f64| Windows {
            beside: &beside,
            fewest: if check.is_one_kind { 1.0 } else { FEWEST },
            length,
            starts: &starts,
            values: starts.iter().map(|it| of(*it)).collect(),
        };
        let square = windows(&|at| (sums.squares(at..at + length) / length as f64).sqrt());
        found.extend(square.outside());
        found.extend(windows(&|at| sums.values(at..at + length).abs() / length as f64).outside());
        length *= 2;
    }
    found.sort_by(|one, other| {
        other.strength.total_cmp(&one.strength).then(one.rows.start.cmp(&other.rows.start))
    });
    let mut kept: Vec<Stretch> = Vec::new();
    for one in found {
        let one = Stretch { rows: sums.ends(&beside, &one.rows), ..one };
        let lasts_s = check.times[one.rows.end - 1] - check.times[one.rows.start];
        if one.rows.len() < shortest || lasts_s > MOST_TIME * (check.times[count - 1] - check.times[0]) {
            continue;
        }
        if kept.iter().all(|it| it.rows.end <= one.rows.start || one.rows.end <= it.rows.start) {
            kept.push(one);
        }
    }
    kept
}

/// The number of rows after which values say something new of each other, without those of some stretches.
fn correlated<'r>(values: &[f64], without: impl Iterator<Item = &'r Range<usize>>) -> usize {
    const CLIPPED: f64 = 4.0;
    const ALIKE: f64 = 0.3;
    let mut centred: Vec<f64> = values.iter().map(|it| it.clamp(-CLIPPED, CLIPPED)).collect();
    let middle = median(centred.iter().copied());
    centred.iter_mut().for_each(|it| *it -= middle);
    without.for_each(|rows| centred[rows.clone()].fill(0.0));
    let all: f64 = centred.iter().map(|it| it.powi(2)).sum();
    let at = |lag: usize| centred.iter().zip(&centred[lag..]).map(|(one, other)| one * other).sum::<f64>();
    let mut lag = 1;
    while lag < values.len() / 4 && all > 0.0 && at(lag) > ALIKE * all {
        lag = (lag + 1).max(lag * 5 / 4);
    }
    lag
}

/// Sums up to each row.
struct Sums {
    values: Vec<f64>,
    squares: Vec<f64>,
}

impl Sums {
    fn of(values: &[f64]) -> Sums {
        let sums = |of: &dyn Fn(f64) -> f64| {
            let mut sum = 0.0;
            std::iter::once(0.0)
                .chain(values.iter().map(|it| {
                    sum += of(*it);
                    sum
                }))
                .collect()
        };
        Sums { values: sums(&|it| it), squares: sums(&|it| it * it) }
    }

    fn values(&self, rows: Range<usize>) -> f64 {
        self.values[rows.end] - self.values[rows.start]
    }

    fn squares(&self, rows: Range<usize>) -> f64 {
        (self.squares[rows.end] - self.squares[rows.start]).max(0.0)
    }

    /// The ends of a stretch near some rows: between them, the squares are more than those that are usual and those of the stretch
    /// have in their middle. J. Bentley, "Programming pearls", CACM 27 (1984), doi:10.1145/358234.381162.
    fn ends(&self, values: &[f64], near: &Range<usize>) -> Range<usize> {
        let inside = self.squares(near.clone()) / near.len().max(1) as f64;
        let outside = (self.squares(0..values.len()) - self.squares(near.clone())).max(0.0)
            / (values.len() - near.len()).max(1) as f64;
        let middle = (inside * outside).sqrt().max(1e-3 * inside);
        let (from, to) = (near.start.saturating_sub(near.len()), (near.end + near.len()).min(values.len()));
        let (mut best, mut best_sum) = (near.clone(), 0.0);
        let (mut start, mut sum) = (from, 0.0_f64);
        for (row, value) in values.iter().enumerate().take(to).skip(from) {
            if sum <= 0.0 {
                (start, sum) = (row, 0.0);
            }
            sum += value.powi(2) - middle;
            if sum > best_sum {
                (best, best_sum) = (start..row + 1, sum);
            }
        }
        best
    }
}

/// Windows of one length.
struct Windows<'a> {
    /// What all rows leave, beside what is usual.
    beside: &'a [f64],
    /// The fewest independent windows of the rest: fewer for signals of one kind than for what only follows a curve.
    fewest: f64,
    length: usize,
    /// Where they start.
    starts: &'a [usize],
    values: Vec<f64>,
}

impl Windows<'_> {
    /// The fewest stretches beside which the rest is smaller by the factor that it needs.
    fn outside(&self) -> Vec<Stretch> {
        let mut is_rest = vec![true; self.values.len()];
        let count = self.beside.len();
        let mut peaks: Vec<(f64, Range<usize>)> = Vec::new();
        for _ in 0..MOST {
            let Some(peak) = self.largest(&is_rest) else { break };
            let value = self.values[peak];
            if !(value > 0.0 && value.is_finite()) {
                break;
            }
            peaks.push((value, self.take_out(peak, &mut is_rest)));
            let rest: Vec<f64> =
                self.values.iter().zip(&is_rest).filter(|it| *it.1).map(|(value, _)| *value).collect();
            let out = 1.0 - rest.len() as f64 / self.values.len() as f64;
            let longest = (MOST_TIME * count as f64).max(5.0 * self.length as f64);
            if out * count as f64 > longest || rest.is_empty() {
                break;
            }
            let most = rest.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            let least = peaks.iter().map(|it| it.0).fold(f64::INFINITY, f64::min);
            if least < LEAST_FACTOR * most {
                continue;
            }
            let windows = (1.0 - out) * count as f64 / self.length as f64;
            let correlated = correlated(self.beside, peaks.iter().map(|it| &it.1));
            let independent = (1.0 - out) * count as f64 / self.length.max(2 * correlated) as f64;
            let Some(needed) = needed(
                windows,
                independent,
                self.fewest,
                most / median(rest.iter().copied()).max(f64::MIN_POSITIVE),
            ) else {
                break;
            };
            if least >= needed * most {
                let stretch = |(value, rows): (f64, Range<usize>)| Stretch {
                    rows,
                    strength: value / (needed * most),
                    times: value / most,
                };
                return peaks.into_iter().map(stretch).collect();
            }
        }
        Vec::new()
    }

    fn largest(&self, is_rest: &[bool]) -> Option<usize> {
        let rest = (0..self.values.len()).filter(|it| is_rest[*it]);
        rest.max_by(|one, other| self.values[*one].total_cmp(&self.values[*other]))
    }

    /// Takes a stretch and what overlaps it out of the rest; the rows of the stretch.
    fn take_out(&self, peak: usize, is_rest: &mut [bool]) -> Range<usize> {
        let least = SHARE * self.values[peak];
        let mut from = peak;
        while from > 0 && is_rest[from - 1] && self.values[from - 1] >= least {
            from -= 1;
        }
        let mut to = peak;
        while to + 1 < self.values.len() && is_rest[to + 1] && self.values[to + 1] >= least {
            to += 1;
        }
        let (first, last) = (self.starts[from], self.starts[to] + self.length);
        let (start, end) = (first.saturating_sub(self.length), last + self.length);
        for (place, at) in self.starts.iter().enumerate() {
            if at + self.length > start && *at < end {
                is_rest[place] = false;
            }
        }
        first..last.min(self.beside.len())
    }
}

/// How many times as large as the largest window of the rest a stretch must be; `None` where nothing would be enough. The rest has
/// so many windows, of which so many are independent: a residual that wanders has few, and must be left far behind.
fn needed(windows: f64, independent: f64, fewest: f64, tail: f64) -> Option<f64> {
    let missing = (MANY / independent).max(1.0);
    let of_few = LEAST_FACTOR * if independent >= FEWEST { missing.sqrt() } else { missing };
    (windows >= FEWEST && independent >= fewest).then(|| of_few.max(tail.powf(OF_TAIL)))
}
