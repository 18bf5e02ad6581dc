//! `shsa-bench navigation`: position and speed of a rover by all methods, from odometry, inertial sensors and position fixes at
//! different rates.
//!
//! D. Ratasich, B. Frömel, O. Höftberger, R. Grosu, "Generic Sensor Fusion Package for ROS", IROS 2015
//! (doi:10.1109/IROS.2015.7353387).

mod simulated;
mod methods;
mod recorded;
mod formats;
mod husky;

use crate::table::{Table, write_document};
use crate::{Outcome, notice};
use methods::{Error, Method};
use recorded::Drive;
use serde_json::json;
use shsa_estimate::particle::Particles;
use simulated::{DEVICES, SECONDS, Scenario};
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa-bench navigation`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench navigation --runs 10")]
pub(crate) struct Arguments {
    /// Simulated runs of each scenario, with the seeds 1, 2, and so on.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    runs: u64,
    /// The number of the particle filter's particles; fewer are quicker.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u16).range(2..))]
    particles: u16,
    /// The recording test1.bag of robot_localization, for all methods, and for the rover whose wheels freeze.
    #[arg(long, value_name = "FILE")]
    husky: Option<PathBuf>,
    /// The recording turtlebot3.bag of fuse, for all methods.
    #[arg(long, value_name = "FILE")]
    turtlebot3: Option<PathBuf>,
    /// The folder of recordings in the formats that users bring, of which a car, a vehicle, a copter and a boat have fixes.
    #[arg(long, value_name = "DIR")]
    formats: Option<PathBuf>,
    /// Write navigation.md there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each method and scenario instead of tables.
    #[arg(long)]
    json: bool,
}

/// The errors of all methods in all scenarios.
type Results = Vec<(Scenario, Method, Error)>;

/// Runs all methods over the same simulated sensors.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut results = Results::new();
    let particles = Particles { count: arguments.particles.into(), ..Particles::default() };
    for scenario in Scenario::ALL {
        let runs: Vec<_> = (1..=arguments.runs).map(|seed| simulated::drive(scenario, seed)).collect();
        for method in Method::ALL {
            let mut error = Error::default();
            for (truths, arrivals) in &runs {
                methods::run(method, particles, truths, arrivals, &mut error)?;
            }
            results.push((scenario, method, error));
        }
    }
    for (scenario, method, error) in results.iter().filter(|_| arguments.json) {
        writeln!(
            stdout().lock(),
            "{}",
            json!({
                "scenario": scenario.name(), "method": method.name(),
                "position_mse_m2": error.position.mean_square(), "speed_mse_m2_s2": error.speed.mean_square(),
                "position_greatest_m": error.position.greatest(),
            })
        )?;
    }
    let mut tables = vec![
        table(&results, "Position: mean square error in m²", |error| error.position.mean_square()),
        table(&results, "Speed: mean square error in (m/s)²", |error| error.speed.mean_square()),
    ];
    let turtlebot3 = arguments.turtlebot3.as_deref().map(recorded::turtlebot3).transpose()?;
    let husky = arguments.husky.as_deref().map(recorded::husky).transpose()?;
    let formats = arguments.formats.as_deref().map(formats::drives).transpose()?;
    let drives: Vec<Drive> =
        turtlebot3.into_iter().chain(husky).chain(formats.into_iter().flatten()).collect();
    if !drives.is_empty() {
        tables.push(recorded::table(&drives, particles, arguments.json)?);
    }
    match &arguments.husky {
        Some(file) => tables.push(husky::table(file, arguments.json)?),
        None => notice("SKIPPED: the rover whose wheels freeze: no --husky FILE"),
    }
    if !arguments.json {
        tables.iter().try_for_each(|table| writeln!(stdout().lock(), "{table}"))?;
    }
    if let Some(folder) = &arguments.out {
        write_document(folder, "navigation", "Navigation", &introduction(arguments), &tables)?;
    }
    Ok(Outcome::Done)
}

fn table(results: &Results, title: &str, of: impl Fn(&Error) -> f64) -> Table {
    let rows = Method::ALL.map(|method| {
        let own = results.iter().filter(|(_, its, _)| *its == method);
        let cells = own.map(|(.., error)| format!("{:.4}", of(error)));
        std::iter::once(method.name().to_owned()).chain(cells).collect()
    });
    let head = std::iter::once("method").chain(Scenario::ALL.map(Scenario::name));
    Table {
        title: title.to_owned(),
        note: "From 5 s on, twenty times a second.".to_owned(),
        head: head.map(str::to_owned).collect(),
        rows: rows.into(),
    }
}

fn introduction(arguments: &Arguments) -> String {
    let sensors: Vec<String> =
        DEVICES.iter().map(|device| format!("{} ({})", device.name, device.deviation)).collect();
    format!(
        "Written by `shsa-bench navigation --runs {} --particles {} --turtlebot3 turtlebot3/turtlebot3.bag --husky husky/test1.bag --formats formats \
         --out workshop/measured`.\n\n\
         A simulated rover drives for {SECONDS} s along a smooth path, and its true position is known. Its \
         sensors, with the standard deviation of their noise in SI units: {}. They deliver 1 to 50 values a \
         second, up to 0.2 s late. In *outliers* one of twenty values is off by ten deviations. In *wheel 1 \
         slips* this wheel is 1 m/s too fast for 30 s. In *no fixes* both position fixes are silent for 30 s.\n\n\
         *Dead reckoning* integrates wheel 1 and the gyroscope. The next six methods have no model: they use the \
         fixes for the position, and the last value of each of the three speed sensors for the speed. The \
         filters have one model of position, heading, speed and turn rate, and apply each value at its own time. \
         The gate accepts 99.99 % of healthy values.",
        arguments.runs,
        arguments.particles,
        sensors.join(", "),
    )
}
