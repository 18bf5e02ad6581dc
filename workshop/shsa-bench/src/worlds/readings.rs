//! What the sensors of a world say: each value with its time stamp and the time of its reception.

use super::world::{Signal, World};
use shsa_lab::calibration::Chance;
use std::f64::consts::TAU;

/// A value of a signal.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reading {
    pub(super) signal: usize,
    /// When the value was true, in seconds.
    pub(super) at: f64,
    /// Nanoseconds since the start of the world.
    pub(super) stamp: i64,
    pub(super) received: i64,
    /// As they come, one for each element.
    pub(super) values: Vec<f64>,
}

/// Declared bounds are kept by this share of them: what rounding needs.
const WITHIN: f64 = 1.0 - 1e-6;

impl World {
    /// All readings in the order of their reception.
    pub(super) fn readings(&self, chance: &mut Chance) -> Vec<Reading> {
        let mut all: Vec<Reading> = Vec::new();
        for (at, signal) in self.signals.iter().enumerate() {
            let own = match signal.copies {
                Some(of) => all.iter().filter(|it| it.signal == of).map(|it| self.copy(it, at)).collect(),
                None => self.measured(chance, at, signal),
            };
            all.extend(own);
        }
        // Who ends later than others does not make these silent.
        let end = nanoseconds(self.seconds);
        all.retain(|it| it.received < end);
        all.sort_by_key(|it| (it.received, it.signal, it.stamp));
        all
    }

    fn measured(&self, chance: &mut Chance, at: usize, signal: &Signal) -> Vec<Reading> {
        let mut readings: Vec<Reading> = Vec::new();
        let schedule = &signal.schedule;
        let mut last = 0.0;
        for (number, moment) in schedule.moments(chance, signal.rate_hz, self.seconds).into_iter().enumerate()
        {
            let values = self.values(chance, signal, number, moment);
            let (lo, hi) = signal.time_error;
            let place = WITHIN * signal.pattern.at(chance, number, moment, true);
            let off = 0.5 * (lo + hi) + 0.5 * place * (hi - lo);
            let stamp = moment + signal.delay - off;
            let ready = stamp.max(moment + signal.delay.max(0.5 * signal.mean_over));
            let received = schedule.received(chance, ready).max(if schedule.in_order { last } else { 0.0 });
            last = received;
            let reading = Reading {
                signal: at,
                at: moment,
                stamp: nanoseconds(stamp),
                received: nanoseconds(received),
                values,
            };
            if chance.share() < schedule.doubled {
                readings.push(Reading { received: reading.received + 1_000_000, ..reading.clone() });
            }
            readings.push(reading);
        }
        readings
    }

    /// The values that a sensor gives of a moment, in its own unit and scale.
    fn values(&self, chance: &mut Chance, signal: &Signal, number: usize, moment: f64) -> Vec<f64> {
        let variable = &self.variables[signal.variable];
        let elements = 0..variable.courses.len();
        let value = |element: usize| {
            let truth = self.content(signal, element, moment);
            let step = 1e-3 / signal.rate_hz;
            let rises = variable.courses[element](moment + step) > variable.courses[element](moment - step);
            let place = signal.pattern.at(chance, number + element, moment, rises);
            let offset = signal.offset.map_or(0.0, |(most, period)| most * (TAU * moment / period).cos());
            let most = signal.offset.map_or(0.0, |(most, _)| most);
            let (lo, hi) = (signal.error.0 + most, signal.error.1 - most);
            // A share of the reading, which is nearer to zero than the truth by no more than both errors.
            let share = signal.share * (truth.abs() - hi.max(-lo)).max(0.0) / (1.0 + signal.share);
            let error = 0.5 * (lo + hi) + WITHIN * (offset + place * (0.5 * (hi - lo) + share));
            let (lowest, highest) = signal.ends.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            self.raw(signal, (truth - error).clamp(lowest, highest))
        };
        elements.map(value).collect()
    }

    /// What a signal is about at a moment of measurement: the value of then, or the mean over a time around it.
    pub(super) fn content(&self, signal: &Signal, element: usize, moment: f64) -> f64 {
        let variable = &self.variables[signal.variable];
        match &variable.waves {
            Some(waves) if signal.mean_over > 0.0 => {
                let half = 0.5 * signal.mean_over;
                (waves.integral(moment + half) - waves.integral(moment - half)) / signal.mean_over
            }
            _ => variable.courses[element](moment),
        }
    }

    /// A value of SI as a signal gives it; what wraps is brought into one turn.
    pub(super) fn raw(&self, signal: &Signal, si: f64) -> f64 {
        let variable = &self.variables[signal.variable];
        let low = variable.range.map_or(0.0, |range| range.0);
        let si = variable.wraps.map_or(si, |turn| low + (si - low).rem_euclid(turn));
        let value = variable.dimension[signal.unit].of(si);
        signal.scaling.map_or(value, |(scale, offset)| (value - offset) / scale)
    }

    /// The value of SI that a signal means by a reading.
    pub(super) fn meant(&self, signal: &Signal, raw: f64) -> f64 {
        let value = signal.scaling.map_or(raw, |(scale, offset)| raw * scale + offset);
        self.variables[signal.variable].dimension[signal.unit].si(value)
    }

    /// The same value as another signal gives it.
    fn copy(&self, reading: &Reading, signal: usize) -> Reading {
        let of = &self.signals[reading.signal];
        let own = &self.signals[signal];
        let values = reading.values.iter().map(|it| self.raw(own, self.meant(of, *it))).collect();
        Reading { signal, values, ..reading.clone() }
    }
}

pub(super) fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}
