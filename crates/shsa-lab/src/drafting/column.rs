//! One recorded column, and what its values alone show.

use super::{dead_band, glitches};
use crate::learning::Signal;
use crate::order::{median, quantile, sorted};

/// Values that are counted one by one: a column with more of them is no choice of modes.
const MOST_LEVELS: usize = 8;

/// The share of the whole movement by which a column may leave a straight line in time and still count as a clock.
const OFF_EVEN: f64 = 2e-3;

/// A change by more than this share of a turn within one period is a wrap.
const WRAPPED: f64 = 0.8;

/// A turn may be exceeded by its rounding.
const ROUNDED_TURN: f64 = 1.001;

/// The share of the steps between values that are usual, and how much larger than these a wrap may be.
const USUAL: f64 = 0.99;
const MORE: f64 = 2.0;

/// Whole turns of angles whose unit nobody names: in radians, degrees and hundredths of degrees, as autopilots log them.
const TURNS: [f64; 3] = [std::f64::consts::TAU, 360.0, 36_000.0];

/// More values at one time than these, on average, are of messages whose times do not advance: a GNSS receiver sends no more
/// sentences before its clock moves.
const MOST_AT_ONCE: usize = 50;

/// The least different times of a signal: two of them are one interval, which shows no rhythm.
const LEAST_TIMES: usize = 3;

/// A column of a recording.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name, unit and values; sessions follow each other in time.
    pub signal: Signal,
    /// The places of the first value of each session after the first one, in order.
    pub breaks: Vec<usize>,
    /// The name without a number or the name of its source: `temperature` of `mote_1_temperature`.
    pub kind: String,
    /// The turn in the column's unit, for angles.
    pub turn: Option<f64>,
}

/// What a column shows of itself, in its own unit and in seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// The number of values.
    pub count: usize,
    /// The times and values of glitches, of which the other facts know nothing.
    pub glitches: Vec<(f64, f64)>,
    /// The lowest and the highest value.
    pub range: (f64, f64),
    /// The median time between two values.
    pub period_s: f64,
    /// The longest time between two values of a session.
    pub gap_s: f64,
    /// The share of values that repeat the one before.
    pub repeated: f64,
    /// The median time for which a value stands.
    pub stands_s: f64,
    /// The smallest step between two different values.
    pub quantum: f64,
    /// The standard deviation of the noise from value to value, at least that of rounding.
    pub noise: f64,
    /// The largest change a second beyond noise and rounding.
    pub fastest: f64,
    /// Whether the values go round a turn.
    pub wraps: bool,
    /// The different values, where they are few.
    pub levels: Option<Vec<f64>>,
    /// Whether the values never fall and mostly grow, or the opposite: the range of another hour is another one.
    pub drifts: bool,
    /// Whether the values grow evenly with time: a clock or a counter.
    pub is_even: bool,
    /// Whether the times do not advance.
    pub is_untimed: bool,
    /// How far a value is from the one before when it is sent, where it is sent on change.
    pub dead_band: Option<f64>,
}

impl Facts {
    /// The facts of a column; `None` without two values. Time: O(n log n).
    #[must_use]
    pub fn of(column: &Column) -> Option<Facts> {
        // An angle that swings about the end of its turn jumps and comes back, too.
        let is_angle = column.turn.is_some();
        let places = if is_angle { Vec::new() } else { glitches::of(&column.signal.points, &column.breaks) };
        if places.is_empty() {
            return Facts::of_sound(column);
        }
        let glitches = places.iter().map(|at| column.signal.points[*at]).collect();
        let sound = Facts::of_sound(&column.without(&places))?;
        Some(Facts { count: column.signal.points.len(), glitches, ..sound })
    }

    fn of_sound(column: &Column) -> Option<Facts> {
        let points = &column.signal.points;
        let first = points.first()?;
        let values = || points.iter().map(|(_, value)| *value);
        let whole = column.turn.unwrap_or(f64::INFINITY);
        let mut steps = steps(column);
        let wraps = steps.iter().any(|step| step.1.abs() > WRAPPED * whole);
        steps.iter_mut().for_each(|step| step.1 = shorter(step.1, whole));
        let length_s = steps.iter().map(|step| step.0).sum::<f64>();
        let period_s = period(&steps, length_s);
        let quantum = quantum(&steps);
        let noise = noise(&steps).max(quantum / 12.0_f64.sqrt());
        let bound =
            |step: &(f64, f64)| (step.1.abs() - 6.0 * noise - quantum).max(0.0) / step.0.max(0.5 * period_s);
        let repeats = steps.iter().filter(|step| step.1 == 0.0).count();
        let range = values().fold((first.1, first.1), |(low, high), it| (low.min(it), high.max(it)));
        let changes = steps.len() - repeats;
        let fastest = steps.iter().map(bound).filter(|it| it.is_finite()).fold(0.0, f64::max);
        Some(Facts {
            count: points.len(),
            glitches: Vec::new(),
            range,
            period_s,
            gap_s: steps.iter().map(|step| step.0).fold(0.0, f64::max),
            repeated: repeats as f64 / steps.len().max(1) as f64,
            stands_s: length_s / changes.max(1) as f64,
            quantum,
            noise,
            fastest: fastest.max(slow_rate(points, whole)),
            wraps: wraps && range.1 - range.0 <= whole * ROUNDED_TURN,
            levels: levels(points),
            drifts: is_monotone(&steps) || leaves_first_half(points),
            is_even: is_even(points),
            is_untimed: is_untimed(points),
            dead_band: dead_band::of(&steps),
        })
        .filter(|facts| facts.count > 1)
    }

    /// Whether all values are the same.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.range.0 == self.range.1
    }

    /// A first tolerance: three deviations of the noise, and half a step of rounding.
    #[must_use]
    pub fn tolerance(&self) -> f64 {
        3.0 * self.noise + 0.5 * self.quantum
    }
}

impl Column {
    /// The turn that the values themselves show: all lie within one, from 0 or about 0, and what jumps from one of its ends to the other is a usual
    /// step the shorter way round. Time: O(n log n).
    pub(super) fn seen_turn(&self) -> Option<f64> {
        let values = self.signal.points.iter().map(|(_, value)| *value);
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(it), high.max(it)));
        let holds = |turn: &f64| {
            let most = turn * ROUNDED_TURN;
            let from_zero = low >= 0.0 && high <= most;
            let about_zero = low >= -0.5 * most && high <= 0.5 * most;
            high - low > WRAPPED * turn && (from_zero || about_zero)
        };
        TURNS.into_iter().filter(holds).find(|turn| {
            let (wraps, usual): (Vec<f64>, Vec<f64>) =
                steps(self).iter().map(|step| step.1.abs()).partition(|step| *step > WRAPPED * turn);
            let usual = quantile(&sorted(usual.into_iter()), USUAL).unwrap_or(0.0);
            !wraps.is_empty() && wraps.iter().all(|step| (turn - step).abs() <= MORE * usual)
        })
    }

    /// The column without the values at these places, which are in order.
    fn without(&self, places: &[usize]) -> Column {
        let stays = |at: &usize| places.binary_search(at).is_err();
        let kept = (0..self.signal.points.len()).filter(stays).map(|at| self.signal.points[at]);
        let moved = |at: &usize| at - places.partition_point(|place| place < at);
        let breaks = self.breaks.iter().map(moved).collect();
        let signal = Signal { points: kept.collect(), ..self.signal.clone() };
        Column { signal, breaks, kind: self.kind.clone(), turn: self.turn }
    }
}

/// The median time between two values; their mean time where most values share the time of another.
fn period(steps: &[(f64, f64)], length_s: f64) -> f64 {
    let usual = median(steps.iter().map(|it| it.0));
    if usual > 0.0 { usual } else { length_s / steps.len().max(1) as f64 }
}

/// Whether the times do not advance. The points are in the order of time.
fn is_untimed(points: &[(f64, f64)]) -> bool {
    let times = 1 + points.windows(2).filter(|pair| pair[1].0 > pair[0].0).count();
    times < LEAST_TIMES.min(points.len()) || times * MOST_AT_ONCE < points.len()
}

/// Times and changes from value to value within a session.
fn steps(column: &Column) -> Vec<(f64, f64)> {
    let pairs = column.signal.points.windows(2).enumerate();
    let within = pairs.filter(|(at, _)| !column.breaks.contains(&(at + 1)));
    within.map(|(_, pair)| (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1)).collect()
}

/// The smallest step of rounding: one that is seen often, as numbers are written with digits that were computed.
fn quantum(steps: &[(f64, f64)]) -> f64 {
    let sizes = sorted(steps.iter().map(|step| step.1.abs()).filter(|size| *size > 0.0));
    let least = quantile(&sizes, 0.01).unwrap_or(0.0);
    let is_alike = |size: &&f64| (**size / least - 1.0).abs() < 0.01;
    let alike = sizes.iter().filter(is_alike).count();
    if alike * 50 > sizes.len() { least } else { 0.0 }
}

/// From second differences, by their median: jumps and bends are no noise.
fn noise(steps: &[(f64, f64)]) -> f64 {
    // Repeated values are no measurements of their own.
    let changes: Vec<f64> = steps.iter().map(|step| step.1).filter(|change| *change != 0.0).collect();
    let second = changes.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    1.4826 * median(second) / 6.0_f64.sqrt()
}

/// A change the shorter way round a turn.
fn shorter(change: f64, whole: f64) -> f64 {
    if change.abs() > WRAPPED * whole { change - whole.copysign(change) } else { change }
}

/// The largest change a second over the hundredth part of the recording.
fn slow_rate(points: &[(f64, f64)], whole: f64) -> f64 {
    let over = if whole.is_finite() { 1 } else { (points.len() / 100).max(1) };
    let rate = |(early, late): (&(f64, f64), &(f64, f64))| {
        shorter(late.1 - early.1, whole).abs() / (late.0 - early.0)
    };
    points.iter().zip(points.iter().skip(over)).map(rate).filter(|it| it.is_finite()).fold(0.0, f64::max)
}

fn levels(points: &[(f64, f64)]) -> Option<Vec<f64>> {
    let mut levels: Vec<f64> = Vec::new();
    for (_, value) in points {
        if !levels.contains(value) {
            levels.push(*value);
        }
        if levels.len() > MOST_LEVELS {
            return None;
        }
    }
    levels.sort_by(f64::total_cmp);
    Some(levels)
}

fn is_monotone(steps: &[(f64, f64)]) -> bool {
    let (rises, falls) = steps.iter().fold((0usize, 0usize), |(rises, falls), step| {
        (rises + usize::from(step.1 > 0.0), falls + usize::from(step.1 < 0.0))
    });
    rises.min(falls) == 0 && rises.max(falls) > 2
}

/// Whether the second half spends most of its time outside of the range of the first half.
fn leaves_first_half(points: &[(f64, f64)]) -> bool {
    let (early, late) = points.split_at(points.len() / 2);
    let seen = early
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(it.1), high.max(it.1)));
    let outside = late.iter().filter(|it| it.1 < seen.0 || it.1 > seen.1).count();
    2 * outside > late.len()
}

/// Whether the values lie on a rising line in time, but for jitter.
fn is_even(points: &[(f64, f64)]) -> bool {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return false };
    let slope = (last.1 - first.1) / (last.0 - first.0);
    if points.len() < 10 || !(slope > 0.0 && slope.is_finite()) {
        return false;
    }
    let most = OFF_EVEN * (last.1 - first.1);
    let is_near = |point: &(f64, f64)| (point.1 - first.1 - slope * (point.0 - first.0)).abs() <= most;
    let never_falls = points.windows(2).all(|pair| pair[1].1 >= pair[0].1);
    never_falls && points.iter().all(is_near)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(values: impl Iterator<Item = f64>, period_s: f64) -> Column {
        let points = values.enumerate().map(|(at, value)| (at as f64 * period_s, value)).collect();
        let signal = Signal { name: "one".to_owned(), unit: None, points };
        Column { signal, breaks: Vec::new(), kind: "one".to_owned(), turn: None }
    }

    #[test]
    fn rounding_repeats_and_rates_are_those_of_the_values() {
        let wave = column((0..2_000).map(|at| (f64::from(at / 4) / 30.0).sin()), 0.1);
        let facts = Facts::of(&wave).unwrap();
        assert!((facts.repeated - 0.75).abs() < 0.01 && (facts.stands_s - 0.4).abs() < 0.01, "{facts:?}");
        assert!(!facts.is_even && !facts.drifts && facts.levels.is_none(), "{facts:?}");
        let rounded = column((0..2_000).map(|at| ((f64::from(at) / 90.0).sin() * 20.0).round() / 10.0), 0.1);
        let facts = Facts::of(&rounded).unwrap();
        assert!((facts.quantum - 0.1).abs() < 1e-9, "{facts:?}");
        assert!(facts.fastest < 0.5, "{facts:?}");
    }

    #[test]
    fn clocks_constants_choices_and_angles() {
        let clock = Facts::of(&column((0..500).map(|at| 7.0 + 100.0 * f64::from(at)), 0.1)).unwrap();
        assert!(clock.is_even && clock.drifts);
        assert!(Facts::of(&column((0..5).map(|_| 3.0), 1.0)).unwrap().is_constant());
        let gear = Facts::of(&column((0..100).map(|at| f64::from(at / 7 % 3)), 1.0)).unwrap();
        assert_eq!(gear.levels, Some(vec![0.0, 1.0, 2.0]));
        let mut heading = column((0..300).map(|at| f64::from(at * 5 % 360)), 0.1);
        heading.turn = Some(360.0);
        let facts = Facts::of(&heading).unwrap();
        assert!(facts.wraps && facts.fastest < 60.0, "{facts:?}");
        heading.turn = None;
        assert_eq!(heading.seen_turn(), Some(360.0));
        assert_eq!(Facts::of(&column([1.0].into_iter(), 1.0)), None);
    }

    #[test]
    fn a_turn_is_seen_where_values_go_round_and_where_they_swing_about_its_end() {
        let round = |turn: f64, from: f64, swing: bool, seed: u32| {
            let angle = move |at: u32| {
                let time = f64::from(at) / 100.0;
                let wide = if swing { 0.1 } else { 3.0 };
                turn * (wide * (0.37 * time + f64::from(seed)).sin() + 0.02 * (2.9 * time).sin())
            };
            (0..4_000).map(move |at| (angle(at) - from).rem_euclid(turn) + from)
        };
        for seed in 0..8 {
            for turn in TURNS {
                for (from, swing) in [(0.0, false), (0.0, true), (-0.5 * turn, false)] {
                    let column = column(round(turn, from, swing, seed), 0.01);
                    assert_eq!(column.seen_turn(), Some(turn), "{seed}: {turn} from {from}, {swing}");
                }
            }
        }
        // Kelvins with values of 0, a saw-tooth that falls slower, and a wave as wide as a turn.
        let lost = |at: u32| if at % 97 == 5 { 0.0 } else { 320.0 + 9.0 * (f64::from(at) / 30.0).sin() };
        assert_eq!(column((0..2_000).map(lost), 0.1).seen_turn(), None);
        let saw = |at: u32| if at % 100 < 95 { 3.7 * f64::from(at % 100) } else { 0.0 };
        assert_eq!(column((0..2_000).map(saw), 0.1).seen_turn(), None);
        assert_eq!(column((0..2_000).map(|at| 180.0 * (f64::from(at) / 9.0).sin()), 0.1).seen_turn(), None);
    }
}
