//! An explanation as one page for the browser, without scripts and external resources.

use super::{Explanation, Item, Section};
use crate::page::{document, section};
use shsa_drawing::{Timeline, escaped};

const DRAWN: &str = "Each band is one way of knowing the variable: between its edges lies what it takes for possible. \
    Full lines rest on the signal in question. Where bands do not touch, they cannot both be right.";

/// An introduction to each section, for first-time readers.
fn about(title: &str) -> &'static str {
    match title {
        "Evidence against it" => {
            "Two ways of knowing the same variable that disagree: one of the signals that they rest on is faulty."
        }
        "Evidence for it" => "Comparisons with independent witnesses that agree.",
        "Comparisons that are no evidence" => "They count neither for nor against it.",
        "Other candidates" => "Every other signal in the comparisons that disagree.",
        _ => "",
    }
}

pub(super) fn page(explanation: &Explanation<'_>, drawings: &[Timeline], model: &str) -> String {
    let headline = explanation.headline();
    let drawn: String =
        drawings.iter().map(|drawing| format!("<div class=\"graph\">{}</div>\n", drawing.svg())).collect();
    let mut sections = explanation.sections().into_iter();
    let plain = sections.next().map(|first| list(&first.items)).unwrap_or_default();
    let rest: String =
        sections.map(|Section { title, items }| section(title, about(title), &list(&items))).collect();
    let body = format!("{plain}{}{rest}", section("Over time", DRAWN, &drawn));
    let lead = format!("Why, by {}.", escaped(model));
    document(&escaped(&headline), "explanation", &lead, &body)
}

pub(crate) fn list(items: &[Item]) -> String {
    let item = |item: &Item| {
        let notes: String =
            item.notes.iter().map(|note| format!("<div class=\"note\">{}</div>", escaped(note))).collect();
        format!("<li>{}{notes}</li>\n", escaped(&item.text))
    };
    format!("<ul>\n{}</ul>\n", items.iter().map(item).collect::<String>())
}
