//! The analysis as one page for the browser, without scripts and external resources.

use super::matrix::{chips, matrix};
use super::{Report, losses};
use crate::page::{document, list, section};
use shsa_core::analysis::{Addition, Comparison, Watch};
use shsa_core::knowledge::{NeedId, RelationId, SignalId, SignalSet};
use shsa_core::trust::Component;
use shsa_drawing::{Marks, escaped};
use shsa_format::text::counted;
use std::fmt::Write;

/// The most comparisons that are listed for one signal.
const MOST_LISTED: usize = 12;

pub(super) fn page(report: &Report<'_>) -> String {
    let title = escaped(&report.title);
    let sections = [
        tiles(report),
        notes(report),
        section("Needs", NEEDS, &needs(report)),
        section("Signals", SIGNALS, &signals(report)),
        section("Relations", RELATIONS, &relations(report)),
        section("Which faults can be told apart", MATRIX, &apart(report)),
        section("What the structure would tell and no comparison does", GAPS, &gaps(report)),
        section("What would help most", ADDITIONS, &additions(report)),
        section("What is watched", WATCHED, &watched(report)),
        section("Structure", STRUCTURE, &structure(report)),
        section("The knowledge base", GRAPH, &graph(report)),
    ];
    let size = size(report);
    let lead = format!("{size}. What can be detected, told apart and healed, before anything runs.");
    document(&title, "analysis", &lead, &sections.concat())
}

const NEEDS: &str = "How many signals may be lost at once, whichever they are, and the need is still served. \
    A single point of failure is a signal whose loss alone takes the need.";
const SIGNALS: &str = "A fault is detectable when a comparison of two ways of knowing the same variable shows it. \
    A signal is substitutable when its variable can be known without it; it tolerates so many losses of signals \
    before its variable cannot be known.";
const RELATIONS: &str = "A relation is faulty when it does not hold. Its fault is detectable when a comparison of two ways \
    of knowing the same variable shows it, of which it is only in one, or in both at different places.";
const MATRIX: &str = "Each row is a faulty signal, or a relation that does not hold; each column one that it may be taken for. \
    A fault is told from another when a comparison shows it that does not rest on the other.";
const GAPS: &str = "What the structure allows any method to detect or tell apart, and no comparison of two ways does, and what \
    hinders the residual that comes closest.";
const ADDITIONS: &str = "Each was put into the model and the analysis repeated. A relation helps only if there is one \
    in the world. First comes what makes faults show, then what tells them apart, then what can be replaced, then \
    what survives.";
const WATCHED: &str = "The ways of knowing each variable that are compared with each other. Where there are more than \
    the budget allows, those that tell most faults apart; the last column names what only more ways would tell. \
    Operations a second are those of the formulas and comparisons, by the declared rates.";
const STRUCTURE: &str = "Which variables stand in which equations, and nothing else: the most that any method can reach \
    with these equations and signals (Dulmage and Mendelsohn 1958; Krysander, \u{c5}slund and Nyberg 2008).";
const GRAPH: &str = "Variables are ellipses, filled when a signal carries them; relations are boxes; arrowheads show \
    the directions in which a relation can be used.";

fn size(report: &Report<'_>) -> String {
    let knowledge = report.knowledge;
    [
        counted(knowledge.signals().len(), "signal"),
        counted(knowledge.variables().len(), "variable"),
        counted(knowledge.relations().len(), "relation"),
        counted(knowledge.needs().len(), "need"),
    ]
    .join(", ")
}

fn tiles(report: &Report<'_>) -> String {
    let (analysis, count) = (report.analysis, report.knowledge.signals().len());
    let of = |is: &dyn Fn(SignalId) -> bool| {
        let number = report.knowledge.signals().ids().filter(|&signal| is(signal)).count();
        format!("{number} of {count}")
    };
    let weakest = analysis.needs.iter().min_by_key(|need| (need.known, need.survives.unwrap_or(usize::MAX)));
    let tiles = [
        (of(&|signal| analysis.faults.is_detectable(signal)), "faults are detectable"),
        (of(&|signal| analysis.faults.suspects(signal).len() == 1), "faults name one culprit"),
        (of(&|signal| analysis.is_substitutable(signal)), "signals are substitutable"),
        (weakest.map_or("-".to_owned(), losses), "losses are survived by every need"),
        (analysis.comparisons.pairs().len().to_string(), "comparisons watch the signals"),
    ];
    let tile = |(number, what): &(String, &str)| {
        format!("<div class=\"tile\"><b>{number}</b><span>{what}</span></div>\n")
    };
    format!("<div class=\"tiles\">\n{}</div>\n", tiles.iter().map(tile).collect::<String>())
}

fn notes(report: &Report<'_>) -> String {
    let notes: String = report.notes().iter().map(|note| format!("<p>{}</p>", escaped(note))).collect();
    if notes.is_empty() { notes } else { format!("<div class=\"notes\">{notes}</div>\n") }
}

fn needs(report: &Report<'_>) -> String {
    let rows: Vec<String> = report.knowledge.needs().ids().map(|need| need_row(report, need)).collect();
    list(&["Need", "Variable", "Survives losses", "Single points of failure", "Taken by the loss of"], &rows)
}

fn need_row(report: &Report<'_>, need: NeedId) -> String {
    let tolerance = &report.analysis.needs[need];
    let class = if tolerance.survives == Some(0) { "no" } else { "yes" };
    format!(
        "<tr><td class=\"name\">{}</td><td>{}</td><td class=\"{class}\">{}</td><td>{}</td><td>{}</td></tr>\n",
        escaped(report.need(need)),
        escaped(report.variable(report.knowledge.needs()[need].variable)),
        losses(tolerance),
        chips_or(report, &tolerance.single_points, "none"),
        chips_or(report, &tolerance.cut, "nothing"),
    )
}

fn chips_or(report: &Report<'_>, signals: &SignalSet, none: &str) -> String {
    match signals.is_empty() {
        true => format!("<span class=\"quiet\">{none}</span>"),
        false => chips(report, signals),
    }
}

fn signals(report: &Report<'_>) -> String {
    let head =
        ["Signal", "Carries", "Detectable", "Isolable from", "Substitutable", "Tolerates", "Its loss takes"];
    let rows: Vec<String> =
        report.knowledge.signals().ids().map(|signal| signal_row(report, signal)).collect();
    list(&head, &rows)
}

fn signal_row(report: &Report<'_>, signal: SignalId) -> String {
    let analysis = report.analysis;
    let others = report.knowledge.signals().len() - 1;
    let is_signal = |other: &Component| matches!(other, Component::Signal(_));
    let component = Component::Signal(signal);
    let class =
        if analysis.isolable_from(component).filter(is_signal).count() == others { "yes" } else { "no" };
    let lost: Vec<String> = report.needs_lost(signal).into_iter().map(escaped).collect();
    format!(
        "<tr><td class=\"name\">{name}</td><td>{variable}</td><td>{shown}</td><td class=\"{class}\">{isolable}</td>\
         <td>{replaced}</td><td>{survives}</td><td class=\"no\">{lost}</td></tr>\n",
        name = escaped(report.signal(signal)),
        variable = escaped(report.variable(report.knowledge.signals()[signal].variable)),
        shown = shown(report, signal),
        isolable = report.isolable(component, is_signal, others),
        replaced = yes(analysis.is_substitutable(signal)),
        survives = losses(&analysis.signals[signal]),
        lost = lost.join(", "),
    )
}

fn relations(report: &Report<'_>) -> String {
    let knowledge = report.knowledge;
    let others = (knowledge.signals().len() + knowledge.relations().len()).saturating_sub(1);
    let row = |relation: RelationId| {
        let component = Component::Relation(relation);
        let class = if report.analysis.isolable_from(component).count() == others { "yes" } else { "no" };
        format!(
            "<tr><td class=\"name\">{}</td><td>{}</td><td>{}</td><td class=\"{class}\">{}</td></tr>\n",
            escaped(report.component(component)),
            escaped(&knowledge.relations()[relation].text),
            detectable(report, component),
            report.isolable(component, |_| true, others),
        )
    };
    let rows: Vec<String> = knowledge.relations().ids().map(row).collect();
    list(&["Relation", "Equation", "Detectable", "Isolable from"], &rows)
}

fn gaps(report: &Report<'_>) -> String {
    let lines: String = report.gaps().iter().map(|line| format!("<li>{}</li>\n", escaped(line))).collect();
    if lines.is_empty() { lines } else { format!("<ul>\n{lines}</ul>\n") }
}

fn yes(is: bool) -> &'static str {
    if is { "<span class=\"yes\">\u{2713} yes</span>" } else { "<span class=\"no\">\u{2717} no</span>" }
}

fn detectable(report: &Report<'_>, component: Component) -> &'static str {
    match report.detectable(component) {
        "in part" => "<span class=\"no\">in part</span>",
        described => yes(described == "yes"),
    }
}

/// Whether a fault is detectable, and by which comparisons.
fn shown(report: &Report<'_>, signal: SignalId) -> String {
    let (faults, comparisons) = (&report.analysis.faults, &report.analysis.comparisons);
    if !faults.is_detectable(signal) {
        return yes(false).to_owned();
    }
    let count = faults.shown_by(signal) as usize;
    let shows = |pair: &&Comparison| {
        comparisons.signals(**pair).contains(signal) && comparisons.shows(**pair).contains(signal)
    };
    let mut items = String::new();
    for &pair in comparisons.pairs().iter().filter(shows).take(MOST_LISTED) {
        let _ = write!(items, "<li>{}</li>", escaped(&comparison(report, pair)));
    }
    if count > MOST_LISTED {
        let _ = write!(items, "<li>and {} more</li>", count - MOST_LISTED);
    }
    let (is, by) = (detectable(report, Component::Signal(signal)), counted(count, "comparison"));
    format!("<details><summary>{is}, by {by}</summary><ul>{items}</ul></details>")
}

fn comparison(report: &Report<'_>, pair: Comparison) -> String {
    let way = |at: usize| report.analysis.comparisons.ways().get(at);
    let described = |at: usize| way(at).map(|way| way.describe(report.knowledge)).unwrap_or_default();
    let variable = way(pair.one).map(|way| report.variable(way.substitution.sink)).unwrap_or_default();
    format!("{variable}: {} against {}", described(pair.one), described(pair.other))
}

fn apart(report: &Report<'_>) -> String {
    let groups = report.analysis.faults.groups();
    let mut html = matrix(report);
    if !groups.is_empty() {
        let item = |group: &SignalSet| format!("<li>{}</li>\n", chips(report, group));
        let items: String = groups.iter().map(item).collect();
        let _ = write!(
            html,
            "<p class=\"after\">That one of these is faulty shows, but not which one:</p>\n<ul class=\"groups\">\n{items}</ul>\n"
        );
    }
    html
}

fn additions(report: &Report<'_>) -> String {
    let rows: Vec<String> = report.analysis.additions.iter().map(|each| addition_row(report, each)).collect();
    list(
        &[
            "Addition",
            "Faults that would show",
            "Pairs told apart",
            "Signals substitutable",
            "Needs survive losses",
        ],
        &rows,
    )
}

fn addition_row(report: &Report<'_>, addition: &Addition) -> String {
    let gained = |signals: &SignalSet| match signals.len() {
        0 => "<span class=\"quiet\">-</span>".to_owned(),
        count => format!("<span class=\"gain\">+{count}</span> {}", chips(report, signals)),
    };
    let pairs = match addition.isolable_pairs {
        0 => "<span class=\"quiet\">-</span>".to_owned(),
        count => format!("<span class=\"gain\">+{count}</span>"),
    };
    let survives: Vec<String> = report.survives(addition).iter().map(|each| escaped(each)).collect();
    format!(
        "<tr><td class=\"name\">{}</td><td>{}</td><td>{pairs}</td><td>{}</td><td>{}</td></tr>\n",
        escaped(&report.addition(addition.candidate)),
        gained(&addition.detectable),
        gained(&addition.substitutable),
        if survives.is_empty() { "<span class=\"quiet\">-</span>".to_owned() } else { survives.join("<br>") },
    )
}

fn watched(report: &Report<'_>) -> String {
    let row = |watch: &Watch| {
        let class = if watch.hidden.is_empty() { "yes" } else { "no" };
        let hidden = watch.hidden.iter().take(MOST_LISTED).map(|hidden| escaped(&report.hidden(hidden)));
        let mut hidden: Vec<String> = hidden.collect();
        if watch.hidden.len() > MOST_LISTED {
            hidden.push(format!("and {} more", watch.hidden.len() - MOST_LISTED));
        }
        if hidden.is_empty() {
            hidden.push("<span class=\"quiet\">nothing</span>".to_owned());
        }
        format!(
            "<tr><td class=\"name\">{}</td><td class=\"{class}\">{}</td><td>{:.0}</td><td>{}</td></tr>\n",
            escaped(report.variable(watch.variable)),
            Report::ways(watch),
            watch.cost,
            hidden.join("<br>"),
        )
    };
    let rows: Vec<String> = report.analysis.watched.iter().map(row).collect();
    list(&["Variable", "Ways watched", "Operations a second", "What only more ways would tell"], &rows)
}

fn structure(report: &Report<'_>) -> String {
    let row =
        |(what, figure): (&str, String)| format!("<tr><td>{what}</td><td>{}</td></tr>\n", escaped(&figure));
    let rows: Vec<String> = report.figures.rows().into_iter().map(row).collect();
    list(&["", "Figure"], &rows)
}

fn graph(report: &Report<'_>) -> String {
    match shsa_drawing::svg(report.knowledge, &Marks::default()) {
        Ok(svg) => format!("<div class=\"graph\">{svg}</div>\n"),
        Err(too_large) => format!("<p>Not drawn: {}.</p>\n", escaped(&too_large.to_string())),
    }
}
