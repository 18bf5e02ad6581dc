//! What was learned (`shsa_lab::learning`), as text, as one JSON object, and as a change of the model.

use crate::Style;
use serde_json::{Value, json};
use shsa_format::text::counted;
use shsa_lab::learning::Learned;
use shsa_lab::naming::{fine, number};
use shsa_lab::proposal::{Proposal, Proposals, Serving, Subject, Worth};

/// Relations that were learned, with what they were learned from.
///
/// # Example
/// ```
/// use shsa_model::live::{Live, Written};
/// use shsa_recording::{ReadOptions, Wanted, read};
/// use shsa_lab::learning::learn;
/// use shsa_lab::proposal::{Proposals, Subject};
/// use shsa_report::{Style, learning::Report};
///
/// let text = "{ shsa: 1, variables: { v: { unit: m/s }, w: { unit: rad/s } }, signals: { v: { variable: v }, w: { variable: w } } }";
/// let model = Written { name: "wheel.yaml", text };
/// let (live, _) = Live::load(model).expect("the model is valid");
/// // A wheel of 0.3 m for two minutes.
/// let file = std::env::temp_dir().join(format!("wheel-{}.csv", std::process::id()));
/// let speed = |step: u32| 5.0 + (0.07 * f64::from(step)).sin() + (0.019 * f64::from(step)).cos();
/// let row = |step: u32| format!("{:.1},{:.4},{:.4}\n", 0.1 * f64::from(step), speed(step), speed(step) / 0.3);
/// std::fs::write(&file, format!("t [s],v,w\n{}", (0..1_200).map(row).collect::<String>()))?;
/// let wanted = ["v", "w"].map(|name| Wanted::new(name, format!("{}#{name}", file.file_stem().unwrap().display())));
/// let recording = read(&[file.clone()], &wanted, &ReadOptions::default())?;
/// std::fs::remove_file(file)?;
///
/// let subject = Subject::of_model(model, live.knowledge(), &recording);
/// let learned = learn(&subject.signals, &())?;
/// let proposals = Proposals::new(&subject, &learned, &())?;
/// let report = Report { subject: &subject, learned: &learned, proposals: &proposals, serving: None };
/// assert!(report.text(Style::PLAIN).contains("w = 3.333 rad/m * v"));
/// assert!(report.patch().contains("w_from_v"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy)]
pub struct Report<'a> {
    /// What they were learned from.
    pub subject: &'a Subject,
    /// All that was found.
    pub learned: &'a Learned,
    /// The relations as entries of the model.
    pub proposals: &'a Proposals,
    /// What they do for the need that they are chosen for.
    pub serving: Option<&'a Serving>,
}

impl Report<'_> {
    /// The relations with their shares, and what the model is with them.
    #[must_use]
    pub fn text(&self, style: Style) -> String {
        let mut lines = self.subject.equal.clone();
        lines.extend(self.learned.copies.iter().map(|copy| {
            format!(
                "{} is computed from {}: no witness",
                self.subject.signals[copy.signal].name, self.subject.signals[copy.of].name
            )
        }));
        if !lines.is_empty() {
            lines.push(String::new());
        }
        lines.extend(self.serving.map(for_need));
        let signals = counted(self.subject.signals.len(), "variable");
        if self.proposals.all.is_empty() {
            lines.push(format!("no relation found between {signals}"));
            return lines.join("\n");
        }
        let head = ["relation", "unexplained: fitted, chosen, unseen", "error", "note"];
        lines.push(style.table(&head, self.proposals.all.iter().map(row).collect()));
        let (before, after) = (self.proposals.before, self.proposals.after);
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

    /// One JSON object.
    #[must_use]
    pub fn json(&self) -> Value {
        let name = |signal: usize| self.subject.signals[signal].name.clone();
        let copies =
            self.learned.copies.iter().map(|it| json!({ "variable": name(it.signal), "of": name(it.of) }));
        let mut found = json!({
            "model": self.subject.model,
            "variables": self.subject.signals.len(),
            "equal": self.subject.equal,
            "copies": copies.collect::<Vec<_>>(),
            "relations": self.proposals.all.iter().map(of_proposal).collect::<Vec<_>>(),
            "before": of_worth(self.proposals.before),
            "after": of_worth(self.proposals.after),
        });
        if let Some(serving) = self.serving {
            found["for"] = of_serving(serving);
        }
        found
    }

    /// The change of the model; relations that the model cannot have, or with statistical evidence only, are comments.
    #[must_use]
    pub fn patch(&self) -> String {
        let mut text = format!(
            "# Learned by `shsa learn` for {}. Shares are of the target's spread that stays unexplained, in the fitted, the chosen and the\n\
             # unseen part. `shsa calibrate` fits the errors.\n",
            self.subject.model
        );
        let (active, commented): (Vec<&Proposal>, Vec<&Proposal>) =
            self.proposals.all.iter().partition(|it| it.is_active());
        // A file of comments only would be no change of a model.
        text += if active.is_empty() { "relations: {}\n" } else { "relations:\n" };
        for proposal in active {
            text += &format!("  # {}\n{}", evidence(proposal), proposal.entry());
        }
        for proposal in commented {
            text += &format!(
                "  # {}; {}\n  # {}",
                note(proposal),
                evidence(proposal),
                proposal.entry().trim_start()
            );
        }
        text
    }
}

/// What relations do for a need, in words.
fn for_need(serving: &Serving) -> String {
    let Serving { need, variable, is_served, single_points, left, relations } = serving;
    let now = match (is_served, single_points.as_slice()) {
        (false, _) => "no signal and no relation gives it".to_owned(),
        (true, []) => "no single loss fails it".to_owned(),
        (true, lost) => format!("nothing stands in for {}", lost.join(", ")),
    };
    let with = match (relations.len(), left.as_slice()) {
        (0, _) if *is_served && single_points.is_empty() => return format!("{need} ({variable}): {now}.\n"),
        (0, _) => {
            "no relation that was found changes this; `shsa analyze` lists sensors that would".to_owned()
        }
        (count, []) => format!("with {} no single loss fails it", counted(count, "relation")),
        (count, left) => {
            format!("with {} something does, but for {}", counted(count, "relation"), left.join(", "))
        }
    };
    format!("{need} ({variable}): {now}; {with}.\n")
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

fn of_serving(serving: &Serving) -> Value {
    json!({
        "need": serving.need,
        "variable": serving.variable,
        "served": serving.is_served,
        "single_points": serving.single_points,
        "relations": serving.relations,
        "left": serving.left,
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

fn evidence(proposal: &Proposal) -> String {
    let score = proposal.relation.score;
    let shares = [score.fitted, score.chosen, score.unseen].map(|it| format!("{} %", number(100.0 * it)));
    let seen = proposal
        .seen
        .iter()
        .map(|(name, low, high)| format!("{name} {} to {}", fine(*low, high - low), fine(*high, high - low)));
    format!("{} unexplained; seen with {}", shares.join(", "), seen.collect::<Vec<_>>().join(", "))
}
