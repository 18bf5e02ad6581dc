//! The variables of a system over time, made from their descriptions.

use super::System;
use super::formula::Formula;
use anyhow::Context;
use serde::Deserialize;
use shsa_lab::calibration::Chance;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// The step of the world behind the signals, in seconds.
pub(super) const STEP_S: f64 = 0.01;

/// Sines that a wandering variable is made of.
const SINES: usize = 12;

/// One variable.
#[derive(Deserialize)]
pub(super) struct Variable {
    pub(super) name: String,
    pub(super) unit: String,
    make: Make,
}

/// How a variable is made; times in seconds, frequencies in hertz.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Make {
    Wander {
        mean: f64,
        sd: f64,
        from_hz: f64,
        to_hz: f64,
    },
    Levels {
        low: f64,
        high: f64,
        hold_s: f64,
        tau_s: f64,
    },
    Steps {
        values: Vec<f64>,
        hold_s: f64,
    },
    /// Rises for no reason that lasts.
    Trend {
        start: f64,
        rise: f64,
        bend: f64,
        sd: f64,
    },
    /// Has the same period and phase as another by chance.
    Cycle {
        mean: f64,
        sd: f64,
        own_sd: f64,
        period_s: f64,
        phase: f64,
    },
    /// Has a cause in common that is not measured.
    Mixed {
        of: Vec<String>,
        mean: f64,
        by: f64,
        own_sd: f64,
    },
    /// Follows at first only.
    Until {
        of: Vec<String>,
        share: f64,
    },
    Linear {
        of: Vec<String>,
        by: Vec<f64>,
        plus: f64,
    },
    Product {
        of: Vec<String>,
        by: f64,
    },
    Ratio {
        of: Vec<String>,
        by: f64,
    },
    Derivative {
        of: Vec<String>,
        by: f64,
    },
    Integral {
        of: Vec<String>,
        by: f64,
        plus: f64,
    },
    Delay {
        of: Vec<String>,
        by_s: f64,
    },
    LowPass {
        of: Vec<String>,
        tau_s: f64,
    },
    Polynomial {
        of: Vec<String>,
        by: Vec<f64>,
    },
    Gears {
        of: Vec<String>,
        ratios: Vec<f64>,
    },
    Saturation {
        of: Vec<String>,
        by: f64,
        plus: f64,
        low: f64,
        high: f64,
    },
    Formula {
        of: Vec<String>,
        formula: String,
    },
}

/// All variables of a system on a day, at every step; on any day but 0 the inputs differ, and signals that were only correlated
/// with others become independent.
pub(super) fn variables(system: &System, day: u64) -> anyhow::Result<BTreeMap<String, Vec<f64>>> {
    let count = (system.duration_s / STEP_S).round() as usize + 1;
    let mut made = BTreeMap::new();
    for (number, variable) in system.variables.iter().enumerate() {
        let seed = system.seed.wrapping_mul(1009) + number as u64 * 9176 + day * 7919;
        let mut maker = Maker { made: &made, count, day, chance: Chance::new(seed) };
        let values =
            maker.make(&variable.make).with_context(|| format!("{} {}", system.id, variable.name))?;
        made.insert(variable.name.clone(), values);
    }
    Ok(made)
}

/// What one variable is made with.
struct Maker<'w> {
    made: &'w BTreeMap<String, Vec<f64>>,
    count: usize,
    day: u64,
    chance: Chance,
}

impl<'w> Maker<'w> {
    fn make(&mut self, make: &Make) -> anyhow::Result<Vec<f64>> {
        Ok(match make {
            Make::Wander { mean, sd, from_hz, to_hz } => plus(*mean, &self.waves(*sd, *from_hz, *to_hz)),
            Make::Levels { low, high, hold_s, tau_s } => {
                let level = |chance: &mut Chance| low + (high - low) * chance.share();
                let held = self.held(*hold_s, *tau_s, level);
                smooth(&held, *tau_s)
            }
            Make::Steps { values, hold_s } => self
                .held(*hold_s, 1.0, |chance| values.get(chance.below(values.len())).copied().unwrap_or(0.0)),
            Make::Trend { start, rise, bend, sd } => {
                let rise = if self.day > 0 { rise * (3.0 * self.chance.share() - 1.5) } else { *rise };
                let own = self.own(*sd, 3.0, 30.0);
                self.each(|at, share| start + rise * (share + bend * share * (1.0 - share)) + own[at])
            }
            Make::Cycle { mean, sd, own_sd, period_s, phase } => {
                let other_day = self.day > 0;
                let period = if other_day { period_s * (0.5 + 1.5 * self.chance.share()) } else { *period_s };
                let phase = if other_day { phase + TAU * self.chance.share() } else { *phase };
                let own = self.waves(*own_sd, 1.0 / period, 10.0 / period);
                self.each(|at, _| {
                    let turn = TAU * at as f64 * STEP_S / period + phase;
                    mean + sd * 2.0_f64.sqrt() * turn.sin() + own[at]
                })
            }
            Make::Mixed { of, mean, by, own_sd } => {
                let by = if self.day > 0 { by * (2.0 * self.chance.share() - 1.0) } else { *by };
                let (cause, own) = (self.first(of)?, self.own(*own_sd, 5.0, 50.0));
                self.each(|at, _| mean + by * cause[at] + own[at])
            }
            Make::Until { of, share } => {
                let other = self.first(of)?;
                let (mean, sd) = (mean(other), deviation(other));
                let own = self.own(sd, 5.0, 50.0);
                let is_over = self.each(|_, at| f64::from(u8::from(self.day > 0 || at > *share)));
                let on = smooth(&is_over, 0.01 * self.duration_s());
                self.each(|at, _| other[at] * (1.0 - on[at]) + (mean + own[at]) * on[at])
            }
            related => self.related(related)?,
        })
    }

    /// What follows from other variables, on every day.
    fn related(&self, make: &Make) -> anyhow::Result<Vec<f64>> {
        Ok(match make {
            Make::Linear { of, by, plus } => {
                let inputs = of.iter().map(|name| self.get(name)).collect::<anyhow::Result<Vec<_>>>()?;
                self.each(|at, _| plus + inputs.iter().zip(by).map(|(input, by)| by * input[at]).sum::<f64>())
            }
            Make::Product { of, by } => {
                let (one, other) = (self.first(of)?, self.second(of)?);
                self.each(|at, _| by * one[at] * other[at])
            }
            Make::Ratio { of, by } => {
                let (one, other) = (self.first(of)?, self.second(of)?);
                self.each(|at, _| by * one[at] / other[at])
            }
            Make::Derivative { of, by } => {
                let x = self.first(of)?;
                self.each(|at, _| {
                    let (before, after) = (at.saturating_sub(1), (at + 1).min(x.len() - 1));
                    by * (x[after] - x[before]) / ((after - before) as f64 * STEP_S)
                })
            }
            Make::Integral { of, by, plus } => {
                let mut sum = *plus;
                let steps = self.first(of)?.windows(2).map(|it| by * 0.5 * (it[0] + it[1]) * STEP_S);
                std::iter::once(*plus)
                    .chain(steps.map(|step| {
                        sum += step;
                        sum
                    }))
                    .collect()
            }
            Make::Delay { of, by_s } => {
                let x = self.first(of)?;
                self.each(|at, _| read(x, at as f64 * STEP_S - by_s))
            }
            Make::LowPass { of, tau_s } => smooth(self.first(of)?, *tau_s),
            Make::Polynomial { of, by } => {
                let x = self.first(of)?;
                self.each(|at, _| by.iter().rev().fold(0.0, |sum, factor| sum * x[at] + factor))
            }
            Make::Gears { of, ratios } => {
                let (x, gear) = (self.first(of)?, self.second(of)?);
                let ratio = |gear: f64| ratios[(gear.round().max(1.0) as usize).min(ratios.len()) - 1];
                anyhow::ensure!(!ratios.is_empty(), "no ratios");
                self.each(|at, _| ratio(gear[at]) * x[at])
            }
            Make::Saturation { of, by, plus, low, high } => {
                let x = self.first(of)?;
                self.each(|at, _| (by * x[at] + plus).max(*low).min(*high))
            }
            Make::Formula { of, formula } => {
                let inputs = of.iter().map(|name| self.get(name)).collect::<anyhow::Result<Vec<_>>>()?;
                let formula = Formula::parse(formula, of)?;
                self.each(|at, _| formula.value(&inputs.iter().map(|it| it[at]).collect::<Vec<_>>()))
            }
            _ => anyhow::bail!("it follows from no other"),
        })
    }

    fn get(&self, name: &str) -> anyhow::Result<&'w [f64]> {
        self.made.get(name).map(Vec::as_slice).with_context(|| format!("{name} comes later, or not at all"))
    }

    fn first(&self, of: &[String]) -> anyhow::Result<&'w [f64]> {
        self.get(of.first().context("`of` is empty")?)
    }

    fn second(&self, of: &[String]) -> anyhow::Result<&'w [f64]> {
        self.get(of.get(1).context("`of` needs two")?)
    }

    fn duration_s(&self) -> f64 {
        (self.count - 1) as f64 * STEP_S
    }

    /// A value for every step, from its number and its share of the time.
    fn each(&self, value: impl Fn(usize, f64) -> f64) -> Vec<f64> {
        (0..self.count).map(|at| value(at, at as f64 / (self.count - 1).max(1) as f64)).collect()
    }

    /// Waves whose frequencies make this many periods in the whole time.
    fn own(&mut self, sd: f64, from: f64, to: f64) -> Vec<f64> {
        let duration_s = self.duration_s();
        self.waves(sd, from / duration_s, to / duration_s)
    }

    /// Sines of random frequencies, evenly in their logarithms, and phases; slower ones are larger.
    fn waves(&mut self, sd: f64, from_hz: f64, to_hz: f64) -> Vec<f64> {
        let chance = &mut self.chance;
        let sines: Vec<[f64; 3]> = (0..SINES)
            .map(|_| {
                let hz = from_hz * (to_hz / from_hz).powf(chance.share());
                [hz, (hz / from_hz).powf(-0.5) * (0.5 + chance.share()), TAU * chance.share()]
            })
            .collect();
        let size = sd / (sines.iter().map(|[_, size, _]| size * size).sum::<f64>() / 2.0).sqrt();
        let sine = |time: f64| {
            sines.iter().map(|[hz, own, phase]| own * (TAU * hz * time + phase).sin()).sum::<f64>()
        };
        self.each(|at, _| size * sine(at as f64 * STEP_S))
    }

    /// Values that are each held for about this time.
    fn held(&mut self, hold_s: f64, least_s: f64, mut value: impl FnMut(&mut Chance) -> f64) -> Vec<f64> {
        let (mut until, mut now) = (f64::NEG_INFINITY, 0.0);
        (0..self.count)
            .map(|at| {
                let time = at as f64 * STEP_S;
                if time >= until {
                    until = time + hold_s * self.chance.exponential() + least_s;
                    now = value(&mut self.chance);
                }
                now
            })
            .collect()
    }
}

/// A value between two steps, or that of the nearest end.
pub(super) fn read(values: &[f64], time_s: f64) -> f64 {
    let place = (time_s / STEP_S).clamp(0.0, (values.len() - 1) as f64);
    let before = place.floor() as usize;
    let after = (before + 1).min(values.len() - 1);
    values[before] + (place - before as f64) * (values[after] - values[before])
}

pub(super) fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn plus(mean: f64, values: &[f64]) -> Vec<f64> {
    values.iter().map(|it| mean + it).collect()
}

/// A low-pass of the first order, started at rest.
fn smooth(values: &[f64], tau_s: f64) -> Vec<f64> {
    let mut last = values.first().copied().unwrap_or(0.0);
    let step = |value: &f64| {
        last += STEP_S / (tau_s + STEP_S) * (value - last);
        last
    };
    values.iter().map(step).collect()
}
