//! Compares the consumer's values with the truth: the last decimals of every reading encode the time of its measurement.

use serde_json::Value;

/// As in `tests/python/unsteady.py`.
const PERIOD: f64 = 60.0;
const LOW: f64 = 10.0;
const SLOPE: f64 = 2.0;
/// Readings encode their time modulo this, seconds.
const TURN: f64 = 100.0;
/// The largest error of a value without a fault: two sensors can agree although they differ by the sum of their errors, plus the
/// change that `max_rate` allows between two readings, plus rounding.
const ALLOWED: f64 = 2.0 * 0.5 + 6.0 * 0.05 + 0.03;
/// The need's greatest age, plus the time that a busy machine may delay a message, seconds.
const ON_ITS_WAY: f64 = 2.0;
/// This many good values in a row are no accident.
const LASTING: usize = 50;

fn speed(at: f64) -> f64 {
    let phase = at.rem_euclid(PERIOD);
    LOW + SLOPE * phase.min(PERIOD - phase)
}

/// A value received by the consumer.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    pub(crate) at: f64,
    value: f64,
    quality: String,
    /// The broker's delay of a message at that time.
    lag: f64,
}

impl Seen {
    pub(crate) fn read(row: &Value) -> Seen {
        let number = |at: usize| row[at].as_f64().unwrap();
        let quality = row[2].as_str().unwrap_or_default().to_owned();
        Seen { at: number(0), value: number(1), quality, lag: number(3) }
    }

    fn is_good(&self) -> bool {
        self.quality == "Good"
    }

    fn is_served(&self) -> bool {
        self.is_good() || self.quality == "UncertainSubstituteValue"
    }

    /// The time of its measurement.
    fn measured(&self) -> f64 {
        let stamp = (self.value * 1e7).round().rem_euclid(1e5) / 1e3;
        self.at - (self.at - stamp).rem_euclid(TURN)
    }

    /// Its error at the time of measurement.
    fn lie(&self) -> f64 {
        (self.value - speed(self.measured())).abs()
    }

    /// Its distance from the nearest recent truth.
    fn stale(&self) -> f64 {
        // The broker delays a message twice: to the run, and to the consumer.
        let way = ON_ITS_WAY + 2.0 * self.lag;
        let lately = (0..=200).map(|part| self.at - way * f64::from(part) / 200.0);
        lately.map(|at| (self.value - speed(at)).abs()).fold(f64::MAX, f64::min)
    }

    fn is_wrong(&self) -> bool {
        self.lie() > ALLOWED
    }

    fn is_old(&self) -> bool {
        self.stale() > ALLOWED
    }

    fn is_true(&self) -> bool {
        !self.is_wrong() && !self.is_old()
    }
}

/// The consumer's result of a sequence.
#[derive(Debug)]
pub(crate) struct Judgement {
    pub(crate) values: usize,
    /// The number of wrong and of outdated values that were published as served.
    pub(crate) off: [usize; 2],
    /// The longest time without a value, from the first fault until the need was served permanently, seconds.
    pub(crate) gap: f64,
    /// Values with quality good that were not true.
    pub(crate) wrong: Vec<String>,
    /// Values of substitutes that were not true.
    pub(crate) wrong_substitutes: Vec<String>,
    /// The longest delay of the broker, seconds.
    pub(crate) slowest: f64,
    /// From the last fault's end until the need was served permanently, seconds.
    pub(crate) recovery: Option<f64>,
}

/// Judges the values; the last fault ended at `last`.
pub(crate) fn judged(seen: &[Seen], begun: f64, last: f64) -> Judgement {
    let untrue = |is_good: bool| {
        let served = seen.iter().filter(|it| it.is_served() && it.is_good() == is_good && !it.is_true());
        let values = served.map(|it| {
            let (at, age) = (it.at - begun, it.at - it.measured());
            let (value, lie, stale, lag) = (it.value, it.lie(), it.stale(), it.lag);
            format!("{at:.3} s: {value:.2}, measured {age:.3} s before, lag {lag:.3} s, off by {lie:.2}, {stale:.2}")
        });
        values.collect()
    };
    let count = |is_so: fn(&Seen) -> bool| seen.iter().filter(|it| it.is_served() && is_so(it)).count();
    let after: Vec<&Seen> = seen.iter().filter(|seen| seen.at >= last).collect();
    let lasts = |part: &&[&Seen]| part.iter().all(|seen| seen.is_served() && seen.is_true());
    let served = after.windows(LASTING).find(lasts).map(|part| part[0].at - last);
    let end = last + served.unwrap_or(0.0);
    let times = seen.iter().filter(|seen| seen.is_served()).map(|seen| seen.at);
    let inside = times.filter(|at| (begun..end).contains(at));
    let times: Vec<f64> = [begun].into_iter().chain(inside).chain([end]).collect();
    Judgement {
        values: seen.len(),
        off: [count(Seen::is_wrong), count(Seen::is_old)],
        gap: times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max),
        wrong: untrue(true),
        wrong_substitutes: untrue(false),
        slowest: seen.iter().map(|seen| seen.lag).fold(0.0, f64::max),
        recovery: served,
    }
}
