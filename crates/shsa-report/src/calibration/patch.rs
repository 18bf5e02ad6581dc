//! The change of the model as a file, with the evidence in comments.

use super::{Report, number};
use crate::Style;
use shsa_core::knowledge::{Draft, RelationDraft, SignalDraft, VariableDraft};
use shsa_lab::calibration::{Fitted, Parameter};
use shsa_lab::campaign::Kind;
use shsa_model::write;

/// The change as YAML: every changed variable, signal and relation in full, below comments with its evidence.
pub(super) fn text(report: &Report<'_>, style: Style) -> String {
    let mut text = String::new();
    for description in [report.promised(), report.tested()] {
        style.wrapped(&description, 0).lines().for_each(|line| text += &format!("# {line}\n"));
    }
    for remark in report.remarks() {
        text += &format!("# {remark}\n");
    }
    let (old, new) = (report.draft, &report.found.draft);
    let written = |draft: Draft| entry(&write::yaml(&draft));
    let relation = |it: &RelationDraft| written(Draft { relations: vec![it.clone()], ..Draft::default() });
    let signal = |it: &SignalDraft| written(Draft { signals: vec![it.clone()], ..Draft::default() });
    let variable = |it: &VariableDraft| written(Draft { variables: vec![it.clone()], ..Draft::default() });
    let variables = old
        .variables
        .iter()
        .zip(&new.variables)
        .map(|(old, new)| (&old.name.text, variable(old), variable(new)));
    let relations = old
        .relations
        .iter()
        .zip(&new.relations)
        .map(|(old, new)| (&new.name.text, relation(old), relation(new)));
    let signals =
        old.signals.iter().zip(&new.signals).map(|(old, new)| (&new.name.text, signal(old), signal(new)));
    let sections = [
        ("variables", variables.collect::<Vec<_>>()),
        ("relations", relations.collect()),
        ("signals", signals.collect()),
    ];
    for (section, entries) in sections {
        let mut changed = entries.iter().filter(|(_, old, new)| old != new).peekable();
        if changed.peek().is_some() {
            text += &format!("{section}:\n");
        }
        for (name, _, new) in changed {
            let fitted = report.found.fitted.iter().find(|it| is_of(report, it, section, name));
            fitted
                .into_iter()
                .flat_map(|it| evidence(report, it))
                .for_each(|line| text += &format!("  # {line}\n"));
            text += new;
        }
    }
    text
}

fn is_of(report: &Report<'_>, fitted: &Fitted, section: &str, name: &str) -> bool {
    let own = match fitted.parameter {
        Parameter::Signal(_) => "signals",
        Parameter::Relation(_) => "relations",
    };
    own == section && report.name(fitted.parameter) == name
}

/// The lines below the section's key.
fn entry(yaml: &str) -> String {
    yaml.lines().filter(|line| line.starts_with("  ")).map(|line| format!("{line}\n")).collect()
}

fn evidence(report: &Report<'_>, fitted: &Fitted) -> Vec<String> {
    let mut lines = Vec::new();
    if fitted.error.is_some() {
        let factor = number(report.found.promise.factor);
        let singles = match fitted.singles > 0.0 {
            true => format!(", and {} for single values", number(fitted.singles)),
            false => String::new(),
        };
        lines.push(format!(
            "{} all the time, and {factor} deviations of {}{singles}",
            number(fitted.offset),
            number(fitted.spread)
        ));
    }
    if let Parameter::Signal(signal) = fitted.parameter {
        let unit = report.unit(signal);
        if fitted.delay.0 > 0 {
            lines.push(format!("it tells {} ms later than before", number(fitted.delay.seconds() * 1e3)));
        }
        if let Some(bias) = fitted.smallest_bias {
            lines.push(format!("a step of {}{unit} is told", number(bias)));
        }
        if let Some(smallest) = report.smallest {
            let signal_of_model = &report.knowledge.signals()[signal];
            let description =
                |kind: Kind| format!("{} {}", kind.name(), smallest.described(signal_of_model, signal, kind));
            let description: Vec<String> = smallest.kinds().into_iter().map(description).collect();
            lines.push(format!("smallest faults that give an alarm: {}", description.join(", ")));
        }
        let rhythm = &report.found.rhythms[shsa_core::knowledge::Id::index(signal)];
        if let (Some((lo, hi)), Some(fastest), Some(gap)) =
            (rhythm.range, rhythm.fastest, rhythm.longest_gap_s)
        {
            lines.push(format!(
                "seen: {} to {}{unit}, at most {}{unit} a second, {} ms apart at most",
                number(lo),
                number(hi),
                number(fastest),
                number(gap * 1e3)
            ));
        }
    }
    lines
}
