//! The delay between two signals.

use crate::learning::form::deviation;
use crate::learning::signal::Seen;

/// The longest delay that is searched: in seconds, and as a share of the recording.
const LONGEST_S: f64 = 6.0;
const LONGEST: f64 = 0.05;

/// The number of delays tried to either side, and the number of moments at which each is tried.
const STEPS: i32 = 60;
const MOMENTS: usize = 300;

/// Rounds of the golden-section search between the neighbours of the best delay.
const ROUNDS: usize = 25;
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Below this correlation at every delay, signals are unrelated.
const RELATED: f64 = 0.9;

/// The delay of `one` after `other` in seconds, negative when it is earlier; `None` where no delay fits better than the others.
/// Time: O(delays * moments * log n).
pub(crate) fn lag_between(seen: &Seen<'_>, one: usize, other: usize) -> Option<f64> {
    let longest = LONGEST_S.min(LONGEST * seen.duration_s);
    let step = longest / f64::from(STEPS);
    let few = correlated_at(seen, one, other, longest, MOMENTS);
    let tried: Vec<f64> = (-STEPS..=STEPS).map(|at| few(f64::from(at) * step)).collect();
    let best = (0..tried.len()).max_by(|one, next| tried[*one].total_cmp(&tried[*next]))?;
    if tried[best] < RELATED || best == 0 || best + 1 == tried.len() {
        return None;
    }
    let middle = f64::from(best as i32 - STEPS) * step;
    let many = correlated_at(seen, one, other, longest, 4 * MOMENTS);
    let (mut low, mut high) = (middle - step, middle + step);
    for _ in 0..ROUNDS {
        let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if many(left) < many(right) { low = left } else { high = right }
    }
    Some(0.5 * (low + high))
}

/// The correlation of both signals as a function of the delay.
fn correlated_at(
    seen: &Seen<'_>,
    one: usize,
    other: usize,
    longest: f64,
    moments: usize,
) -> impl Fn(f64) -> f64 {
    let clock = seen.slowest([one, other]);
    let is_turned = seen.period_s(other) > seen.period_s(one);
    let (slow, fast) = if is_turned { (other, one) } else { (one, other) };
    let sign = if is_turned { -1.0 } else { 1.0 };
    let curve = &seen.curves[fast];
    let ends = curve.times().first().copied().zip(curve.times().last().copied()).unwrap_or((0.0, 0.0));
    let rows: Vec<(f64, f64)> = clock
        .times
        .iter()
        .zip(&clock.values[slow])
        .filter(|(time, value)| ends.0 + longest < **time && **time < ends.1 - longest && value.is_finite())
        .map(|(time, value)| (*time, *value))
        .collect();
    let every = rows.len().div_ceil(moments).max(1);
    let rows: Vec<(f64, f64)> = rows.into_iter().step_by(every).collect();
    move |lag: f64| {
        let value = |time: f64| curve.read(time - sign * lag).map_or(f64::NAN, |(value, _)| value);
        correlation(&rows.iter().map(|(time, own)| (*own, value(*time))).collect::<Vec<_>>())
    }
}

/// Pearson's correlation of pairs; 0 where one of the two is constant.
fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len().max(1) as f64;
    let means = pairs.iter().fold((0.0, 0.0), |sum, it| (sum.0 + it.0 / count, sum.1 + it.1 / count));
    let together = pairs.iter().map(|it| (it.0 - means.0) * (it.1 - means.1)).sum::<f64>() / count;
    let sizes = deviation(pairs.iter().map(|it| it.0)) * deviation(pairs.iter().map(|it| it.1));
    if sizes > 0.0 { together / sizes } else { 0.0 }
}
