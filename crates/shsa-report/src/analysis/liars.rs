//! How many signals may lie together, for each need: by signal, and by common cause.

use super::Report;
use crate::style::{Paint, Style};
use serde_json::{Value, json};
use shsa_core::analysis::{Liar, Options, Withstands, liars};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{IdVec, KnowledgeBase, NeedId};
use shsa_format::text::counted;
use shsa_format::words;

/// The liars that each need withstands.
pub struct Liars {
    signals: IdVec<NeedId, Withstands>,
    /// `None` without common causes.
    causes: Option<IdVec<NeedId, Withstands>>,
}

impl Liars {
    /// Counts the liars that each need of a model withstands.
    #[must_use]
    pub fn of(knowledge: &KnowledgeBase, options: Options) -> Liars {
        let has_causes = !knowledge.causes().is_empty();
        Liars {
            signals: liars(knowledge, false, options),
            causes: has_causes.then(|| liars(knowledge, true, options)),
        }
    }

    pub(super) fn text(&self, report: &Report<'_>, style: Style) -> String {
        let tables = [("signals", Some(&self.signals)), ("common causes", self.causes.as_ref())];
        let tables = tables.into_iter().filter_map(|(who, found)| Some(table(report, style, who, found?)));
        let mut blocks: Vec<String> = tables.collect();
        let far: Vec<String> = report.knowledge.needs().ids().map(|need| how_far(report, need)).collect();
        let head = "Where too many lie together, the need's value is false without a word about them, as long as they lie:";
        blocks.push(format!("{}\n  {}", style.paint(Paint::Bold, head), far.join("\n  ")));
        blocks.join("\n\n")
    }

    pub(super) fn json(&self, report: &Report<'_>) -> Value {
        let rows = |found: &IdVec<NeedId, Withstands>| -> Vec<Value> {
            found.enumerate().map(|(need, found)| row_of(report, need, found)).collect()
        };
        json!({ "signals": rows(&self.signals), "causes": self.causes.as_ref().map(rows) })
    }
}

fn row_of(report: &Report<'_>, need: NeedId, found: &Withstands) -> Value {
    json!({
        "need": report.need(need),
        "withstands": found.liars,
        "exact": found.exact,
        "coalition": names(report, found),
        "is_tie": found.is_tie,
        "more_signals_for_one_more": found.missing,
    })
}

fn names<'r>(report: &Report<'r>, found: &Withstands) -> Vec<&'r str> {
    let name = |liar: &Liar| match *liar {
        Liar::Signal(signal) => report.signal(signal),
        Liar::Cause(cause) => &report.knowledge.causes()[cause].name,
    };
    found.coalition.iter().map(name).collect()
}

fn table(report: &Report<'_>, style: Style, who: &str, found: &IdVec<NeedId, Withstands>) -> String {
    let row = |(need, found): (NeedId, &Withstands)| {
        let count = match found.liars {
            None => "all".to_owned(),
            Some(count) if found.exact => count.to_string(),
            Some(count) => format!("{count} or more"),
        };
        let (coalition, outcome) = match (names(report, found), found.is_tie) {
            (names, _) if names.is_empty() => ("-".to_owned(), "-"),
            (names, true) => (names.join(", "), "nobody can say who lies"),
            (names, false) => (names.join(", "), "the others are blamed"),
        };
        let more =
            if found.liars.is_none() { "-".to_owned() } else { counted(found.missing, "independent signal") };
        vec![report.need(need).to_owned(), count, coalition, outcome.to_owned(), more]
    };
    let withstands = format!("withstands lying {who}");
    let head = ["need", &withstands, "too many, for example", "then", "one more with"];
    style.table(&head, found.enumerate().map(row).collect())
}

/// How far off a need's value can be.
fn how_far(report: &Report<'_>, need: NeedId) -> String {
    let variable = report.knowledge.needs()[need].variable;
    let of = &report.knowledge.variables()[variable];
    let within = match of.range.filter(|range| *range != Interval::ENTIRE) {
        Some(range) => format!("anywhere in {}", words::interval(report.knowledge, variable, range)),
        None => "any distance off, as the variable has no `range`".to_owned(),
    };
    let pace = match of.max_rate {
        Some(rate) => format!("by {} a second", words::difference(report.knowledge, variable, rate)),
        None => "at once, as the variable has no `max_rate`".to_owned(),
    };
    format!("{}: {within}; {pace}", report.need(need))
}
