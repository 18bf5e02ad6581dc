//! A diagnosis as text for people.

use super::Report;
use crate::style::{Paint, Style};
use shsa_format::text::counted;

/// The most entries of each list on the page of text.
const MOST: usize = 12;

impl Report<'_> {
    /// One page of text: the findings, what is not checked, what was found out, and what one sensor more would bring.
    #[must_use]
    pub fn text(&self, style: Style) -> String {
        let mut lines = Vec::new();
        let findings = &self.diagnosis.findings;
        if findings.is_empty() {
            lines.push(style.paint(Paint::Green, &self.summary()));
        } else {
            lines.push(style.paint(Paint::Red, &self.summary()));
        }
        for (at, finding) in findings.iter().enumerate() {
            lines.push(String::new());
            lines.push(style.wrapped(&format!("{}. {}", at + 1, self.headline(finding)), 0));
            lines.push(format!("   {}", self.when(finding)));
            lines.extend(self.evidence(finding).iter().map(|it| style.wrapped(it, 3)));
        }
        let diagnosis = self.diagnosis;
        let groups =
            diagnosis.groups.iter().map(|it| format!("measure the same: {}", self.names(it).join(", ")));
        list(&mut lines, style, "Found out", groups.chain(self.relations()).collect());
        let unchecked =
            diagnosis.unchecked.iter().map(|(column, why)| format!("{}: {why}", self.name(*column)));
        list(&mut lines, style, "Not checked by anything here", unchecked.collect());
        list(&mut lines, style, "What one sensor more would bring", self.more());
        lines.join("\n")
    }

    /// The result in one sentence.
    pub(super) fn summary(&self) -> String {
        let checked: std::collections::BTreeSet<usize> =
            self.diagnosis.relations.iter().flat_map(|it| it.columns.iter().copied()).collect();
        let by = format!(
            "{} of {} are checked by {}",
            checked.len(),
            counted(self.columns.columns.len(), "signal"),
            counted(self.diagnosis.relations.len(), "relation")
        );
        match self.diagnosis.findings.len() {
            0 => format!("Nothing contradicts anything else: {by}."),
            count => format!("{}: {by}.", counted(count, "finding")),
        }
    }

    /// The relations that are no groups.
    fn relations(&self) -> Vec<String> {
        let is_in_group = |columns: &[usize]| {
            self.diagnosis.groups.iter().any(|group| columns.iter().all(|it| group.contains(it)))
        };
        self.diagnosis
            .relations
            .iter()
            .filter(|it| !is_in_group(&it.columns))
            .map(|it| self.relation(it))
            .collect()
    }
}

fn list(lines: &mut Vec<String>, style: Style, title: &str, entries: Vec<String>) {
    if entries.is_empty() {
        return;
    }
    lines.push(String::new());
    lines.push(style.paint(Paint::Bold, &format!("{title}:")));
    let count = entries.len();
    lines.extend(entries.iter().take(MOST).map(|it| style.wrapped(it, 2)));
    if count > MOST {
        lines.push(format!("  and {} more", count - MOST));
    }
}
