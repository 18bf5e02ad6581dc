//! A radar: its field of view, and the tracks of a scan.
//!
//! The field is a triangle, as in the knowledge base of the thesis's program: one corner at the radar, the others at `RANGE_M` from it,
//! half of `ANGLE` to either side of the road's direction. A vehicle that is partly outside is seen where the rest of it is.

use super::traffic::Vehicle;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Radars: one every 100 m.
pub(super) const RADARS: usize = 4;
const SPACING_M: f64 = 100.0;
/// Where they stand beside the road, m.
const SIDE_M: f64 = -3.0;
const RANGE_M: f64 = 200.0;
const ANGLE: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// The largest errors of position along and across, m, and of speed, m/s: three standard deviations.
const ALONG_M: f64 = 1.2;
const ACROSS_M: f64 = 0.6;
const SPEED: f64 = 0.6;
/// The share of vehicles that a scan misses.
const MISSED: f64 = 0.05;

/// What is known of a vehicle at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Track {
    pub(super) at_s: f64,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) speed: f64,
    /// The vehicle, for the score only: nothing else knows it.
    pub(super) of: u32,
}

/// Whether a point lies in the field of a radar.
fn sees(radar: usize, x: f64, y: f64) -> bool {
    let along = x - SPACING_M * radar as f64;
    along <= RANGE_M * (ANGLE / 2.0).cos() && (y - SIDE_M).abs() <= along * (ANGLE / 2.0).tan()
}

/// The tracks of a scan: vehicles in the field with errors, but for those that are missed.
pub(super) fn scan<'a>(
    radar: usize,
    at_s: f64,
    vehicles: impl Iterator<Item = &'a Vehicle>,
    random: &mut ChaCha8Rng,
) -> Vec<Track> {
    let mut track = |vehicle: &Vehicle| {
        let (along, across, speed) = (ALONG_M * bell(random), ACROSS_M * bell(random), SPEED * bell(random));
        let is_missed = random.random_bool(MISSED);
        let x = middle_of_seen(radar, vehicle).filter(|_| !is_missed)?;
        Some(Track {
            at_s,
            x: x + along,
            y: vehicle.y + across,
            speed: vehicle.speed + speed,
            of: vehicle.id,
        })
    };
    vehicles.filter_map(&mut track).collect()
}

/// The middle of the part of a vehicle that is in the field.
fn middle_of_seen(radar: usize, vehicle: &Vehicle) -> Option<f64> {
    const PARTS: usize = 7;
    let part = |part: usize| vehicle.x + vehicle.length * (part as f64 / (PARTS - 1) as f64 - 0.5);
    let seen: Vec<f64> = (0..PARTS).map(part).filter(|x| sees(radar, *x, vehicle.y)).collect();
    (seen.len() > 1).then(|| seen.iter().sum::<f64>() / seen.len() as f64)
}

/// A random number within plus-minus 1, bell-shaped: the mean of three uniform numbers, standard deviation 1/3.
pub(super) fn bell(random: &mut ChaCha8Rng) -> f64 {
    (0..3).map(|_| random.random_range(-1.0..=1.0)).sum::<f64>() / 3.0
}
