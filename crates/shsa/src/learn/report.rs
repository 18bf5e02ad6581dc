//! What was learned, as text, as one JSON object, and as a change of the model.

use super::proposal::{Proposal, Proposals, Worth};
use super::subject::Subject;
use crate::draft::{fine, number};
use crate::show;
use serde_json::{Value, json};
use shsa_format::text::counted;
use shsa_lab::learning::Learned;

pub(super) fn text(subject: &Subject, learned: &Learned, proposals: &Proposals) -> String {
    let mut lines = subject.equal.clone();
    lines.extend(learned.copies.iter().map(|copy| {
        format!(
            "{} is computed from {}: no witness",
            subject.signals[copy.signal].name, subject.signals[copy.of].name
        )
    }));
    if !lines.is_empty() {
        lines.push(String::new());
    }
    let signals = counted(subject.signals.len(), "variable");
    if proposals.all.is_empty() {
        lines.push(format!("no relation found between {signals}"));
        return lines.join("\n");
    }
    let head = ["relation", "unexplained: fitted, chosen, unseen", "error", "note"];
    lines.push(show::style().table(&head, proposals.all.iter().map(row).collect()));
    let (before, after) = (proposals.before, proposals.after);
    lines.push(String::new());
    lines.push(format!(
        "Of {}, with the model as it is, and with these relations: detectable {} and {}, isolable from all others {} and {}, \
         substitutable {} and {}.",
        counted(before.signals, "signal"),
        before.detectable,
        after.detectable,
        before.isolable,
        after.isolable,
        before.substitutable,
        after.substitutable
    ));
    lines.join("\n")
}

fn row(proposal: &Proposal) -> Vec<String> {
    let score = proposal.relation.score;
    let shares = [score.fitted, score.chosen, score.unseen].map(|it| format!("{} %", number(100.0 * it)));
    vec![proposal.equation.clone(), shares.join(", "), number(proposal.error), note(proposal)]
}

fn note(proposal: &Proposal) -> String {
    match &proposal.refusal {
        Some(reason) => format!("not for the model: {reason}"),
        None if proposal.is_statistical => "statistical only".to_owned(),
        None => String::new(),
    }
}

pub(super) fn json(subject: &Subject, learned: &Learned, proposals: &Proposals) -> Value {
    let name = |signal: usize| subject.signals[signal].name.clone();
    let copies = learned.copies.iter().map(|it| json!({ "variable": name(it.signal), "of": name(it.of) }));
    json!({
        "model": subject.model,
        "variables": subject.signals.len(),
        "equal": subject.equal,
        "copies": copies.collect::<Vec<_>>(),
        "relations": proposals.all.iter().map(of_proposal).collect::<Vec<_>>(),
        "before": of_worth(proposals.before),
        "after": of_worth(proposals.after),
    })
}

fn of_proposal(proposal: &Proposal) -> Value {
    let score = proposal.relation.score;
    let seen = |(variable, low, high): &(String, f64, f64)| json!({ "variable": variable, "low": low, "high": high });
    json!({
        "name": proposal.name,
        "equation": proposal.equation,
        "kind": proposal.kind,
        "variables": proposal.variables,
        "unexplained": { "fitted": score.fitted, "chosen": score.chosen, "unseen": score.unseen },
        "error": proposal.error,
        "seen": proposal.seen.iter().map(seen).collect::<Vec<_>>(),
        "statistical": proposal.is_statistical,
        "refused": proposal.refusal,
        "with_it": of_worth(proposal.worth),
    })
}

fn of_worth(worth: Worth) -> Value {
    json!({
        "signals": worth.signals,
        "detectable": worth.detectable,
        "isolable": worth.isolable,
        "substitutable": worth.substitutable,
    })
}

/// The change of the model; relations that the model cannot have, or with statistical evidence only, are comments.
pub(super) fn patch(subject: &Subject, proposals: &Proposals) -> String {
    let mut text = format!(
        "# Learned by `shsa learn` for {}. Shares are of the target's spread that stays unexplained, in the fitted, the chosen and the\n\
         # unseen part. `shsa calibrate` fits the errors.\n",
        subject.model
    );
    let (active, commented): (Vec<&Proposal>, Vec<&Proposal>) =
        proposals.all.iter().partition(|it| it.is_active());
    // A file of comments only would be no change of a model.
    text += if active.is_empty() { "relations: {}\n" } else { "relations:\n" };
    for proposal in active {
        text += &format!("  # {}\n{}", evidence(proposal), proposal.entry());
    }
    for proposal in commented {
        text +=
            &format!("  # {}; {}\n  # {}", note(proposal), evidence(proposal), proposal.entry().trim_start());
    }
    text
}

fn evidence(proposal: &Proposal) -> String {
    let score = proposal.relation.score;
    let shares = [score.fitted, score.chosen, score.unseen].map(|it| format!("{} %", number(100.0 * it)));
    let seen = proposal
        .seen
        .iter()
        .map(|(name, low, high)| format!("{name} {} to {}", fine(*low, high - low), fine(*high, high - low)));
    format!("{} unexplained; seen with {}", shares.join(", "), seen.collect::<Vec<_>>().join(", "))
}
