//! A rover whose true motion is known, and its sensors: they have different rates, noise, delays and faults.

use shsa_core::time::{Span, Time};
use shsa_estimate::random::Random;
use std::f64::consts::TAU;

/// The duration of a drive.
pub(super) const SECONDS: f64 = 120.0;

/// The number of simulation steps in a second.
const STEPS: u32 = 200;

/// The rover's position, heading, speed and turn rate; SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Truth {
    pub(super) at: Time,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) heading: f64,
    pub(super) speed: f64,
    pub(super) turn: f64,
}

/// A sensor: its rate in steps of the simulation, its noise, and the delay of its values.
pub(super) struct Device {
    pub(super) name: &'static str,
    every: u32,
    pub(super) deviation: f64,
    late: Span,
    says: fn(&Truth) -> f64,
}

/// Two coordinates of position fixes, three speeds, turn rate and heading.
pub(super) const DEVICES: [Device; 7] = [
    device("fix x", 200, 0.5, 200, |it| it.x),
    device("fix y", 200, 0.5, 200, |it| it.y),
    device("wheel 1", 10, 0.05, 0, |it| it.speed),
    device("wheel 2", 20, 0.05, 20, |it| it.speed),
    device("GNSS speed", 40, 0.1, 100, |it| it.speed),
    device("gyroscope", 4, 0.02, 0, |it| it.turn),
    device("compass", 20, 0.05, 20, |it| it.heading),
];

const fn device(
    name: &'static str,
    every: u32,
    deviation: f64,
    late_ms: i64,
    says: fn(&Truth) -> f64,
) -> Device {
    Device { name, every, deviation, late: Span(late_ms * 1_000_000), says }
}

/// The fault of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scenario {
    Healthy,
    Outliers,
    WheelSlips,
    FixesLost,
}

impl Scenario {
    pub(super) const ALL: [Scenario; 4] =
        [Scenario::Healthy, Scenario::Outliers, Scenario::WheelSlips, Scenario::FixesLost];

    pub(super) fn name(self) -> &'static str {
        match self {
            Scenario::Healthy => "all is well",
            Scenario::Outliers => "outliers",
            Scenario::WheelSlips => "wheel 1 slips",
            Scenario::FixesLost => "no fixes for 30 s",
        }
    }

    /// The value of a sensor in this scenario; `None` when the sensor is silent.
    fn spoilt(self, device: &Device, at_s: f64, value: f64, random: &mut Random) -> Option<f64> {
        let is_between = (40.0..70.0).contains(&at_s);
        match self {
            Scenario::Outliers if random.share() < 0.05 => {
                let sign = if random.share() < 0.5 { -1.0 } else { 1.0 };
                Some(value + sign * 10.0 * device.deviation)
            }
            Scenario::WheelSlips if is_between && device.name == "wheel 1" => Some(value + 1.0),
            Scenario::FixesLost if is_between && device.name.starts_with("fix") => None,
            _ => Some(value),
        }
    }
}

/// A value with the time of its arrival.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Arrival {
    pub(super) received: Time,
    pub(super) at: Time,
    pub(super) sensor: usize,
    pub(super) value: f64,
}

/// The truth twenty times a second, and the values in the order of their arrival.
pub(super) fn drive(scenario: Scenario, seed: u64) -> (Vec<Truth>, Vec<Arrival>) {
    let (mut random, mut truth) = (Random::new(seed), Truth::default());
    let (mut truths, mut arrivals) = (Vec::new(), Vec::new());
    // Every run takes another way.
    let phases = [TAU * random.share(), TAU * random.share()];
    for step in 1..=(SECONDS * f64::from(STEPS)) as u32 {
        let at_s = f64::from(step) / f64::from(STEPS);
        go_on(&mut truth, at_s, phases);
        if step.is_multiple_of(STEPS / 20) {
            truths.push(truth);
        }
        for (sensor, device) in DEVICES.iter().enumerate() {
            if !step.is_multiple_of(device.every) {
                continue;
            }
            let value = (device.says)(&truth) + device.deviation * random.normal();
            if let Some(value) = scenario.spoilt(device, at_s, value, &mut random) {
                arrivals.push(Arrival { received: truth.at + device.late, at: truth.at, sensor, value });
            }
        }
    }
    arrivals.sort_by_key(|arrival| arrival.received);
    (truths, arrivals)
}

/// One step of a smooth drive with changing speed and direction.
fn go_on(truth: &mut Truth, at_s: f64, [one, other]: [f64; 2]) {
    let dt = 1.0 / f64::from(STEPS);
    truth.at = Time((1e9 * at_s) as i64);
    truth.speed = 1.0 + 0.5 * (0.3 * at_s + one).sin() + 0.2 * (0.9 * at_s + other).sin();
    truth.turn = 0.25 * (0.15 * at_s + other).sin();
    truth.heading += truth.turn * dt;
    truth.x += truth.speed * truth.heading.cos() * dt;
    truth.y += truth.speed * truth.heading.sin() * dt;
}
