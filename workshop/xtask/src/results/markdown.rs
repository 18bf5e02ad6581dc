//! Tables and figures as Markdown.

use super::replay::{Fault, Need, Verdict};
use std::collections::BTreeSet;

/// A table with its header; the columns are aligned, so that the source can be read, too.
pub(super) fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let header: Vec<String> = header.iter().map(|&title| title.to_owned()).collect();
    let width = |column: usize| {
        let cells = rows.iter().chain([&header]).filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}")).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let rule: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
    let body: String = rows.iter().map(line).collect();
    format!("{}| {} |\n{body}", line(&header), rule.join(" | "))
}

/// A line of code.
pub(super) fn code(text: &str) -> String {
    format!("`{text}`")
}

/// The verdicts about a faulty signal, with their latencies.
pub(super) fn verdict(verdict: &Verdict, fault: &Fault) -> [String; 2] {
    let after = |time_s: f64| format!("{:.2} s", time_s - fault.start_s());
    match (verdict.suspected_s, &verdict.named) {
        (None, None) => ["not detected".to_owned(), String::new()],
        (Some(suspected), Some((kind, named))) if suspected < *named => {
            [format!("suspected, then {kind}"), format!("{}, {}", after(suspected), after(*named))]
        }
        (_, Some((kind, named))) => [kind.clone(), after(*named)],
        (Some(suspected), None) => ["suspected".to_owned(), after(suspected)],
    }
}

/// Names, or a dash for none.
pub(super) fn names(names: &BTreeSet<&str>) -> String {
    if names.is_empty() { "-".to_owned() } else { names.iter().copied().collect::<Vec<_>>().join(", ") }
}

/// Longest gap, and error relative to the run without the fault.
pub(super) fn served(need: Option<&Need>) -> [String; 2] {
    let Some(need) = need else { return ["-".to_owned(), "-".to_owned()] };
    let rmse = need.rmse.map_or("-".to_owned(), |rmse| format!("{rmse:.3}"));
    [format!("{:.2} s", need.longest_gap_s), rmse]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_aligned() {
        let rows = [vec!["a".to_owned(), "long cell".to_owned()], vec!["bcd".to_owned(), String::new()]];
        let expected = "\
| x   | y         |
| --- | --------- |
| a   | long cell |
| bcd |           |
";
        assert_eq!(table(&["x", "y"], &rows), expected);
    }

    #[track_caller]
    fn check(suspected_s: Option<f64>, named: Option<f64>, expected: &str) {
        let fault = Fault { kind: "drop", signal: "a", start_ms: 20_000 };
        let found = Verdict { suspected_s, named: named.map(|time_s| ("silent".to_owned(), time_s)) };
        assert_eq!(verdict(&found, &fault).join(": "), expected);
    }

    #[test]
    fn a_verdict_tells_its_delay() {
        check(None, None, "not detected: ");
        check(Some(20.5), None, "suspected: 0.50 s");
        check(None, Some(21.0), "silent: 1.00 s");
        check(Some(20.5), Some(21.0), "suspected, then silent: 0.50 s, 1.00 s");
        check(Some(30.0), Some(21.0), "silent: 1.00 s");
    }
}
