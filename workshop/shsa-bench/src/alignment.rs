//! `shsa-bench alignment`: the error of a substitution's input at the time of computation, as its latest value and extrapolated.
//!
//! Recorded signals are thinned out to longer periods. The omitted values are the truth that each access is compared with
//! (temporal alignment, D. Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien 2019, 1.6.3).

use crate::table::{Errors, Table, write_document};
use crate::{Outcome, notice};
use serde_json::json;
use shsa_core::alignment::{History, Sample};
use shsa_core::interval::Interval;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time, Validity};
use shsa_estimate::extrapolation::{Access, Extrapolation};
use shsa_estimate::kinematic::Kinematic;
use shsa_recording::{ReadOptions, Wanted, read};
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `shsa-bench alignment`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench alignment ../shared/data

The folder holds the recordings that the project's models are about, each in a folder of its name; what is absent is left out.")]
pub(crate) struct Arguments {
    /// The folder of recordings.
    folder: PathBuf,
    /// Write alignment.md there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each signal and period instead of a table.
    #[arg(long)]
    json: bool,
}

/// A recorded signal.
struct Signal {
    folder: &'static str,
    source: &'static str,
    name: &'static str,
    unit: &'static str,
}

const fn signal(
    folder: &'static str,
    source: &'static str,
    name: &'static str,
    unit: &'static str,
) -> Signal {
    Signal { folder, source, name, unit }
}

const SIGNALS: [Signal; 9] = [
    signal("comma2k19", "wheel_speed#wheel_1", "car, wheel", "m/s"),
    signal("comma2k19", "gyro#gyro_z", "car, yaw rate", "rad/s"),
    signal("comma2k19", "steering_angle#steering_angle", "car, steering", "deg"),
    signal("husky", "/imu/data#angular_velocity.y", "husky, yaw rate", "rad/s"),
    signal("husky", "/husky_velocity_controller/odom#twist.twist.linear.x", "husky, speed", "m/s"),
    signal("husky", "/husky_velocity_controller/odom#pose.pose.position.x", "husky, position", "m"),
    signal("turtlebot3", "/odom#twist.twist.linear.x", "turtlebot, speed", "m/s"),
    signal("turtlebot3", "/odom#pose.pose.position.x", "turtlebot, position", "m"),
    signal("battery", "discharge_1c#Voltage(V)", "cell, voltage", "V"),
];

/// One sample of this many is kept.
const THINNED: [usize; 4] = [2, 5, 10, 20];

/// How often the time is taken.
const TURNS: usize = 5;

/// The number of accesses, in the order of their columns.
const ACCESSES: usize = 4;

/// An input that is asked for its value between two samples.
enum Asked {
    Extrapolated(Box<Extrapolation>),
    /// As `access: estimate` of a model does.
    Keyed(History),
}

impl Asked {
    fn observe(&mut self, at: Time, value: f64) {
        match self {
            Asked::Extrapolated(input) => input.observe(at, value),
            Asked::Keyed(history) => {
                let sample = Sample { validity: Validity::at(at), value: Interval::point(value) };
                history.push(sample);
            }
        }
    }

    fn at(&mut self, at: Time) -> Option<f64> {
        match self {
            Asked::Extrapolated(input) => input.at(at).map(|aligned| aligned.value),
            Asked::Keyed(history) => history.ahead(Validity::at(at), 0.0).map(Interval::midpoint),
        }
    }
}

/// A signal at a period.
struct Measured {
    signal: &'static Signal,
    period_s: f64,
    order: usize,
    errors: [Errors; ACCESSES],
    /// Nanoseconds for each value asked for, including the observations passed in before.
    costs_ns: [f64; ACCESSES],
}

/// Measures all signals that are there.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut all = Vec::new();
    for signal in &SIGNALS {
        let path = arguments.folder.join(signal.folder);
        let samples = if path.exists() { samples(&path, signal.source)? } else { Vec::new() };
        if samples.len() < 100 {
            notice(&format!(
                "SKIPPED: {}: {} has {} values of it",
                signal.name,
                path.display(),
                samples.len()
            ));
            continue;
        }
        all.extend(THINNED.iter().filter_map(|thinned| measure(signal, &samples, *thinned)));
    }
    for measured in all.iter().filter(|_| arguments.json) {
        writeln!(stdout().lock(), "{}", object(measured))?;
    }
    let table = table(&all);
    if !arguments.json {
        writeln!(stdout().lock(), "{table}")?;
    }
    if let Some(folder) = &arguments.out {
        write_document(folder, "alignment", "Temporal alignment", INTRODUCTION, &[table])?;
    }
    Ok(if all.is_empty() { Outcome::No } else { Outcome::Done })
}

/// The values of a signal, sorted by stamp, one for each stamp.
fn samples(folder: &Path, source: &str) -> anyhow::Result<Vec<(Time, f64)>> {
    let recording = read(&[folder.to_owned()], &[Wanted::new("signal", source)], &ReadOptions::default())?;
    let numbers = recording.samples.iter().filter_map(|sample| match sample.value {
        RawValue::Number(number) if number.is_finite() => Some((sample.time, number)),
        _ => None,
    });
    let mut numbers: Vec<(Time, f64)> = numbers.collect();
    numbers.sort_by_key(|(at, _)| *at);
    numbers.dedup_by_key(|(at, _)| *at);
    Ok(numbers)
}

/// Fits on the first half of the kept samples, judges by the omitted samples of the second half.
fn measure(signal: &'static Signal, samples: &[(Time, f64)], thinned: usize) -> Option<Measured> {
    let (first, second) = samples.split_at(samples.len() / 2);
    let kept: Vec<(Time, f64)> = first.iter().copied().step_by(thinned).collect();
    let model = Kinematic::fit(1..=2, &kept)?;
    let (begin, end) = (second.first()?.0, second.last()?.0);
    let period = Span((end - begin).0 * thinned as i64 / second.len().max(1) as i64);
    let reach = samples.iter().map(|(_, value)| value.abs()).fold(1e-3, f64::max);
    let mut errors = [Errors::default(); ACCESSES];
    let mut costs_ns = [f64::INFINITY; ACCESSES];
    let accesses = [Some(Access::Port), Some(Access::Estimate), Some(Access::Both(Span(period.0 / 2))), None];
    for ((access, errors), cost) in accesses.into_iter().zip(&mut errors).zip(&mut costs_ns) {
        // The fastest turn counts: other work on the machine only adds time.
        for _ in 0..TURNS {
            let mut input = match access {
                Some(access) => Asked::Extrapolated(Box::new(
                    Extrapolation::new(model, reach, access, Span(100 * period.0)).ok()?,
                )),
                None => Asked::Keyed(History::new(History::AHEAD)),
            };
            *errors = Errors::default();
            let (begun, mut asked) = (Instant::now(), 0.0);
            for (place, (at, value)) in second.iter().enumerate() {
                if place % thinned == 0 {
                    input.observe(*at, *value);
                } else if let Some(found) = input.at(*at) {
                    errors.add(found - value, 1.0);
                    asked += 1.0;
                }
            }
            *cost = cost.min(begun.elapsed().as_nanos() as f64 / asked);
        }
    }
    Some(Measured { signal, period_s: period.seconds(), order: model.order(), errors, costs_ns })
}

fn object(measured: &Measured) -> serde_json::Value {
    json!({
        "signal": measured.signal.name, "unit": measured.signal.unit, "period_s": measured.period_s, "order": measured.order,
        "rms": measured.errors.map(|errors| errors.rms()), "greatest": measured.errors.map(|errors| errors.greatest()),
        "ns": measured.costs_ns,
    })
}

fn table(all: &[Measured]) -> Table {
    let rows = all.iter().map(|measured| {
        let [port, estimate, both, keyed] = measured.errors.map(|errors| errors.rms());
        let [port_ns, estimate_ns, _, keyed_ns] = measured.costs_ns;
        vec![
            format!("{} [{}]", measured.signal.name, measured.signal.unit),
            format!("{:.3}", measured.period_s),
            measured.order.to_string(),
            format!("{port:.4}"),
            format!("{estimate:.4}"),
            format!("{both:.4}"),
            format!("{keyed:.4}"),
            format!("{:.2}", keyed / port),
            format!("{port_ns:.0}"),
            format!("{estimate_ns:.0}"),
            format!("{keyed_ns:.0}"),
        ]
    });
    let head = [
        "signal",
        "period in s",
        "order",
        "port",
        "filter",
        "port, then filter",
        "`access: estimate`",
        "that : port",
        "port, ns",
        "filter, ns",
        "`access: estimate`, ns",
    ];
    Table {
        title: "Error between samples, root of the mean square".to_owned(),
        note: "The cost is that of one value asked for, with the samples taken in before it: the fastest of five turns, with other work \
               on the machine."
            .to_owned(),
        head: head.map(str::to_owned).into(),
        rows: rows.collect(),
    }
}

const INTRODUCTION: &str = "\
Written by `shsa-bench alignment ../shared/data --out workshop/measured`.

The inputs of a substitute come at different rates. When it is computed, *port* takes the latest value of an input, *filter* what a \
filter makes of all its values for that time, *port, then filter* the latest value while it is younger than half a period. \
[`access: estimate`](../../docs/model.md#inputs-of-different-rates) is what a model can say of a signal: the latest value and a share of \
the change that a line through the last ones predicts; it needs no fit.

Each recorded signal is thinned out to a longer period. The filter is a Kalman filter over a kinematic model of order 1 \
(a random walk) or 2 (a nearly constant rate), fitted by maximum likelihood to what is left of the first half; the values of the \
second half that were left out are the truth.";
