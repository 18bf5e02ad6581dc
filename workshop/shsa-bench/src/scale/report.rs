//! The results as a table, as plots and as a document.

use super::measure::Measured;
use super::{Arguments, model};
use anyhow::Context;
use shsa_drawing::{Axis, Chart, Point, Scale, Series};
use shsa_format::text::{self, seconds};
use std::fs;
use std::path::Path;

/// A column: its heading, the key of its value, and its format.
type Column = (&'static str, &'static str, fn(f64) -> String);

const COLUMNS: [Column; 14] = [
    ("relations", "relations", count),
    ("signals", "signals", count),
    ("needs", "needs", count),
    ("file", "file_bytes", bytes),
    ("load", "load_s", seconds),
    ("peak of loading", "load_peak_bytes", bytes),
    ("graph", "graph_s", seconds),
    ("a plan, median", "plan_median_s", seconds),
    ("table of losses", "table_s", seconds),
    ("its needs", "table_needs", count),
    ("a change, median", "change_median_s", seconds),
    ("worst", "change_worst_s", seconds),
    ("a change of structure, median", "structure_median_s", seconds),
    ("worst", "structure_worst_s", seconds),
];

/// A table for the terminal.
pub(super) fn table(all: &[Measured]) -> String {
    let heads = COLUMNS.map(|(head, ..)| head);
    text::table(&heads, all.iter().map(cells).collect())
}

/// Writes `scale.md`, its plots and the raw results.
pub(super) fn write(folder: &Path, arguments: &Arguments, all: &[Measured]) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let put = |name: &str, text: String| {
        let path = folder.join(name);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    };
    put("scale-time.svg", time(all).svg())?;
    put("scale-memory.svg", memory(all).svg())?;
    put("scale.jsonl", all.iter().map(|one| format!("{}\n", one.to_json())).collect())?;
    put("scale.md", document(arguments, all))
}

fn cells(one: &Measured) -> Vec<String> {
    COLUMNS.iter().map(|&(_, key, write)| write(one.get(key))).collect()
}

fn time(all: &[Measured]) -> Chart {
    let series = [
        ("load from JSON", "load_s"),
        ("table of losses", "table_s"),
        ("a change of structure, worst", "structure_worst_s"),
        ("graph", "graph_s"),
        ("a change, worst", "change_worst_s"),
        ("a plan, median", "plan_median_s"),
    ];
    chart("Time by relations", "time", "s", &series, all)
}

fn memory(all: &[Measured]) -> Chart {
    let series = [
        ("with graph and table", "peak_bytes"),
        ("peak of loading, text included", "load_peak_bytes"),
        ("file", "file_bytes"),
    ];
    chart("Memory by relations", "memory", "B", &series, all)
}

fn chart(title: &str, label: &str, unit: &str, series: &[(&str, &str)], all: &[Measured]) -> Chart {
    let axis = |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Log };
    let points = |key| all.iter().map(|one| Point::exact(one.get("relations"), one.get(key))).collect();
    let series =
        series.iter().map(|&(name, key)| Series { name: name.into(), points: points(key) }).collect();
    Chart { title: title.into(), x: axis("relations", ""), y: axis(label, unit), series }
}

fn document(arguments: &Arguments, all: &[Measured]) -> String {
    let sizes: Vec<String> = arguments.sizes.iter().map(usize::to_string).collect();
    let head = COLUMNS.map(|(head, ..)| head).join(" | ");
    let rule = "---|".repeat(COLUMNS.len());
    let rows: String = all.iter().map(|one| format!("| {} |\n", cells(one).join(" | "))).collect();
    let parts = all.last().map(parts).unwrap_or_default();
    let limited: f64 = all.iter().map(|one| one.get("plans_limited")).sum();
    format!(
        "# Scale

Written by `shsa-bench scale --sizes {} --seed {} --out workshop/measured`; the numbers are in `scale.jsonl`.

{}

| {head} |
|{rule}
{rows}
- *load* reads the file, checks everything and builds the knowledge base; *peak* is the largest resident memory of the
  process until then (VmHWM), the text included.
- *graph* prepares the searches. *a plan* is the best substitution of a need, its own signals left out; {limited} searches
  were stopped by a limit or found none.
- *table of losses* holds the best plans of every need for every single lost signal, *its needs* are those for which it
  does: a limit bounds the set-up of each.
- *a change*: a signal is lost, or comes back; until graph and table are current again.
- *a change of structure*: a relation is added, or a signal removed, in the middle of the model; until graph and table are
  those of the new knowledge base, once that is checked. {parts}

![time](scale-time.svg)

![memory](scale-memory.svg)
",
        sizes.join(","),
        arguments.seed,
        model::DESCRIPTION,
    )
}

/// The parts of the time of a change of structure.
fn parts(one: &Measured) -> String {
    format!(
        "Of {} relations, matching the elements of both takes {}, the table {} (of its {} searches, at most {} are made \
         again), and the graph, which is made anew, {}: loading a model, with all checks, takes {:.0} times as long.",
        count(one.get("relations")),
        seconds(one.get("structure_match_s")),
        seconds(one.get("structure_table_s")),
        count(one.get("table_searches")),
        count(one.get("structure_searches")),
        seconds(one.get("structure_graph_s")),
        one.get("load_s") / one.get("structure_graph_s"),
    )
}

fn count(value: f64) -> String {
    let digits = format!("{value:.0}");
    let grouped: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|three| std::str::from_utf8(three).unwrap_or_default())
        .collect();
    grouped.join(",")
}

fn bytes(value: f64) -> String {
    if value.is_nan() { "unknown".to_owned() } else { format!("{:.1} MiB", value / f64::from(1 << 20)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_for_people() {
        assert_eq!([count(7.0), count(1_000.0), count(1_234_567.0)], ["7", "1,000", "1,234,567"]);
        assert_eq!([bytes(f64::from(3 << 20)), bytes(f64::NAN)], ["3.0 MiB", "unknown"]);
    }
}
