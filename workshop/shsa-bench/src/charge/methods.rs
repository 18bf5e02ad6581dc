//! The methods that estimate the charge, and the scenarios of their inputs.

use super::cell::{Row, half};
use super::circuit::{Circuit, PAIR_S, through_pair};
use shsa_core::time::{Span, Time};
use shsa_estimate::formulas::{Draft, Formulas, Sensor, Vocabulary};
use shsa_estimate::fusion::{Fusion, Options};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::{self, Measurement};
use shsa_estimate::unscented::{Points, Unscented};

/// A method that estimates the charge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    Count,
    Inverse,
    Extended,
    Unscented,
}

impl Method {
    pub(super) const ALL: [Method; 4] = [Method::Count, Method::Inverse, Method::Extended, Method::Unscented];

    pub(super) fn name(self) -> &'static str {
        match self {
            Method::Count => "count",
            Method::Inverse => "inverse curve",
            Method::Extended => "EKF",
            Method::Unscented => "UKF",
        }
    }
}

/// A scenario of the inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scenario {
    Well,
    UnknownStart,
    BiasedCurrent,
    CurrentLost,
    VoltageLost,
}

impl Scenario {
    pub(super) const ALL: [Scenario; 5] = [
        Scenario::Well,
        Scenario::UnknownStart,
        Scenario::BiasedCurrent,
        Scenario::CurrentLost,
        Scenario::VoltageLost,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Scenario::Well => "all is well",
            Scenario::UnknownStart => "begins at half, wrongly",
            Scenario::BiasedCurrent => "current 0.1 A too high",
            Scenario::CurrentLost => "current lost half-way",
            Scenario::VoltageLost => "voltage lost half-way",
        }
    }

    /// Whether a sensor fails.
    pub(super) fn fails(self) -> bool {
        matches!(self, Scenario::CurrentLost | Scenario::VoltageLost)
    }

    /// The initial charge that a method is given: value and standard deviation.
    fn beginning(self, circuit: &Circuit) -> (f64, f64) {
        match self {
            Scenario::UnknownStart => (0.5 * circuit.capacity_ah, 0.3 * circuit.capacity_ah),
            _ => (0.0, 0.03 * circuit.capacity_ah),
        }
    }

    /// The measured current and voltage in a scenario.
    fn measured(self, row: &Row, is_second_half: bool) -> [Option<f64>; 2] {
        let bias = if self == Scenario::BiasedCurrent { 0.1 } else { 0.0 };
        let has_current = !(is_second_half && self == Scenario::CurrentLost);
        let has_voltage = !(is_second_half && self == Scenario::VoltageLost);
        [has_current.then_some(row.current_a + bias), has_voltage.then_some(row.voltage_v)]
    }
}

/// The charge at each row by a method, and the resistance that it has learned.
///
/// # Errors
/// A filter cannot be made.
pub(super) fn run_method(
    method: Method,
    scenario: Scenario,
    circuit: &Circuit,
    rows: &[Row],
) -> anyhow::Result<(Vec<f64>, Option<f64>)> {
    let half = half(rows);
    let inputs =
        rows.iter().enumerate().map(|(place, row)| (row.at_s, scenario.measured(row, place >= half)));
    let inputs: Vec<(f64, [Option<f64>; 2])> = inputs.collect();
    match method {
        Method::Count => Ok((count(scenario.beginning(circuit).0, &inputs), None)),
        Method::Inverse => Ok((invert(circuit, &inputs), None)),
        Method::Extended | Method::Unscented => fuse(method, scenario, circuit, &inputs),
    }
}

/// The current integrated, by trapezia.
fn count(beginning: f64, inputs: &[(f64, [Option<f64>; 2])]) -> Vec<f64> {
    let (mut charge, mut before) = (beginning, None);
    let mut add = |(at, [current, _]): &(f64, [Option<f64>; 2])| {
        let Some(current) = current else { return f64::NAN };
        if let Some((last_at, last)) = before.replace((*at, *current)) {
            charge += 0.5 * (last + current) * (at - last_at) / 3600.0;
        }
        charge
    };
    inputs.iter().map(&mut add).collect()
}

/// The inverse of the curve at the measured voltage minus the voltage over resistance and pair.
fn invert(circuit: &Circuit, inputs: &[(f64, [Option<f64>; 2])]) -> Vec<f64> {
    let (mut pair, mut before) = (0.0, 0.0);
    let mut add = |(at, [current, voltage]): &(f64, [Option<f64>; 2])| {
        let (Some(current), Some(voltage)) = (current, voltage) else { return f64::NAN };
        pair = through_pair(pair, *current, at - before);
        before = *at;
        circuit.charge_at(voltage - circuit.resistance * current - circuit.pair * pair)
    };
    inputs.iter().map(&mut add).collect()
}

/// The sensors in declared order.
const CURRENT: usize = 0;
const VOLTAGE: usize = 1;

/// The error of curve and circuit, and its correlation time: rows closer together share an error, so each row is weighted by its
/// time.
const CIRCUIT_V: f64 = 0.04;
const CIRCUIT_S: f64 = 60.0;

/// Charge in Ah, current through the pair in A, current in A, resistance in ohm.
///
/// The current may change by 3 A in a second, at any time since the last row, so half of a change counts for the charge.
fn model(circuit: &Circuit) -> anyhow::Result<Formulas> {
    let mut words = Vocabulary::default();
    ["q", "p", "i", "r"].into_iter().for_each(|name| {
        words.add_number(name);
    });
    let formula = |text: &str| words.formula("the cell", text);
    // Numbers of the model have no units here, so time has none either.
    let dt = "(dt/(1 s))";
    let kept = format!("exp(-{dt}/{PAIR_S})");
    let transition =
        [format!("q + i*{dt}/3600"), format!("p*{kept} + i*(1 - {kept})"), "i".into(), "r".into()];
    let (charge, pair) = (format!("({dt}/7200)"), format!("(0.5*(1 - {kept}))"));
    let noise = [
        format!("10*{dt}*{charge}^2 + 1e-8*{dt}"),
        format!("10*{dt}*{charge}*{pair}"),
        format!("10*{dt}*{charge}"),
        "0".to_owned(),
        format!("10*{dt}*{pair}^2"),
        format!("10*{dt}*{pair}"),
        "0".to_owned(),
        format!("10*{dt}"),
        "0".to_owned(),
        format!("1e-16*{dt}"),
    ];
    let sensor = |name: &str, text: &str, variance: &str| {
        anyhow::Ok(Sensor {
            name: name.into(),
            formula: formula(text)?,
            variance: formula(variance)?,
            turn: None,
        })
    };
    let voltage = format!("{} + r*i + {:e}*p", circuit.curve("q"), circuit.pair);
    Ok(Formulas::new(Draft {
        transition: transition.iter().map(|text| formula(text)).collect::<Result<_, _>>()?,
        controls: 0,
        noise: noise.iter().map(|text| formula(text)).collect::<Result<_, _>>()?,
        sensors: vec![sensor("current", "i", "0.05^2")?, sensor("voltage", &voltage, "0.04^2")?],
    })?)
}

fn fuse(
    method: Method,
    scenario: Scenario,
    circuit: &Circuit,
    inputs: &[(f64, [Option<f64>; 2])],
) -> anyhow::Result<(Vec<f64>, Option<f64>)> {
    let (charge, deviation) = scenario.beginning(circuit);
    // The initial resistance is 20 % too high, with a standard deviation of 20 %: as a data sheet may be.
    let start = [charge, 0.0, 0.0, 1.2 * circuit.resistance];
    let variances = [deviation.powi(2), 1.0, 1.0, (0.2 * circuit.resistance).powi(2)];
    let spread = Matrix::from_fn(4, 4, |i, j| if i == j { variances[i] } else { 0.0 });
    let system = model(circuit)?;
    let filter: Box<dyn method::Method> = match method {
        Method::Unscented => Box::new(Unscented::new(system, &start, &spread, Points::default())?),
        _ => Box::new(Kalman::new(system, &start, &spread, Loss::Square)?),
    };
    let time = |at_s: f64| Time((1e9 * at_s) as i64);
    let options = Options { horizon: Span(0), moments: 2, gate: None, unknown_after: Span(300_000_000_000) };
    let mut fusion = Fusion::new(filter, time(0.0), 2, 0, options)?;
    let mut before = 0.0;
    let (mut charges, mut resistance) = (Vec::with_capacity(inputs.len()), None);
    for (at_s, [current, voltage]) in inputs {
        let of_voltage = CIRCUIT_V.powi(2) * CIRCUIT_S / (at_s - before).clamp(0.4, CIRCUIT_S);
        before = *at_s;
        for (sensor, value, variance) in [(CURRENT, current, None), (VOLTAGE, voltage, Some(of_voltage))] {
            let measurement = value.map(|value| Measurement { sensor, value, variance, bound: 0.0 });
            measurement.map(|measurement| fusion.measure(time(*at_s), measurement));
        }
        let estimate = fusion.estimate(time(*at_s));
        charges.push(estimate.map_or(f64::NAN, |it| it.mean[0]));
        resistance = estimate.map(|it| it.mean[3]).or(resistance);
    }
    Ok((charges, resistance))
}
