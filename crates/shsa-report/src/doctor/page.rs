//! A diagnosis as one page for the browser, without scripts and external resources.

use super::Report;
use crate::page::{document, paragraphs, section, table};
use shsa_drawing::{Axis, Chart, Point, Scale, Series, escaped};
use shsa_lab::doctor::Finding;
use shsa_lab::naming::number;

/// The diagnosis as one page; `title` is the name of the recording.
pub(super) fn page(report: &Report<'_>, title: &str) -> String {
    let findings: String =
        report.diagnosis.findings.iter().enumerate().map(|(at, it)| card(report, at + 1, it)).collect();
    let groups = report.diagnosis.groups.iter().map(|it| vec![report.names(it).join(", ")]);
    let relations =
        report.diagnosis.relations.iter().map(|it| {
            vec![it.formula.clone(), number(it.deviation), format!("{} %", number(100.0 * it.share))]
        });
    let unchecked = report
        .diagnosis
        .unchecked
        .iter()
        .map(|(column, why)| vec![report.name(*column).to_owned(), (*why).to_owned()]);
    let model = format!("<pre class=\"model\">{}</pre>\n", escaped(&report.diagnosis.model));
    let sections = [
        section("Findings", FINDINGS, &findings),
        section("What measures the same", "", &table(&["signals"], groups)),
        section("Relations", RELATIONS, &table(&["relation", "deviation", "of the spread"], relations)),
        section("Not checked by anything here", "", &table(&["signal", "reason"], unchecked)),
        section("What one sensor more would bring", "", &paragraphs(report.more())),
        section("The model", MODEL, &model),
    ];
    document(&escaped(title), "doctor", &escaped(&report.summary()), &sections.concat())
}

/// A finding with its picture.
fn card(report: &Report<'_>, number: usize, finding: &Finding) -> String {
    let lines = std::iter::once(report.when(finding)).chain(report.evidence(finding));
    let chart = chart(report, finding)
        .map_or_else(String::new, |it| format!("<div class=\"graph\">{}</div>\n", it.svg()));
    format!("<h3>{number}. {}</h3>\n{}{chart}", escaped(&report.headline(finding)), paragraphs(lines))
}

fn chart(report: &Report<'_>, finding: &Finding) -> Option<Chart> {
    let name = report.name(finding.in_unit_of).to_owned();
    let points = |of: &[(f64, f64)]| {
        of.iter().map(|(time, value)| Point::exact(report.in_session(*time).1, *value)).collect::<Vec<_>>()
    };
    let own = Series { name: name.clone(), points: points(&finding.chart.own) };
    if own.points.is_empty() {
        return None;
    }
    let expected = Series { name: "what the others say".to_owned(), points: points(&finding.chart.expected) };
    let axis = |label: &str, unit: &str| Axis {
        label: label.to_owned(),
        unit: unit.to_owned(),
        scale: Scale::Linear,
    };
    let series = if expected.points.is_empty() { vec![own] } else { vec![own, expected] };
    let unit = report.unit(finding.in_unit_of);
    let label = if unit.is_empty() { name.clone() } else { format!("{name},{unit}") };
    Some(Chart { title: report.when(finding), x: axis("time, s", ""), y: axis(&label, ""), series })
}

const FINDINGS: &str = "What leaves a relation far outside of what it does in the remaining time, the largest first. No healthy part was assumed.";
const RELATIONS: &str = "They hold most of the time; the deviation is that of the remaining time.";
const MODEL: &str = "<code>shsa check</code> accepts it; <code>shsa calibrate</code> and <code>shsa replay</code> go on with it.";
