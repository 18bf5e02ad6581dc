//! A campaign as text: by fault, by signal, by need, and the changes since an earlier one.

use crate::style::{Paint, Style};
use shsa_core::knowledge::{Need, NeedId, SignalId};
use shsa_core::time::Span;
use shsa_format::text::counted;
use shsa_lab::campaign::{Campaign, Change, Comparison, LEGEND, Onset, Reason, Tally, What, rounded};

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

/// The most changes that are listed; further ones are only counted.
const MOST_CHANGES: usize = 20;

/// The campaign in tables by fault, by signal and by need, with the changes since an earlier one.
#[must_use]
pub fn text(campaign: &Campaign<'_>, comparison: Option<&Comparison>, style: Style) -> String {
    let mut parts = vec![head(campaign)];
    parts.extend(not_counted(campaign, style));
    parts.extend([by_fault(campaign, style), by_signal(campaign, style)]);
    if !campaign.knowledge().needs().is_empty() {
        parts.push(by_need(campaign, style));
    }
    parts.push(legend(style));
    parts.extend(comparison.map(|comparison| compared(comparison, style)));
    parts.join("\n\n")
}

/// Describes the grid.
pub(super) fn head(campaign: &Campaign<'_>) -> String {
    let grid = campaign.grid;
    let alarms = match campaign.clean_alarms() {
        0 => "no alarm".to_owned(),
        count => counted(count, "alarm"),
    };
    format!(
        "{} over {:.1} s{}; without a fault {alarms}\n{} of {} in {}, each fault for {:.1} s, beginning at {}\n{}",
        counted(campaign.observations(), "observation"),
        campaign.length().seconds(),
        if campaign.baselines.len() > 1 {
            format!(" in {} sessions", campaign.baselines.len())
        } else {
            String::new()
        },
        counted(grid.whats.len(), "fault"),
        counted(grid.signals.len(), "signal"),
        counted(grid.trials.len(), "run"),
        grid.duration.seconds(),
        onsets(campaign),
        headline(campaign),
    )
}

/// Describes when faults begin.
pub(super) fn onsets(campaign: &Campaign<'_>) -> String {
    let described = |onset: &Onset| match campaign.baselines.len() {
        1 => format!("{:.1}", onset.at.seconds()),
        _ => format!("{:.1} (session {})", onset.at.seconds(), onset.session + 1),
    };
    let described: Vec<String> = campaign.grid.onsets.iter().map(described).collect();
    format!("{} s", described.join(", "))
}

/// The detected share, and the runs that it does not count.
pub(super) fn headline(campaign: &Campaign<'_>) -> String {
    let tally = campaign.tally(|_| true);
    let share =
        tally.share(tally.detected).map_or(String::new(), |share| format!(" ({:.1} %)", 100.0 * share));
    let mut text = format!("Detected {} of {}{share}", tally.detected, counted(tally.runs, "run"));
    if tally.accused > 0 {
        let (accused, detected) = (tally.accused, tally.accused_detected);
        text += &format!(", among them {accused} whose signal was accused before ({detected} detected)");
    }
    let not_tried =
        |reason: Reason| (campaign.untried(reason, |_| true), format!("not tried {}", reason.words()));
    let too_small = match tally.too_small_detected {
        0 => "smaller than the smallest detected fault".to_owned(),
        detected => format!("smaller than the smallest detected fault ({detected} of them detected)"),
    };
    let mut reasons = vec![
        (tally.without_effect - tally.too_small, "that changed no value".to_owned()),
        (tally.too_small, too_small),
    ];
    reasons.extend(Reason::ALL.map(not_tried));
    reasons.retain(|(count, _)| *count > 0);
    let out: usize = reasons.iter().map(|(count, _)| count).sum();
    let reasons: Vec<String> =
        reasons.into_iter().map(|(count, reason)| format!("{count} {reason}")).collect();
    match out {
        0 => text + "; none left out",
        out => format!("{text}; left out {out}: {}", reasons.join(", ")),
    }
}

/// The runs that no share counts, and those whose signal was accused before the fault, by signal.
pub(super) fn not_counted_rows(campaign: &Campaign<'_>) -> Vec<[String; 7]> {
    let row = |&id: &SignalId| {
        let tally = campaign.tally(|cell| cell.signal == id);
        let not_tried = Reason::ALL.map(|reason| campaign.untried(reason, |it| it == id));
        let left =
            [tally.without_effect - tally.too_small, tally.too_small, not_tried.iter().sum(), tally.accused];
        let figures = [left[0], left[1], tally.too_small_detected, left[2], left[3], tally.accused_detected];
        let name = campaign.knowledge().signals()[id].name.clone();
        let mut row =
            [name, String::new(), String::new(), String::new(), String::new(), String::new(), String::new()];
        row.iter_mut().skip(1).zip(figures).for_each(|(cell, figure)| *cell = figure.to_string());
        (left.iter().sum::<usize>() > 0).then_some(row)
    };
    campaign.grid.signals.iter().filter_map(row).collect()
}

/// The heading of these rows.
pub(super) const NOT_COUNTED: [&str; 7] = [
    "signal",
    "no value changed",
    "too small",
    "of these detected",
    "not tried",
    "accused before",
    "of these detected",
];

fn not_counted(campaign: &Campaign<'_>, style: Style) -> Option<String> {
    let rows: Vec<Vec<String>> = not_counted_rows(campaign).into_iter().map(Vec::from).collect();
    (!rows.is_empty()).then(|| style.table(&NOT_COUNTED, rows))
}

fn by_fault(campaign: &Campaign<'_>, style: Style) -> String {
    let row = |what: &What| (what.label(), campaign.tally(|cell| cell.what == *what));
    let all = ("all".to_owned(), campaign.tally(|_| true));
    figures("fault", style, campaign.grid.whats.iter().map(row).chain([all]))
}

fn by_signal(campaign: &Campaign<'_>, style: Style) -> String {
    let signals = campaign.knowledge().signals();
    let row = |&id: &SignalId| (signals[id].name.clone(), campaign.tally(|cell| cell.signal == id));
    figures("signal", style, campaign.grid.signals.iter().map(row))
}

fn figures(head: &str, style: Style, rows: impl Iterator<Item = (String, Tally)>) -> String {
    let rows =
        rows.map(|(name, tally)| std::iter::once(name).chain(cells(&tally, style)).collect()).collect();
    let heads: Vec<&str> = std::iter::once(head).chain(FIGURES).collect();
    style.table(&heads, rows)
}

fn cells(tally: &Tally, style: Style) -> [String; 10] {
    let bad = |count: usize| match count {
        0 => "0".to_owned(),
        count => style.paint(Paint::Red, &count.to_string()),
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

/// For each need, how often it was unmet, and its largest error.
fn by_need(campaign: &Campaign<'_>, style: Style) -> String {
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
    style.table(&["need", "unmet", "largest error", "with"], rows)
}

fn legend(style: Style) -> String {
    let line = |(word, meaning): &(&str, &str)| style.wrapped(&format!("{word}: {meaning}"), 2);
    LEGEND.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn compared(comparison: &Comparison, style: Style) -> String {
    let mut lines = vec![comparison.summary()];
    let row = |change: &Change| {
        let paint = if change.is_better { Paint::Green } else { Paint::Red };
        let word = if change.is_better { "better" } else { "worse" };
        let cells = [&change.fault, &change.signal, &change.figure, &change.before, &change.now];
        cells.into_iter().cloned().chain([style.paint(paint, word)]).collect()
    };
    let described: Vec<Vec<String>> = comparison.changes.iter().take(MOST_CHANGES).map(row).collect();
    if !described.is_empty() {
        lines.push(style.table(&["fault", "signal", "figure", "before", "now", ""], described));
    }
    if let Some(more) = comparison.changes.len().checked_sub(MOST_CHANGES).filter(|more| *more > 0) {
        lines.push(format!("and {more} more, all of them in the JSON and on the page"));
    }
    lines.join("\n")
}
