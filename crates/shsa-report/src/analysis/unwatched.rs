//! Warnings about faults that a model's comparisons do not show.

use super::naming::{Names, ways};
use shsa_core::analysis::{Gap, Held, Hidden, Obstacle, Options, Unwatched, Watch};
use shsa_core::engine::WatchBudget;
use shsa_core::knowledge::{KnowledgeBase, SignalSet};
use shsa_core::trust::Component;

/// The most steps for this search at a start.
const STEPS: u64 = 300_000;

/// The most signals of a model for this search, whose memory grows with their square.
const MOST_SIGNALS: usize = 10_000;

/// The most warnings of one kind, and the most names in each.
const MOST: usize = 12;

/// Facts known before a run: signals whose faults no comparison shows although others know their variable, comparisons that the
/// budget leaves out, and inputs that substitutes hold without a limit of their change; one sentence each, and the number of those beyond 12.
///
/// Time: bounded in steps of the search; of more than 10,000 signals there is one sentence only.
#[must_use]
pub fn unwatched(knowledge: &KnowledgeBase, watch: WatchBudget) -> Vec<String> {
    let count = knowledge.signals().len();
    if count > MOST_SIGNALS {
        return vec![format!(
            "{count} signals, more than {MOST_SIGNALS}: which faults no comparison shows was not looked for"
        )];
    }
    let Unwatched { watched, gaps, held } = shsa_core::analysis::unwatched(knowledge, options(watch));
    let names = Names::new(knowledge);
    let mut described: Vec<String> = watched.iter().filter_map(|watch| left_out(&names, watch)).collect();
    let is_hidden = |fault: Component| {
        let of = |hidden: &Hidden| Component::Signal(hidden.signal) == fault;
        watched.iter().any(|watch| watch.hidden.iter().any(of))
    };
    let matters = |obstacle: &Obstacle| !matches!(obstacle, Obstacle::NotRun { .. } | Obstacle::NotSearched);
    let is_shown = |gap: &Gap| {
        let is_signal = matches!(gap.fault, Component::Signal(_));
        is_signal && gap.from.is_none() && gap.obstacles.iter().all(matters) && !is_hidden(gap.fault)
    };
    let undetected: Vec<Gap> = gaps.into_iter().filter(is_shown).collect();
    let lines = names.by_reason(&undetected);
    described.extend(lines.into_iter().map(|line| format!("no comparison shows a fault of {line}")));
    described.extend(held.iter().map(|held| unbounded(knowledge, &names, held)));
    shortened(described)
}

fn options(watch: WatchBudget) -> Options {
    Options { only_runnable: true, steps: STEPS, addition_steps: 0, watch }
}

/// The needs that rest on signals which nothing confirms, one sentence for each need.
///
/// Time: as [`unwatched`]; nothing of a model with more than 10,000 signals.
#[must_use]
pub fn unconfirmed(knowledge: &KnowledgeBase, watch: WatchBudget) -> Vec<String> {
    if knowledge.signals().len() > MOST_SIGNALS {
        return Vec::new();
    }
    let alone = shsa_core::analysis::unconfirmed(knowledge, options(watch));
    let names = Names::new(knowledge);
    let sentence = |(need, signals): (_, &SignalSet)| {
        let named: Vec<&str> = signals.iter().take(MOST).map(|signal| names.signal(signal)).collect();
        let need = &knowledge.needs()[need].signal;
        let named = Some(named.join(", ")).filter(|named| !named.is_empty())?;
        Some(format!(
            "{need} rests on {named} alone, and nothing confirms it: what is wrong and possible is published as good"
        ))
    };
    shortened(alone.enumerate().filter_map(sentence).collect())
}

/// The inputs that a variable's substitutes hold without a limit of their change.
fn unbounded(knowledge: &KnowledgeBase, names: &Names<'_>, held: &Held) -> String {
    let first: Vec<&str> = held.signals.iter().take(MOST).map(|&signal| names.signal(signal)).collect();
    let mut variables: Vec<&str> =
        held.signals.iter().map(|&signal| names.variable(knowledge.signals()[signal].variable)).collect();
    variables.sort_unstable();
    variables.dedup();
    variables.truncate(MOST);
    let more = if held.signals.len() > first.len() { ", .." } else { "" };
    format!(
        "substitutes of {} hold {}{more} between two values as if nothing changed: give {} a `max_rate`, else their bounds may miss the truth",
        names.variable(held.variable),
        first.join(", "),
        variables.join(", "),
    )
}

/// The ways of a variable that the budget leaves out.
fn left_out(names: &Names<'_>, watch: &Watch) -> Option<String> {
    if watch.hidden.is_empty() {
        return None;
    }
    let (undetected, not_isolated): (Vec<_>, Vec<_>) =
        watch.hidden.iter().partition(|hidden| hidden.undetected);
    let listed = |signals: &[&Hidden]| {
        let first: Vec<&str> = signals.iter().take(MOST).map(|hidden| names.signal(hidden.signal)).collect();
        let more = signals.len() - first.len();
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{}{more}", first.join(", "))
    };
    let of = ways(watch);
    let variable = names.variable(watch.variable);
    let mut described = format!("{of} ways of knowing {variable} are watched (--watch, --watch-cost)");
    if !undetected.is_empty() {
        described.push_str(&format!("; no comparison shows a fault of {}", listed(&undetected)));
    }
    if !not_isolated.is_empty() {
        described.push_str(&format!("; not told from others is one of {}", listed(&not_isolated)));
    }
    Some(described)
}

/// The first 12 lines, and the number of the others in a line of its own.
#[must_use]
pub fn shortened(mut lines: Vec<String>) -> Vec<String> {
    let more = lines.len().saturating_sub(MOST);
    lines.truncate(MOST);
    if more > 0 {
        lines.push(format!("and {more} more of this kind"));
    }
    lines
}
