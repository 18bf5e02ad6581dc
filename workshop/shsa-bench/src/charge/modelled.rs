//! The charge that a model of the cell serves in the whole loop, with one sensor failing half-way.

use super::cell::{Recording, Row, after};
use crate::in_loop::{Recorded, Served, Shown};
use crate::table::{Errors, Table};
use serde_json::json;
use std::io::{Write, stdout};

/// The first one is that of the model.
pub(super) const METHODS: [&str; 3] = ["extended_kalman", "unscented_kalman", "student"];

/// A sensor, its failure, and the same in the notation of `shsa replay --inject`.
pub(super) type Failure = (&'static str, &'static str, &'static str);

pub(super) const FAILURES: [Failure; 17] = [
    ("current", "silent", "drop"),
    ("current", "stuck", "stuck"),
    ("current", "offset 1 A", "bias=1"),
    ("current", "offset 3 A", "bias=3"),
    ("current", "drift 0.18 A/h", "drift=0.00005"),
    ("current", "scale 1.05", "scale=1.05"),
    ("current", "noise 3 A", "noise=3"),
    ("current", "outliers of 20 A", "spike=20"),
    ("voltage", "silent", "drop"),
    ("voltage", "stuck", "stuck"),
    ("voltage", "offset 100 mV", "bias=0.1"),
    ("voltage", "offset -100 mV", "bias=-0.1"),
    ("voltage", "offset 500 mV", "bias=0.5"),
    ("voltage", "drift 18 mV/h", "drift=0.000005"),
    ("voltage", "scale 1.03", "scale=1.03"),
    ("voltage", "noise 100 mV", "noise=0.1"),
    ("voltage", "outliers of 1 V", "spike=1"),
];

/// The needs of the model.
const NEEDS: [&str; 2] = ["/cell/charge", "/cell/voltage"];

/// A run in one scenario.
pub(super) struct Run {
    method: &'static str,
    failure: Option<Failure>,
    /// The share of the recording after which the failure begins.
    begins: f64,
    capacity_ah: f64,
    /// Of the charge, in ampere-hours.
    pub(super) charge: Errors,
    /// Of the voltage, in volts.
    voltage: Errors,
    /// The longest time between two values, in seconds, of charge and voltage.
    pub(super) gaps_s: [f64; 2],
    /// The first accusation, and how long after the failure it came.
    accused: Option<(f64, String)>,
}

impl Run {
    /// A charge in ampere-hours in shares of the capacity.
    pub(super) fn share(&self, charge_ah: f64) -> f64 {
        charge_ah / self.capacity_ah
    }

    /// Prints what `--json` shows of it.
    pub(super) fn print(&self, recording: &Recording) -> anyhow::Result<()> {
        let line = json!({
            "recording": recording.name()?, "begins": self.begins, "model": self.method, "sensor": self.failure.map(|it| it.0), "failure": self.failure.map(|it| it.1),
            "rms": self.share(self.charge.rms()), "greatest": self.share(self.charge.greatest()),
            "voltage_rms_v": self.voltage.rms(), "voltage_greatest_v": self.voltage.greatest(),
            "charge_gap_s": self.gaps_s[0], "voltage_gap_s": self.gaps_s[1],
            "accused": self.accused.as_ref().map(|it| &it.1), "accused_after_s": self.accused.as_ref().map(|it| it.0),
        });
        Ok(writeln!(stdout().lock(), "{line}")?)
    }
}

/// Runs a model with each of the methods, without a failure and with each of those that are wanted half-way, and prints an object for each
/// run where `is_json`.
///
/// # Errors
/// The model is wrong, or has no fusion by the first method.
pub(super) fn runs(
    model: &str,
    methods: &[&'static str],
    failures: &[Failure],
    recording: &Recording,
    is_json: bool,
) -> anyhow::Result<Vec<Run>> {
    let word = format!("method: {}", METHODS[0]);
    anyhow::ensure!(model.contains(&word), "the model has no `{word}`");
    let mut runs = Vec::new();
    for method in methods {
        let text = model.replace(&word, &format!("method: {method}"));
        let recorded = Recorded::new(&text, &recording.file)?;
        for failure in std::iter::once(None).chain(failures.iter().copied().map(Some)) {
            let run = run(&recorded, method, failure, &recording.rows, 0.5)?;
            if is_json {
                run.print(recording)?;
            }
            runs.push(run);
        }
    }
    Ok(runs)
}

/// The failures that are asked for by kind and sensor; all without any.
pub(super) fn wanted(only: &[String]) -> Vec<Failure> {
    let is_wanted = |failure: &Failure| {
        only.is_empty() || only.iter().any(|it| *it == format!("{}:{}", failure.2, failure.0))
    };
    FAILURES.into_iter().filter(is_wanted).collect()
}

/// A run in which a sensor fails after a share of the recording.
pub(super) fn run(
    recorded: &Recorded,
    method: &'static str,
    failure: Option<Failure>,
    rows: &[Row],
    share: f64,
) -> anyhow::Result<Run> {
    let first_s = rows.first().map_or(0.0, |row| row.at_s);
    let fails_s = rows.get(after(rows, share)).map_or(0.0, |row| row.at_s);
    let fault = failure.map(|(sensor, _, kind)| format!("{kind}:{sensor}@{}s..", fails_s - first_s));
    let Shown { served, accused } = recorded.serve(fault.as_deref(), NEEDS)?;
    let from_s = if failure.is_some() { fails_s } else { first_s + 3600.0 };
    let capacity_ah = rows.iter().map(|row| row.charge_ah).fold(0.0, f64::max);
    let begin = recorded.span()?.0;
    let at_s = |served: &Served| first_s + (served.at - begin).seconds();
    let errors = |need: usize, unit: f64, truth: fn(&Row) -> f64| {
        let mut errors = Errors::default();
        for pair in served[need].windows(2) {
            let (at, since) = (at_s(&pair[1]), at_s(&pair[1]) - at_s(&pair[0]));
            if at >= from_s {
                errors.add(pair[1].value.midpoint() / unit - true_value(rows, at, truth), since);
            }
        }
        errors
    };
    // Ampere-hours are coulombs inside.
    let charge = errors(0, 3600.0, |row| row.charge_ah);
    let voltage = errors(1, 1.0, |row| row.voltage_v);
    let end = recorded.span()?.1;
    let gap = |served: &Vec<Served>| {
        let times = served.iter().map(|it| it.at).chain([end]);
        let gaps = times.clone().skip(1).zip(times).map(|(later, earlier)| (later - earlier).seconds());
        gaps.fold(0.0, f64::max)
    };
    let gaps_s = [gap(&served[0]), gap(&served[1])];
    let accused = accused.map(|(at, how)| (first_s + (at - begin).seconds() - fails_s, how));
    Ok(Run { method, failure, begins: share, capacity_ah, charge, voltage, gaps_s, accused })
}

/// A recorded quantity at a time, between two rows on the straight line.
fn true_value(rows: &[Row], at_s: f64, of: fn(&Row) -> f64) -> f64 {
    let after = rows.partition_point(|row| row.at_s <= at_s).clamp(1, rows.len() - 1);
    let (one, other) = (&rows[after - 1], &rows[after]);
    let share = ((at_s - one.at_s) / (other.at_s - one.at_s)).clamp(0.0, 1.0);
    of(one) + share * (of(other) - of(one))
}

/// A row for each failure, with the errors of all methods; the rest is of the first one.
pub(super) fn table(title: &str, note: &str, runs: &[Run], failures: &[Failure]) -> Table {
    let of = |failure: Option<Failure>| runs.iter().filter(move |run| run.failure == failure);
    let row = |failure: Option<Failure>| {
        let (sensor, how, _) = failure.unwrap_or(("", "all is well", ""));
        let first = of(failure).next();
        let errors = of(failure).map(|run| {
            format!(
                "{:.2} ({:.2})",
                100.0 * run.share(run.charge.rms()),
                100.0 * run.share(run.charge.greatest())
            )
        });
        let gap = |need: usize| first.map_or(String::new(), |run| format!("{:.0}", run.gaps_s[need]));
        let accused = first.and_then(|run| run.accused.as_ref());
        let accused = accused.map_or("-".to_owned(), |(after_s, how)| format!("{how} after {after_s:.0} s"));
        let named = [sensor.to_owned(), how.to_owned()];
        let off = first.map_or(String::new(), |run| {
            format!("{:.0} ({:.0})", 1e3 * run.voltage.rms(), 1e3 * run.voltage.greatest())
        });
        named.into_iter().chain(errors).chain([off, gap(0), gap(1), accused]).collect()
    };
    let head = ["sensor", "failure"].into_iter().chain(of(None).map(|run| run.method));
    let head = head.chain([
        "voltage off by, mV",
        "longest gap of the charge, s",
        "of the voltage, s",
        "first accused",
    ]);
    Table {
        title: title.to_owned(),
        note: note.to_owned(),
        head: head.map(str::to_owned).collect(),
        rows: std::iter::once(None).chain(failures.iter().copied().map(Some)).map(row).collect(),
    }
}

pub(super) const NOTE: &str = "\
The model's `fusion:` is the only source of the charge that knows the voltage, and the only source of the voltage without the \
faults of its sensor. A sensor fails from the middle of the \
recording on, for good. The columns of the methods give the error of the charge in percent of the capacity, as the root of its \
mean square over time (greatest); what follows is of the model's own method, `extended_kalman`. A need is met while its values \
are no older than 150 s; rows are up to 60 s apart.

A sensor that is silent, or repeats one reading for longer than it can be right, is excluded, and what it showed in the 5 minutes \
before is taken back. A sensor that lies \
otherwise is not accused: current and voltage make one equation over the charge, and what contradicts it may be either, or \
the curve. `shsa analyze models/cell-charge.yaml` has both among the faults that nothing shows, and one more sensor of \
the charge, the voltage or the current among what would help most: with it they could be told. But the filter follows what each fault \
would lead to: that a sensor has become off, by an amount or by a share, drifts, or has become noisy (`jumps` and `noisier`), or that one \
value is an outlier (`outliers`). What decides between them is how exactly the circuit is known, and that a load rests between its \
changes (`steps`): a current of which the sensor shows 3 A more at once, and the voltage nothing, has not changed. The model before, with a circuit \
that was 3.6 mV off, offsets that walk and a current of any course, was 2.7 % off (9.1 % at most) with an offset of 3 A, and 2.6 % (8.2 %) with \
outliers of 20 A. The kinds of the failures above were known when this model was made; the table below has others. A voltage of 4.2 V that the charger keeps is another witness: a \
sensor that shows it as another number is \
accused of being stuck, for as long as it lasts.

What bounds the error: a method that knows which sensor fails, and when, and leaves it out from then on, has the errors of the rows \
`silent`. The curve rises by 12 to 15 mV/Ah from a third to nine tenths of the capacity, so the error of the circuit above is an error \
of the charge of 0.6 %; the current alone is right to 0.1 %. What is above that is the time that it takes to tell which sensor fails.";
