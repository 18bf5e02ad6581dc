//! The unit tests and examples of the thesis's package for sensor fusion, with the right numbers.
//!
//! Where the package corrects the covariance without a measurement, the exact `x` and `P` count, not the assertions of its tests.

use super::distributions::{density, sampled, transformed};
use super::matrices::{Matrices, measured};
use super::model::Model;
use super::{Wanted, matrix, number};
use crate::oracle::Compared;
use anyhow::{Context, bail};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use shsa_estimate::average::{Certain, Filling, MovingAverage, Window, by_confidence};
use shsa_estimate::method::Method;
use shsa_estimate::particle::Particles;
use shsa_estimate::unscented::Points;

/// A file of `shsa-fusion-sfpkg-1`.
#[derive(Deserialize)]
pub(crate) struct Recorded {
    unit_tests: Vec<Value>,
    examples: Examples,
}

#[derive(Deserialize)]
struct Examples {
    moving_average: Vec<Windowed>,
    moving_median: Vec<Windowed>,
    constant_signal: Constant,
    rover: Rover,
}

/// The largest difference of the estimates of unit tests.
const TOLERANCE: f64 = 1e-9;

/// Compares all tests and examples.
///
/// # Errors
/// When a test is of an unknown kind, or no valid model.
pub(crate) fn compare(recorded: &Recorded, compared: &mut Compared) -> anyhow::Result<()> {
    for test in &recorded.unit_tests {
        let label = test["label"].as_str().unwrap_or("a test");
        let method = test["method"].as_str().context("a test without a method")?;
        match method {
            "kalman" => {
                let (facts, matrices): (Facts, Matrices) = (typed(test)?, typed(test)?);
                run(label, &facts.steps, &mut matrices.kalman()?, compared);
            }
            "extended_kalman" => run_model(label, test, false, compared)?,
            "unscented_kalman" => run_model(label, test, true, compared)?,
            "particle_sir" => particles(label, test, compared)?,
            "unscented_transform" => each(test, |case| transformed(label, case), compared)?,
            "confidence_weighted_average" => each(test, |case| averaged(label, case), compared)?,
            "density" => each(test, |case| density(label, case), compared)?,
            "sampling" => sampled(label, test, compared)?,
            _ => bail!("{label}: unknown method {method}"),
        }
    }
    let examples = &recorded.examples;
    examples.moving_average.iter().try_for_each(|case| average(case, compared))?;
    examples.moving_median.iter().for_each(|case| median(case, compared));
    constant(&examples.constant_signal, compared)?;
    rover(&examples.rover, compared)
}

pub(super) fn typed<T: DeserializeOwned>(value: &Value) -> anyhow::Result<T> {
    Ok(T::deserialize(value)?)
}

/// One answer for each case of a test.
pub(super) fn each(
    test: &Value,
    differences: impl Fn(&Value) -> anyhow::Result<Vec<String>>,
    compared: &mut Compared,
) -> anyhow::Result<()> {
    let cases = test["cases"].as_array().context("a test without cases")?;
    for case in cases {
        compared.answer(differences(case)?);
    }
    Ok(())
}

#[derive(Deserialize)]
struct Facts {
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Step {
    z: Vec<Option<f64>>,
    #[serde(default)]
    u: Vec<f64>,
    #[serde(default)]
    x: Vec<f64>,
    #[serde(rename = "P", default)]
    p: Vec<f64>,
}

fn run(label: &str, steps: &[Step], filter: &mut dyn Method, compared: &mut Compared) {
    for (place, step) in steps.iter().enumerate() {
        filter.predict(1.0, &step.u);
        filter.update(&measured(&step.z), &step.u);
        let wanted = Wanted { x: &step.x, p: &step.p, tolerance_x: TOLERANCE, tolerance_p: TOLERANCE };
        compared.answer(wanted.differences(&format!("{label} step {place}"), filter));
    }
}

/// `a = f; b = g` by name.
fn assignments(text: &Value) -> anyhow::Result<Vec<(String, String)>> {
    let text = text.as_str().context("no formulas")?;
    let pair =
        |it: &str| Some((it.split_once('=')?.0.trim().to_owned(), it.split_once('=')?.1.trim().to_owned()));
    text.split(';').map(|it| pair(it).with_context(|| format!("no assignment: {it}"))).collect()
}

/// A test's formulas as a model; its noise has no unit.
fn model(test: &Value) -> anyhow::Result<Model> {
    let transition = assignments(&test["transition"])?;
    let measurements = assignments(&test["measurement"])?;
    let variances: Vec<Vec<f64>> = typed(&test["R"])?;
    let sensors = measurements.iter().enumerate().map(|(place, (name, formula))| {
        (name.clone(), json!({"formula": formula, "variance": variances[place][place]}))
    });
    let noise: Vec<Vec<f64>> = typed(&test["Q"])?;
    let x0: Vec<f64> = typed(&test["x0"])?;
    let zero = vec![vec![0.0; x0.len()]; x0.len()];
    Ok(Model {
        states: transition.iter().map(|(name, _)| name.clone()).collect(),
        inputs: vec!["u0".to_owned()],
        constants: Map::new(),
        transition: transition.into_iter().map(|(name, formula)| (name, Value::String(formula))).collect(),
        process_noise: noise.iter().map(|row| row.iter().map(f64::to_string).collect()).collect(),
        measurements: sensors.collect(),
        p0: test.get("P0").map_or(Ok(zero), typed)?,
        x0,
    })
}

/// The points of the package for n states.
pub(super) fn points(n: usize) -> Points {
    Points { alpha: 1.0, beta: 2.0, kappa: 3.0 - n as f64 }
}

fn run_model(label: &str, test: &Value, is_unscented: bool, compared: &mut Compared) -> anyhow::Result<()> {
    let (facts, model): (Facts, Model) = (typed(test)?, model(test)?);
    if is_unscented {
        run(label, &facts.steps, &mut model.unscented(points(model.states.len()))?, compared);
    } else {
        run(label, &facts.steps, &mut model.extended()?, compared);
    }
    Ok(())
}

/// The test's own loose bounds, with several seeds.
fn particles(label: &str, test: &Value, compared: &mut Compared) -> anyhow::Result<()> {
    let (model, facts): (Model, Facts) = (model(test)?, typed(test)?);
    let count = test["particles"].as_u64().context("no number of particles")? as usize;
    for seed in 1..=5 {
        let options = Particles { count, seed, resample_below: 0.8 };
        let spread = matrix(&model.p0);
        let mut filter =
            shsa_estimate::particle::Particle::new(model.system()?, &model.x0, &spread, options)?;
        let (mut differences, mut last) = (Vec::new(), 0.0);
        for (place, step) in facts.steps.iter().enumerate() {
            filter.predict(1.0, &step.u);
            filter.update(&measured(&step.z), &step.u);
            let wanted = &test["steps"][place]["test_expects"];
            let x: Vec<f64> = typed(&wanted["x"])?;
            for (i, x) in x.iter().enumerate() {
                let tolerance =
                    wanted["tolerance"].as_f64().or(wanted["tolerance"][i].as_f64()).unwrap_or(0.0);
                if (filter.mean()[i] - x).abs() > tolerance {
                    differences.push(format!("{label} step {place}: state {i} is {}", filter.mean()[i]));
                }
            }
            let variance = filter.spread()[(0, 0)];
            let is_right = match wanted["variance"].as_str() {
                Some("greater than in the step before") => variance > last,
                Some(_) => variance > 0.0 && variance < 0.5,
                None => true,
            };
            differences
                .extend((!is_right).then(|| format!("{label} step {place}: the variance is {variance}")));
            last = variance;
        }
        compared.answer(differences);
    }
    Ok(())
}

fn averaged(label: &str, case: &Value) -> anyhow::Result<Vec<String>> {
    let values: Vec<Option<f64>> = typed(&case["values"])?;
    let variances: Vec<f64> = typed(&case["variances"])?;
    let pairs: Vec<_> = values.into_iter().zip(variances).collect();
    let is_left_out = case["ignore_zero_variance"] == Value::Bool(true);
    let found = by_confidence(&pairs, if is_left_out { Certain::LeftOut } else { Certain::Refused }).ok();
    // A case without a value expects an error.
    let tolerance = case["tolerance"].as_f64().unwrap_or(0.0).min(1e-9);
    let value = number(label, "the value", found.map(|it| it.value), case["value"].as_f64(), tolerance);
    let variance =
        number(label, "the variance", found.map(|it| it.variance), case["variance"].as_f64(), tolerance);
    Ok(value.into_iter().chain(variance).collect())
}

#[derive(Deserialize)]
struct Windowed {
    window: usize,
    weights_newest_first: Option<Vec<f64>>,
    values: Vec<f64>,
    output: Vec<f64>,
}

fn average(case: &Windowed, compared: &mut Compared) -> anyhow::Result<()> {
    let weights = case.weights_newest_first.clone().unwrap_or(vec![1.0; case.window]);
    let mut average = MovingAverage::new(&weights, Filling::Echo)?;
    for (value, wanted) in case.values.iter().zip(&case.output) {
        let difference = number("moving average", "it", Some(average.push(*value)), Some(*wanted), 1e-12);
        compared.answer(difference.into_iter().collect());
    }
    Ok(())
}

/// The package returns the upper one of the middle two. Until the window is full it returns -1, which is a defect of the package.
fn median(case: &Windowed, compared: &mut Compared) {
    let mut window = Window::new(case.window);
    for (value, wanted) in case.values.iter().zip(&case.output) {
        window.push(*value);
        if window.is_full() {
            let upper = window.middle().map(|(_, upper)| upper);
            compared.answer(number("moving median", "it", upper, Some(*wanted), 1e-12).into_iter().collect());
        }
    }
}

#[derive(Deserialize)]
struct Constant {
    #[serde(rename = "Q")]
    q: f64,
    #[serde(rename = "R")]
    r: f64,
    x0: f64,
    #[serde(rename = "P0")]
    p0: f64,
    steps: Vec<Step>,
}

fn constant(case: &Constant, compared: &mut Compared) -> anyhow::Result<()> {
    let test = json!({"states": ["x"], "transition": "x = x", "measurement": "z = x",
        "Q": [[case.q]], "R": [[case.r]], "x0": [case.x0], "P0": [[case.p0]]});
    let model = model(&test)?;
    run("constant signal, ekf", &case.steps, &mut model.extended()?, compared);
    run("constant signal, ukf", &case.steps, &mut model.unscented(points(1))?, compared);
    Ok(())
}

#[derive(Deserialize)]
struct Rover {
    period_s: f64,
    measurements: Map<String, Value>,
    variances: Vec<f64>,
    models: Map<String, Value>,
    inputs: Vec<Step>,
    tolerance: f64,
    results: Map<String, Value>,
}

fn rover(rover: &Rover, compared: &mut Compared) -> anyhow::Result<()> {
    for (name, results) in &rover.results {
        let model = rover.models.iter().find(|(names, _)| names.split(", ").any(|known| known == name));
        // An example that the package computes itself has no model of its own.
        let Some((_, facts)) = model else { continue };
        let states: Vec<String> = typed(&facts["states"])?;
        let n = states.len();
        let diagonal: Vec<f64> = typed(&facts["process_noise_diagonal"])?;
        let entry = |i: usize, j: usize| if i == j { diagonal[i].to_string() } else { "0".to_owned() };
        let sensors = rover.measurements.iter().zip(&rover.variances);
        let model = Model {
            inputs: vec!["u0".to_owned(), "u1".to_owned()],
            constants: Map::new(),
            transition: typed(&facts["transition"])?,
            process_noise: (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect(),
            measurements: sensors
                .map(|((name, formula), variance)| {
                    (name.clone(), json!({"formula": formula, "variance": variance}))
                })
                .collect(),
            x0: vec![0.0; n],
            p0: vec![vec![0.0; n]; n],
            states,
        };
        let (mut extended, mut unscented) = (model.extended()?, model.unscented(points(n))?);
        let filter: &mut dyn Method = if name.starts_with("ukf") { &mut unscented } else { &mut extended };
        let results: Vec<Step> = results
            .as_array()
            .context("no results")?
            .iter()
            .map(|it| {
                let mut it = it.clone();
                it["z"] = json!([]);
                typed(&it)
            })
            .collect::<anyhow::Result<_>>()?;
        for (place, (input, wanted)) in rover.inputs.iter().zip(&results).enumerate() {
            filter.predict(rover.period_s, &input.u);
            filter.update(&measured(&input.z), &input.u);
            let tolerance = rover.tolerance;
            let wanted =
                Wanted { x: &wanted.x, p: &wanted.p, tolerance_x: tolerance, tolerance_p: tolerance };
            compared.answer(wanted.differences(&format!("{name} step {place}"), filter));
        }
    }
    Ok(())
}
