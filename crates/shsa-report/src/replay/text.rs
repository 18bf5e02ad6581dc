//! The results of a replay as text.

use super::{Part, Report, difference_from_si, verdict};
use crate::analysis::shortened;
use crate::events::event_text;
use crate::style::{Paint, Style};
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::monitor::{Figures, WatchedWay};
use shsa_core::time::Time;
use shsa_format::comparisons::Noted;
use shsa_format::text::counted;
use std::time::Duration;

impl Report<'_> {
    /// Decisions, then tables of needs, signals and ways, then remarks; `elapsed` is how long the replay has taken.
    #[must_use]
    pub fn text(&self, style: Style, elapsed: Duration) -> String {
        let sessions = match self.parts.len() {
            1 => String::new(),
            count => format!(" in {count} sessions"),
        };
        let mut parts = vec![format!(
            "{} over {:.1} s{sessions}, replayed in {:.3} s",
            counted(self.observations(), "observation"),
            self.duration().seconds(),
            elapsed.as_secs_f64()
        )];
        parts.extend(self.parts.iter().enumerate().map(|(at, part)| self.events_text(style, at, part)));
        if !self.needs.is_empty() {
            parts.push(self.needs_text(style));
        }
        parts.push(self.signals_text(style));
        parts.extend(self.measurements_text(style));
        parts.extend(self.ways_text(style));
        let warning = |described: &String| format!("{} {described}", style.paint(Paint::Yellow, "warning:"));
        let warnings: Vec<String> = self.warnings.iter().map(warning).collect();
        parts.extend((!warnings.is_empty()).then(|| warnings.join("\n")));
        let notes = shortened(self.notes.iter().map(Noted::text).collect());
        let notes: Vec<String> = notes.iter().map(|described| format!("note: {described}")).collect();
        parts.extend((!notes.is_empty()).then(|| notes.join("\n")));
        parts.join("\n\n")
    }

    fn events_text(&self, style: Style, at: usize, part: &Part<'_>) -> String {
        let text = |time: Time| format!("{:>9.3} s", part.since(time));
        let described = part.run.events_with_models();
        let mut lines: Vec<(Time, String)> = described
            .map(|(known, event)| (event.time, event_text(style, &text(event.time), known, event)))
            .collect();
        for (time, file) in part.reloads() {
            let word = style.paint(Paint::Bold, &format!("{:<11}", "reloaded"));
            // Events caused by the change follow it.
            let at = lines.partition_point(|(described, _)| *described < time);
            lines.insert(at, (time, format!("{}  {word} {file}", text(time))));
        }
        let nothing = lines.is_empty();
        for (known, event) in part.run.outliers_with_models() {
            let at = lines.partition_point(|(described, _)| *described < event.time);
            lines.insert(at, (event.time, event_text(style, &text(event.time), known, event)));
        }
        let head = self.number(at).map(|number| {
            let (from, to) = (part.since(part.run.first), part.since(part.run.last));
            let files = part.files().join(", ");
            format!("Session {number}: {files}, {from:.1} s to {to:.1} s{}", part.because())
        });
        let nothing = nothing.then(|| "No events: nothing failed, nothing was substituted.".to_owned());
        let lines = lines.into_iter().map(|(_, line)| line);
        head.into_iter().chain(nothing).chain(lines).collect::<Vec<_>>().join("\n")
    }

    fn needs_text(&self, style: Style) -> String {
        let mut rows = Vec::new();
        for report in &self.needs {
            let need = &self.knowledge.needs()[report.id];
            let in_unit = |value: f64| difference_from_si(self.knowledge, need.variable, value);
            let error = report.error.map_or(String::new(), |error| {
                format!(
                    "rmse {:.3}, at most {:.3}{}",
                    in_unit(error.rms()),
                    in_unit(error.most),
                    unit(self.knowledge, need.variable)
                )
            });
            rows.push(vec![
                self.knowledge.variables()[need.variable].name.clone(),
                if report.met { style.paint(Paint::Green, "yes") } else { style.paint(Paint::Red, "no") },
                report.published.to_string(),
                format!("{:.3} s", report.longest_gap.seconds()),
                report.source.clone().unwrap_or_else(|| "nothing".to_owned()),
                error,
            ]);
        }
        let mut head = vec!["need", "met", "published", "longest gap", "source at the end"];
        if self.source.clean.is_some() {
            head.push("error");
        }
        style.table(&head, rows)
    }

    fn signals_text(&self, style: Style) -> String {
        let mut rows = Vec::new();
        for signal in self.knowledge.signals().iter() {
            let counts = self.counts(&signal.name, self.parts);
            let verdict = verdict(self.run, &signal.name);
            rows.push(vec![
                signal.name.clone(),
                style.verdict(verdict, verdict),
                counts.accepted.to_string(),
                (counts.dropped + counts.duplicates).to_string(),
                counts.late.to_string(),
                counts.out_of_order.to_string(),
                counts.invalid.to_string(),
                counts.out_of_range.to_string(),
                counts.too_fast.to_string(),
            ]);
        }
        let head = [
            "signal",
            "verdict",
            "accepted",
            "dropped",
            "late",
            "out of order",
            "invalid",
            "out of range",
            "too fast",
        ];
        style.table(&head, rows)
    }

    /// What has become of the measurements of fusions, in the last session.
    fn measurements_text(&self, style: Style) -> Option<String> {
        let engine = &self.parts.last()?.run.engine;
        let knowledge = engine.knowledge();
        let mut rows = Vec::new();
        for (place, fusion) in knowledge.fusions().iter().enumerate() {
            for (input, it) in fusion.inputs.iter().enumerate() {
                let counts = engine.measurements(place, input);
                let numbers = [
                    counts.used,
                    counts.duplicate,
                    counts.too_late,
                    counts.rejected,
                    counts.masked,
                    counts.ahead,
                ];
                let names = [fusion.name.clone(), knowledge.signals()[it.signal].name.clone()];
                rows.push(names.into_iter().chain(numbers.map(|number| number.to_string())).collect());
            }
        }
        let head = ["fusion", "input", "used", "duplicate", "too late", "rejected", "masked", "ahead"];
        (!rows.is_empty()).then(|| style.table(&head, rows))
    }

    /// The ways of the needed variables with their figures: which one would take over, and why.
    fn ways_text(&self, style: Style) -> Option<String> {
        let is_needed =
            |variable: VariableId| self.knowledge.needs().iter().any(|need| need.variable == variable);
        let share = |share: Option<f64>| {
            share.map_or_else(|| "unknown".to_owned(), |share| format!("{:.1} %", 100.0 * share))
        };
        let row = |(way, figures): (&WatchedWay, Figures)| {
            let variable = way.variable();
            let distance = |value: Option<f64>| {
                let in_unit = |value| difference_from_si(self.knowledge, variable, value);
                let with_unit = |value| format!("{:.3}{}", in_unit(value), unit(self.knowledge, variable));
                value.map_or_else(|| "unknown".to_owned(), with_unit)
            };
            vec![
                self.knowledge.variables()[variable].name.clone(),
                way.computation.way().describe(self.knowledge),
                share(figures.agreement),
                distance(figures.error),
                distance(figures.width),
                share(figures.availability),
            ]
        };
        let rows: Vec<_> = self.ways().filter(|(way, _)| is_needed(way.variable())).map(row).collect();
        let head = ["need", "way, in the last minutes", "agreed", "off by", "width", "there"];
        (!rows.is_empty()).then(|| style.table(&head, rows))
    }
}

fn unit(knowledge: &KnowledgeBase, variable: VariableId) -> String {
    knowledge.variables()[variable].unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"))
}
