//! Which signals may say the same: those that move alike at some delay, most of the time.

use crate::curve::Curve;
use crate::order::{mean, median, quantile, sorted};

/// The moments at which signals are compared, and the delays to either side.
const MOMENTS: usize = 256;
const STEPS: usize = 24;

/// The longest delay in seconds, and as a share of the recording.
const LONGEST_S: f64 = 6.0;
const LONGEST: f64 = 0.05;

/// Values further from the median than this many deviations count as this far: a minority of them may be anything.
const CLIPPED: f64 = 2.5;

/// Below this correlation two signals are not tried.
const LEAST: f64 = 0.5;

/// A delay is tried where it raises the correlation by this share of what is missing to 1.
const WORTH: f64 = 0.2;

/// The most partners of a signal.
const PARTNERS: usize = 10;

/// Two signals that move alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Likely {
    /// The slower one, or the later one in order.
    pub(super) target: usize,
    /// The other one.
    pub(super) input: usize,
    /// How much later the target says the same, in seconds; below 0 where it is earlier.
    pub(super) lag_s: f64,
    /// The size of the correlation.
    pub(super) correlation: f64,
}

/// The step between two delays that are tried, in seconds.
pub(super) fn step_s(duration_s: f64) -> f64 {
    LONGEST_S.min(LONGEST * duration_s) / STEPS as f64
}

/// The likely pairs among signals, the best partners of each. Time: O(signals^2), with bounded moments and delays each.
pub(super) fn pairs(curves: &[Curve], own: &[usize], (start, end): (f64, f64)) -> Vec<Likely> {
    let step = step_s(end - start);
    let shown: Vec<Shown> = own.iter().map(|it| Shown::new(&curves[*it], (start, end), step)).collect();
    let mut found: Vec<Likely> = Vec::new();
    for one in 0..own.len() {
        for other in one + 1..own.len() {
            let is_slower = curves[own[one]].period_s() > 1.01 * curves[own[other]].period_s();
            let (target, input) = if is_slower { (one, other) } else { (other, one) };
            let (correlation, lag_s) = shown[target].best(&shown[input], step);
            if correlation >= LEAST {
                found.push(Likely { target: own[target], input: own[input], lag_s, correlation });
            }
        }
    }
    found.sort_by(|one, other| other.correlation.total_cmp(&one.correlation));
    let mut partners = vec![0_usize; curves.len()];
    found.retain(|it| {
        let is_wanted = partners[it.target] < PARTNERS || partners[it.input] < PARTNERS;
        partners[it.target] += 1;
        partners[it.input] += 1;
        is_wanted
    });
    found
}

/// A signal at some moments, and before and after each of them: clipped, with a mean of 0 and a length of 1.
struct Shown(Vec<Vec<f64>>);

impl Shown {
    fn new(curve: &Curve, (start, end): (f64, f64), step: f64) -> Shown {
        let at = |moment: usize| {
            // Not evenly: what repeats itself would be seen at one phase.
            let jitter = (moment as f64 * 0.618_033_988_749_895).fract();
            start + (end - start) * (moment as f64 + jitter) / MOMENTS as f64
        };
        let column = |lag: i32| {
            let read = |moment| curve.read(at(moment) - f64::from(lag) * step).map_or(f64::NAN, |it| it.0);
            normalised((0..MOMENTS).map(read).collect())
        };
        let last = STEPS as i32;
        Shown((-last..=last).map(column).collect())
    }

    /// The largest size of the correlation of this one with another one, and how much later this one is, in seconds.
    fn best(&self, other: &Shown, step: f64) -> (f64, f64) {
        let own = &self.0[STEPS];
        let with =
            |column: &Vec<f64>| own.iter().zip(column).map(|(one, other)| one * other).sum::<f64>().abs();
        let all: Vec<f64> = other.0.iter().map(with).collect();
        let at_once = all[STEPS];
        let best = (0..all.len()).max_by(|one, next| all[*one].total_cmp(&all[*next])).unwrap_or(STEPS);
        if 1.0 - all[best] < (1.0 - WORTH) * (1.0 - at_once) {
            (all[best], (best as f64 - STEPS as f64) * step)
        } else {
            (at_once, 0.0)
        }
    }
}

/// Values clipped, without their mean, divided by their length; 0 where there is none, or none that moves.
fn normalised(mut values: Vec<f64>) -> Vec<f64> {
    let known = || values.iter().copied().filter(|it| it.is_finite());
    let middle = median(known());
    let away = sorted(known().map(|it| (it - middle).abs()));
    let deviation = 1.4826 * quantile(&away, 0.5).unwrap_or(0.0);
    let most = if deviation > 0.0 { CLIPPED * deviation } else { quantile(&away, 0.95).unwrap_or(0.0) };
    let clip = |it: f64| if it.is_finite() { (it - middle).clamp(-most, most) } else { 0.0 };
    values.iter_mut().for_each(|it| *it = clip(*it));
    let middle = mean(&values);
    values.iter_mut().for_each(|it| *it -= middle);
    let length = values.iter().map(|it| it * it).sum::<f64>().sqrt();
    let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
    values.iter_mut().for_each(|it| *it *= scale);
    values
}
