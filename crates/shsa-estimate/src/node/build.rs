//! Builds a method from a checked fusion of a model.

use super::each::{Each, Sensor};
use crate::Error;
use crate::average::{Filling, MovingAverage, Window};
use crate::bounded::Bounded;
use crate::continuous::Continuous;
use crate::direct::{Faulty, Rule};
use crate::formulas::{self, Draft};
use crate::kalman::{Kalman, Loss};
use crate::matrix::Matrix;
use crate::method::Method;
use crate::particle::{Particle, Particles};
use crate::system::System;
use crate::unscented::{Points, Unscented};
use shsa_core::expression::{Constant, Formula};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Fusion, FusionInput, FusionMethod, KnowledgeBase, Signal};

/// Huber's limit, which loses 5 % on normal noise.
const HUBER: f64 = 1.345;
/// Student's degrees of freedom: heavy tails with a finite variance.
const STUDENT: f64 = 4.0;
/// The half-width of an interval in fusion of intervals, in standard deviations: 99.7 % of normal noise.
pub(super) const REACH: f64 = 3.0;
/// How long a value counts in direct fusion: for a sensor without a rate, in seconds; for others, in periods.
const FRESH_S: f64 = 1.0;
const FRESH_PERIODS: f64 = 2.5;

/// The standard deviation of an input from its signal's noise or errors; 0 where neither is declared.
pub(super) fn deviation(signal: &Signal) -> f64 {
    let error = signal.value_error;
    signal.noise.unwrap_or((error.hi - error.lo) / 2.0 / libm::sqrt(3.0))
}

/// The inputs of a fusion as sensors of its states.
fn sensors<'f>(knowledge: &KnowledgeBase, fusion: &'f Fusion) -> impl Iterator<Item = formulas::Sensor> {
    fusion.inputs.iter().map(|input: &'f FusionInput| {
        let signal = &knowledge.signals()[input.signal];
        let usual = || number(deviation(signal));
        formulas::Sensor {
            name: signal.name.clone(),
            formula: input.measures.clone(),
            variance: input.noise.clone().unwrap_or_else(usual),
            turn: input.turn,
        }
    })
}

/// The model of a fusion: its inputs as sensors, followed by its outputs if requested.
pub(super) fn system(
    knowledge: &KnowledgeBase,
    fusion: &Fusion,
    with_outputs: bool,
) -> Result<Continuous, Error> {
    let states = || fusion.states.iter().enumerate();
    let noise = states().flat_map(|(row, state)| {
        states()
            .skip(row)
            .map(move |(column, _)| if row == column { state.noise.clone() } else { number(0.0) })
    });
    let outputs = fusion.outputs.iter().filter(|_| with_outputs).map(|output| formulas::Sensor {
        name: knowledge.signals()[output.signal].name.clone(),
        formula: output.value.clone(),
        variance: number(0.0),
        turn: None,
    });
    Continuous::new(Draft {
        transition: fusion.states.iter().map(|state| state.transition.clone()).collect(),
        controls: fusion.controls.len(),
        noise: noise.collect(),
        sensors: sensors(knowledge, fusion).chain(outputs).collect(),
    })
}

fn number(value: f64) -> Formula {
    Formula::constant(Constant { value, bounds: Interval::point(value) })
}

/// The method in its initial state.
pub(super) fn method(knowledge: &KnowledgeBase, fusion: &Fusion) -> Result<Box<dyn Method>, Error> {
    let mean: Vec<f64> = fusion.states.iter().map(|state| state.initial).collect();
    let spread = Matrix::from_fn(mean.len(), mean.len(), |row, column| {
        let deviation = fusion.states.get(row).map_or(0.0, |state| state.spread);
        if row == column { deviation * deviation } else { 0.0 }
    });
    let system = || system(knowledge, fusion, false);
    let kalman = |loss| -> Result<Box<dyn Method>, Error> {
        Ok(Box::new(Kalman::new(system()?, &mean, &spread, loss)?))
    };
    let direct = |rule| each(knowledge, fusion, &rule);
    let settings = &fusion.settings;
    let faulty = Faulty { count: settings.faulty, deviations: REACH };
    match fusion.method {
        FusionMethod::Average => {
            direct(Rule::Average(MovingAverage::new(&vec![1.0; settings.window], Filling::Partial)?))
        }
        FusionMethod::Median => direct(Rule::Median(Window::new(settings.window))),
        FusionMethod::Confidence => direct(Rule::Confidence),
        FusionMethod::Marzullo => direct(Rule::Marzullo(faulty)),
        FusionMethod::Schmid => direct(Rule::Schmid(faulty)),
        FusionMethod::BrooksIyengar => direct(Rule::BrooksIyengar(faulty)),
        FusionMethod::Kalman | FusionMethod::ExtendedKalman => kalman(Loss::Square),
        FusionMethod::Huber => kalman(Loss::Huber(HUBER)),
        FusionMethod::Student => kalman(Loss::Student(STUDENT)),
        FusionMethod::UnscentedKalman => {
            Ok(Box::new(Unscented::new(system()?, &mean, &spread, Points::default())?))
        }
        FusionMethod::Particle => {
            let options =
                Particles { count: settings.particles, seed: settings.seed, ..Particles::default() };
            Ok(Box::new(Particle::new(system()?, &mean, &spread, options)?))
        }
    }
}

/// The method, with what bounds of errors make of its estimate where an input may have one.
pub(super) fn bounded(knowledge: &KnowledgeBase, fusion: &Fusion) -> Result<Box<dyn Method>, Error> {
    let method = method(knowledge, fusion)?;
    let has_bound = |input: &FusionInput| {
        let is_noisy = input.noise.is_some() || knowledge.signals()[input.signal].noise.is_some();
        !is_noisy && !knowledge.is_fused(input.signal)
    };
    if fusion.method.is_direct() || !fusion.inputs.iter().any(has_bound) {
        return Ok(method);
    }
    Ok(Box::new(Bounded::new(method, system(knowledge, fusion, false)?)))
}

/// Direct fusion of each state.
fn each(knowledge: &KnowledgeBase, fusion: &Fusion, rule: &Rule) -> Result<Box<dyn Method>, Error> {
    let mut model = system(knowledge, fusion, false)?;
    let mean: Vec<f64> = fusion.states.iter().map(|state| state.initial).collect();
    let controls = vec![0.0; fusion.controls.len()];
    let mut sensors = Vec::new();
    for (place, input) in fusion.inputs.iter().enumerate() {
        let Some(state) = measured_directly(fusion, input) else {
            return Err(Error::Formula {
                what: knowledge.signals()[input.signal].name.clone(),
                reason: format!(
                    "is no state by itself, and `{}` combines what measures the same",
                    fusion.method.name()
                ),
            });
        };
        let rate = knowledge.signals()[input.signal].rate_hz;
        let variance = model.covariance(place, place, &mean, &controls);
        sensors.push(Sensor {
            state,
            // An input without declared errors counts only with values that bring their own.
            variance: if variance > 0.0 { variance } else { f64::MAX },
            fresh_s: rate.map_or(FRESH_S, |rate| FRESH_PERIODS / rate),
            turn: input.turn,
        });
    }
    let growth =
        fusion.states.iter().map(|state| state.noise.as_constant().map_or(0.0, |it| it.value * it.value));
    let initial: Vec<(f64, f64)> = fusion.states.iter().map(|state| (state.initial, state.spread)).collect();
    Ok(Box::new(Each::new(rule, sensors, growth.collect(), &initial, model)?))
}

/// The state that an input measures directly.
fn measured_directly(fusion: &Fusion, input: &FusionInput) -> Option<usize> {
    use shsa_core::expression::Operation;
    match (input.measures.operation(), input.measures.symbols().as_slice()) {
        (Operation::Symbol(_), [symbol]) => {
            Some(symbol.0 as usize).filter(|place| *place < fusion.states.len())
        }
        _ => None,
    }
}
