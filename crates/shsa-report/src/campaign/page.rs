//! A campaign as one HTML page: heat maps of faults by signals, the text, and every figure.

use super::text::{NOT_COUNTED, head, latency, not_counted_rows};
use shsa_core::knowledge::SignalId;
use shsa_format::drawing::{Heat, escaped};
use shsa_lab::campaign::{Campaign, Cell, Comparison, LEGEND, Tally, What, rounded};
use std::fmt::Write;

const STYLE: &str = "
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; padding: 0 1.5rem; max-width: 1400px;
  background: #ffffff; color: #10151b; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
.maps { display: flex; flex-wrap: wrap; gap: 1.5rem; }
.map, .wide { overflow-x: auto; max-width: 100%; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .7rem; border-bottom: 1px solid #d5dae0; text-align: right; white-space: nowrap; }
th:nth-child(-n+2), td:nth-child(-n+2) { text-align: left; }
dt { font-weight: 600; } dd { margin: 0 0 .4rem 1.2rem; }
@media (prefers-color-scheme: dark) {
  body { background: #10151b; color: #e6edf3; } th, td { border-color: #363d46; }
}";

/// A cell with its figures.
type Counted<'a> = (&'a Cell, Tally);

/// The page; `title` is the name of the model's file.
#[must_use]
pub fn page(campaign: &Campaign<'_>, title: &str, comparison: Option<&Comparison>) -> String {
    let counted: Vec<Counted<'_>> = campaign.grid.cells.iter().zip(campaign.by_cell()).collect();
    let mut html = String::new();
    let title = escaped(title);
    put(&mut html, format_args!("<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">"));
    put(
        &mut html,
        format_args!("<meta name=\"viewport\" content=\"width=device-width\"><title>{title}</title>"),
    );
    put(&mut html, format_args!("<style>{STYLE}</style></head>\n<body>\n<h1>Faults tried on {title}</h1>"));
    for line in head(campaign).lines() {
        put(&mut html, format_args!("<p>{}</p>", escaped(line)));
    }
    if !campaign.grid.left_out.is_empty() {
        put(&mut html, format_args!("<p>Left out: {}</p>", escaped(&campaign.grid.left_out.join("; "))));
    }
    let rows = not_counted_rows(campaign);
    if !rows.is_empty() {
        put(&mut html, format_args!("<h2>What is in no share, and what was accused before</h2>"));
        put_table(&mut html, &NOT_COUNTED.map(str::to_owned), rows.into_iter().map(Vec::from));
    }
    if let Some(comparison) = comparison {
        put_comparison(&mut html, comparison);
    }
    put(&mut html, format_args!("<div class=\"maps\">"));
    for heat in maps(campaign, &counted) {
        put(&mut html, format_args!("<div class=\"map\">{}</div>", heat.svg()));
    }
    put(&mut html, format_args!("</div>\n<h2>What the words mean</h2>\n<dl>"));
    for (word, meaning) in LEGEND {
        put(&mut html, format_args!("<dt>{word}</dt><dd>{}</dd>", escaped(meaning)));
    }
    put(&mut html, format_args!("</dl>\n<h2>Every figure</h2>"));
    put_figures(&mut html, campaign, &counted);
    put(&mut html, format_args!("</body>\n</html>"));
    html
}

/// Adds a line; writing to a string cannot fail.
fn put(html: &mut String, line: std::fmt::Arguments<'_>) {
    let _ = writeln!(html, "{line}");
}

fn maps(campaign: &Campaign<'_>, counted: &[Counted<'_>]) -> Vec<Heat> {
    let duration = campaign.grid.duration.seconds();
    let mut maps = vec![
        heat(campaign, counted, "Detected, share of the runs", |tally| tally.share(tally.detected)),
        heat(campaign, counted, "Isolated, share of the runs", |tally| tally.share(tally.isolated)),
        heat(campaign, counted, "Wrong blame, share of the runs", |tally| tally.share(tally.wrong_blame)),
        heat(campaign, counted, &format!("Median latency, share of the fault's {duration:.1} s"), |tally| {
            tally.median().map(|latency| latency.seconds() / duration)
        }),
    ];
    for (number, (id, need)) in campaign.knowledge().needs().enumerate().enumerate() {
        let of_need = |tally: &Tally| tally.needs.get(number).copied().unwrap_or_default();
        let unmet = format!("{} unmet, share of the runs", need.signal);
        maps.push(heat(campaign, counted, &unmet, |tally| tally.share(of_need(tally).0)));
        let most = counted.iter().map(|(_, tally)| of_need(tally).1).fold(0.0, f64::max);
        let (shown, unit) = campaign.error(id, most);
        if most > 0.0 {
            let title = format!("{} error, share of {}{unit}", need.signal, rounded(shown));
            let share = |tally: &Tally| (tally.runs > 0).then(|| of_need(tally).1 / most);
            maps.push(heat(campaign, counted, &title, share));
        }
    }
    maps
}

/// A heat map of faults by signals.
fn heat(
    campaign: &Campaign<'_>,
    counted: &[Counted<'_>],
    title: &str,
    value: impl Fn(&Tally) -> Option<f64>,
) -> Heat {
    let grid = campaign.grid;
    let names = |signal: &SignalId| campaign.knowledge().signals()[*signal].name.clone();
    let at = |what: &What, signal: &SignalId| {
        let of_both = |(cell, _): &&Counted<'_>| cell.what == *what && cell.signal == *signal;
        counted.iter().find(of_both).and_then(|(_, tally)| value(tally))
    };
    Heat {
        title: title.to_owned(),
        row: "fault".to_owned(),
        column: "faulty signal".to_owned(),
        rows: grid.whats.iter().map(|what| what.label()).collect(),
        columns: grid.signals.iter().map(names).collect(),
        cells: grid
            .whats
            .iter()
            .map(|what| grid.signals.iter().map(|signal| at(what, signal)).collect())
            .collect(),
    }
}

fn put_comparison(html: &mut String, comparison: &Comparison) {
    put(html, format_args!("<h2>What has changed</h2>\n<p>{}</p>", escaped(&comparison.summary())));
    if comparison.changes.is_empty() {
        return;
    }
    let rows = comparison.changes.iter().map(|change| {
        let word = if change.is_better { "better" } else { "worse" };
        let cells = [&change.fault, &change.signal, &change.figure, &change.before, &change.now];
        cells.into_iter().cloned().chain([word.to_owned()]).collect()
    });
    put_table(html, &["fault", "signal", "figure", "before", "now", ""].map(str::to_owned), rows);
}

fn put_figures(html: &mut String, campaign: &Campaign<'_>, counted: &[Counted<'_>]) {
    let plain = [
        "fault",
        "signal",
        "amount",
        "runs",
        "detected",
        "isolated",
        "wrong blame",
        "not told",
        "false alarms",
        "latency, median",
        "worst",
        "without effect",
    ];
    let mut heads: Vec<String> = plain.map(str::to_owned).into();
    for need in campaign.knowledge().needs() {
        heads.extend([format!("{} unmet", need.signal), "error".to_owned()]);
    }
    put_table(html, &heads, counted.iter().map(|counted| figures(campaign, counted)));
}

fn figures(campaign: &Campaign<'_>, (cell, tally): &Counted<'_>) -> Vec<String> {
    let mut row = vec![
        cell.what.label(),
        campaign.knowledge().signals()[cell.signal].name.clone(),
        cell.size.map_or("-".to_owned(), rounded),
    ];
    let counts = [
        tally.runs,
        tally.detected,
        tally.isolated,
        tally.wrong_blame,
        tally.runs - tally.detected,
        tally.false_alarms,
    ];
    row.extend(counts.map(|count| count.to_string()));
    row.extend([latency(tally.median()), latency(tally.worst()), tally.without_effect.to_string()]);
    for (id, (unmet, error)) in campaign.knowledge().needs().ids().zip(&tally.needs) {
        let (error, unit) = campaign.error(id, *error);
        row.extend([unmet.to_string(), format!("{}{unit}", rounded(error))]);
    }
    row
}

fn put_table(html: &mut String, heads: &[String], rows: impl Iterator<Item = Vec<String>>) {
    let line = |cells: &[String], tag: &str| {
        let cells = cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell)));
        format!("<tr>{}</tr>", cells.collect::<String>())
    };
    put(html, format_args!("<div class=\"wide\"><table>\n{}", line(heads, "th")));
    rows.for_each(|row| put(html, format_args!("{}", line(&row, "td"))));
    put(html, format_args!("</table></div>"));
}
