//! The isolability matrix as a table for the browser.

use super::Report;
use shsa_core::engine::Isolability;
use shsa_core::knowledge::{SignalId, SignalSet};
use shsa_core::trust::Component;
use shsa_drawing::escaped;
use shsa_format::text::counted;
use std::fmt::Write;

/// The most rows that are shown.
const MOST: usize = 60;

/// A row for each faulty signal or relation, a column for each one that it could be taken for; if there are many, only those in
/// question.
pub(super) fn matrix(report: &Report<'_>) -> String {
    let shown = shown(report);
    if shown.is_empty() {
        return String::new();
    }
    let mut html = key();
    let all = report.knowledge.signals().len() + report.knowledge.relations().len();
    if shown.len() < all {
        let _ = writeln!(
            html,
            "<p>{} of {all} signals and relations: those whose faults do not show or are taken for others', as far as there is room.</p>",
            shown.len()
        );
    }
    html.push_str("<div class=\"wide\"><table class=\"matrix\">\n<thead><tr><th></th>");
    for &column in &shown {
        let name = escaped(report.component(column));
        let _ = write!(html, "<th scope=\"col\" title=\"{name}\"><div>{name}</div></th>");
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for &row in &shown {
        let name = escaped(report.component(row));
        let _ = write!(html, "<tr><th scope=\"row\" title=\"{name}\">{name}</th>");
        shown.iter().for_each(|&column| html.push_str(&cell(report, row, column)));
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody>\n</table></div>\n");
    html
}

fn key() -> String {
    "<div class=\"key\"><span><i class=\"told\"></i>told apart</span>\
     <span><i class=\"same\">\u{d7}</i>cannot be told apart</span>\
     <span><i class=\"blind\"></i>the fault does not show</span></div>\n"
        .to_owned()
}

/// The shown components: signals that cannot be told apart stand together, others in file order; relations follow.
fn shown(report: &Report<'_>) -> Vec<Component> {
    let faults = &report.analysis.faults;
    let groups = faults.groups();
    let first =
        |signal: SignalId| groups.iter().find(|group| group.contains(signal)).and_then(|g| g.iter().next());
    let mut shown: Vec<Component> = faults.components().collect();
    if shown.len() > MOST {
        let is_sure = |described: &Isolability| described.signals.len() + described.relations.len() == 1;
        shown.retain(|&component| !faults.isolability(component).is_some_and(is_sure));
        shown.truncate(MOST);
    }
    shown.sort_by_key(|&component| match component {
        Component::Signal(signal) => (Component::Signal(first(signal).unwrap_or(signal)), component),
        other => (other, other),
    });
    shown
}

fn cell(report: &Report<'_>, row: Component, column: Component) -> String {
    let nothing = Isolability::default();
    let described = report.analysis.faults.isolability(row).unwrap_or(&nothing);
    let (fault, other) = (report.component(row), report.component(column));
    let count = || counted(described.shown_by as usize, "comparison");
    let (class, sign, title) = if described.shown_by == 0 {
        ("blind", "", format!("No comparison shows a fault in {fault}."))
    } else if row == column {
        (
            "self",
            "",
            format!("{} show a fault in {fault}.", count())
                .replace("1 comparison show", "1 comparison shows"),
        )
    } else if report.analysis.is_isolable_from(row, column) {
        ("told", "", format!("A fault in {fault} is told from one in {other}."))
    } else if described.is_isolable_from(column) {
        let why = report.in_part(row).join("; ");
        ("same", "\u{d7}", format!("A fault in {fault} is told from one in {other} only in part: {why}."))
    } else {
        let through = format!("{} that show it rest on {other}, too", all(&count()));
        ("same", "\u{d7}", format!("A fault in {fault} is also explained by {other}: {through}."))
    };
    format!("<td class=\"{class}\" title=\"{}\">{sign}</td>", escaped(&title))
}

fn all(count: &str) -> String {
    match count.strip_prefix("1 ") {
        Some(_) => "the comparison".to_owned(),
        None => format!("all {count}"),
    }
}

/// Names of signals, each in a frame.
pub(super) fn chips(report: &Report<'_>, signals: &SignalSet) -> String {
    let chip = |name: &str| format!("<span class=\"chip\">{}</span>", escaped(name));
    report.signals(signals).into_iter().map(chip).collect()
}
