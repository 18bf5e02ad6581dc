//! A campaign for the terminal: by fault, by signal, by need, and what has changed since an earlier one.

use super::compare::{Change, Comparison};
use super::grid::What;
use super::tally::{Campaign, LEGEND, Tally};
use crate::show::{self, Paint};
use shsa_core::knowledge::{Need, NeedId, SignalId};
use shsa_core::time::Span;

const FIGURES: [&str; 10] = [
    "runs",
    "detected",
    "isolated",
    "wrong blame",
    "not told",
    "false alarms",
    "unmet",
    "latency, median",
    "worst",
    "without effect",
];

/// More changes than these are only counted.
const MOST_CHANGES: usize = 20;

pub(super) fn text(campaign: &Campaign<'_>, comparison: Option<&Comparison>) -> String {
    let mut parts = vec![head(campaign), by_fault(campaign), by_signal(campaign)];
    if !campaign.knowledge().needs().is_empty() {
        parts.push(by_need(campaign));
    }
    parts.push(legend());
    parts.extend(comparison.map(compared));
    parts.join("\n\n")
}

/// What was run, in words.
pub(super) fn head(campaign: &Campaign<'_>) -> String {
    let (grid, ground) = (campaign.grid, campaign.ground);
    let onsets: Vec<String> = grid.onsets.iter().map(|onset| format!("{:.1}", onset.seconds())).collect();
    let alarms = match ground.alarms.len() {
        0 => "no alarm".to_owned(),
        count => show::counted(count, "alarm"),
    };
    format!(
        "{} over {:.1} s; without a fault {alarms}\n{} of {} in {}, each fault for {:.1} s, beginning at {} s",
        show::counted(ground.samples.len(), "observation"),
        campaign.length().seconds(),
        show::counted(grid.whats.len(), "fault"),
        show::counted(grid.signals.len(), "signal"),
        show::counted(grid.trials.len(), "run"),
        grid.duration.seconds(),
        onsets.join(", "),
    )
}

fn by_fault(campaign: &Campaign<'_>) -> String {
    let row = |what: &What| (what.label(), campaign.tally(|cell| cell.what == *what));
    let all = ("all".to_owned(), campaign.tally(|_| true));
    figures("fault", campaign.grid.whats.iter().map(row).chain([all]))
}

fn by_signal(campaign: &Campaign<'_>) -> String {
    let signals = campaign.knowledge().signals();
    let row = |&id: &SignalId| (signals[id].name.clone(), campaign.tally(|cell| cell.signal == id));
    figures("signal", campaign.grid.signals.iter().map(row))
}

fn figures(head: &str, rows: impl Iterator<Item = (String, Tally)>) -> String {
    let rows = rows.map(|(name, tally)| std::iter::once(name).chain(cells(&tally)).collect()).collect();
    let heads: Vec<&str> = std::iter::once(head).chain(FIGURES).collect();
    show::table(&heads, rows)
}

fn cells(tally: &Tally) -> [String; 10] {
    let bad = |count: usize| match count {
        0 => "0".to_owned(),
        count => show::paint(Paint::Red, &count.to_string()),
    };
    [
        tally.runs.to_string(),
        tally.detected.to_string(),
        tally.isolated.to_string(),
        bad(tally.wrong_blame),
        (tally.runs - tally.detected).to_string(),
        bad(tally.false_alarms),
        bad(tally.unmet),
        latency(tally.median()),
        latency(tally.worst()),
        tally.without_effect.to_string(),
    ]
}

/// A latency, `-` where there is none.
pub(super) fn latency(latency: Option<Span>) -> String {
    latency.map_or("-".to_owned(), |latency| format!("{:.2} s", latency.seconds()))
}

/// Four digits that count.
pub(super) fn rounded(value: f64) -> String {
    let text = format!("{value:.3e}");
    text.parse::<f64>().map_or(text, |value| value.to_string())
}

/// For each need: how often it was unmet, and where it was most wrong.
fn by_need(campaign: &Campaign<'_>) -> String {
    let tallies: Vec<_> = campaign.grid.cells.iter().zip(campaign.by_cell()).collect();
    let row = |(number, (id, need)): (usize, (NeedId, &Need))| {
        let of_need = |tally: &Tally| tally.needs.get(number).copied().unwrap_or_default();
        let unmet: usize = tallies.iter().map(|(_, tally)| of_need(tally).0).sum();
        let worst = tallies.iter().max_by(|(_, one), (_, other)| of_need(one).1.total_cmp(&of_need(other).1));
        let (cell, tally) = worst?;
        let (error, unit) = campaign.error(id, of_need(tally).1);
        let signal = &campaign.knowledge().signals()[cell.signal].name;
        let cause = if error > 0.0 { format!("{} of {signal}", cell.what.label()) } else { "-".to_owned() };
        Some(vec![need.signal.clone(), unmet.to_string(), format!("{}{unit}", rounded(error)), cause])
    };
    let rows = campaign.knowledge().needs().enumerate().enumerate().filter_map(row).collect();
    show::table(&["need", "unmet", "largest error", "with"], rows)
}

fn legend() -> String {
    let line = |(word, meaning): &(&str, &str)| show::wrapped(&format!("{word}: {meaning}"), 2);
    LEGEND.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn compared(comparison: &Comparison) -> String {
    let mut lines = vec![comparison.summary()];
    let row = |change: &Change| {
        let paint = if change.is_better { Paint::Green } else { Paint::Red };
        let word = if change.is_better { "better" } else { "worse" };
        let cells = [&change.fault, &change.signal, &change.figure, &change.before, &change.now];
        cells.into_iter().cloned().chain([show::paint(paint, word)]).collect()
    };
    let told: Vec<Vec<String>> = comparison.changes.iter().take(MOST_CHANGES).map(row).collect();
    if !told.is_empty() {
        lines.push(show::table(&["fault", "signal", "figure", "before", "now", ""], told));
    }
    if let Some(more) = comparison.changes.len().checked_sub(MOST_CHANGES).filter(|more| *more > 0) {
        lines.push(format!("and {more} more, all of them in the JSON and on the page"));
    }
    lines.join("\n")
}
