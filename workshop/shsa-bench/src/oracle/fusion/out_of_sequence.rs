//! Measurements that arrive late, twice or too late. The reference is a filter that gets them in the order of time.

use super::Wanted;
use super::model::Model;
use crate::oracle::Compared;
use serde::Deserialize;
use shsa_core::time::{Span, Time};
use shsa_estimate::fusion::{Fusion, Options, Verdict};
use shsa_estimate::method::Measurement;

#[derive(Deserialize)]
pub(super) struct OutOfSequence {
    label: String,
    #[serde(flatten)]
    model: Model,
    /// `null`: unlimited.
    horizon_s: Option<f64>,
    tolerance: f64,
    arrivals: Vec<Arrival>,
}

#[derive(Deserialize)]
struct Arrival {
    time_ns: i64,
    sensor: String,
    value: f64,
    verdict: String,
    at_ns: Option<i64>,
    #[serde(default)]
    x: Vec<f64>,
    #[serde(rename = "P", default)]
    p: Vec<f64>,
}

/// Compares after each arrival; one answer each.
pub(super) fn compare(case: &OutOfSequence, compared: &mut Compared) -> anyhow::Result<()> {
    let options = Options {
        horizon: case.horizon_s.map_or(Span::MAX, Span::from_seconds),
        moments: case.arrivals.len(),
        gate: None,
        unknown_after: Span::MAX,
    };
    let sensors = case.model.measurements.len();
    let mut fusion = Fusion::new(Box::new(case.model.extended()?), Time(0), sensors, 0, options)?;
    for (place, arrival) in case.arrivals.iter().enumerate() {
        let label = format!("{} arrival {place}", case.label);
        let sensor = case.model.sensor(&arrival.sensor)?;
        let measurement = Measurement { sensor, value: arrival.value, variance: None, bound: 0.0 };
        let verdict = match fusion.measure(Time(arrival.time_ns), measurement) {
            Verdict::Used => "used",
            Verdict::Duplicate => "duplicate",
            Verdict::TooLate => "too_late",
            Verdict::Rejected => "rejected",
            Verdict::Masked => "masked",
        };
        let mut differences = Vec::new();
        if verdict != arrival.verdict {
            differences.push(format!("{label}: it is {verdict}, not {}", arrival.verdict));
        }
        if let Some(at) = arrival.at_ns {
            let (x, p, tolerance) = (&arrival.x, &arrival.p, case.tolerance);
            let wanted = Wanted { x, p, tolerance_x: tolerance, tolerance_p: tolerance };
            match fusion.estimate(Time(at)) {
                Some(estimate) => {
                    differences.extend(wanted.differences_of(&label, estimate.mean, estimate.spread));
                }
                None => differences.push(format!("{label}: nothing is known")),
            }
        }
        compared.answer(differences);
    }
    Ok(())
}
