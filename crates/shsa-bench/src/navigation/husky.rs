//! A recorded rover whose wheel odometry freezes for 20 s: the same filter with and without a monitor of its inputs.
//!
//! The recording is `test1.bag` of robot_localization (T. Moore, D. Stouch 2014, doi:10.1007/978-3-319-08338-4_25).

use crate::table::{Errors, Table};
use anyhow::Context;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_estimate::formulas::{Draft, Formulas, Sensor, Vocabulary};
use shsa_estimate::fusion::{Fusion, Options};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::Measurement;
use shsa_format::recording::{ReadOptions, Wanted, read};
use std::path::Path;

/// The fields that are read: speed of the wheels, yaw rate of the gyroscope (it is mounted on its side), latitude, longitude.
const SOURCES: [&str; 4] = [
    "/husky_velocity_controller/odom#twist.twist.linear.x",
    "/imu/data#angular_velocity.y",
    "/fix#latitude",
    "/fix#longitude",
];
const WHEELS: usize = 0;
/// Position to the north and to the east.
const FIXES: [usize; 2] = [2, 3];

/// The delay of the odometry beyond its stamps.
const LATE: Span = Span(400_000_000);

const EARTH_M: f64 = 6_371_000.0;
const FROZEN_S: i64 = 20;
/// Errors count until this long after the wheels have begun to freeze.
const JUDGED_S: i64 = 30;

/// A value with its time of validity.
#[derive(Clone, Copy, Debug)]
struct Heard {
    at: Time,
    sensor: usize,
    value: f64,
}

/// How the filter is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// Wheels and gyroscope, as in the recording's own test.
    Plain,
    /// With the fixes.
    WithFixes,
    /// With the fixes; a value unchanged for a second is left out until it changes, as the detector of frozen values does.
    Watched,
}

/// The error of each use while the wheels are frozen in one window after the other. The reference is the same use without the
/// fault.
///
/// # Errors
/// The recording cannot be read, or lacks one of these signals.
pub(super) fn table(path: &Path) -> anyhow::Result<Table> {
    let heard = heard(path)?;
    let begin = heard.first().context("the recording has none of the signals")?.at;
    let end = heard.last().map_or(begin, |last| last.at);
    let uses = [Use::Plain, Use::WithFixes, Use::Watched];
    let mut healthy = Vec::new();
    for its in uses {
        healthy.push(positions(&heard, None, its)?);
    }
    let mut rows = Vec::new();
    let mut from_s = FROZEN_S;
    while begin + Span((from_s + JUDGED_S) * 1_000_000_000) < end {
        let from = begin + Span(from_s * 1_000_000_000);
        let mut row = vec![format!("{from_s} to {} s", from_s + FROZEN_S)];
        for (its, healthy) in uses.into_iter().zip(&healthy) {
            let found = positions(&heard, Some(from), its)?;
            row.push(format!("{:.2}", apart(&found, healthy, from)));
        }
        rows.push(row);
        from_s += FROZEN_S;
    }
    let head = ["wheels frozen", "wheels and gyroscope, m", "and fixes, m", "and fixes, watched, m"];
    Ok(Table {
        title: "A recorded rover: wheel odometry frozen for 20 s".to_owned(),
        note: "Distance from where the same filter is without the fault, root of the mean square over 30 s from the beginning of \
               the fault on. Where the rover keeps its speed of 1 m/s, a frozen wheel tells the truth, and to \
               leave it out costs; where the rover stops, the wheel lies."
            .to_owned(),
        head: head.map(str::to_owned).into(),
        rows,
    })
}

/// The recording's values in the order of their validity; fixes in metres relative to the first.
fn heard(path: &Path) -> anyhow::Result<Vec<Heard>> {
    let wanted = SOURCES.map(|source| Wanted::new(source, source));
    let recording = read(&[path.to_owned()], &wanted, &ReadOptions::default())?;
    let mut origin = [None; 4];
    let mut all = Vec::new();
    for sample in &recording.samples {
        let RawValue::Number(number) = sample.value else { continue };
        let first = *origin[sample.wanted].get_or_insert(number);
        let metres = (number - first).to_radians() * EARTH_M;
        let (late, value) = match sample.wanted {
            0 => (LATE, number),
            1 => (Span(0), number),
            2 => (Span(0), metres),
            _ => (Span(0), metres * origin[2].unwrap_or(0.0).to_radians().cos()),
        };
        all.push(Heard { at: sample.time - late, sensor: sample.wanted, value });
    }
    all.sort_by_key(|heard| (heard.at, heard.sensor));
    Ok(all)
}

/// The rover's position ten times a second. From `frozen` on, the wheels repeat their last value for 20 s.
fn positions(heard: &[Heard], frozen: Option<Time>, its: Use) -> anyhow::Result<Vec<(Time, [f64; 2])>> {
    let begin = heard.first().map_or(Time(0), |first| first.at);
    let mut fusion = fusion(start(heard, begin), begin)?;
    let (mut kept, mut changed, mut next, mut all) = (f64::NAN, begin, begin, Vec::new());
    for one in heard {
        while next < one.at {
            let estimate = fusion.estimate(next);
            all.push((next, estimate.map_or([f64::NAN; 2], |it| [it.mean[0], it.mean[1]])));
            next = next + Span(100_000_000);
        }
        if its == Use::Plain && FIXES.contains(&one.sensor) {
            continue;
        }
        let is_frozen = one.sensor == WHEELS
            && frozen.is_some_and(|from| from <= one.at && one.at < from + Span(FROZEN_S * 1_000_000_000));
        let value = if is_frozen { kept } else { one.value };
        if one.sensor == WHEELS {
            changed = if value.to_bits() == kept.to_bits() { changed } else { one.at };
            kept = value;
            fusion.mask(WHEELS, its == Use::Watched && one.at - changed > Span(1_000_000_000));
        }
        fusion.measure(one.at, Measurement { sensor: one.sensor, value, variance: None });
    }
    Ok(all)
}

/// The initial position and heading, from the movement of the fixes in the first five seconds.
fn start(heard: &[Heard], begin: Time) -> [f64; 5] {
    let last = |sensor: usize| {
        let mut early = heard.iter().filter(|one| one.at < begin + Span(5_000_000_000));
        early.rfind(|one| one.sensor == sensor).map_or(0.0, |one| one.value)
    };
    [0.0, 0.0, last(FIXES[1]).atan2(last(FIXES[0])), 1.0, 0.0]
}

/// North, east, heading from north to east, speed, yaw rate.
fn fusion(start: [f64; 5], begin: Time) -> anyhow::Result<Fusion> {
    let mut words = Vocabulary::default();
    for state in ["n", "e", "h", "v", "w"] {
        words.add_number(state);
    }
    let formula = |text: &str| words.formula("the rover", text);
    let transition = ["n + v*dt*cos(h + w*dt/2)", "e + v*dt*sin(h + w*dt/2)", "h + w*dt", "v", "w"];
    let diffusion = ["1e-3*dt", "1e-3*dt", "1e-5*dt", "0.3*dt", "0.5*dt"];
    let places = (0..5).flat_map(|i| (i..5).map(move |j| (i, j)));
    let noise = places.map(|(i, j)| formula(if i == j { diffusion[i] } else { "0" }));
    // The heading (seen from above) turns against the gyroscope.
    let says = [("v", "0.05^2"), ("-w", "0.02^2"), ("n", "1.5^2"), ("e", "1.5^2")];
    let sensors = says.into_iter().zip(SOURCES).map(|((says, variance), source)| {
        anyhow::Ok(Sensor {
            name: source.into(),
            formula: formula(says)?,
            variance: formula(variance)?,
            turn: None,
        })
    });
    let system = Formulas::new(Draft {
        transition: transition.iter().map(|text| formula(text)).collect::<Result<_, _>>()?,
        controls: 0,
        noise: noise.collect::<Result<_, _>>()?,
        sensors: sensors.collect::<Result<_, _>>()?,
    })?;
    let spread = Matrix::from_fn(5, 5, |i, j| if i == j { [4.0, 4.0, 0.1, 1.0, 1.0][i] } else { 0.0 });
    let filter = Kalman::new(system, &start, &spread, Loss::Square)?;
    let options = Options {
        horizon: Span(1_000_000_000),
        moments: 64,
        gate: None,
        unknown_after: Span(10_000_000_000),
    };
    Ok(Fusion::new(Box::new(filter), begin, SOURCES.len(), 0, options)?)
}

/// The distance of two runs from a time on.
fn apart(found: &[(Time, [f64; 2])], healthy: &[(Time, [f64; 2])], from: Time) -> f64 {
    let mut errors = Errors::default();
    for ((at, [n, e]), (_, [n_healthy, e_healthy])) in found.iter().zip(healthy) {
        if from <= *at && *at < from + Span(JUDGED_S * 1_000_000_000) {
            errors.add((n - n_healthy).hypot(e - e_healthy), 1.0);
        }
    }
    errors.rms()
}
