//! Random plants whose truth is known: variables that vary smoothly, relations between them, and sensors with every kind of noise.

use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Id, RelationDraft, SignalDraft, SignalId, Text, VariableDraft,
};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_lab::calibration::{Chance, Session};

/// The distribution of a sensor's errors; all have the same standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Noise {
    Gaussian,
    Uniform,
    Laplace,
    /// Student's, with three degrees of freedom.
    Student,
    /// Gaussian, rounded to two standard deviations.
    Quantised,
    /// Half of the variance has a memory of ten values.
    Correlated,
    /// Larger with the value.
    Growing,
    /// Gaussian, and one value in a thousand is ten times as far off.
    Outliers,
}

const NOISES: [Noise; 8] = [
    Noise::Gaussian,
    Noise::Uniform,
    Noise::Laplace,
    Noise::Student,
    Noise::Quantised,
    Noise::Correlated,
    Noise::Growing,
    Noise::Outliers,
];

/// The formula of a variable, from variables before it.
#[derive(Clone, Copy, Debug)]
enum Law {
    /// The sum of two waves (amplitudes, periods in seconds, phases) and `middle`.
    Free {
        middle: f64,
        waves: [(f64, f64, f64); 2],
    },
    Sum(usize, usize),
    Product(usize, usize),
    Times(usize, f64),
    /// The rate of change over so many seconds.
    Rate(usize, f64),
}

/// A sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensor {
    pub(super) variable: usize,
    pub(super) noise: Noise,
    /// The standard deviation of its noise.
    pub(super) deviation: f64,
    pub(super) rate_hz: f64,
    delay_s: f64,
}

/// A session without a fault.
pub(super) struct Healthy {
    pub(super) session: Session,
    /// The error of each value: time, signal, error.
    pub(super) errors: Vec<(Time, usize, f64)>,
}

/// A plant.
#[derive(Clone, Debug)]
pub(super) struct Plant {
    laws: Vec<Law>,
    pub(super) sensors: Vec<Sensor>,
    /// The standard deviation of a sensor's offset between sessions, relative to that of its noise.
    pub(super) between: f64,
    seed: u64,
}

impl Plant {
    /// The plant with this number.
    pub(super) fn random(seed: u64) -> Plant {
        let mut chance = Chance::new(seed ^ 0x7075_7a7a_6c65);
        let free = 1 + chance.below(2);
        let mut laws: Vec<Law> = (0..free).map(|_| free_law(&mut chance)).collect();
        for _ in 0..1 + chance.below(6) {
            let (one, other) = (chance.below(free), chance.below(laws.len()));
            laws.push(match chance.below(4) {
                0 if one != other => Law::Sum(one, other),
                1 if one != other => Law::Product(one, other),
                2 => Law::Rate(one, 5.0 + 10.0 * chance.share()),
                _ => Law::Times(one, 0.5 + chance.share()),
            });
        }
        let mut plant = Plant {
            laws,
            sensors: Vec::new(),
            between: 0.5 * chance.below(3) as f64,
            seed: chance.below(1 << 40) as u64,
        };
        let count = (2 + chance.below(11)).max(plant.laws.len()).min(12);
        let rates = [1.0, 1.0, 2.0, 0.5];
        for number in 0..count {
            let variable = if number < plant.laws.len() { number } else { chance.below(plant.laws.len()) };
            let span = plant.span(variable);
            plant.sensors.push(Sensor {
                variable,
                noise: NOISES[chance.below(NOISES.len())],
                deviation: span * (0.005 + 0.02 * chance.share()),
                rate_hz: rates[chance.below(rates.len())],
                delay_s: if chance.below(4) == 0 { (5.0 * chance.share()).round() / 10.0 } else { 0.0 },
            });
        }
        plant
    }

    /// The true value of a variable at a time.
    fn truth(&self, variable: usize, time: f64) -> f64 {
        match self.laws[variable] {
            Law::Free { middle, waves } => {
                middle
                    + waves
                        .iter()
                        .map(|(size, period, phase)| size * (time / period + phase).sin())
                        .sum::<f64>()
            }
            Law::Sum(one, other) => self.truth(one, time) + self.truth(other, time),
            Law::Product(one, other) => self.truth(one, time) * self.truth(other, time),
            Law::Times(one, factor) => factor * self.truth(one, time),
            Law::Rate(one, _) => (self.truth(one, time + 0.5) - self.truth(one, time - 0.5)) / 1.0,
        }
    }

    /// The range of a variable's values.
    fn span(&self, variable: usize) -> f64 {
        let values = (0..400).map(|at| self.truth(variable, 9.0 * f64::from(at)));
        let (lo, hi) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), it| (lo.min(it), hi.max(it)));
        hi - lo
    }

    /// The model as a user would write it by hand: true relations, and tolerances that are too wide.
    pub(super) fn model(&self) -> Draft {
        let text = |text: String| Text { text, ..Text::default() };
        let name = |variable: usize| format!("v{variable}");
        let mut draft = Draft::default();
        for (number, law) in self.laws.iter().enumerate() {
            draft.variables.push(VariableDraft { name: text(name(number)), ..VariableDraft::default() });
            let (formula, is_rate) = match *law {
                Law::Free { .. } => continue,
                Law::Sum(one, other) => (format!("v{one} + v{other}"), false),
                Law::Product(one, other) => (format!("v{one} * v{other}"), false),
                Law::Times(one, factor) => (format!("{factor} * v{one}"), false),
                Law::Rate(one, window) => (format!("derivative(v{one}, {window:.1} s) * 1 s"), true),
            };
            draft.relations.push(RelationDraft {
                name: text(format!("r{number}")),
                body: BodyDraft::Equation(text(format!("v{number} = {formula}"))),
                directions: is_rate.then(|| vec![text(name(number))]),
                condition: None,
                error: Some(Bounds::One(text(format!("{}", 0.2 * self.span(number))))),
                learn: Vec::new(),
                properties: Vec::new(),
            });
        }
        for (number, sensor) in self.sensors.iter().enumerate() {
            draft.signals.push(SignalDraft {
                name: text(format!("s{number}")),
                variable: Some(text(name(sensor.variable))),
                rate: Some(text(format!("{} Hz", sensor.rate_hz))),
                delay: Some(text(format!("{} ms", (1e3 * sensor.delay_s).round()))),
                value_error: Some(Bounds::One(text(format!("{}", 8.0 * sensor.deviation)))),
                ..SignalDraft::default()
            });
        }
        draft
    }

    /// A healthy session of `seconds`; the same number gives the same session.
    pub(super) fn session(&self, number: u64, seconds: f64) -> Healthy {
        let mut chance = Chance::new(self.seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let begin = 1e5 * chance.share();
        let mut all: Vec<(Observation, f64)> = Vec::new();
        for (at, sensor) in self.sensors.iter().enumerate() {
            let offset = self.between * sensor.deviation * chance.normal();
            let span = self.span(sensor.variable).max(1e-12);
            let mut memory = chance.normal();
            let phase = 0.2 * chance.share();
            for step in 0..(seconds * sensor.rate_hz) as usize {
                let time = phase + step as f64 / sensor.rate_hz;
                let truth = self.truth(sensor.variable, begin + time - sensor.delay_s);
                let rest = sensor.noise.drawn(&mut chance, &mut memory, truth.abs() / span);
                let mut value = truth + offset + sensor.deviation * rest;
                if sensor.noise == Noise::Quantised {
                    let step = 2.0 * sensor.deviation;
                    value = (value / step).round() * step;
                }
                let time = Time::from_seconds(time);
                let signal = SignalId::from_index(at);
                let observation =
                    Observation { signal, stamp: time, received: time, value: RawValue::Number(value) };
                all.push((observation, value - truth));
            }
        }
        all.sort_by_key(|it| it.0.received);
        let errors = all.iter().map(|(it, error)| (it.received, it.signal.index(), *error)).collect();
        Healthy { session: Session::new(all.into_iter().map(|it| it.0).collect(), &[]), errors }
    }
}

fn free_law(chance: &mut Chance) -> Law {
    let mut wave =
        |size: f64| (size * (0.5 + chance.share()), 20.0 + 100.0 * chance.share(), 6.0 * chance.share());
    let waves = [wave(10.0), wave(4.0)];
    Law::Free { middle: 40.0 + 40.0 * chance.share(), waves }
}

impl Noise {
    /// A random error with standard deviation 1.
    fn drawn(self, chance: &mut Chance, memory: &mut f64, size: f64) -> f64 {
        match self {
            Noise::Gaussian => chance.normal(),
            Noise::Uniform => 12.0_f64.sqrt() * (chance.share() - 0.5),
            Noise::Laplace => {
                let side = if chance.below(2) == 0 { 1.0 } else { -1.0 };
                side * chance.exponential() / 2.0_f64.sqrt()
            }
            Noise::Student => {
                let freedom: f64 = (0..3).map(|_| chance.normal().powi(2)).sum();
                chance.normal() / freedom.sqrt()
            }
            Noise::Quantised => 0.8 * chance.normal(),
            Noise::Correlated => {
                *memory = 0.9 * *memory + (1.0 - 0.81_f64).sqrt() * chance.normal();
                (*memory + chance.normal()) / 2.0_f64.sqrt()
            }
            Noise::Growing => (0.5 + 0.25 * size.min(4.0)) * chance.normal(),
            Noise::Outliers => {
                let wild = if chance.below(1_000) == 0 { 10.0 } else { 1.0 };
                wild * chance.normal()
            }
        }
    }
}
