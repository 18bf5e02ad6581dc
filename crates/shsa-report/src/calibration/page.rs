//! A calibration as one page for the browser, without scripts and external resources.

use super::Report;
use super::text::{Columns, moments};
use crate::page::{document, paragraphs, section, table};
use crate::style::Style;
use shsa_drawing::escaped;

pub(super) fn page(report: &Report<'_>, title: &str) -> String {
    let of = |columns: Columns| table(&columns.head, columns.rows);
    let smallest = report.smallest.map(|smallest| {
        section("Smallest faults", &escaped(&moments(smallest)), &of(report.faults(smallest)))
    });
    let items: String =
        report.remarks().iter().map(|remark| format!("<li>{}</li>\n", escaped(remark))).collect();
    let remarks = if items.is_empty() { items } else { format!("<ul class=\"remarks\">\n{items}</ul>\n") };
    let patch = match report.refusal {
        Some(_) => String::new(),
        None => format!(
            "<pre class=\"model\">{}</pre>\n",
            escaped(&report.patch(Style { width: Some(WIDTH), ..Style::PLAIN }))
        ),
    };
    let sections = [
        result(report),
        section("What was fitted", NUMBERS, &of(report.numbers())),
        smallest.unwrap_or_default(),
        section("Remarks", "", &remarks),
        section("Comparisons", PAIRS, &of(report.pairs())),
        section("Signals", SIGNALS, &of(report.rhythms())),
        section("The change of the model", PATCH, &patch),
    ];
    document(&escaped(title), "calibration", &escaped(&report.promised()), &sections.concat())
}

/// Comments of the patch are wrapped here, characters.
const WIDTH: usize = 110;

const NUMBERS: &str = "Errors of signals and of relations, as the model has them and as they were fitted. An error is what is there all \
    the time, and a multiple of the deviation.";
const PAIRS: &str = "Two ways of knowing a variable in the fitted part: their mean difference, its spread, and what error their parts \
    get together. A relation that is not shown to hold is left as it is.";
const SIGNALS: &str = "What was seen of each signal in the fitted part.";
const PATCH: &str = "<code>shsa model patch</code> writes it into the file of the model; <code>shsa replay --reload</code> tries it.";

/// What the fitted model did in the part that was not fitted.
fn result(report: &Report<'_>) -> String {
    let is_well = report.refusal.is_none() && report.found.after.failed == 0;
    let lines =
        [Some(report.tested()), report.refusal.map(|why| format!("The fitted numbers are not used: {why}"))];
    let class = if is_well { "notes well" } else { "notes" };
    format!("<div class=\"{class}\">\n{}</div>\n", paragraphs(lines.into_iter().flatten()))
}
