//! The promised and the measured rates, as text, as JSON and as a document.

use super::Arguments;
use super::measure::{Measured, Recorded};
use serde_json::{Value, json};
use shsa_format::text::table;
use shsa_lab::calibration::{fewest_expected, most_expected};

/// All calibrations of one way of recording.
struct Summary {
    recorded: Recorded,
    calibrations: usize,
    refused: usize,
    hours: f64,
    alarms: usize,
    suspected: usize,
    failed: usize,
    holds: usize,
    quick: Option<f64>,
    lasting: Option<f64>,
    seconds: Option<f64>,
}

impl Summary {
    fn of(all: &[Measured], recorded: Recorded) -> Summary {
        // A patch that is not written makes no promise.
        let own = || all.iter().filter(move |it| it.recorded == recorded);
        let written: Vec<&Measured> = own().filter(|it| it.refused.is_none()).collect();
        let sum = |of: fn(&Measured) -> usize| -> usize { written.iter().map(|it| of(it)).sum() };
        Summary {
            recorded,
            calibrations: written.len(),
            refused: own().count() - written.len(),
            hours: written.iter().map(|it| it.hours).sum(),
            alarms: sum(|it| it.verdicts.alarms),
            suspected: sum(|it| it.verdicts.suspected),
            failed: sum(|it| it.verdicts.failed),
            holds: sum(|it| usize::from(it.holds)),
            quick: median(written.iter().flat_map(|it| &it.steps).map(|it| it.0)),
            lasting: median(written.iter().flat_map(|it| &it.steps).map(|it| it.1)),
            seconds: median(own().map(|it| it.seconds)),
        }
    }

    fn cells(&self, promise: f64) -> Vec<String> {
        let per_hour = |count: usize| count as f64 / self.hours;
        let optional = |it: Option<f64>| it.map_or_else(|| "-".to_owned(), |it| format!("{it:.2}"));
        vec![
            self.recorded.name().to_owned(),
            format!("{} ({} refused)", self.calibrations, self.refused),
            format!("{:.0}", self.hours),
            promise.to_string(),
            format!("{:.4} (at most {:.4})", per_hour(self.alarms), most_expected(self.alarms) / self.hours),
            format!("{} of {}", self.holds, self.calibrations),
            format!("{:.2}", 1e3 * per_hour(self.failed)),
            optional(self.quick),
            optional(self.lasting),
            optional(self.seconds),
        ]
    }

    fn to_json(&self, promise: f64) -> Value {
        json!({
            "recorded": self.recorded.name(),
            "calibrations": self.calibrations,
            "refused": self.refused,
            "hours": self.hours,
            "promised_per_hour": promise,
            "alarms": self.alarms,
            "suspected": self.suspected,
            "failed": self.failed,
            "alarms_per_hour": self.alarms as f64 / self.hours,
            "alarms_per_hour_at_most": most_expected(self.alarms) / self.hours,
            "holds": self.holds,
            "failed_per_1000_h": 1e3 * self.failed as f64 / self.hours,
            "median_step_over_quick_test": self.quick,
            "median_step_over_lasting_test": self.lasting,
            "median_seconds": self.seconds,
        })
    }
}

const HEAD: [&str; 10] = [
    "fitted",
    "calibrations",
    "hours watched",
    "promised an hour",
    "alarms an hour (95 %)",
    "promise holds",
    "failed in 1000 h",
    "step / test of 4",
    "step / test of 64",
    "seconds each",
];

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|it| it.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn rows(all: &[Measured], promise: f64) -> Vec<Vec<String>> {
    Recorded::ALL.iter().map(|it| Summary::of(all, *it).cells(promise)).collect()
}

/// A table for the terminal.
pub(super) fn text(all: &[Measured], promise: f64) -> String {
    table(&HEAD, rows(all, promise))
}

/// A line for each calibration, and one for each way of recording.
pub(super) fn lines(all: &[Measured], promise: f64) -> String {
    let one = |it: &Measured| {
        json!({
            "plant": it.plant, "recorded": it.recorded.name(), "signals": it.signals, "factor": it.factor,
            "refused": it.refused, "hours": it.hours, "alarms": it.verdicts.alarms, "suspected": it.verdicts.suspected,
            "failed": it.verdicts.failed, "false_alarms": it.false_alarms, "holds": it.holds, "holds_by": fewest_expected(it.verdicts.alarms) / it.hours,
            "steps": it.steps, "seconds": it.seconds,
        })
        .to_string()
    };
    let summaries = Recorded::ALL.iter().map(|it| Summary::of(all, *it).to_json(promise).to_string());
    all.iter().map(one).chain(summaries).collect::<Vec<_>>().join("\n")
}

/// The document.
pub(super) fn document(all: &[Measured], arguments: &Arguments) -> String {
    let row = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let head = row(&HEAD.map(str::to_owned));
    let rule = row(&HEAD.map(|_| "---".to_owned()));
    let body: String = rows(all, arguments.promise).iter().map(|it| row(it)).collect();
    format!(
        "# Promise and power

Written by `shsa-bench truth --plants {} --hours {} --seed {} --out workshop/measured`. Random plants with known truth, each calibrated and
watched for other hours; every session has offsets of its own. A promise holds unless the lower 95 % bound of the observed rate
exceeds it. A step counts when it is detected with either sign, at each of three onsets, within two minutes. It is divided by the
step that a likelihood ratio test with exact knowledge of the noise detects, over windows of up to 4 and 64 values, with as many
false alarms.

{head}{rule}{body}",
        arguments.plants, arguments.hours, arguments.seed
    )
}
