//! What sensors say of a system: rates, jitter, delays, offsets and noise.

use super::System;
use super::world::{read, variables};
use anyhow::Context;
use serde::Deserialize;
use shsa_core::unit::Unit;
use shsa_lab::calibration::Chance;
use shsa_lab::learning::Signal;

/// What is recorded together.
#[derive(Deserialize)]
pub(super) struct File {
    name: String,
    rate_hz: f64,
    jitter: f64,
}

/// One signal: what it measures and how, or what it is computed from.
#[derive(Deserialize)]
pub(super) struct SignalRecord {
    pub(super) name: String,
    pub(super) variable: String,
    file: String,
    unit: Option<String>,
    pub(super) copy_of: Option<String>,
    #[serde(default)]
    by: f64,
    #[serde(default)]
    plus: f64,
    #[serde(default)]
    delay_s: f64,
    #[serde(default)]
    offset: f64,
    noise: Option<Noise>,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Noise {
    Gaussian { size: f64 },
    Uniform { size: f64 },
    Quantised { size: f64 },
    Drift { size: f64, tau_s: f64 },
}

/// The signals of a system on a day, as a file would have them.
pub(super) fn signals(system: &System, day: u64) -> anyhow::Result<Vec<Signal>> {
    let made = variables(system, day)?;
    let mut signals: Vec<Signal> = Vec::new();
    for (number, declared) in system.signals.iter().enumerate() {
        let at = || format!("{} {}", system.id, declared.name);
        let variable = system.variables.iter().find(|it| it.name == declared.variable).with_context(at)?;
        let unit = Unit::parse(declared.unit.as_ref().unwrap_or(&variable.unit))
            .map_err(|it| anyhow::anyhow!("{}: {it}", at()))?;
        let points = match &declared.copy_of {
            Some(of) => {
                let of = signals.iter().find(|it| it.name == *of).with_context(at)?;
                of.points
                    .iter()
                    .map(|(time, value)| (*time, written(declared.by * value + declared.plus)))
                    .collect()
            }
            None => {
                let values = made.get(&declared.variable).with_context(at)?;
                let times = times(system, &declared.file, day).with_context(at)?;
                let exact = times
                    .iter()
                    .map(|time| read(values, time - declared.delay_s) + declared.offset)
                    .collect();
                let chance =
                    Chance::new(system.seed.wrapping_mul(17) + number as u64 * 523 + day * 3301 + 11);
                let noisy = declared.noise.as_ref().with_context(at)?.onto(&times, exact, chance);
                times.into_iter().zip(noisy.into_iter().map(written)).collect()
            }
        };
        signals.push(Signal { name: declared.name.clone(), unit: Some(unit), points });
    }
    Ok(signals)
}

/// A number as it is written, with seven digits.
fn written(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

/// The times of a file; `None` when the system has no such file.
fn times(system: &System, name: &str, day: u64) -> Option<Vec<f64>> {
    let number = system.files.iter().position(|it| it.name == name)?;
    let File { rate_hz, jitter, .. } = system.files[number];
    let mut chance = Chance::new(system.seed.wrapping_mul(31) + number as u64 * 101 + day * 977 + 7);
    let first = chance.share();
    let count = (system.duration_s * rate_hz - first).max(0.0) as usize;
    let mut time = |at: usize| {
        let late = jitter * (chance.share() - 0.5);
        ((at as f64 + first + late) / rate_hz).clamp(0.0, system.duration_s)
    };
    let mut times: Vec<f64> = (0..count).map(&mut time).collect();
    times.sort_by(f64::total_cmp);
    Some(times)
}

impl Noise {
    fn onto(&self, times: &[f64], exact: Vec<f64>, mut chance: Chance) -> Vec<f64> {
        match *self {
            Noise::Gaussian { size } => exact.into_iter().map(|it| it + size * chance.normal()).collect(),
            Noise::Uniform { size } => {
                exact.into_iter().map(|it| it + size * (2.0 * chance.share() - 1.0)).collect()
            }
            Noise::Quantised { size } => exact
                .into_iter()
                .map(|it| ((it + 0.2 * size * chance.normal()) / size).round() * size)
                .collect(),
            Noise::Drift { size, tau_s } => {
                let (mut last, mut before) = (size * chance.normal(), times.first().copied().unwrap_or(0.0));
                let mut drift = |time: f64| {
                    let kept = (-(time - before) / tau_s).exp();
                    before = time;
                    last = kept * last + (1.0 - kept * kept).sqrt() * size * chance.normal();
                    last + 0.1 * size * chance.normal()
                };
                times.iter().zip(exact).map(|(time, it)| it + drift(*time)).collect()
            }
        }
    }
}
