//! Recorded drives with something to judge an estimate by: the truth of a simulator, or fixes that no method is given.

use super::methods::{self, Error, Method};
use super::simulated::{Arrival, Truth};
use crate::table::Table;
use serde_json::{Map, Value};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_estimate::particle::Particles;
use shsa_recording::{ReadOptions, Sample, Wanted, read};
use std::io::{Write, stdout};
use std::iter::{once, zip};
use std::path::Path;

/// What is known of a drive, and what its sensors deliver, in the order of arrival. The sensors are those of the simulation
/// ([`DEVICES`](super::simulated::DEVICES)), as far as they are there.
pub(super) struct Drive {
    name: &'static str,
    truths: Vec<Truth>,
    arrivals: Vec<Arrival>,
    /// What a method is judged by: its name in JSON, its heading, and its mean square error.
    columns: &'static [Column],
}

type Column = (&'static str, &'static str, fn(&Error) -> f64);

const POSITION: Column = ("position_mse_m2", "position, m²", |error| error.position.mean_square());
const SPEED: Column = ("speed_mse_m2_s2", "speed, (m/s)²", |error| error.speed.mean_square());

/// The places of the sensors that recordings have.
const FIX: [usize; 2] = [0, 1];
pub(super) const WHEEL: [usize; 2] = [2, 3];
pub(super) const COMMANDED: usize = 4;
pub(super) const GYROSCOPE: usize = 5;
pub(super) const COMPASS: usize = 6;

/// The values of a field, each with its stamp.
pub(super) type Series = Vec<(Time, f64)>;

impl Drive {
    fn new(
        name: &'static str,
        columns: &'static [Column],
        truths: Vec<Truth>,
        sensors: Vec<(usize, Series, Span)>,
    ) -> Drive {
        // The filters begin at the time 0.
        let begin = truths.first().map_or(Time(0), |truth| truth.at);
        let truths = truths.into_iter().map(|it| Truth { at: Time((it.at - begin).0), ..it }).collect();
        let arrival = |sensor, at: Time, late, value| {
            let received = Time((at - begin).0);
            Arrival { received, at: received - late, sensor, value }
        };
        let all = sensors.into_iter().flat_map(|(sensor, values, late)| {
            values.into_iter().map(move |(at, value)| arrival(sensor, at, late, value))
        });
        let mut arrivals: Vec<Arrival> = all.filter(|it| it.at > Time(0)).collect();
        arrivals.sort_by_key(|it| (it.received, it.sensor));
        Drive { name, truths, arrivals, columns }
    }
}

/// The errors of all methods on recorded drives. Prints an object for each method where `is_json`.
///
/// # Errors
/// A filter cannot be built, or the output is closed.
pub(super) fn table(drives: &[Drive], particles: Particles, is_json: bool) -> anyhow::Result<Table> {
    let mut rows = Vec::new();
    for method in Method::ALL {
        let mut row = vec![method.name().to_owned()];
        for Drive { name, truths, arrivals, columns } in drives {
            let mut error = Error::default();
            methods::run(method, particles, truths, arrivals, &mut error)?;
            let numbers = columns.iter().map(|(key, _, of)| (*key, of(&error)));
            row.extend(numbers.clone().map(|(_, number)| shown(number)));
            if is_json {
                let named = [("recording", *name), ("method", method.name())];
                let named = named.map(|(key, name)| (key.to_owned(), Value::from(name)));
                let line: Map<String, Value> =
                    named.into_iter().chain(numbers.map(|(key, it)| (key.to_owned(), it.into()))).collect();
                writeln!(stdout().lock(), "{}", Value::from(line))?;
            }
        }
        rows.push(row);
    }
    let columns = drives
        .iter()
        .flat_map(|drive| drive.columns.iter().map(|(_, heading, _)| format!("{}: {heading}", drive.name)));
    Ok(Table {
        title: "Recorded rovers: mean square errors".to_owned(),
        note: NOTE.to_owned(),
        head: once("method".to_owned()).chain(columns).collect(),
        rows,
    })
}

fn shown(number: f64) -> String {
    if number.is_nan() { "-".to_owned() } else { format!("{number:.4}") }
}

const NOTE: &str = "\
The same methods with the same settings; from 5 s on.

The recorded TurtleBot3 was simulated by others, with the true pose (`turtlebot3/turtlebot3.bag`, 91 s, 25 m). Each \
of its two wheels gives a speed, with the gyroscope, and the command is the third; its inertial unit gives the \
heading. It has no fixes, so methods without a model have no position, and nothing observes the position of the others.

The others are real, and their true position is unknown. The methods are given every fifth satellite fix, and are \
judged by the other four. The errors of fixes are correlated for a minute: how far a fix is from the truth does not \
show here, but only how well a method carries it on. With few fixes, particles are too sparse. Where there is no \
gyroscope, dead reckoning goes straight on.

* Husky (`husky/test1.bag`, 395 s, 359 m): wheels, gyroscope, a fix in 2 s. The gated filter has no estimate at times \
there: fixes contradict it, and nothing decides.
* Car (`formats/mdf/car_decoded.mf4`, MDF 4, 170 s): speed and heading of the satellite receiver and a fix in 5 s, \
gyroscope.
* Vehicle (`formats/rosbag2/gps_nav`, ROS 2 bag, 114 s): odometry, heading, a fix in 5 s; times are those of the \
reception. The odometry follows the motion only loosely.
* Copter (`formats/dataflash/log.bin`, ArduPilot, 51 s): speed and course of the receiver, a fix in a second. It \
hovers for two thirds of the time, where the course means nothing.
* Boat (`formats/nmea/boat.log`, NMEA 0183, 103 minutes): speed through the water, speed and course of the receiver, \
a fix in 21 s. The water moves.

No other recording of `formats/` has fixes of a motion for more than 20 s with another sensor of it: those of ULog \
and Signal K last 6 to 14 s, those of CAN and MCAP are the car's, the other receivers' stand still.";

/// A simulated TurtleBot3 with two wheels 0.287 m apart, of 33 mm radius: each wheel with the gyroscope gives a speed, and the
/// command is the third. The pose of its odometry is the simulator's.
///
/// # Errors
/// The recording cannot be read, or lacks one of the fields.
pub(super) fn turtlebot3(file: &Path) -> anyhow::Result<Drive> {
    let pose = [
        "/odom#pose.pose.position.x",
        "/odom#pose.pose.position.y",
        "/odom#pose.pose.orientation.z",
        "/odom#pose.pose.orientation.w",
        "/odom#twist.twist.linear.x",
    ];
    let [x, y, sine, cosine, speed] = fields(file, pose)?;
    let sensors = [
        "/joint_states#position[0]",
        "/joint_states#position[1]",
        "/imu#angular_velocity.z",
        "/imu#orientation.z",
        "/imu#orientation.w",
        "/cmd_vel#linear.x",
    ];
    let [right, left, turn, imu_sine, imu_cosine, commanded] = fields(file, sensors)?;
    let (heading, mut compass) = (yaw(&sine, &cosine), yaw(&imu_sine, &imu_cosine));
    let start = heading.first().map_or(0.0, |(_, heading)| *heading);
    compass.iter_mut().for_each(|(_, heading)| *heading -= start);
    let place = zip(zip(&x, &y), zip(&heading, &speed));
    let truths = place.map(|((x, y), (heading, speed))| Truth {
        at: x.0,
        x: x.1,
        y: y.1,
        heading: heading.1,
        speed: speed.1,
        turn: 0.0,
    });
    let right = along(&right, &turn, -1.0);
    let left = along(&left, &turn, 1.0);
    let sensors =
        [(WHEEL[0], right), (WHEEL[1], left), (COMMANDED, commanded), (GYROSCOPE, turn), (COMPASS, compass)];
    let sensors = sensors.map(|(sensor, values)| (sensor, values, Span::ZERO)).into();
    Ok(Drive::new("TurtleBot3", &[POSITION, SPEED], from_origin(truths.collect(), start), sensors))
}

/// A Husky with wheels, gyroscope and satellite fixes.
///
/// # Errors
/// The recording cannot be read, or lacks one of the fields.
pub(super) fn husky(file: &Path) -> anyhow::Result<Drive> {
    let sources = [
        "/fix#latitude",
        "/fix#longitude",
        "/husky_velocity_controller/odom#twist.twist.linear.x",
        "/imu/data#angular_velocity.y",
    ];
    let [latitude, longitude, wheels, mut turn] = fields(file, sources)?;
    // The unit is mounted on its side.
    turn.iter_mut().for_each(|(_, turn)| *turn = -*turn);
    let sensors = vec![(WHEEL[0], wheels, Span(400_000_000)), (GYROSCOPE, turn, Span::ZERO)];
    Ok(by_fixes("Husky", [&latitude, &longitude], HUSKY_HEADING, sensors))
}

/// A drive with satellite fixes, their latitudes and longitudes in degrees, which heads in this direction at first, in radians from north to the east. The methods
/// are given every fifth fix, and judged by the others.
pub(super) fn by_fixes(
    name: &'static str,
    fixes: [&Series; 2],
    heading: f64,
    mut sensors: Vec<(usize, Series, Span)>,
) -> Drive {
    let [latitude, longitude] = fixes;
    let cosine = latitude.first().map_or(1.0, |(_, latitude)| latitude.to_radians().cos());
    let metres = |(north, east): (&(Time, f64), &(Time, f64))| Truth {
        at: north.0,
        x: EARTH_RADIUS_M * north.1.to_radians(),
        y: EARTH_RADIUS_M * cosine * east.1.to_radians(),
        speed: f64::NAN,
        ..Truth::default()
    };
    let fixes = from_origin(zip(latitude, longitude).map(metres).collect(), heading);
    let (given, judging): (Vec<_>, Vec<_>) =
        fixes.into_iter().enumerate().partition(|(place, _)| place.is_multiple_of(5));
    let coordinate = |of: fn(&Truth) -> f64| given.iter().map(|(_, fix)| (fix.at, of(fix))).collect();
    sensors.push((FIX[0], coordinate(|fix| fix.x), Span::ZERO));
    sensors.push((FIX[1], coordinate(|fix| fix.y), Span::ZERO));
    Drive::new(name, &[POSITION], judging.into_iter().map(|(_, fix)| fix).collect(), sensors)
}

const EARTH_RADIUS_M: f64 = 6_371_000.0;
/// Where the Husky heads at first, in radians from north; as in `models/husky-filter.yaml`.
const HUSKY_HEADING: f64 = -0.6;

/// The same way, beginning at the origin in the direction of x.
fn from_origin(mut truths: Vec<Truth>, heading: f64) -> Vec<Truth> {
    let Some(start) = truths.first().copied() else { return truths };
    let (sine, cosine) = heading.sin_cos();
    for truth in &mut truths {
        let (x, y) = (truth.x - start.x, truth.y - start.y);
        (truth.x, truth.y) = (cosine * x + sine * y, cosine * y - sine * x);
        truth.heading -= heading;
    }
    truths
}

/// The speed of the middle between two wheels, from the angle of one of them and the turn rate: `side` is 1 for the left wheel, -1
/// for the right one.
fn along(angle: &Series, turn: &Series, side: f64) -> Series {
    const RADIUS_M: f64 = 0.033;
    const HALF_TRACK_M: f64 = 0.1435;
    let speed = |pair: &[(Time, f64)]| {
        let [before, after] = pair else { return None };
        let newest = turn.partition_point(|(at, _)| *at <= after.0).checked_sub(1)?;
        let rim = RADIUS_M * (after.1 - before.1) / (after.0 - before.0).seconds();
        Some((after.0, rim + side * HALF_TRACK_M * turn.get(newest)?.1))
    };
    angle.windows(2).filter_map(speed).collect()
}

/// The heading of a quaternion about the vertical axis.
pub(super) fn yaw(sine: &Series, cosine: &Series) -> Series {
    zip(sine, cosine).map(|((at, sine), (_, cosine))| (*at, 2.0 * sine.atan2(*cosine))).collect()
}

/// The numbers of some fields of a recording, by their stamps.
pub(super) fn fields<const N: usize>(file: &Path, sources: [&str; N]) -> anyhow::Result<[Series; N]> {
    fields_by(file, sources, |sample| sample.time)
}

/// The numbers of some fields of a recording, each at a time of it.
pub(super) fn fields_by<const N: usize>(
    file: &Path,
    sources: [&str; N],
    time: fn(&Sample) -> Time,
) -> anyhow::Result<[Series; N]> {
    let wanted = sources.map(|source| Wanted::new(source, source));
    let samples = read(&[file.to_owned()], &wanted, &ReadOptions::default())?.samples;
    let mut all = [(); N].map(|()| Series::new());
    for sample in samples {
        let RawValue::Number(value) = sample.value else { continue };
        if let Some(series) = all.get_mut(sample.wanted) {
            series.push((time(&sample), value));
        }
    }
    if let Some(missing) = all.iter().position(Vec::is_empty) {
        anyhow::bail!("{} has no values of {}", file.display(), sources[missing]);
    }
    Ok(all)
}
