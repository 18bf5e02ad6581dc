//! The results as tables, as a plot and as a document, ratios first.

use super::measure::Measured;
use super::rival::Rival;
use super::{Arguments, Found};
use anyhow::Context;
use shsa_drawing::{Axis, Chart, Point, Scale, Series};
use shsa_format::text::{seconds, table};
use std::fs;
use std::path::Path;

/// Observations a second of the public program on the generic experiment, with the smallest buffer.
const PUBLIC: f64 = 7_186.0;

/// The goal of a case.
enum Goal {
    /// Observations a second, at least.
    Rate(f64),
    /// Share of a core, below.
    Share(f64),
}

/// The goals of the cases, in their order.
const GOALS: [Goal; 5] =
    [Goal::Rate(5e6), Goal::Rate(1e6), Goal::Share(0.2), Goal::Share(0.2), Goal::Share(0.01)];

const HEAD: [&str; 8] =
    ["case", "of the goal", "public", "goal", "measured", "an observation", "ways", "pairs"];
const CROWD_HEAD: [&str; 4] = ["ways", "an observation", "pairs", "a pair"];

fn rows(found: &Found) -> Vec<Vec<String>> {
    let mut rows: Vec<Vec<String>> =
        found.cases.iter().zip(&GOALS).map(|(measured, goal)| row(measured, goal)).collect();
    for rival in &found.rivals {
        let rate = |rate: f64| format!("{}/s", millions(rate));
        rows.push(vec![
            rival.case.to_owned(),
            times(rival.ratio()),
            format!("RTLola {}", rate(rival.rtlola)),
            "RTLola".to_owned(),
            rate(rival.ours),
            seconds(1.0 / rival.ours),
            "3".to_owned(),
            "3".to_owned(),
        ]);
    }
    rows
}

/// The ratio is above 1 when the case is better than its goal.
fn row(measured: &Measured, goal: &Goal) -> Vec<String> {
    let (ratio, wanted, reached) = match goal {
        Goal::Rate(rate) => {
            let reached = format!("{}/s", millions(measured.rate()));
            (measured.rate() / rate, format!("{}/s", millions(*rate)), reached)
        }
        Goal::Share(share) => {
            let reached = percent(measured.share());
            (share / measured.share(), format!("below {}", percent(*share)), reached)
        }
    };
    let public = match goal {
        Goal::Rate(_) => times(measured.rate() / PUBLIC),
        Goal::Share(_) => String::new(),
    };
    vec![
        measured.case.clone(),
        times(ratio),
        public,
        wanted,
        reached,
        seconds(1.0 / measured.rate()),
        measured.ways.to_string(),
        measured.pairs.to_string(),
    ]
}

fn crowd_rows(found: &Found) -> Vec<Vec<String>> {
    let row = |measured: &Measured| {
        let each = 1.0 / measured.rate();
        // An observation completes one way, which is in a pair with every other.
        let partners = measured.ways.saturating_sub(1).max(1);
        vec![
            measured.ways.to_string(),
            seconds(each),
            measured.pairs.to_string(),
            seconds(each / partners as f64),
        ]
    };
    found.crowds.iter().map(row).collect()
}

/// Tables for the terminal.
pub(super) fn text(found: &Found) -> String {
    format!("{}\n\n{}", table(&HEAD, rows(found)), table(&CROWD_HEAD, crowd_rows(found)))
}

/// Writes `monitor.md`, its plot and the raw results.
pub(super) fn write(folder: &Path, arguments: &Arguments, found: &Found) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let put = |name: &str, text: String| {
        let path = folder.join(name);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    };
    let lines = found.cases.iter().chain(&found.crowds).map(Measured::to_json);
    let lines = lines.chain(found.rivals.iter().map(Rival::to_json));
    put("monitor.jsonl", lines.map(|line| format!("{line}\n")).collect())?;
    put("monitor-ways.svg", chart(found).svg())?;
    put("monitor.md", document(arguments, found))
}

fn chart(found: &Found) -> Chart {
    let axis = |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Log };
    let points = found.crowds.iter().map(|each| Point::exact(each.ways as f64, 1.0 / each.rate()));
    Chart {
        title: "Time of an observation by ways of knowing its variable".into(),
        x: axis("ways", ""),
        y: axis("time", "s"),
        series: vec![Series { name: "an observation".into(), points: points.collect() }],
    }
}

fn document(arguments: &Arguments, found: &Found) -> String {
    let rtlola = if arguments.rtlola { " --rtlola" } else { "" };
    let [scan, row] = super::model::SCAN;
    format!(
        "# What watching costs

Written by `shsa-bench monitor --turn {}{rtlola} --out workshop/measured`; each measurement is a line in `monitor.jsonl`. One core, time on
the processor, the fastest of five turns; making the observation is included.

{}
- *of the goal*: how many times better than the goal (above 1: reached). *public*: how many times as many observations as
  the thesis's own program, which takes {PUBLIC} a second (Python 3.11, smallest buffer), not of this run.
- *generic*: the thesis's generic experiment, three signals of one variable, each at its own moment; the default mode is the
  whole engine with its monitor and diagnosis. *thesis mode* is the published method, a step of three observations.
- *plant*: 2,000 variables, each carried by 5 signals, so that every signal has 4 substitutes; 10,000 signals at 10 Hz, each at
  a moment of its own. *computed*: each variable is measured by one signal and computed by 4 relations from signals of their own.
  The share is that of one core.
- *scan and image row*: the distance of the nearest obstacle as the least of {scan} beams and as the least of {row} values of a
  depth image's row, both at 30 Hz; the need is served from them.
- *interval check*: three signals with their errors, every two compared; RTLola's interpreter (crate `rtlola-interpreter`) runs a
  specification of the same, with an event for each observation, and with one event for three that come at one moment. Ours is
  the whole engine. Both in turns, by `cargo run --release --manifest-path workshop/shsa-bench/rtlola/Cargo.toml`.

## Ways of knowing one variable

Each observation completes one way; *a pair* is its time by the ways that it can be compared with.

{}
![time by ways](monitor-ways.svg)
",
        arguments.turn,
        markdown(&HEAD, &rows(found)),
        markdown(&CROWD_HEAD, &crowd_rows(found)),
    )
}

fn markdown(head: &[&str], rows: &[Vec<String>]) -> String {
    let rule = "---|".repeat(head.len());
    let rows: String = rows.iter().map(|row| format!("| {} |\n", row.join(" | "))).collect();
    format!("| {} |\n|{rule}\n{rows}", head.join(" | "))
}

/// `5.2 M`, `7.2 k`.
fn millions(value: f64) -> String {
    let (scaled, unit) = if value < 1e6 { (value / 1e3, "k") } else { (value / 1e6, "M") };
    format!("{scaled:.1} {unit}")
}

fn percent(share: f64) -> String {
    let percent = share * 100.0;
    let digits = if percent < 0.995 { 3 } else { usize::from(percent < 99.5) };
    format!("{percent:.digits$} %")
}

fn times(ratio: f64) -> String {
    let digits = usize::from(ratio < 99.5) + usize::from(ratio < 9.95);
    format!("{ratio:.digits$}x")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_for_people() {
        assert_eq!([millions(7_186.0), millions(5.04e6)], ["7.2 k", "5.0 M"]);
        assert_eq!([percent(0.2), percent(0.01), percent(0.000_5)], ["20.0 %", "1.0 %", "0.050 %"]);
        assert_eq!([times(1.234), times(12.34), times(696.4)], ["1.23x", "12.3x", "696x"]);
    }
}
