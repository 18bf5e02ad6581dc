//! Whether the truth of a world is what its model declares: an oracle counts only where it is.

use super::readings::Reading;
use super::world::{Signal, World};

/// Rounding of values and nanoseconds.
const ROUNDING: f64 = 1e-9;

impl World {
    /// What does not hold of the declarations.
    pub(super) fn untrue(&self, readings: &[Reading]) -> Option<String> {
        let variables = (0..self.variables.len()).find_map(|it| self.untrue_variable(it));
        let relations = || (0..self.relations.len()).find_map(|it| self.untrue_relation(it));
        variables.or_else(relations).or_else(|| readings.iter().find_map(|it| self.untrue_reading(it)))
    }

    /// Times that no other samples use.
    fn times(&self, count: i32) -> impl Iterator<Item = f64> + use<> {
        let step = self.seconds / f64::from(count);
        (0..count).map(move |at| step * (f64::from(at) + 0.37))
    }

    fn untrue_variable(&self, at: usize) -> Option<String> {
        let variable = &self.variables[at];
        let step = self.seconds / 4000.0;
        for (time, course) in
            self.times(4000).flat_map(|time| variable.courses.iter().map(move |it| (time, it)))
        {
            let value = course(time);
            let is_out =
                variable.wraps.is_none() && variable.range.is_some_and(|(lo, hi)| value < lo || value > hi);
            if is_out || !value.is_finite() {
                return Some(format!("v{at} is {value} at {time} s"));
            }
            let rate = (course(time + step) - value).abs() / step;
            if variable
                .max_rate
                .is_some_and(|most| rate > most * (1.0 + ROUNDING) + ROUNDING * value.abs() / step)
            {
                return Some(format!("v{at} changes by {rate} a second at {time} s"));
            }
        }
        None
    }

    fn untrue_relation(&self, at: usize) -> Option<String> {
        let relation = &self.relations[at];
        let scale = self.size(relation.left);
        let off = |time| (relation.off)(time).map(|off| (time, off));
        let is_wrong = |(_, off): &(f64, f64)| off.is_nan() || off.abs() > relation.error + ROUNDING * scale;
        let (time, off) = self.times(1000).filter_map(off).find(is_wrong)?;
        Some(format!("r{at} is off by {off} at {time} s"))
    }

    fn untrue_reading(&self, reading: &Reading) -> Option<String> {
        let signal = &self.signals[reading.signal];
        let content_s = 1e-9 * reading.stamp as f64 - signal.delay;
        let (early, late) = signal.time_error;
        let is_dated = (content_s + early - 2e-9..=content_s + late + 2e-9).contains(&reading.at);
        let is_meant = |(element, raw): (usize, &f64)| {
            let truth = self.content(signal, element, reading.at);
            self.encloses(signal, *raw, truth)
        };
        let is_true = is_dated && reading.values.iter().enumerate().all(is_meant);
        (!is_true).then(|| format!("s{} gives {reading:?}", reading.signal))
    }

    /// Whether the declared errors of a reading hold a value of SI.
    fn encloses(&self, signal: &Signal, raw: f64, truth: f64) -> bool {
        let variable = &self.variables[signal.variable];
        let meant = self.meant(signal, raw);
        let truth = variable.wraps.map_or(truth, |turn| truth - turn * ((truth - meant) / turn).round());
        let share = signal.share * meant.abs();
        let rest = ROUNDING * (truth.abs() + meant.abs());
        let error = truth - meant;
        let (lowest, highest) = signal.ends.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let is_above = error >= signal.error.0 - share - rest || meant <= lowest + rest;
        let is_below = error <= signal.error.1 + share + rest || meant >= highest - rest;
        is_above && is_below
    }
}
