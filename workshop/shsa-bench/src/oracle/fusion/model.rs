//! A recorded model of formulas, and its conversion to ours.

use anyhow::{Context, bail};
use serde::Deserialize;
use serde_json::{Map, Value};
use shsa_core::expression::{Constant, Formula, Kind, Shape};
use shsa_estimate::formulas::{Draft, Formulas, Sensor, Vocabulary};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::Measurement;
use shsa_estimate::unscented::{Points, Unscented};
use std::f64::consts::TAU;

/// The formulas and the initial state.
#[derive(Clone, Deserialize)]
pub(super) struct Model {
    pub(super) states: Vec<String>,
    #[serde(default)]
    pub(super) inputs: Vec<String>,
    #[serde(default)]
    pub(super) constants: Map<String, Value>,
    pub(super) transition: Map<String, Value>,
    pub(super) process_noise: Vec<Vec<String>>,
    /// By name: formula, variance, whether it is an angle.
    pub(super) measurements: Map<String, Value>,
    pub(super) x0: Vec<f64>,
    #[serde(rename = "P0")]
    pub(super) p0: Vec<Vec<f64>>,
}

/// Parameters of sigma points.
#[derive(Clone, Copy, Deserialize)]
pub(super) struct SigmaPoints {
    pub(super) alpha: f64,
    pub(super) beta: f64,
    pub(super) kappa: f64,
}

impl From<SigmaPoints> for Points {
    fn from(points: SigmaPoints) -> Points {
        Points { alpha: points.alpha, beta: points.beta, kappa: points.kappa }
    }
}

impl Model {
    /// The compiled formulas.
    pub(super) fn system(&self) -> anyhow::Result<Formulas> {
        let mut vocabulary = Vocabulary::default();
        for name in self.states.iter().chain(&self.inputs) {
            vocabulary.add_number(name);
        }
        for (name, value) in &self.constants {
            let constant = Some(Constant::exact(value.as_f64().context("a constant is no number")?));
            vocabulary.add(name, Kind { shape: Shape::Scalar, unit: None, range: None, constant });
        }
        let formula = |text: &Value| -> anyhow::Result<Formula> {
            let text = text.as_str().context("a formula is no text")?;
            Ok(vocabulary.formula("the model", text)?)
        };
        let transition = self.states.iter().map(|state| {
            formula(self.transition.get(state).with_context(|| format!("no transition of {state}"))?)
        });
        let n = self.states.len();
        let upper = (0..n).flat_map(|row| (row..n).map(move |column| (row, column)));
        let noise =
            upper.map(|(row, column)| Ok(vocabulary.formula("the noise", &self.process_noise[row][column])?));
        let sensors = self.measurements.iter().map(|(name, facts)| {
            let variance = facts["variance"].as_f64().context("a variance is no number")?;
            Ok(Sensor {
                name: name.clone(),
                formula: formula(&facts["formula"])?,
                variance: Formula::constant(Constant::exact(variance)),
                turn: (facts["angle"] == Value::Bool(true)).then_some(TAU),
            })
        });
        Ok(Formulas::new(Draft {
            transition: transition.collect::<anyhow::Result<_>>()?,
            controls: self.inputs.len(),
            noise: noise.collect::<anyhow::Result<_>>()?,
            sensors: sensors.collect::<anyhow::Result<_>>()?,
        })?)
    }

    /// The initial covariance.
    fn spread(&self) -> Matrix {
        super::matrix(&self.p0)
    }

    /// An extended Kalman filter of this model.
    pub(super) fn extended(&self) -> anyhow::Result<Kalman<Formulas>> {
        Ok(Kalman::new(self.system()?, &self.x0, &self.spread(), Loss::Square)?)
    }

    /// An unscented Kalman filter of this model.
    pub(super) fn unscented(&self, points: Points) -> anyhow::Result<Unscented<Formulas>> {
        Ok(Unscented::new(self.system()?, &self.x0, &self.spread(), points)?)
    }

    /// The index of the sensor with this name.
    pub(super) fn sensor(&self, name: &str) -> anyhow::Result<usize> {
        self.measurements.keys().position(|known| known == name).with_context(|| format!("no sensor {name}"))
    }

    /// The measurements of a moment, in declared order.
    pub(super) fn measurements(&self, z: &Map<String, Value>) -> anyhow::Result<Vec<Measurement>> {
        if let Some(name) = z.keys().find(|name| !self.measurements.contains_key(*name)) {
            bail!("no sensor {name}");
        }
        let present = self.measurements.keys().enumerate().filter_map(|(sensor, name)| {
            let value = z.get(name)?.as_f64()?;
            Some(Measurement { sensor, value, variance: None, bound: 0.0 })
        });
        Ok(present.collect())
    }
}
