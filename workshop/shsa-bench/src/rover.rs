//! `shsa-bench rover`: how soon the rover of the thesis detects faults of its lidar, and heals, by settings.
//!
//! D. Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien 2019, Fig. 1.9: a lidar that breaks, and an attacker who replaces its
//! scans, with the goal of 100 ms.

use crate::Outcome;
use crate::table::{Table, write_document};
use anyhow::Context;
use serde_json::Value;
use shsa_core::monitor::Debounce;
use shsa_core::time::Span;
use shsa_demo::Provision;
use shsa_demo::rover::{Settings, Trial};
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa-bench rover`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench rover --seeds 100")]
pub(crate) struct Arguments {
    /// How many trials of a minute for each setting: the seeds from --first on.
    #[arg(long, value_name = "N", default_value_t = 100)]
    seeds: u64,
    /// The first seed.
    #[arg(long, value_name = "SEED", default_value_t = 1_001)]
    first: u64,
    /// Write rover.md there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Settings with a name and what is special about them.
struct Variant {
    name: &'static str,
    about: &'static str,
    settings: Settings,
}

const INTRODUCTION: &str = "\
A simulated robot drives about a room and stops before obstacles (`shsa demo rover`). The lidar is silent from second 12 to 24, and each of its \
distances is 3 m from second 36 on. Periods: lidar 100 ms, sonar ring 80 ms, depth camera 67 ms, odometry 50 ms; results come 10 to 40 ms \
after the measurement, and measurements are up to 4 ms early or late.\n\n\
The thesis asks for 100 ms. A lidar of 10 Hz that has just spoken cannot be missed before its next scan is late: 100 ms after its last one, and \
on average 50 ms after the fault. A lie cannot be seen before the next scan, and a single contradiction may be the edge of an obstacle that one \
sensor has seen and the other one has not yet.";

const NOTE: &str = "\
Median / worst over the trials, from the beginning of the fault. *detected*: the lidar is called silent or failed. *healed*: the first `dmin` \
that does not rest on the lidar, which was suspected before. *gap*: the longest time without a `dmin` during the fault. *missed*: trials in \
which the fault was not named. *false alarms*: how often a healthy sensor was called silent or failed, per hour. *accidents*: how often the robot ran into something.";

/// # Errors
/// A model with errors, or a file that cannot be written.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut rows = [Vec::new(), Vec::new()];
    for variant in variants() {
        let results = results(arguments, &variant.settings).with_context(|| variant.name)?;
        for (fault, rows) in rows.iter_mut().enumerate() {
            rows.push(row(&variant, &results, fault));
        }
    }
    let head =
        ["settings", "detected", "healed", "gap", "missed", "false alarms", "accidents"].map(str::to_owned);
    let mut tables = Vec::new();
    for (title, rows) in ["The lidar falls silent", "The lidar is spoofed"].into_iter().zip(rows) {
        tables.push(Table { title: title.to_owned(), note: NOTE.to_owned(), head: head.to_vec(), rows });
    }
    tables.iter().try_for_each(|table| writeln!(stdout(), "{table}"))?;
    if let Some(folder) = &arguments.out {
        let Arguments { seeds, first, .. } = arguments;
        let settings: Vec<String> =
            variants().iter().map(|it| format!("- *{}*: {}", it.name, it.about)).collect();
        let introduction = format!(
            "Written by `shsa-bench rover --seeds {seeds} --first {first} --out workshop/measured`.\n\n{INTRODUCTION}\n\n{}",
            settings.join("\n")
        );
        write_document(folder, "rover", "Detection and healing times of the rover", &introduction, &tables)?;
    }
    Ok(Outcome::Done)
}

/// The compared settings.
fn variants() -> Vec<Variant> {
    let Settings { model, debounce } = Settings::default();
    let tuned = timeouts(&model, [120, 105, 95]);
    let twice = Debounce { span: Span::from_millis(250), least: 2, share: 0.75 };
    let once = Debounce { span: Span::from_millis(100), least: 1, share: 1.0 };
    let of = |name, about, model: &str, debounce| Variant {
        name,
        about,
        settings: Settings { model: model.to_owned(), debounce },
    };
    vec![
        of(
            "default",
            "`models/rover.yaml`: timeouts of 350 ms, three disagreements of four within 250 ms",
            &model,
            debounce,
        ),
        of(
            "tuned",
            "timeouts of a period with its jitter and the spread of the delays (120, 105 and 95 ms), two disagreements of two",
            &tuned,
            twice,
        ),
        of("hasty", "the same timeouts, and each disagreement is a conflict", &tuned, once),
        of(
            "author",
            "the errors of value and time that the author of the thesis gave her sensors (0.15 m and -100 to 0 ms for the lidar, 0.2 m and -80 to 0 ms for the sonar ring, 0.15 m and 100 ms for the depth camera), timeouts as tuned, two disagreements of two",
            &authors(&tuned),
            twice,
        ),
    ]
}

/// The model with timeouts of lidar, sonar ring and depth camera, in milliseconds.
fn timeouts(model: &str, milliseconds: [u32; 3]) -> String {
    let sensors = ["/lidar/scan:", "/sonar/ranges:", "/depth/image:"];
    let line = |line: &str| {
        let sensor =
            sensors.iter().zip(milliseconds).find(|(sensor, _)| line.trim_start().starts_with(**sensor));
        sensor
            .map_or(line.to_owned(), |(_, ms)| line.replace("timeout: 350 ms", &format!("timeout: {ms} ms")))
    };
    model.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// The model with the author's errors: published beside the thesis's program for her rover.
fn authors(model: &str) -> String {
    let with = |line: &str, value: &str, time: &str| {
        let line = line.replace("time_error: [-5 ms, 5 ms]", &format!("time_error: [{time}]"));
        ["0.04", "0.13", "0.08"].iter().fold(line, |line, own| {
            line.replace(&format!("value_error: {own}"), &format!("value_error: {value}"))
        })
    };
    let line = |line: &str| match line.trim_start() {
        start if start.starts_with("/lidar/scan:") => with(line, "0.15", "-100 ms, 0 ms"),
        start if start.starts_with("/sonar/ranges:") => with(line, "0.2", "-80 ms, 0 ms"),
        start if start.starts_with("/depth/image:") => with(line, "0.15", "-100 ms, 100 ms"),
        _ => line.to_owned(),
    };
    model.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// The scores of all trials.
fn results(arguments: &Arguments, settings: &Settings) -> anyhow::Result<Vec<Value>> {
    (arguments.first..arguments.first + arguments.seeds)
        .map(|seed| {
            let mut trial = Trial::healed(seed, settings)?;
            while trial.now() < Trial::END {
                trial.step()?;
            }
            Ok(trial.finish().json(seed, Provision::Healed))
        })
        .collect()
}

fn row(variant: &Variant, results: &[Value], fault: usize) -> Vec<String> {
    let times = |key: &str| {
        let mut all: Vec<f64> =
            results.iter().filter_map(|result| result["faults"][fault][key].as_f64()).collect();
        all.sort_by(f64::total_cmp);
        match (all.get(all.len() / 2), all.last()) {
            (Some(median), Some(worst)) => format!("{:.0} / {:.0} ms", median * 1e3, worst * 1e3),
            _ => "-".to_owned(),
        }
    };
    let sum = |of: &dyn Fn(&Value) -> f64| results.iter().map(of).sum::<f64>();
    let missed =
        results.iter().filter(|result| result["faults"][fault]["detected_after_s"].is_null()).count();
    let hours = sum(&|result| result["duration_s"].as_f64().unwrap_or(0.0)) / 3600.0;
    vec![
        variant.name.to_owned(),
        times("detected_after_s"),
        times("healed_after_s"),
        times("longest_gap_s"),
        format!("{missed} of {}", results.len()),
        format!("{:.1}", sum(&|result| result["false_alarms"].as_f64().unwrap_or(0.0)) / hours),
        sum(&|result| result["faults"][fault]["collisions"].as_f64().unwrap_or(0.0)).to_string(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variant_is_another_model_that_loads() {
        let variants = variants();
        for variant in &variants {
            assert!(Trial::healed(1, &variant.settings).is_ok(), "{}", variant.name);
        }
        let [default, tuned, _, author] = &variants[..] else { panic!("there are four") };
        assert!(
            tuned.settings.model.contains("timeout: 120 ms")
                && default.settings.model != tuned.settings.model
        );
        assert_eq!(author.settings.model.matches("value_error: 0.15").count(), 2);
        assert_eq!(author.settings.model.matches("[-100 ms, 100 ms]").count(), 1);
    }
}
