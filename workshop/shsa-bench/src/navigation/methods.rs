//! The methods: those without a model estimate each quantity alone, filters estimate all together.

use super::simulated::{Arrival, DEVICES, Truth};
use crate::table::Errors;
use shsa_core::time::{Span, Time};
use shsa_estimate::average::{Filling, MovingAverage, Window};
use shsa_estimate::direct::{Direct, Faulty, Rule};
use shsa_estimate::formulas::{Draft, Formulas, Sensor, Vocabulary};
use shsa_estimate::fusion::{Fusion, Gate, Options};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::{self, Measurement};
use shsa_estimate::particle::{Particle, Particles};
use shsa_estimate::unscented::{Points, Unscented};
use std::f64::consts::TAU;

/// A method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    DeadReckoning,
    Average,
    Median,
    Confidence,
    Marzullo,
    Schmid,
    BrooksIyengar,
    Extended,
    Gated,
    Huber,
    Student,
    Unscented,
    Particles,
}

impl Method {
    pub(super) const ALL: [Method; 13] = [
        Method::DeadReckoning,
        Method::Average,
        Method::Median,
        Method::Confidence,
        Method::Marzullo,
        Method::Schmid,
        Method::BrooksIyengar,
        Method::Extended,
        Method::Gated,
        Method::Huber,
        Method::Student,
        Method::Unscented,
        Method::Particles,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Method::DeadReckoning => "dead reckoning",
            Method::Average => "moving average",
            Method::Median => "moving median",
            Method::Confidence => "by confidence",
            Method::Marzullo => "Marzullo",
            Method::Schmid => "Schmid",
            Method::BrooksIyengar => "Brooks-Iyengar",
            Method::Extended => "EKF",
            Method::Gated => "EKF, gated",
            Method::Huber => "EKF, Huber",
            Method::Student => "EKF, Student",
            Method::Unscented => "UKF",
            Method::Particles => "particles",
        }
    }

    /// How a method combines direct measurements of one quantity; `None` for a filter.
    fn rule(self) -> anyhow::Result<Option<Rule>> {
        let faulty = Faulty { count: 1, deviations: 3.0 };
        Ok(Some(match self {
            Method::Average => Rule::Average(MovingAverage::new(&[1.0; 5], Filling::Partial)?),
            Method::Median => Rule::Median(Window::new(5)),
            Method::Confidence => Rule::Confidence,
            Method::Marzullo => Rule::Marzullo(faulty),
            Method::Schmid => Rule::Schmid(faulty),
            Method::BrooksIyengar => Rule::BrooksIyengar(faulty),
            _ => return Ok(None),
        }))
    }
}

/// The errors of position and speed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Error {
    pub(super) position: Errors,
    pub(super) speed: Errors,
}

/// Errors count from this time on, when the filters have settled.
const SETTLED: Time = Time(5_000_000_000);

/// The fixes, and the sensors of speed.
const FIXES: [usize; 2] = [0, 1];
const SPEEDS: [usize; 3] = [2, 3, 4];
const GYROSCOPE: usize = 5;
const COMPASS: usize = 6;

/// Runs a method over what arrives, asking it twenty times a second.
pub(super) fn run(
    method: Method,
    particles: Particles,
    truths: &[Truth],
    arrivals: &[Arrival],
    error: &mut Error,
) -> anyhow::Result<()> {
    let mut estimator: Box<dyn Estimator> = match method.rule()? {
        _ if method == Method::DeadReckoning => Box::new(Reckoning::default()),
        Some(rule) => Box::new(Separate::new(&rule)?),
        None => Box::new(Joint { fusion: joint(method, particles)? }),
    };
    let mut arrivals = arrivals.iter().peekable();
    for truth in truths {
        while let Some(arrival) = arrivals.next_if(|arrival| arrival.received <= truth.at) {
            estimator.take(arrival);
        }
        let [x, y, speed] = estimator.estimate(truth.at);
        if truth.at >= SETTLED {
            error.position.add((x - truth.x).hypot(y - truth.y), 1.0);
            error.speed.add(speed - truth.speed, 1.0);
        }
    }
    Ok(())
}

/// An estimator of position and speed.
trait Estimator {
    fn take(&mut self, arrival: &Arrival);

    /// x, y and speed.
    fn estimate(&mut self, at: Time) -> [f64; 3];
}

/// Integrates wheel 1 and the gyroscope; without wheels the third sensor of speed.
#[derive(Default)]
struct Reckoning {
    state: Truth,
    has_wheel: bool,
}

impl Estimator for Reckoning {
    fn take(&mut self, arrival: &Arrival) {
        match arrival.sensor {
            2 => (self.state.speed, self.has_wheel) = (arrival.value, true),
            4 if !self.has_wheel => self.state.speed = arrival.value,
            GYROSCOPE => self.state.turn = arrival.value,
            _ => {}
        }
    }

    fn estimate(&mut self, at: Time) -> [f64; 3] {
        let dt = (at - self.state.at).seconds();
        self.state.at = at;
        self.state.heading += self.state.turn * dt;
        self.state.x += self.state.speed * self.state.heading.cos() * dt;
        self.state.y += self.state.speed * self.state.heading.sin() * dt;
        [self.state.x, self.state.y, self.state.speed]
    }
}

/// Estimates each quantity alone, from its direct measurements.
struct Separate {
    /// x, y, speed.
    quantities: [Fusion; 3],
    /// The last value of each sensor of speed.
    speeds: [Option<f64>; 3],
}

impl Separate {
    fn new(rule: &Rule) -> anyhow::Result<Separate> {
        let quantity = |rule: Rule, sensors: &[usize]| {
            let variances: Vec<f64> =
                sensors.iter().map(|sensor| DEVICES[*sensor].deviation.powi(2)).collect();
            let direct = Direct::new(rule, &variances, 0.1, (0.0, 100.0))?;
            anyhow::Ok(Fusion::new(Box::new(direct), Time(0), sensors.len(), 0, OPTIONS)?)
        };
        // One fix cannot be outvoted: interval fusion returns the fix itself.
        let of_fixes = match rule {
            Rule::Average(_) | Rule::Median(_) => rule.clone(),
            _ => Rule::Confidence,
        };
        let [x, y] = FIXES.map(|sensor| quantity(of_fixes.clone(), &[sensor]));
        Ok(Separate { quantities: [x?, y?, quantity(rule.clone(), &SPEEDS)?], speeds: [None; 3] })
    }
}

impl Estimator for Separate {
    fn take(&mut self, arrival: &Arrival) {
        let Arrival { sensor, value, at, .. } = *arrival;
        if FIXES.contains(&sensor) {
            self.quantities[sensor].measure(at, Measurement { sensor: 0, value, variance: None, bound: 0.0 });
        }
        if let Some(place) = SPEEDS.iter().position(|own| *own == sensor) {
            self.speeds[place] = Some(value);
        }
    }

    /// The latest speeds are combined on request, because they come at different rates.
    fn estimate(&mut self, at: Time) -> [f64; 3] {
        let [.., speed] = &mut self.quantities;
        for (sensor, value) in self.speeds.iter().enumerate() {
            let Some(value) = *value else { continue };
            speed.measure(at, Measurement { sensor, value, variance: None, bound: 0.0 });
        }
        let value = |fusion: &mut Fusion| fusion.estimate(at).map_or(f64::NAN, |estimate| estimate.mean[0]);
        self.quantities.each_mut().map(value)
    }
}

/// Estimates all quantities in one filter.
struct Joint {
    fusion: Fusion,
}

impl Estimator for Joint {
    fn take(&mut self, arrival: &Arrival) {
        let Arrival { sensor, value, at, .. } = *arrival;
        self.fusion.measure(at, Measurement { sensor, value, variance: None, bound: 0.0 });
    }

    fn estimate(&mut self, at: Time) -> [f64; 3] {
        let Some(estimate) = self.fusion.estimate(at) else { return [f64::NAN; 3] };
        [estimate.mean[0], estimate.mean[1], estimate.mean[3]]
    }
}

const OPTIONS: Options =
    Options { horizon: Span(500_000_000), moments: 64, gate: None, unknown_after: Span(60_000_000_000) };

/// The filter of a method.
fn joint(method: Method, particles: Particles) -> anyhow::Result<Fusion> {
    let (start, p) = ([0.0, 0.0, 0.0, 1.0, 0.0], 0.1 * Matrix::identity(5, 5));
    let kalman = |loss| anyhow::Ok(Kalman::new(model()?, &start, &p, loss)?);
    let filter: Box<dyn method::Method> = match method {
        Method::Huber => Box::new(kalman(Loss::Huber(1.345))?),
        Method::Student => Box::new(kalman(Loss::Student(4.0))?),
        Method::Unscented => Box::new(Unscented::new(model()?, &start, &p, Points::default())?),
        Method::Particles => Box::new(Particle::new(model()?, &start, &p, particles)?),
        _ => Box::new(kalman(Loss::Square)?),
    };
    let gate = (method == Method::Gated).then(|| Gate::new(0.9999, 20));
    Ok(Fusion::new(filter, Time(0), DEVICES.len(), 0, Options { gate, ..OPTIONS })?)
}

/// The model of position, heading, speed and turn rate; speed and turn rate are random walks.
fn model() -> anyhow::Result<Formulas> {
    let mut words = Vocabulary::default();
    for state in ["x", "y", "h", "v", "w"] {
        words.add_number(state);
    }
    let formula = |text: &str| words.formula("the rover", text);
    let transition = ["x + v*dt*cos(h + w*dt/2)", "y + v*dt*sin(h + w*dt/2)", "h + w*dt", "v", "w"];
    let diffusion = ["1e-3*dt", "1e-3*dt", "1e-4*dt", "0.1*dt", "0.01*dt"];
    let places = (0..5).flat_map(|i| (i..5).map(move |j| (i, j)));
    let noise = places.map(|(i, j)| formula(if i == j { diffusion[i] } else { "0" }));
    let says = ["x", "y", "v", "v", "v", "w", "h"];
    let sensors = says.iter().zip(&DEVICES).enumerate().map(|(place, (says, device))| {
        let turn = (place == COMPASS).then_some(TAU);
        let variance = formula(&format!("{:e}", device.deviation.powi(2)))?;
        anyhow::Ok(Sensor { name: device.name.into(), formula: formula(says)?, variance, turn })
    });
    Ok(Formulas::new(Draft {
        transition: transition.iter().map(|text| formula(text)).collect::<Result<_, _>>()?,
        controls: 0,
        noise: noise.collect::<Result<_, _>>()?,
        sensors: sensors.collect::<Result<_, _>>()?,
    })?)
}
