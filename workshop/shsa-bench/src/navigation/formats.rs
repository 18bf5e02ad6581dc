//! Recordings in the formats that users bring, which have fixes of a motion and another sensor of it.

use super::recorded::{
    COMMANDED, COMPASS, Drive, GYROSCOPE, Series, WHEEL, by_fixes, fields, fields_by, yaw,
};
use shsa_core::time::Span;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Metres a second of a knot.
const KNOT: f64 = 1852.0 / 3600.0;

/// The drives below a folder.
///
/// # Errors
/// A recording cannot be read, or lacks one of the fields.
pub(super) fn drives(folder: &Path) -> anyhow::Result<Vec<Drive>> {
    Ok(vec![
        car(&folder.join("mdf/car_decoded.mf4"))?,
        vehicle(&folder.join("rosbag2/gps_nav"))?,
        copter(&folder.join("dataflash/log.bin"))?,
        boat(&folder.join("nmea/boat.log"))?,
    ])
}

/// A car: its receiver gives position, speed and heading; its gyroscope counts to the left.
fn car(file: &Path) -> anyhow::Result<Drive> {
    let sources = [
        "CAN2 message ID=0x13 EXT=False#Latitude",
        "CAN2 message ID=0x13 EXT=False#Longitude",
        "CAN2 message ID=0x17 EXT=False#Speed",
        "CAN2 message ID=0x15 EXT=False#Heading",
        "CAN2 message ID=0x19 EXT=False#AngularRateZ",
    ];
    let [latitude, longitude, speed, heading, turn] = fields(file, sources)?;
    let (start, heading) = from_start(heading.into_iter().map(|(at, it)| (at, it.to_radians())).collect());
    let turn = turn.into_iter().map(|(at, it)| (at, -it.to_radians())).collect();
    let sensors = vec![now(COMMANDED, speed), now(COMPASS, heading), now(GYROSCOPE, turn)];
    Ok(by_fixes("Car", [&latitude, &longitude], start, sensors))
}

/// A vehicle of a course: odometry without a turn rate, and a pose with the heading, whose stamps are 0.
fn vehicle(file: &Path) -> anyhow::Result<Drive> {
    let sources = [
        "/gps#latitude",
        "/gps#longitude",
        "/odometry#twist.twist.linear.x",
        "/vehicle_pose#pose.orientation.z",
        "/vehicle_pose#pose.orientation.w",
    ];
    let [latitude, longitude, speed, sine, cosine] = fields_by(file, sources, |sample| sample.received)?;
    // From the east to the left.
    let from_north = yaw(&sine, &cosine).into_iter().map(|(at, it)| (at, FRAC_PI_2 - it));
    let (start, heading) = from_start(from_north.collect());
    let sensors = vec![now(WHEEL[0], speed), now(COMPASS, heading)];
    Ok(by_fixes("Vehicle", [&latitude, &longitude], start, sensors))
}

/// A copter, which need not fly where it heads: its course is the receiver's.
fn copter(file: &Path) -> anyhow::Result<Drive> {
    let [latitude, longitude, speed, course] = fields(file, ["GPS#Lat", "GPS#Lng", "GPS#Spd", "GPS#GCrs"])?;
    let (start, course) = from_start(course.into_iter().map(|(at, it)| (at, it.to_radians())).collect());
    let sensors = vec![now(COMMANDED, speed), now(COMPASS, course)];
    Ok(by_fixes("Copter", [&latitude, &longitude], start, sensors))
}

/// A sailing boat, with a log of its speed through the water.
fn boat(file: &Path) -> anyhow::Result<Drive> {
    let sources = ["GPRMC#latitude", "GPRMC#longitude", "GPRMC#speed", "GPRMC#course", "VWVHW#speed"];
    let [latitude, longitude, speed, course, water] = fields(file, sources)?;
    let metres = |speed: Series| speed.into_iter().map(|(at, knots)| (at, KNOT * knots)).collect();
    let (start, course) = from_start(course.into_iter().map(|(at, it)| (at, it.to_radians())).collect());
    let sensors = vec![now(WHEEL[0], metres(water)), now(COMMANDED, metres(speed)), now(COMPASS, course)];
    Ok(by_fixes("Boat", [&latitude, &longitude], start, sensors))
}

/// A sensor whose values come at once.
fn now(sensor: usize, values: Series) -> (usize, Series, Span) {
    (sensor, values, Span::ZERO)
}

/// The first heading, and all headings from it.
fn from_start(mut headings: Series) -> (f64, Series) {
    let start = headings.first().map_or(0.0, |(_, heading)| *heading);
    headings.iter_mut().for_each(|(_, heading)| *heading -= start);
    (start, headings)
}
