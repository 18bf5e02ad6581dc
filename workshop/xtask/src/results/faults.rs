//! The faults that are injected into each recording.

use super::replay::Fault;

pub(super) const WHEELS: [&str; 4] = ["wheel_1", "wheel_2", "wheel_3", "wheel_4"];
pub(super) const GNSS: &str = "gnss_ublox";

/// Faults of one signal, and the need that it can serve.
pub(super) struct Row {
    pub(super) signal: &'static str,
    pub(super) need: Option<&'static str>,
    pub(super) kinds: &'static [&'static str],
}

/// Kinds of faults of the car that begin at 20 s.
pub(super) const CAR_KINDS: [&str; 5] = ["bias=2", "spoof=0", "drop", "noise=3", "scale=1.3"];

/// Kinds of faults for pairs of faults.
pub(super) const PAIR_KINDS: [&str; 9] =
    ["bias=2", "bias=-2", "spoof=0", "scale=1.3", "noise=3", "stuck", "drop", "drift=0.2", "bias=1.2"];

/// The beginning of the flight's faults, when it cruises.
pub(super) const FLIGHT_MS: u32 = 200_000;

/// The beginning of the rover's faults: it stands, drives off at once, and its heading can be compared for a while.
pub(super) const ROVER_MS: u32 = 100_000;

const VELOCITY: &[&str] =
    &["bias=1", "bias=2", "spoof=0", "stuck", "drop", "noise=3", "scale=1.3", "drift=0.1"];
const POSITION: &[&str] = &["bias=3e-5", "spoof=0", "stuck", "drop", "noise=1e-5", "drift=1e-5"];
const CELL: &[&str] =
    &["bias=0.2", "bias=-0.3", "spoof=0", "stuck", "drop", "noise=0.5", "scale=1.1", "drift=0.002"];

pub(super) const QUAD: &[Row] = &[
    Row { signal: "xSpeed", need: Some("vx"), kinds: VELOCITY },
    Row { signal: "ySpeed", need: Some("vy"), kinds: VELOCITY },
    Row { signal: "zSpeed", need: Some("vz"), kinds: VELOCITY },
    Row { signal: "speed", need: None, kinds: VELOCITY },
    Row {
        signal: "height",
        need: Some("height"),
        kinds: &["bias=2", "bias=5", "spoof=0", "stuck", "drop", "noise=3", "scale=1.5", "drift=2"],
    },
    Row { signal: "latitude", need: None, kinds: POSITION },
    Row { signal: "longitude", need: None, kinds: POSITION },
    Row { signal: "cell_1", need: Some("cell"), kinds: CELL },
    Row { signal: "cell_2", need: Some("cell"), kinds: CELL },
    Row {
        signal: "voltage",
        need: Some("cell"),
        kinds: &["bias=1", "bias=2", "spoof=0", "stuck", "drop", "noise=3", "scale=1.1", "drift=0.01"],
    },
    Row {
        signal: "current",
        need: None,
        kinds: &["bias=5", "bias=10", "spoof=0", "stuck", "drop", "noise=10", "scale=1.3", "drift=0.1"],
    },
    Row {
        signal: "battery",
        need: None,
        kinds: &["bias=10", "spoof=50", "stuck", "drop", "noise=5", "scale=1.3", "drift=0.1"],
    },
];

pub(super) const HUSKY: &[Row] = &[
    Row {
        signal: "imu",
        need: Some("yaw_rate"),
        kinds: &["bias=0.2", "bias=0.5", "spoof=0", "stuck", "drop", "noise=1", "scale=2", "drift=0.01"],
    },
    Row {
        signal: "odom_yaw_rate",
        need: Some("yaw_rate"),
        kinds: &["bias=0.2", "bias=1", "spoof=0", "stuck", "drop", "noise=1", "scale=3", "drift=0.05"],
    },
    Row {
        signal: "odom_speed",
        need: Some("path_speed"),
        kinds: &["bias=0.3", "bias=1", "spoof=0", "stuck", "drop", "noise=1", "scale=1.3", "drift=0.05"],
    },
    Row {
        signal: "odom_qz",
        need: Some("yaw_rate"),
        kinds: &["bias=0.2", "spoof=0", "stuck", "drop", "noise=0.2"],
    },
    Row {
        signal: "odom_x",
        need: Some("path_speed"),
        kinds: &["bias=1", "spoof=0", "stuck", "drop", "noise=1", "drift=0.5"],
    },
    Row {
        signal: "gps_latitude",
        need: Some("path_speed"),
        kinds: &["bias=3e-5", "spoof=0", "stuck", "drop", "noise=3e-5", "drift=2e-5"],
    },
];

impl Row {
    /// Its faults, all with the same beginning.
    pub(super) fn faults(&self, start_ms: u32) -> impl Iterator<Item = Fault> + '_ {
        self.kinds.iter().map(move |&kind| Fault { kind, signal: self.signal, start_ms })
    }
}

/// Every fault in the car's table. A stuck fault begins at 30 s, when the car brakes: before, a constant value is no fault.
pub(super) fn car() -> Vec<Fault> {
    let signals = WHEELS.into_iter().chain([GNSS]);
    let of_signal = |signal: &'static str| {
        let at_20 = CAR_KINDS.into_iter().map(move |kind| Fault { kind, signal, start_ms: 20_000 });
        at_20.chain([Fault { kind: "stuck", signal, start_ms: 30_000 }])
    };
    signals.flat_map(of_signal).collect()
}

/// All pairs of the car's signals: two wheels first, then a wheel and the GNSS.
pub(super) fn car_pairs() -> Vec<(&'static str, &'static str)> {
    let after = |at: usize| WHEELS.into_iter().skip(at + 1).map(move |other| (WHEELS[at], other));
    let wheels = (0..WHEELS.len()).flat_map(after);
    wheels.chain(WHEELS.into_iter().map(|wheel| (wheel, GNSS))).collect()
}
