//! A campaign as one HTML page: heat maps of faults by signals, the text, and every figure.

use super::text::{NOT_COUNTED, head, latency, not_counted_rows};
use crate::page::{document, paragraphs, section, table};
use shsa_core::knowledge::SignalId;
use shsa_core::time::Span;
use shsa_drawing::{Heat, escaped};
use shsa_lab::campaign::{Campaign, Cell, Comparison, LEGEND, Tally, What, rounded};

/// A cell with its figures.
type Counted<'a> = (&'a Cell, Tally);

/// The page; `title` is the name of the model's file.
#[must_use]
pub fn page(campaign: &Campaign<'_>, title: &str, comparison: Option<&Comparison>) -> String {
    let counted: Vec<Counted<'_>> = campaign.grid.cells.iter().zip(campaign.by_cell()).collect();
    let about = head(campaign);
    let mut lines = about.lines();
    let lead = escaped(lines.next().unwrap_or_default());
    let left_out = &campaign.grid.left_out;
    let left_out = (!left_out.is_empty()).then(|| format!("Left out: {}", left_out.join("; ")));
    let maps: String = maps(campaign, &counted)
        .iter()
        .map(|heat| format!("<div class=\"map\">{}</div>", heat.svg()))
        .collect();
    let meaning = |(word, meaning): &(&str, &str)| format!("<dt>{word}</dt><dd>{}</dd>", escaped(meaning));
    let meanings: String = LEGEND.iter().map(meaning).collect();
    let sections = [
        paragraphs(lines.map(str::to_owned).chain(left_out)),
        section("Faults by signals", "", &format!("<div class=\"maps\">{maps}</div>\n")),
        comparison.map(changes).unwrap_or_default(),
        section(
            "What is in no share, and what was accused before",
            "",
            &table(&NOT_COUNTED, not_counted_rows(campaign).into_iter().map(Vec::from)),
        ),
        section("What the words mean", "", &format!("<dl class=\"words\">{meanings}</dl>\n")),
        section("Every figure", "", &every_figure(campaign, &counted)),
    ];
    document(&escaped(title), "faults tried", &lead, &sections.concat())
}

fn maps(campaign: &Campaign<'_>, counted: &[Counted<'_>]) -> Vec<Heat> {
    let duration = campaign.grid.duration.seconds();
    let slowest = counted.iter().filter_map(|(_, tally)| tally.median()).max();
    let slowest = slowest.filter(|slowest| *slowest > Span::ZERO).map_or(duration, Span::seconds);
    let mut maps = vec![
        heat(campaign, counted, "Detected, share of the runs", |tally| tally.share(tally.detected)),
        heat(campaign, counted, "Isolated, share of the runs", |tally| tally.share(tally.isolated)),
        heat(campaign, counted, "Wrong blame, share of the runs", |tally| tally.share(tally.wrong_blame)),
        Heat {
            // The colours resolve the latencies that occur; most are far shorter than the fault.
            full: slowest,
            ..heat(campaign, counted, &format!("Median latency, s, of a fault's {duration:.1} s"), |tally| {
                tally.median().map(Span::seconds)
            })
        },
    ];
    for (number, (id, need)) in campaign.knowledge().needs().enumerate().enumerate() {
        let of_need = |tally: &Tally| tally.needs.get(number).copied().unwrap_or_default();
        let unmet = format!("{} unmet, share of the runs", need.signal);
        maps.push(heat(campaign, counted, &unmet, |tally| tally.share(of_need(tally).0)));
        let most = counted.iter().map(|(_, tally)| of_need(tally).1).fold(0.0, f64::max);
        let (shown, unit) = campaign.error(id, most);
        if most > 0.0 {
            let title = format!("{} error,{unit}", need.signal);
            let error = |tally: &Tally| (tally.runs > 0).then(|| campaign.error(id, of_need(tally).1).0);
            maps.push(Heat { full: shown, ..heat(campaign, counted, &title, error) });
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
        full: 1.0,
    }
}

fn changes(comparison: &Comparison) -> String {
    let rows = comparison.changes.iter().map(|change| {
        let word = if change.is_better { "better" } else { "worse" };
        let cells = [&change.fault, &change.signal, &change.figure, &change.before, &change.now];
        cells.into_iter().cloned().chain([word.to_owned()]).collect()
    });
    let changed = table(&["fault", "signal", "figure", "before", "now", ""], rows);
    section("What has changed", "", &(paragraphs([comparison.summary()]) + &changed))
}

fn every_figure(campaign: &Campaign<'_>, counted: &[Counted<'_>]) -> String {
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
    table(&heads, counted.iter().map(|counted| figures(campaign, counted)))
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
