//! The results as text, as a plot and as a document.

use super::Measured;
use anyhow::Context;
use shsa_drawing::{Axis, Chart, Point, Scale, Series};
use shsa_format::text::seconds;
use std::fs;
use std::path::Path;

/// The largest number of points in the plot.
const POINTS: usize = 300;

/// The sentences for the terminal.
pub(super) fn text(measured: &Measured) -> String {
    sentences(measured).join("\n")
}

fn sentences(measured: &Measured) -> Vec<String> {
    let (shape, replayed) = (&measured.shape, &measured.replayed);
    let count = measured.observations();
    let mib = |bytes: f64| format!("{:.1} MiB", bytes / f64::from(1 << 20));
    vec![
        format!(
            "{:.2} h of {} signals at {} Hz: {:.1} million observations, a CSV file of {}.",
            shape.hours(),
            shape.signals,
            shape.rate,
            count / 1e6,
            mib(measured.file_bytes)
        ),
        format!(
            "Replayed in {}, the first look at the file included: {:.2} million observations a second, {:.0} times as fast \
             as it was; events: {}.",
            seconds(replayed.seconds),
            count / replayed.seconds / 1e6,
            shape.hours() * 3_600.0 / replayed.seconds,
            measured.events()
        ),
        format!(
            "Resident memory: at most {}; {} after a quarter of the time, {} at the end.",
            mib(measured.peak_bytes()),
            mib(measured.memory_at(0.25)),
            mib(measured.memory_at(0.98))
        ),
    ]
}

/// Writes `day.md`, its plot and the raw results.
pub(super) fn write(folder: &Path, measured: &Measured) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let put = |name: &str, text: String| {
        let path = folder.join(name);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    };
    put("day.jsonl", format!("{}\n", measured.to_json()))?;
    put("day-memory.svg", chart(measured).svg())?;
    let shape = &measured.shape;
    let list: String = sentences(measured).iter().map(|sentence| format!("- {sentence}\n")).collect();
    put(
        "day.md",
        format!(
            "# A day of data

Written by `shsa-bench day --hours {} --signals {} --rate {} --out workshop/measured`. `shsa replay` ran over a CSV file in a process of its
own, whose resident memory was read every 20 ms; five signals of each variable are compared, one need is served.

{list}
![memory](day-memory.svg)
",
            shape.hours(),
            shape.signals,
            shape.rate
        ),
    )
}

fn chart(measured: &Measured) -> Chart {
    let memory = &measured.replayed.memory;
    let step = memory.len().div_ceil(POINTS).max(1);
    let points = memory.iter().step_by(step).map(|(at, bytes)| Point::exact(*at, *bytes)).collect();
    let axis =
        |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Linear };
    Chart {
        title: "Resident memory of a replay".into(),
        x: axis("time", "s"),
        y: axis("memory", "B"),
        series: vec![Series { name: "resident".into(), points }],
    }
}
