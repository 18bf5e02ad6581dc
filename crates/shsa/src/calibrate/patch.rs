//! What changes in the model, as a file of its own, with the evidence in comments.

use super::report::{Report, number};
use crate::campaign::grid::Kind;
use shsa_core::knowledge::{Draft, RelationDraft, SignalDraft};
use shsa_estimate::{Fitted, Parameter, Support};
use shsa_format::model::write;

/// The change as YAML: every signal and relation that is different, whole, below what it rests on.
pub(super) fn text(report: &Report<'_>, false_alarms: f64) -> String {
    let mut text = format!(
        "# Fitted to the first {} s of a recording of {} s, for {} false conflicts of a pair an hour.\n\
         # On the rest, a whole run calls {} signals failed and suspects {}.\n",
        number(report.split.seconds()),
        number(report.duration.seconds()),
        number(false_alarms),
        report.found.after.failed,
        report.found.after.suspected,
    );
    let remarks = report.found.pairs.iter().filter_map(|pair| report.remark(pair));
    for remark in report.unhealthy().into_iter().chain(remarks) {
        text += &format!("# {remark}\n");
    }
    let (old, new) = (report.draft, &report.found.draft);
    let written = |draft: Draft| entry(&write::yaml(&draft));
    let relation = |it: &RelationDraft| written(Draft { relations: vec![it.clone()], ..Draft::default() });
    let signal = |it: &SignalDraft| written(Draft { signals: vec![it.clone()], ..Draft::default() });
    let relations = old
        .relations
        .iter()
        .zip(&new.relations)
        .map(|(old, new)| (&new.name.text, relation(old), relation(new)));
    let signals =
        old.signals.iter().zip(&new.signals).map(|(old, new)| (&new.name.text, signal(old), signal(new)));
    for (section, entries) in [("relations", relations.collect::<Vec<_>>()), ("signals", signals.collect())] {
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
    if let Some(pair) = fitted.asked_by.map(|pair| &report.found.pairs[pair]) {
        let block = number(pair.block.seconds());
        let support = match pair.support {
            None => String::new(),
            Some(Support::Counted { rank, of }) => format!("number {rank} of {of} blocks of {block} s"),
            Some(Support::Extrapolated { largest, of }) => {
                format!("{} at most in {of} blocks of {block} s, and a tail", report.amount(pair, largest))
            }
        };
        lines.push(format!("{}: {} ({support})", report.pair(pair), report.amount(pair, pair.needed)));
    }
    if let Parameter::Signal(signal) = fitted.parameter {
        let unit = report.unit(signal);
        if fitted.offset != 0.0 {
            lines.push(format!("it shows {}{unit} more than the others", number(fitted.offset)));
        }
        if fitted.delay.0 > 0 {
            lines.push(format!("it tells {} ms later than before", number(fitted.delay.seconds() * 1e3)));
        }
        if let (Some(bias), Some(by)) = (fitted.smallest_bias, fitted.seen_by) {
            let by = report.pair(&report.found.pairs[by]);
            let lasting =
                report.lasting(fitted).map(|it| format!("; if it lasts, by many together, one of {it}"));
            lines.push(format!(
                "a bias of {}{unit} is seen, by {by}{}",
                number(bias),
                lasting.unwrap_or_default()
            ));
        }
        if let Some(smallest) = report.smallest {
            let signal_of_model = &report.knowledge.signals()[signal];
            let told =
                |kind: Kind| format!("{} {}", kind.name(), smallest.told(signal_of_model, signal, kind));
            let told: Vec<String> = smallest.kinds().into_iter().map(told).collect();
            lines.push(format!("smallest faults that give an alarm: {}", told.join(", ")));
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
