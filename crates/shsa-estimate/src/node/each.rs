//! Direct fusion without a model: each quantity is fused from the inputs that measure it directly.
//!
//! Inputs deliver at different times. So the last value of each input is combined with new ones, while it is fresh, with the
//! uncertainty that has grown since.

use crate::Error;
use crate::continuous::Continuous;
use crate::direct::{Direct, Rule};
use crate::matrix::{Matrix, at, put};
use crate::method::{Bias, Gaussian, Innovation, Measurement, Method, Updated, restore, save};
use crate::system::{System, wrapped};

/// Numbers kept of a sensor's last measurement: value, variance, bound, age in seconds.
const KEPT: usize = 4;

/// An input of direct fusion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensor {
    /// The quantity that the sensor measures.
    pub(super) state: usize,
    /// The variance where a measurement brings none.
    pub(super) variance: f64,
    /// For how many seconds a measurement counts.
    pub(super) fresh_s: f64,
    pub(super) turn: Option<f64>,
}

/// Several quantities, each with a direct fusion.
#[derive(Clone, Debug)]
pub(super) struct Each {
    parts: Vec<Direct>,
    sensors: Vec<Sensor>,
    /// Whether earlier measurements are combined with new ones; otherwise only new ones count.
    is_joint: bool,
    latest: Vec<f64>,
    /// The model, for the noise of a measurement that brings none.
    model: Continuous,
    estimate: Gaussian,
    bias: Bias,
    stack: Vec<Measurement>,
    /// The ages of the measurements in the stack, in seconds.
    ages: Vec<f64>,
}

impl Each {
    /// Starts from a mean and standard deviation of each quantity.
    ///
    /// # Errors
    /// The errors of [`Direct::new`].
    pub(super) fn new(
        rule: &Rule,
        sensors: Vec<Sensor>,
        growth: Vec<f64>,
        initial: &[(f64, f64)],
        model: Continuous,
    ) -> Result<Each, Error> {
        let variances: Vec<f64> = sensors.iter().map(|sensor| sensor.variance).collect();
        let parts = initial.iter().zip(growth).enumerate().map(|(state, ((mean, deviation), growth))| {
            let inputs = sensors.iter().filter(|sensor| sensor.state == state).count();
            Direct::new(rule.clone().among(inputs), &variances, growth, (*mean, deviation * deviation))
        });
        let n = initial.len();
        let mut each = Each {
            parts: parts.collect::<Result<_, _>>()?,
            is_joint: !matches!(rule, Rule::Average(_) | Rule::Median(_)),
            latest: vec![f64::INFINITY; KEPT * sensors.len()],
            stack: Vec::with_capacity(sensors.len()),
            ages: Vec::with_capacity(sensors.len()),
            sensors,
            model,
            estimate: Gaussian { mean: vec![0.0; n], spread: Matrix::zeros(n, n) },
            bias: Bias { reach: Matrix::zeros(n, n), counted: Matrix::zeros(n, n) },
        };
        each.summarise();
        Ok(each)
    }

    fn summarise(&mut self) {
        for (place, (part, mean)) in self.parts.iter().zip(&mut self.estimate.mean).enumerate() {
            *mean = part.mean().first().copied().unwrap_or(f64::NAN);
            put(&mut self.estimate.spread, place, place, at(part.spread(), 0, 0));
            if let Some(bias) = part.bias() {
                put(&mut self.bias.reach, place, place, at(&bias.reach, 0, 0));
                put(&mut self.bias.counted, place, place, at(&bias.counted, 0, 0));
            }
        }
    }

    /// The measurement shifted by whole turns to the estimate, with the noise that it has there.
    fn beside(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<(usize, Measurement)> {
        let Measurement { sensor, value, variance, bound } = *measurement;
        let Sensor { state, turn, variance: usual, .. } = *self.sensors.get(sensor)?;
        let mean = self.estimate.mean.get(state)?;
        let value = if turn.is_some() { mean + wrapped(value - mean, turn) } else { value };
        let modelled = self.model.covariance(sensor, sensor, &self.estimate.mean, controls);
        let variance = variance.or(Some(modelled).filter(|it| *it > 0.0)).unwrap_or(usual);
        Some((state, Measurement { sensor, value, variance: Some(variance), bound }))
    }

    fn note(&mut self, measurement: &Measurement) {
        let kept = self.latest.chunks_exact_mut(KEPT).nth(measurement.sensor);
        if let Some([value, own, bound, age]) = kept {
            (*value, *own) = (measurement.value, measurement.variance.unwrap_or(f64::INFINITY));
            (*bound, *age) = (measurement.bound, 0.0);
        }
    }

    /// The fresh last measurements of a quantity's sensors, in their order. Those that wrap are brought next to the present
    /// estimate, which may have gone on round the circle since.
    fn stack(&mut self, state: usize) {
        self.stack.clear();
        self.ages.clear();
        let mean = self.estimate.mean.get(state).copied().unwrap_or(0.0);
        let standing = self.latest.chunks_exact(KEPT).zip(&self.sensors).enumerate();
        for (sensor, (kept, declared)) in standing.filter(|(_, (_, declared))| declared.state == state) {
            if let [value, variance, bound, age] = *kept
                && age <= declared.fresh_s
            {
                let value = match declared.turn {
                    Some(_) => mean + wrapped(value - mean, declared.turn),
                    None => value,
                };
                self.stack.push(Measurement { sensor, value, variance: Some(variance), bound });
                self.ages.push(age);
            }
        }
    }
}

impl Method for Each {
    fn gaussian(&self) -> &Gaussian {
        &self.estimate
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        &mut self.estimate
    }

    fn bias(&self) -> Option<&Bias> {
        Some(&self.bias)
    }

    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool {
        self.latest.chunks_exact_mut(KEPT).filter_map(<[f64]>::last_mut).for_each(|age| *age += dt.max(0.0));
        self.parts.iter_mut().for_each(|part| _ = part.predict(dt, controls));
        self.summarise();
        true
    }

    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation> {
        let (state, measurement) = self.beside(measurement, controls)?;
        self.parts.get_mut(state)?.innovation(&measurement, controls)
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        let mut updated = Updated::NOTHING;
        for state in 0..self.parts.len() {
            let of_it =
                |it: &Measurement| self.sensors.get(it.sensor).is_some_and(|sensor| sensor.state == state);
            if !measurements.iter().any(of_it) {
                continue;
            }
            self.stack.clear();
            self.ages.clear();
            for place in 0..measurements.len() {
                let Some((own, measurement)) =
                    measurements.get(place).and_then(|it| self.beside(it, controls))
                else {
                    continue;
                };
                if own == state {
                    self.note(&measurement);
                    self.stack.push(measurement);
                }
            }
            if self.is_joint {
                self.stack(state);
            }
            let Some(part) = self.parts.get_mut(state) else { continue };
            let own = part.update_aged(&self.stack, &self.ages);
            updated.used += own.used;
            updated.normalized_square += own.normalized_square;
            updated.log_likelihood += own.log_likelihood;
        }
        self.summarise();
        updated
    }

    fn widen(&mut self, factor: f64) {
        self.parts.iter_mut().for_each(|part| part.widen(factor));
        self.summarise();
    }

    fn memory_len(&self) -> usize {
        self.latest.len() + self.parts.iter().map(Method::memory_len).sum::<usize>()
    }

    fn save(&self, memory: &mut [f64]) {
        save(memory, &[&self.latest]);
        let mut rest = memory.get_mut(self.latest.len()..).unwrap_or(&mut []);
        for part in &self.parts {
            let Some((own, after)) = rest.split_at_mut_checked(part.memory_len()) else { return };
            part.save(own);
            rest = after;
        }
    }

    fn restore(&mut self, memory: &[f64]) {
        restore(memory, &mut [&mut self.latest]);
        let mut rest = memory.get(self.latest.len()..).unwrap_or(&[]);
        for part in &mut self.parts {
            let Some((own, after)) = rest.split_at_checked(part.memory_len()) else { return };
            part.restore(own);
            rest = after;
        }
        self.summarise();
    }
}
