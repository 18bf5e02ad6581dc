//! What the consumer was given, against what was true: every reading tells in its last decimals when it was measured.

use serde_json::Value;

/// As in `tests/python/unsteady.py`.
const PERIOD: f64 = 60.0;
const LOW: f64 = 10.0;
const SLOPE: f64 = 2.0;
/// Readings tell their time modulo this, seconds.
const TURN: f64 = 100.0;
/// Two sensors agree that are off by less than their errors, and the speed's `max_rate` between two readings, allow; and readings
/// are rounded.
const ALLOWED: f64 = 2.0 * 0.5 + 6.0 * 0.05 + 0.03;
/// The need's greatest age, and what a busy machine may keep a message waiting on its way, seconds.
const ON_ITS_WAY: f64 = 2.0;
/// So many good values in a row are no accident.
const LASTING: usize = 50;

fn speed(at: f64) -> f64 {
    let phase = at.rem_euclid(PERIOD);
    LOW + SLOPE * phase.min(PERIOD - phase)
}

/// A value at the consumer.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    pub(crate) at: f64,
    value: f64,
    quality: String,
    /// What the broker took for a message at that time.
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

    /// When it was measured.
    fn measured(&self) -> f64 {
        let told = (self.value * 1e7).round().rem_euclid(1e5) / 1e3;
        self.at - (self.at - told).rem_euclid(TURN)
    }

    /// How far off it was when it was measured.
    fn lie(&self) -> f64 {
        (self.value - speed(self.measured())).abs()
    }

    /// How far it is from all that was true lately.
    fn stale(&self) -> f64 {
        // To the run, and to the consumer.
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

/// What became of a sequence at the consumer.
#[derive(Debug)]
pub(crate) struct Judgement {
    pub(crate) values: usize,
    /// Of those that went out as served: how many were wrong, and how many of before.
    pub(crate) off: [usize; 2],
    /// The longest time without a value, from the first fault until served for good, seconds.
    pub(crate) gap: f64,
    /// Good ones that were not true.
    pub(crate) wrong: Vec<String>,
    /// Those of who stood in that were not true.
    pub(crate) wrong_substitutes: Vec<String>,
    /// How slow the broker was, seconds.
    pub(crate) slowest: f64,
    /// From the last fault's end until served for good, seconds.
    pub(crate) recovery: Option<f64>,
}

/// Judges what was seen; the last fault was over at `last`.
pub(crate) fn judged(seen: &[Seen], begun: f64, last: f64) -> Judgement {
    let untrue = |is_good: bool| {
        let served = seen.iter().filter(|it| it.is_served() && it.is_good() == is_good && !it.is_true());
        let told = served.map(|it| {
            let (at, age) = (it.at - begun, it.at - it.measured());
            let (value, lie, stale, lag) = (it.value, it.lie(), it.stale(), it.lag);
            format!("{at:.3} s: {value:.2}, measured {age:.3} s before, lag {lag:.3} s, off by {lie:.2}, {stale:.2}")
        });
        told.collect()
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
