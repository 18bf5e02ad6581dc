//! The report of a model as text.

use super::model::{ModelReport, Need, lacking};
use crate::style::{Paint, Style};
use shsa_core::assurance::Verdict;
use shsa_core::knowledge::Id;
use shsa_drawing::case::words;
use shsa_format::text::{counted, table};

/// The most sets that are listed for a question.
const MOST_SETS: usize = 4;

pub(super) fn text(report: &ModelReport<'_>, style: Style) -> String {
    let when = if report.is_moment { "at this moment" } else { "with all evidence as it should be" };
    let head = format!("{}: {} with contracts, {when}\n", report.title, counted(report.needs.len(), "need"));
    let needs = report.needs.iter().map(|need| of_need(report, style, need));
    head + &needs.collect::<String>()
}

fn of_need(report: &ModelReport<'_>, style: Style, need: &Need) -> String {
    let paint = if need.served.is_some() { Paint::Green } else { Paint::Red };
    let answer = style.paint(paint, &answer(report, need));
    let mut parts = vec![format!("\n{}: {answer}", need.name), ways(report, need)];
    parts.extend(losses(report, need));
    parts.extend(weak(report, need));
    if !need.prospect.is_complete {
        parts.push(format!("There may be more ways than these {}.", need.prospect.ways.len()));
    }
    parts.join("\n") + "\n"
}

/// Whether a need gets what it asks, at which level, and from which way.
pub(super) fn answer(report: &ModelReport<'_>, need: &Need) -> String {
    let Some(at) = need.served else { return "not given".to_owned() };
    let (candidacy, (_, assessment)) = (&need.prospect.ways[at], &need.now[at]);
    let level = report.level(assessment.level).map_or(String::new(), |level| format!(" at {level}"));
    format!("given{level} from {}", candidacy.way.describe(report.knowledge))
}

/// The levels and conditions of each way.
fn ways(report: &ModelReport<'_>, need: &Need) -> String {
    let row = |(at, (candidacy, (_, assessment))): (
        usize,
        (&shsa_core::analysis::Candidacy, &(_, shsa_core::assurance::Assessment)),
    )| {
        let verdict = words::verdict(assessment.verdict);
        let mode = report.mode(candidacy, assessment).filter(|mode| mode != "served");
        let verdict = mode.map_or(verdict.to_owned(), |mode| format!("{verdict} ({mode})"));
        vec![
            candidacy.way.describe(report.knowledge),
            report.level(assessment.level).unwrap_or_else(|| "-".to_owned()),
            verdict,
            conditions(report, need, at),
        ]
    };
    let rows = need.prospect.ways.iter().zip(&need.now).enumerate().map(row).collect();
    table(&["way", "level", "", "on condition that"], rows)
}

/// The conditions that a way rests on, or that it lacks.
fn conditions(report: &ModelReport<'_>, need: &Need, at: usize) -> String {
    let (candidacy, (_, assessment)) = (&need.prospect.ways[at], &need.now[at]);
    if assessment.verdict == Verdict::Holds {
        let names = |set: &Vec<_>| set.iter().map(|&id| report.evidence(candidacy, id)).collect::<Vec<_>>();
        return listed(candidacy.conditions.sets.iter().map(names).collect());
    }
    let sets = need.why(at).iter().map(|set| set.iter().map(lacking).collect()).collect();
    format!("lacks {}", listed(sets))
}

/// Sets as `a, b; or c`.
pub(super) fn listed(sets: Vec<Vec<String>>) -> String {
    let more = sets.len().saturating_sub(MOST_SETS);
    let mut told: Vec<String> = sets.into_iter().take(MOST_SETS).map(|set| set.join(", ")).collect();
    if told.iter().any(String::is_empty) {
        return "always".to_owned();
    }
    if more > 0 {
        told.push(format!("one of {more} more"));
    }
    if told.is_empty() { "what nothing can give".to_owned() } else { told.join("; or ") }
}

/// The effect of each lost signal, if it has one.
fn losses(report: &ModelReport<'_>, need: &Need) -> Option<String> {
    let best = need.prospect.best(|candidacy| candidacy.at_best);
    let changed = need.prospect.losses.iter().filter(|(_, left)| *left != best);
    let row = |(signal, left): &(_, Option<usize>)| {
        let name = report.knowledge.signals()[*signal].name.clone();
        let then = left.and_then(|at| need.prospect.ways.get(at)).map_or("nothing".to_owned(), |candidacy| {
            let level = report.level(candidacy.without(report.knowledge, &[*signal]).level);
            let by = candidacy.way.describe(report.knowledge);
            level.map_or(by.clone(), |level| format!("{by}, {level}"))
        });
        vec![name, then]
    };
    // The losses are those of the design, whatever the moment.
    let left = if report.is_moment { "what is left, all else as it should be" } else { "what is left" };
    let rows: Vec<Vec<String>> = changed.map(row).collect();
    (!rows.is_empty()).then(|| format!("\n{}", table(&["lost", left], rows)))
}

/// Evidence without which the serving way gives nothing.
pub(super) fn weak(report: &ModelReport<'_>, need: &Need) -> Option<String> {
    let candidacy = need.prospect.ways.get(need.served?)?;
    let observed = report.observed(candidacy);
    let names: Vec<&str> = candidacy.weak.iter().map(|id| observed[id.index()].as_str()).collect();
    let way = candidacy.way.describe(report.knowledge);
    (!names.is_empty()).then(|| format!("\n{way} gives nothing without any of these: {}.", names.join("; ")))
}
