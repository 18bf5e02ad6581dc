//! The analysis as text.

use super::{Report, losses};
use crate::style::{Paint, Style};
use shsa_core::analysis::{Addition, Watch};
use shsa_core::knowledge::{Fusion, RelationId, SignalId};
use shsa_core::trust::Component;
use shsa_estimate::node::observability;

/// The most signals that are named for a variable whose faults further ways would detect or isolate.
const MOST_HIDDEN: usize = 12;

/// The most reasons why comparisons isolate fewer faults than the structure.
const MOST_REASONS: usize = 20;

/// Tables of signals, needs and additions, then the weaknesses in sentences.
pub(super) fn text(report: &Report<'_>, style: Style) -> String {
    let blocks = [
        signals(report, style),
        fusions(report, style),
        relations(report, style),
        needs(report, style),
        report.liars.map(|liars| liars.text(report, style)).unwrap_or_default(),
        weaknesses(report, style),
        partly(report, style),
        gaps(report, style),
        additions(report, style),
        watched(report, style),
        structure(report, style),
        report.notes().join("\n"),
    ];
    blocks.into_iter().filter(|block| !block.is_empty()).collect::<Vec<_>>().join("\n\n")
}

fn signals(report: &Report<'_>, style: Style) -> String {
    if report.knowledge.signals().is_empty() {
        return "no signals".to_owned();
    }
    let head =
        ["signal", "carries", "detectable", "isolable", "substitutable", "tolerates", "its loss takes"];
    let measured = report.knowledge.signals().ids().filter(|signal| !report.knowledge.is_computed(*signal));
    style.table(&head, measured.map(|signal| signal_row(report, style, signal)).collect())
}

/// What each fusion says of its inputs, and what the loss of each takes.
fn fusions(report: &Report<'_>, style: Style) -> String {
    let rows: Vec<Vec<String>> =
        report.knowledge.fusions().iter().flat_map(|it| fused(report, style, it)).collect();
    if rows.is_empty() {
        return String::new();
    }
    style.table(&["fusion", "input", "the others tell", "what only it observes"], rows)
}

fn fused<'r>(
    report: &'r Report<'_>,
    style: Style,
    fusion: &'r Fusion,
) -> impl Iterator<Item = Vec<String>> + 'r {
    let observed = observability(report.knowledge, fusion);
    fusion.inputs.iter().enumerate().map(move |(place, input)| {
        let prediction = fusion.predictions.iter().find(|it| it.without == [place]);
        let described = match prediction.map(|it| it.is_anchored) {
            Some(false) => style.paint(Paint::Green, "what it measures"),
            Some(true) => "how it changes".to_owned(),
            None => "nothing".to_owned(),
        };
        let only = observed.as_ref().and_then(|it| it.without.get(place)).into_iter().flatten();
        let only: Vec<&str> =
            only.filter_map(|state| fusion.states.get(*state)).map(|it| it.name.as_str()).collect();
        let only = if only.is_empty() { "-".to_owned() } else { only.join(", ") };
        vec![fusion.name.clone(), report.signal(input.signal).to_owned(), described, only]
    })
}

fn signal_row(report: &Report<'_>, style: Style, signal: SignalId) -> Vec<String> {
    let analysis = report.analysis;
    let others = report.knowledge.signals().len() - 1;
    let component = Component::Signal(signal);
    let is_signal = |other: &Component| matches!(other, Component::Signal(_));
    vec![
        report.signal(signal).to_owned(),
        report.variable(report.knowledge.signals()[signal].variable).to_owned(),
        detectable(report, style, component),
        report.isolable(component, is_signal, others),
        yes(style, analysis.is_substitutable(signal)),
        losses(&analysis.signals[signal]),
        report.needs_lost(signal).join(", "),
    ]
}

/// Relations with their faults: a relation is faulty when it does not hold.
fn relations(report: &Report<'_>, style: Style) -> String {
    let knowledge = report.knowledge;
    if knowledge.relations().is_empty() {
        return String::new();
    }
    let others = knowledge.signals().len() + knowledge.relations().len() - 1;
    let row = |relation: RelationId| {
        let component = Component::Relation(relation);
        vec![
            report.component(component).to_owned(),
            detectable(report, style, component),
            report.isolable(component, |_| true, others),
        ]
    };
    style.table(&["relation", "detectable", "isolable"], knowledge.relations().ids().map(row).collect())
}

/// Faults that the structure could detect or isolate and no comparison does, with the reasons.
fn gaps(report: &Report<'_>, style: Style) -> String {
    let lines = report.gaps();
    if lines.is_empty() {
        return String::new();
    }
    let more = lines.len().saturating_sub(MOST_REASONS);
    let mut described: Vec<String> =
        lines.iter().take(MOST_REASONS).map(|line| style.wrapped(line, 2)).collect();
    if more > 0 {
        described.push(style.wrapped(&format!("and {more} more reasons (--json)"), 2));
    }
    let head = style.paint(Paint::Bold, "Faults that the structure would tell and no comparison does:");
    format!("{head}\n{}", described.join("\n"))
}

fn detectable(report: &Report<'_>, style: Style, component: Component) -> String {
    match report.detectable(component) {
        "in part" => style.paint(Paint::Yellow, "in part"),
        described => yes(style, described == "yes"),
    }
}

/// Faults that comparisons show or isolate only in part, with the reasons.
fn partly(report: &Report<'_>, style: Style) -> String {
    let lines = report.partly();
    if lines.is_empty() {
        return String::new();
    }
    let described: Vec<String> = lines.iter().map(|line| style.wrapped(line, 2)).collect();
    let head = style.paint(Paint::Bold, "Faults that comparisons show only in part:");
    format!("{head}\n{}", described.join("\n"))
}

fn yes(style: Style, is: bool) -> String {
    if is { style.paint(Paint::Green, "yes") } else { style.paint(Paint::Red, "no") }
}

fn needs(report: &Report<'_>, style: Style) -> String {
    if report.knowledge.needs().is_empty() {
        return String::new();
    }
    let row = |(id, need): (_, &shsa_core::knowledge::Need)| {
        let tolerance = &report.analysis.needs[id];
        let single = report.signals(&tolerance.single_points);
        vec![
            need.signal.clone(),
            report.variable(need.variable).to_owned(),
            losses(tolerance),
            if single.is_empty() { "-".to_owned() } else { single.join(", ") },
        ]
    };
    let head = ["need", "variable", "survives losses", "single points of failure"];
    style.table(&head, report.knowledge.needs().enumerate().map(row).collect())
}

/// The weaknesses, one paragraph each.
fn weaknesses(report: &Report<'_>, style: Style) -> String {
    let groups: Vec<String> =
        report.analysis.faults.groups().iter().map(|group| report.signals(group).join(", ")).collect();
    let lines = [
        ("Faults that nothing shows:", report.signals(&report.undetectable()).join(", ")),
        ("Faults that cannot be told apart:", groups.join("; ")),
        ("Signals that nothing replaces:", report.signals(&report.analysis.unhealed()).join(", ")),
    ];
    let described = lines.iter().filter(|(_, names)| !names.is_empty());
    let described: Vec<String> = described
        .map(|(what, names)| format!("{}\n{}", style.paint(Paint::Bold, what), style.wrapped(names, 2)))
        .collect();
    described.join("\n")
}

fn additions(report: &Report<'_>, style: Style) -> String {
    let additions = &report.analysis.additions;
    if additions.is_empty() {
        return String::new();
    }
    let head =
        ["what would help most", "detectable", "isolable pairs", "substitutable", "needs survive losses"];
    style.table(&head, additions.iter().map(|addition| addition_row(report, addition)).collect())
}

fn watched(report: &Report<'_>, style: Style) -> String {
    let analysis = report.analysis;
    if analysis.watched.is_empty() {
        return String::new();
    }
    let row = |watch: &Watch| {
        vec![report.variable(watch.variable).to_owned(), Report::ways(watch), format!("{:.0}", watch.cost)]
    };
    let rows = analysis.watched.iter().map(row).collect();
    let table = style.table(&["watched variable", "ways of knowing", "operations a second"], rows);
    let described: Vec<String> = analysis
        .watched
        .iter()
        .filter(|watch| !watch.hidden.is_empty())
        .map(|watch| {
            let hidden: Vec<String> =
                watch.hidden.iter().take(MOST_HIDDEN).map(|hidden| report.hidden(hidden)).collect();
            let more = watch.hidden.len() - hidden.len();
            let more = if more > 0 { format!("; and {more} more") } else { String::new() };
            let name = report.variable(watch.variable);
            style.wrapped(&format!("{name}: {}{more}", hidden.join("; ")), 2)
        })
        .collect();
    if described.is_empty() {
        return table;
    }
    let head = style.paint(Paint::Bold, "Faults that only more ways would tell (--watch, --watch-cost):");
    format!("{table}\n\n{head}\n{}", described.join("\n"))
}

fn structure(report: &Report<'_>, style: Style) -> String {
    let row = |(what, figure): (&str, String)| vec![what.to_owned(), figure];
    style.table(&["structure", ""], report.figures.rows().into_iter().map(row).collect())
}

fn addition_row(report: &Report<'_>, addition: &Addition) -> Vec<String> {
    let gained = |count: usize| if count == 0 { "-".to_owned() } else { format!("+{count}") };
    let survives = report.survives(addition);
    vec![
        report.addition(addition.candidate),
        gained(addition.detectable.len()),
        gained(addition.isolable_pairs),
        gained(addition.substitutable.len()),
        if survives.is_empty() { "-".to_owned() } else { survives.join(", ") },
    ]
}
