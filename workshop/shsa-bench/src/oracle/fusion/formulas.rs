//! Models of formulas: extended and unscented filters, gating, masking.

use super::model::{Model, SigmaPoints};
use super::{Wanted, number};
use crate::oracle::Compared;
use serde::Deserialize;
use serde_json::{Map, Value};
use shsa_core::time::Time;
use shsa_estimate::method::{Innovation, Method};

/// A recorded estimate.
#[derive(Deserialize)]
struct Estimate {
    x: Vec<f64>,
    #[serde(rename = "P")]
    p: Vec<f64>,
}

impl Estimate {
    fn wanted(&self, tolerance: f64) -> Wanted<'_> {
        Wanted { x: &self.x, p: &self.p, tolerance_x: tolerance, tolerance_p: tolerance }
    }
}

#[derive(Deserialize)]
struct OfFilters<T> {
    ekf: T,
    ukf: T,
    ukf_wide: T,
}

#[derive(Deserialize)]
struct Both {
    ukf: SigmaPoints,
    ukf_wide: SigmaPoints,
}

#[derive(Deserialize)]
pub(super) struct Nonlinear {
    label: String,
    #[serde(flatten)]
    model: Model,
    sigma_points: Both,
    tolerance: OfFilters<f64>,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Step {
    time_ns: i64,
    z: Map<String, Value>,
    #[serde(default)]
    u: Vec<f64>,
    #[serde(flatten)]
    estimates: OfFilters<Estimate>,
}

/// The seconds since the last step; `last` becomes the present one.
fn elapsed(last: &mut Time, time_ns: i64) -> f64 {
    let at = Time(time_ns);
    (at - std::mem::replace(last, at)).seconds()
}

/// All three filters, step by step.
pub(super) fn compare_nonlinear(case: &Nonlinear, compared: &mut Compared) -> anyhow::Result<()> {
    let (mut ekf, model, points) = (case.model.extended()?, &case.model, &case.sigma_points);
    let (mut ukf, mut wide) = (model.unscented(points.ukf.into())?, model.unscented(points.ukf_wide.into())?);
    let mut last = Time(0);
    for (place, step) in case.steps.iter().enumerate() {
        let (dt, measurements) = (elapsed(&mut last, step.time_ns), model.measurements(&step.z)?);
        let filters: [(&str, &mut dyn Method, &Estimate, f64); 3] = [
            ("ekf", &mut ekf, &step.estimates.ekf, case.tolerance.ekf),
            ("ukf", &mut ukf, &step.estimates.ukf, case.tolerance.ukf),
            ("ukf_wide", &mut wide, &step.estimates.ukf_wide, case.tolerance.ukf_wide),
        ];
        for (name, filter, wanted, tolerance) in filters {
            filter.predict(dt, &step.u);
            filter.update(&measurements, &step.u);
            let label = format!("{} {name} step {place}", case.label);
            compared.answer(wanted.wanted(tolerance).differences(&label, filter));
        }
    }
    Ok(())
}

#[derive(Deserialize)]
pub(super) struct Gating {
    label: String,
    #[serde(flatten)]
    model: Model,
    threshold: f64,
    tolerance: f64,
    steps: Vec<GatedStep>,
}

#[derive(Deserialize)]
struct GatedStep {
    time_ns: i64,
    z: Map<String, Value>,
    #[serde(default)]
    u: Vec<f64>,
    nis: Map<String, Value>,
    used: Vec<String>,
    #[serde(flatten)]
    estimate: Estimate,
}

/// A filter that gates each measurement alone: the published method, which can lock itself out.
pub(super) fn compare_gating(case: &Gating, compared: &mut Compared) -> anyhow::Result<()> {
    let mut filter = case.model.extended()?;
    let mut last = Time(0);
    for (place, step) in case.steps.iter().enumerate() {
        let label = format!("{} step {place}", case.label);
        filter.predict(elapsed(&mut last, step.time_ns), &step.u);
        let mut differences = Vec::new();
        for measurement in case.model.measurements(&step.z)? {
            let name = case.model.measurements.keys().nth(measurement.sensor).map_or("", String::as_str);
            let nis =
                filter.innovation(&measurement, &step.u).map(|innovation| innovation.normalized_square());
            let wanted = step.nis.get(name).and_then(Value::as_f64);
            differences.extend(number(&label, &format!("nis of {name}"), nis, wanted, case.tolerance));
            let is_used = nis.is_some_and(|nis| nis <= case.threshold);
            if is_used {
                filter.update(&[measurement], &step.u);
            }
            if is_used != step.used.iter().any(|used| used == name) {
                differences.push(format!("{label}: {name} is used: {is_used}"));
            }
        }
        differences.extend(step.estimate.wanted(case.tolerance).differences(&label, &filter));
        compared.answer(differences);
    }
    Ok(())
}

#[derive(Deserialize)]
pub(super) struct Masking {
    label: String,
    #[serde(flatten)]
    model: Model,
    tolerance: f64,
    steps: Vec<MaskedStep>,
}

#[derive(Deserialize)]
struct MaskedStep {
    time_ns: i64,
    z: Map<String, Value>,
    #[serde(default)]
    u: Vec<f64>,
    masked: Vec<String>,
    witness: Map<String, Value>,
    #[serde(flatten)]
    estimate: Estimate,
}

/// A filter that leaves suspects out of its update, and still gives the innovation of each.
pub(super) fn compare_masking(case: &Masking, compared: &mut Compared) -> anyhow::Result<()> {
    let mut filter = case.model.extended()?;
    let mut last = Time(0);
    for (place, step) in case.steps.iter().enumerate() {
        let label = format!("{} step {place}", case.label);
        filter.predict(elapsed(&mut last, step.time_ns), &step.u);
        let mut masked = Vec::new();
        for name in &step.masked {
            masked.push(case.model.sensor(name)?);
        }
        let all = case.model.measurements(&step.z)?;
        let (hidden, used): (Vec<_>, Vec<_>) = all.into_iter().partition(|it| masked.contains(&it.sensor));
        let mut found: Vec<(usize, Option<Innovation>)> = Vec::new();
        found.extend(used.iter().map(|it| (it.sensor, filter.innovation(it, &step.u))));
        filter.update(&used, &step.u);
        found.extend(hidden.iter().map(|it| (it.sensor, filter.innovation(it, &step.u))));
        let mut differences = step.estimate.wanted(case.tolerance).differences(&label, &filter);
        for (name, wanted) in &step.witness {
            let sensor = case.model.sensor(name)?;
            let innovation =
                found.iter().find(|(known, _)| *known == sensor).and_then(|(_, innovation)| *innovation);
            let numbers = innovation.map(|it| [it.value, it.variance, it.normalized_square()]);
            for (place, what) in ["innovation", "variance", "nis"].into_iter().enumerate() {
                let found = numbers.map(|numbers| numbers[place]);
                let wanted = wanted[place].as_f64();
                differences.extend(number(
                    &label,
                    &format!("{what} of {name}"),
                    found,
                    wanted,
                    case.tolerance,
                ));
            }
        }
        compared.answer(differences);
    }
    Ok(())
}
