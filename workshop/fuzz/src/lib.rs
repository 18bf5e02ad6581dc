//! The fuzz targets: each takes any bytes, and panics only if the code under test breaks a promise.
//!
//! Two drivers share the targets: libFuzzer (`fuzz_targets/`, needs nightly) and the one of this crate (`driver`, runs anywhere).
//! A new target is a module with `run` and `seeds`, a row in [`TARGETS`], and a file of three lines in `fuzz_targets/`.

pub mod intervals;
pub mod formulas;
pub mod models;
pub mod recordings;
pub mod readers;
pub mod payloads;
pub mod messages;
pub mod engine;
pub mod states;
pub mod driver;

/// A target, which must survive any bytes.
pub struct Target {
    /// Its name on the command line.
    pub name: &'static str,
    /// Runs the target on bytes; panics when a promise is broken.
    pub run: fn(&[u8]),
    /// Good inputs, to be changed at random.
    pub seeds: fn() -> Vec<Vec<u8>>,
}

/// All targets.
pub const TARGETS: &[Target] = &[
    Target { name: "intervals", run: intervals::run, seeds: intervals::seeds },
    Target { name: "formulas", run: formulas::run, seeds: formulas::seeds },
    Target { name: "models", run: models::run, seeds: models::seeds },
    Target { name: "recordings", run: recordings::run, seeds: recordings::seeds },
    Target { name: "ulog", run: readers::ulog::run, seeds: readers::ulog::seeds },
    Target { name: "dataflash", run: readers::dataflash::run, seeds: readers::dataflash::seeds },
    Target { name: "can", run: readers::can::run, seeds: readers::can::seeds },
    Target { name: "nmea", run: readers::nmea::run, seeds: readers::nmea::seeds },
    Target { name: "signalk", run: readers::signalk::run, seeds: readers::signalk::seeds },
    Target { name: "influx", run: readers::influx::run, seeds: readers::influx::seeds },
    Target { name: "mdf", run: readers::mdf::run, seeds: readers::mdf::seeds },
    Target { name: "parquet", run: readers::parquet::run, seeds: readers::parquet::seeds },
    Target { name: "payloads", run: payloads::run, seeds: payloads::seeds },
    Target { name: "messages", run: messages::run, seeds: messages::seeds },
    Target { name: "engine", run: engine::run, seeds: engine::seeds },
    Target { name: "states", run: states::run, seeds: states::seeds },
];
