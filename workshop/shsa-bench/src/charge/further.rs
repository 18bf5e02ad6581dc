//! Failures of other sizes and at other times than those that the model was made with.

use super::cell::Recording;
use super::modelled::{FAILURES, Failure, METHODS, Run, run};
use crate::in_loop::Recorded;
use crate::table::Table;

/// Failures of other sizes.
const SIZES: [Failure; 24] = [
    ("current", "offset 0.5 A", "bias=0.5"),
    ("current", "offset -2 A", "bias=-2"),
    ("current", "offset 5 A", "bias=5"),
    ("current", "offset -10 A", "bias=-10"),
    ("current", "drift 0.07 A/h", "drift=0.00002"),
    ("current", "drift -0.7 A/h", "drift=-0.0002"),
    ("current", "scale 0.9", "scale=0.9"),
    ("current", "scale 1.1", "scale=1.1"),
    ("current", "scale -1", "scale=-1"),
    ("current", "noise 1 A", "noise=1"),
    ("current", "noise 10 A", "noise=10"),
    ("current", "outliers of 5 A", "spike=5"),
    ("current", "outliers of -50 A", "spike=-50"),
    ("voltage", "offset 30 mV", "bias=0.03"),
    ("voltage", "offset -200 mV", "bias=-0.2"),
    ("voltage", "drift 7 mV/h", "drift=0.000002"),
    ("voltage", "drift -70 mV/h", "drift=-0.00002"),
    ("voltage", "scale 1.01", "scale=1.01"),
    ("voltage", "scale 0.98", "scale=0.98"),
    ("voltage", "scale 1.1", "scale=1.1"),
    ("voltage", "noise 30 mV", "noise=0.03"),
    ("voltage", "noise 500 mV", "noise=0.5"),
    ("voltage", "outliers of 0.2 V", "spike=0.2"),
    ("voltage", "outliers of -3 V", "spike=-3"),
];

/// Runs the model by its own method over its recording, and prints an object for each run where `is_json`. What the note says beside how
/// the failures were chosen is of this recording.
///
/// # Errors
/// The model is wrong.
pub(super) fn table(
    title: &str,
    note: &str,
    model: &str,
    recording: &Recording,
    is_json: bool,
) -> anyhow::Result<Table> {
    let recorded = Recorded::new(model, &recording.file)?;
    let later = FAILURES.into_iter().map(|failure| (failure, 0.75));
    let mut rows = Vec::new();
    for (failure, share) in later.chain(SIZES.into_iter().map(|failure| (failure, 0.5))) {
        let run = run(&recorded, METHODS[0], Some(failure), &recording.rows, share)?;
        if is_json {
            run.print(recording)?;
        }
        let (sensor, how, _) = failure;
        rows.push(vec![sensor.to_owned(), how.to_owned(), format!("{:.0} %", 100.0 * share), shown(&run)]);
    }
    let head = ["sensor", "failure", "begins after", "error"];
    Ok(Table {
        title: title.to_owned(),
        note: format!("{CHOSEN} {note}"),
        head: head.map(str::to_owned).into(),
        rows,
    })
}

/// The errors of the charge, and the longest gap of a need where it is too long.
fn shown(run: &Run) -> String {
    let gap = run.gaps_s.into_iter().fold(0.0, f64::max);
    let late = if gap > 150.0 { format!(", gap {gap:.0} s") } else { String::new() };
    format!(
        "{:.2} ({:.2}){late}",
        100.0 * run.share(run.charge.rms()),
        100.0 * run.share(run.charge.greatest())
    )
}

const CHOSEN: &str = "\
The kinds and sizes of the failures above, and their time, were known when the model was made, and those of the 24 failures of other sizes when the \
filter was last changed, as told of the other recording. The failures that begin after 75 % of the recording decided nothing. Where a need is not met for longer than 150 s, the gap is given.";
