//! Simulated recordings of a plant, with one planted fault.

use crate::calibration::Chance;
use crate::drafting::{Columns, Series};
use crate::order::{median, quantile, sorted};

/// The kinds of planted faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    Bias,
    Scale,
    Drift,
    Stuck,
    Noise,
    Spikes,
    Delay,
    Swapped,
    Unit,
}

pub(super) const FAULTS: [Fault; 9] = [
    Fault::Bias,
    Fault::Scale,
    Fault::Drift,
    Fault::Stuck,
    Fault::Noise,
    Fault::Spikes,
    Fault::Delay,
    Fault::Swapped,
    Fault::Unit,
];

/// How many others know what the faulty signal says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sight {
    Two,
    One,
}

/// A recording with a fault.
pub(super) struct Planted {
    pub(super) columns: Columns,
    pub(super) signal: usize,
    pub(super) stretch: (f64, f64),
    pub(super) sight: Sight,
}

/// The length of a recording and how a quantity moves in it.
struct World {
    chance: Chance,
    lasts_s: f64,
    period_s: f64,
}

type Points = Vec<(f64, f64)>;

impl World {
    /// A quantity at steps of a tenth of a period: waves, or a random walk, or both; with a spread of about 1.
    fn truth(&mut self) -> Vec<f64> {
        let step = 0.1 * self.period_s;
        let count = (self.lasts_s / step) as usize + 200;
        let walks = self.chance.share();
        let waves: Vec<(f64, f64)> = (0..3)
            .map(|_| {
                (
                    self.lasts_s / (3.0 + 60.0 * self.chance.share()),
                    std::f64::consts::TAU * self.chance.share(),
                )
            })
            .collect();
        let relax = (20.0 + 200.0 * self.chance.share()) * self.period_s;
        let (mut walk, mut smooth) = (0.0, 0.0);
        (0..count)
            .map(|at| {
                let time = at as f64 * step;
                walk += -walk * step / relax + (2.0 * step / relax).sqrt() * self.chance.normal();
                smooth += (walk - smooth) * (step / (3.0 * self.period_s));
                let wave: f64 = waves
                    .iter()
                    .map(|(period, phase)| (std::f64::consts::TAU * time / period + phase).sin())
                    .sum();
                walks * smooth + (1.0 - walks) * 0.8 * wave
            })
            .collect()
    }

    /// A sensor of a quantity: response, offset, noise, rounding, times of its own.
    fn sensor(&mut self, truth: &[f64], size: f64, level: f64) -> Points {
        let step = 0.1 * self.period_s;
        let noise = size * (0.003 + 0.04 * self.chance.share().powi(2));
        let offset = 0.1 * size * self.chance.normal();
        let rounded = if self.chance.share() < 0.4 { size * 0.03 * self.chance.share() } else { 0.0 };
        let tau = 2.0 * self.period_s * self.chance.share().powi(2);
        let late = self.period_s * self.chance.share();
        let phase = self.period_s * self.chance.share();
        let mut slow = truth[0];
        let slowed: Vec<f64> = truth
            .iter()
            .map(|it| {
                slow += (it - slow) * (step / (tau + step));
                slow
            })
            .collect();
        let count = (self.lasts_s / self.period_s) as usize - 2;
        (0..count)
            .map(|at| {
                let time = at as f64 * self.period_s + phase;
                let place = ((time - late) / step).max(0.0) as usize;
                let value = level
                    + offset
                    + size * slowed[place.min(slowed.len() - 1)]
                    + noise * self.chance.normal();
                (time, if rounded > 0.0 { (value / rounded).round() * rounded } else { value })
            })
            .collect()
    }
}

/// A recording with a fault of a signal that as many others know; `None` where the fault would change nothing that can be seen.
pub(super) fn planted(seed: u64, sight: Sight, fault: Option<Fault>) -> Option<Planted> {
    let mut chance = Chance::new(seed.wrapping_mul(7_919) + 17);
    let period_s = [0.1, 0.5, 1.0, 10.0][chance.below(4)];
    let count = 1_500.0 + 4_000.0 * chance.share();
    let mut world = World { chance, lasts_s: count * period_s, period_s };
    let mut series: Vec<(String, Points)> = Vec::new();
    let [first, second, third, fourth] = [0, 1, 2, 3].map(|_| world.truth());
    let size = [0.3, 2.0, 15.0][world.chance.below(3)];
    for number in 0..3 {
        series.push((format!("alpha_{number}"), world.sensor(&first, size, 4.0 * size)));
    }
    for number in 0..3 {
        series.push((format!("beta_{number}"), world.sensor(&second, 3.0 * size, 20.0 * size)));
    }
    // A speed and a wheel, which imply each other, and two flows with their sum.
    let radius = 0.2 + world.chance.share();
    series.push(("speed".to_owned(), world.sensor(&third, 2.0, 8.0).into_iter().collect()));
    series.push(("turns".to_owned(), world.sensor(&third, 2.0 / radius, 8.0 / radius)));
    let sum: Vec<f64> = second.iter().zip(&fourth).map(|(one, other)| one + other).collect();
    series.push(("flow".to_owned(), world.sensor(&fourth, 3.0 * size, 9.0 * size)));
    series.push(("whole".to_owned(), world.sensor(&sum, 3.0 * size, 29.0 * size)));
    let lonely = world.truth();
    series.push(("lonely".to_owned(), world.sensor(&lonely, 5.0, 40.0)));
    let (signal, witness) = match sight {
        Sight::Two => (world.chance.below(3), 0),
        Sight::One => (6 + world.chance.below(2), 0),
    };
    let witness = if sight == Sight::One { 13 - signal } else { (signal + 1) % 3 } + witness;
    let length = world.lasts_s * (0.01 + 0.19 * world.chance.share());
    let from = (world.lasts_s - length) * (0.02 + 0.96 * world.chance.share());
    let stretch = (from, from + length);
    if let Some(fault) = fault {
        let factor = if sight == Sight::One { [radius, 1.0 / radius][7 - signal] } else { 1.0 };
        let hidden = hidden(&series[signal].1, &series[witness].1, 1.0 / factor);
        plant(&mut series, signal, stretch, fault, hidden, &mut world.chance)?;
    }
    let series = series.into_iter().map(|(path, points)| Series {
        topic: "plant".to_owned(),
        source: format!("plant#{path}"),
        path,
        points,
    });
    Some(Planted { columns: Columns::of_series(series.collect()), signal, stretch, sight })
}

/// What 99.9 % of the differences of a sound signal from a witness do not exceed.
fn hidden(own: &[(f64, f64)], witness: &[(f64, f64)], factor: f64) -> f64 {
    let curve = crate::curve::Curve::new(witness.to_vec());
    let offs: Vec<f64> = own.iter().filter_map(|it| Some(it.1 - curve.read(it.0)?.0 * factor)).collect();
    let middle = median(offs.iter().copied());
    quantile(&sorted(offs.iter().map(|it| (it - middle).abs())), 0.999).unwrap_or(0.0)
}

fn plant(
    series: &mut [(String, Points)],
    signal: usize,
    (from, to): (f64, f64),
    fault: Fault,
    hidden: f64,
    chance: &mut Chance,
) -> Option<()> {
    let sound = series[signal].1.clone();
    let inside: Vec<f64> = sound.iter().filter(|it| from <= it.0 && it.0 <= to).map(|it| it.1).collect();
    let other = if fault == Fault::Swapped { Some(if signal < 3 { 3 } else { 4 }) } else { None };
    let second = other.map(|it| series[it].1.clone());
    let curve = crate::curve::Curve::new(sound.clone());
    let middle = median(inside.iter().map(|it| it.abs()));
    let paces = sorted(sound.windows(2).map(|it| ((it[1].1 - it[0].1) / (it[1].0 - it[0].0)).abs()));
    let _ = &paces;
    let width =
        quantile(&sorted(inside.iter().copied()), 0.9)? - quantile(&sorted(inside.iter().copied()), 0.1)?;
    // The delay at which nearly all differences are below, and some above twice what is hidden.
    let delays = (1..200).map(|it| f64::from(it) * (to - from) / 400.0);
    let size_of = |delay: &f64| {
        let offs = sound
            .iter()
            .filter(|it| from <= it.0 && it.0 <= to)
            .filter_map(|it| Some((it.1 - curve.read(it.0 - delay)?.0).abs()));
        quantile(&sorted(offs), 0.9).unwrap_or(0.0)
    };
    let delay = delays.into_iter().find(|it| size_of(it) > 2.0 * hidden);
    if fault == Fault::Stuck && width < 4.0 * hidden || fault == Fault::Delay && delay.is_none() {
        return None;
    }
    let sign = if chance.share() < 0.5 { -1.0 } else { 1.0 };
    let unit = [1_000.0, 3.6, 60.0, -1.0, 1.8][chance.below(5)];
    let first = inside.first().copied()?;
    for (place, point) in series[signal].1.iter_mut().enumerate() {
        let time = point.0;
        if !(from <= time && time <= to) {
            continue;
        }
        point.1 = match fault {
            Fault::Bias => point.1 + sign * 2.0 * hidden,
            Fault::Scale => point.1 * (1.0 + sign * 2.0 * hidden / middle),
            Fault::Drift => point.1 + sign * 4.0 * hidden * (time - from) / (to - from),
            Fault::Stuck => first,
            Fault::Noise => point.1 + 2.0 * hidden * chance.normal(),
            Fault::Spikes if chance.share() < 0.1 => point.1 + sign * 2.0 * hidden,
            Fault::Spikes => point.1,
            Fault::Delay => curve.read(time - delay.unwrap_or(0.0)).map_or(point.1, |it| it.0),
            Fault::Swapped => second.as_ref().and_then(|it| it.get(place)).map_or(point.1, |it| it.1),
            Fault::Unit if unit == 1.8 => 1.8 * point.1 + 32.0,
            Fault::Unit => unit * point.1,
        };
    }
    if let (Some(other), true) = (other, fault == Fault::Swapped) {
        for (place, point) in
            series[other].1.iter_mut().enumerate().filter(|it| from <= it.1.0 && it.1.0 <= to)
        {
            point.1 = sound.get(place).map_or(point.1, |it| it.1);
        }
    }
    Some(())
}
