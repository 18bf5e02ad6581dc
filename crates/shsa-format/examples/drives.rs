//! Writes the recordings of `examples/`: two drives of a car with three speed sensors, each with its own error.
//!
//! `cargo run -p shsa-format --example drives` writes them again, with the same bytes each time.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::fmt::Write;
use std::path::Path;

/// The length of a drive in seconds.
const DURATION: u32 = 60;

/// The radius of the wheels in m.
const RADIUS: f64 = 0.3;

/// A sensor: its file, its column, its rate in values per second and its largest error.
struct Sensor {
    file: &'static str,
    column: &'static str,
    rate_hz: u32,
    error: f64,
    /// The reading of the sensor at a speed.
    reads: fn(f64) -> f64,
}

const SENSORS: [Sensor; 3] = [
    Sensor { file: "gnss.csv", column: "speed [m/s]", rate_hz: 10, error: 0.25, reads: |speed| speed },
    Sensor {
        file: "wheel.csv",
        column: "turns [rad/s]",
        rate_hz: 20,
        error: 0.7,
        reads: |speed| speed / RADIUS,
    },
    Sensor { file: "radar.csv", column: "speed [m/s]", rate_hz: 10, error: 0.4, reads: |speed| speed },
];

/// The drives: the folder, the seed of the errors, and the speeds in m/s, evenly spaced in time.
const DRIVES: [(&str, u64, [f64; 7]); 2] = [
    ("monday", 1, [12.0, 15.0, 24.0, 21.0, 9.0, 16.0, 18.0]),
    ("tuesday", 2, [20.0, 8.0, 8.0, 17.0, 26.0, 19.0, 14.0]),
];

/// The speed at a time, interpolated linearly.
fn speed(speeds: &[f64], seconds: f64) -> f64 {
    let place = seconds / f64::from(DURATION) * (speeds.len() - 1) as f64;
    let at = (place as usize).min(speeds.len() - 2);
    speeds[at] + (speeds[at + 1] - speeds[at]) * (place - at as f64)
}

/// The table of the values that a sensor records in a drive.
fn table(sensor: &Sensor, speeds: &[f64], random: &mut ChaCha8Rng) -> String {
    let mut text = format!("t [s],{}\n", sensor.column);
    for row in 0..DURATION * sensor.rate_hz {
        let seconds = f64::from(row) / f64::from(sensor.rate_hz);
        let share = f64::from(random.next_u32()) / f64::from(u32::MAX);
        let value = (sensor.reads)(speed(speeds, seconds)) + sensor.error * (2.0 * share - 1.0);
        let _cannot_fail = writeln!(text, "{seconds:.2},{value:.3}");
    }
    text
}

/// Every file with its text.
pub(crate) fn files() -> Vec<(String, String)> {
    let mut files = Vec::new();
    for (folder, seed, speeds) in DRIVES {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for sensor in &SENSORS {
            files.push((format!("{folder}/{}", sensor.file), table(sensor, &speeds, &mut random)));
        }
    }
    files
}

#[allow(dead_code, reason = "the test that includes this compares the files only")]
fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    for (file, text) in files() {
        let path = root.join(file);
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        std::fs::write(path, text)?;
    }
    Ok(())
}
