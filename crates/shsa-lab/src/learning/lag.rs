//! The delay between two signals.

use crate::curve::Curve;
use crate::learning::form::deviation;
use crate::learning::shape::Shape;
use crate::learning::signal::Seen;

/// The longest delay that is searched: in seconds, and as a share of the recording.
const LONGEST_S: f64 = 6.0;
const LONGEST: f64 = 0.05;

/// The number of delays tried to either side, and the number of moments at which each is tried: few at first.
const STEPS: i32 = 60;
const MOMENTS: usize = 300;
const FEW: usize = MOMENTS / 3;

/// Rounds of the golden-section search between the neighbours of the best delay.
const ROUNDS: usize = 25;
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Below this correlation a signal follows no other one.
const SMOOTHED: f64 = 0.6;

/// The number of time constants tried before the search between the neighbours of the best one.
const SIZES: u32 = 10;

/// Below this correlation at every delay, signals are unrelated.
const RELATED: f64 = 0.9;

fn longest_s(duration_s: f64) -> f64 {
    LONGEST_S.min(LONGEST * duration_s)
}

/// A signal at few moments of its own and before and after each of them: for each delay its values there, with a mean of 0 and a length
/// of 1.
#[derive(Debug)]
pub(crate) struct Lagged(Vec<Vec<f64>>);

impl Lagged {
    /// At the moments of the signal's clock. Time: O(delays * moments).
    pub(crate) fn new(curve: &Curve, times: &[f64], duration_s: f64) -> Lagged {
        let longest = longest_s(duration_s);
        let step = longest / f64::from(STEPS);
        let (start, end) =
            curve.times().first().copied().zip(curve.times().last().copied()).unwrap_or((0.0, 0.0));
        // Delays that reach out of the session of a moment are no values.
        let is_inner = |it: &f64| {
            let is_known = |lag_s: f64| curve.before(*it, lag_s).is_some();
            start + longest < *it && *it < end - longest && is_known(longest) && is_known(-longest)
        };
        let inner: Vec<f64> = times.iter().copied().filter(is_inner).collect();
        let every = inner.len().div_ceil(FEW).max(1);
        let column = |at: i32| {
            let lag = f64::from(at) * step;
            let value = |time: &f64| curve.read(time - lag).map_or(f64::NAN, |(value, _)| value);
            normalised(inner.iter().step_by(every).map(value).collect())
        };
        Lagged((-STEPS..=STEPS).map(column).collect())
    }

    /// The correlations with another signal of the same clock, with each delay after it.
    fn correlations(&self, other: &Lagged) -> Vec<f64> {
        let own = &self.0[STEPS as usize];
        let with = |column: &Vec<f64>| own.iter().zip(column).map(|(one, other)| one * other).sum();
        other.0.iter().map(with).collect()
    }
}

/// Values without their mean, divided by their length; zeros where all are the same.
fn normalised(mut values: Vec<f64>) -> Vec<f64> {
    let mean = crate::order::mean(&values);
    values.iter_mut().for_each(|it| *it -= mean);
    let length = values.iter().map(|it| it * it).sum::<f64>().sqrt();
    let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
    values.iter_mut().for_each(|it| *it *= scale);
    values
}

/// The delay of `one` after `other` in seconds, negative when it is earlier; `None` where no delay fits better than the others.
/// Time: O(delays * moments * log n).
pub(crate) fn lag_between(seen: &Seen<'_>, one: usize, other: usize) -> Option<f64> {
    let longest = longest_s(seen.duration_s);
    let step = longest / f64::from(STEPS);
    let tried: Vec<f64> = match seen.have_one_clock(one, other) {
        true => seen.lagged[one].correlations(&seen.lagged[other]),
        false => {
            let few = correlated_at(seen, one, other, longest, FEW);
            (-STEPS..=STEPS).map(|at| few(f64::from(at) * step)).collect()
        }
    };
    let best = (0..tried.len()).max_by(|one, next| tried[*one].total_cmp(&tried[*next]))?;
    if tried[best] < 0.9 * RELATED || best == 0 || best + 1 == tried.len() {
        return None;
    }
    let middle = f64::from(best as i32 - STEPS) * step;
    let many = correlated_at(seen, one, other, longest, 4 * MOMENTS);
    let (mut low, mut high) = (middle - step, middle + step);
    for _ in 0..ROUNDS {
        let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if many(left) < many(right) { low = left } else { high = right }
    }
    let lag = 0.5 * (low + high);
    (many(lag) >= RELATED).then_some(lag)
}

/// The follower and the mean of the input that are nearest to the target; `None` where they are unrelated, or nothing smooths.
/// Time: O(n) for each of some dozen time constants.
pub(crate) fn smoothed(seen: &Seen<'_>, target: usize, input: usize) -> Option<[Shape; 2]> {
    let (shortest, longest) = (seen.period_s(input).max(seen.period_s(target)), LONGEST * seen.duration_s);
    if !(0.0 < shortest && shortest < longest) || seen.period_s(input) > seen.period_s(target) * 1.2 {
        return None;
    }
    let clock = seen.slowest([target]);
    let rows: Vec<(f64, f64)> =
        clock.times.iter().copied().zip(clock.values[target].iter().copied()).collect();
    let every = rows.len().div_ceil(MOMENTS).max(1);
    let rows: Vec<(f64, f64)> = rows.into_iter().step_by(every).collect();
    let own = &seen.curves[input];
    let with = |read: &dyn Fn(f64) -> Option<f64>| {
        correlation(&rows.iter().filter_map(|(time, value)| Some((*value, read(*time)?))).collect::<Vec<_>>())
    };
    if with(&|time| own.read(time).map(|it| it.0)) < SMOOTHED {
        return None;
    }
    let follows = |tau_s: f64| {
        let curve = own.followed(tau_s);
        with(&|time| curve.read(time).map(|it| it.0))
    };
    let means = |window_s: f64| with(&|time| own.at(time - window_s, time));
    let (tau_s, window_s) = (best(shortest, longest, &follows)?, best(shortest, 2.0 * longest, &means)?);
    Some([Shape::Follower { tau_s }, Shape::Mean { window_s }])
}

/// Where a function is largest between two ends, by their logarithms.
fn best(low: f64, high: f64, of: &dyn Fn(f64) -> f64) -> Option<f64> {
    let at = |place: f64| low * (high / low).powf(place / f64::from(SIZES));
    let tried: Vec<f64> = (0..=SIZES).map(|it| of(at(f64::from(it)))).collect();
    let top = (0..tried.len()).max_by(|one, next| tried[*one].total_cmp(&tried[*next]))? as f64;
    let (mut low, mut high) = (top - 1.0, top + 1.0);
    for _ in 0..ROUNDS / 2 {
        let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if of(at(left)) < of(at(right)) { low = left } else { high = right }
    }
    Some(at(0.5 * (low + high)))
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
        let value = |time: f64| curve.before(time, sign * lag);
        correlation(&rows.iter().filter_map(|(time, own)| Some((*own, value(*time)?))).collect::<Vec<_>>())
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
