//! What a page draws: the stretch of each finding, and all columns over time.

use super::Report;
use serde_json::{Value, json};
use shsa_lab::doctor::Finding;
use shsa_lab::drafting::Columns;

/// The findings with their drawings.
pub(super) fn json(report: &Report<'_>) -> Value {
    report.diagnosis.findings.iter().map(|it| of_finding(report, it)).collect()
}

fn of_finding(report: &Report<'_>, finding: &Finding) -> Value {
    let points = |of: &[(f64, f64)]| -> Vec<(f64, f64)> {
        of.iter().map(|(time, value)| (report.in_session(*time).1, *value)).collect()
    };
    let stretch = |(from, to): &(f64, f64)| (report.in_session(*from).1, report.in_session(*to).1);
    json!({
        "headline": report.headline(finding),
        "when": report.when(finding),
        "evidence": report.evidence(finding),
        "signals": report.names(&finding.signals),
        "named": finding.is_named(),
        "of": report.name(finding.in_unit_of),
        "unit": report.unit(finding.in_unit_of).trim(),
        "stretches": finding.stretches.iter().map(stretch).collect::<Vec<_>>(),
        "own": points(&finding.chart.own),
        "expected": points(&finding.chart.expected),
    })
}

/// Each column as `[time, lowest, highest]` of the stretches in which it has values; time in seconds of all recordings together.
pub(super) fn columns(columns: &Columns, stretches: usize) -> Value {
    let points = || columns.columns.iter().map(|column| &column.signal.points);
    let first = points().filter_map(|it| it.first()).map(|it| it.0).fold(f64::INFINITY, f64::min);
    let last = points().filter_map(|it| it.last()).map(|it| it.0).fold(f64::NEG_INFINITY, f64::max);
    let width = ((last - first) / stretches.max(1) as f64).max(f64::MIN_POSITIVE);
    let of = |(column, about): (&_, &shsa_lab::drafting::About)| {
        let column: &shsa_lab::drafting::Column = column;
        json!({
            "signal": about.signal,
            "source": about.source,
            "unit": column.signal.unit.as_ref().map(ToString::to_string),
            "count": column.signal.points.len(),
            "longest_gap_s": longest_gap(&column.signal.points),
            "range": thinned(&column.signal.points, first, width),
        })
    };
    let all: Vec<Value> = columns.columns.iter().zip(&columns.about).map(of).collect();
    json!({ "from_s": first, "to_s": last, "columns": all })
}

/// The longest time between two values; `None` with fewer than two.
fn longest_gap(points: &[(f64, f64)]) -> Option<f64> {
    points.windows(2).map(|pair| pair[1].0 - pair[0].0).reduce(f64::max)
}

fn thinned(points: &[(f64, f64)], first: f64, width: f64) -> Vec<(f64, f64, f64)> {
    let stretch = |time: f64| ((time - first) / width).floor();
    let same = |one: &(f64, f64), other: &(f64, f64)| stretch(one.0) == stretch(other.0);
    let of = |points: &[(f64, f64)]| {
        let values = || points.iter().map(|it| it.1).filter(|it| it.is_finite());
        let lowest = values().reduce(f64::min)?;
        Some((points.first()?.0, lowest, values().reduce(f64::max)?))
    };
    points.chunk_by(same).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_keeps_its_lowest_and_its_highest_value() {
        let points = [(0.0, 1.0), (0.5, -3.0), (0.9, 2.0), (2.5, 7.0), (3.5, f64::NAN)];
        assert_eq!(thinned(&points, 0.0, 1.0), [(0.0, -3.0, 2.0), (2.5, 7.0, 7.0)]);
        assert_eq!(longest_gap(&points[..4]), Some(1.6));
        assert_eq!(longest_gap(&points[..1]), None);
    }
}
