//! What came of many worlds.

use super::odds::Tenths;
use super::voter::Voters;
use super::watch::Watched;
use serde_json::json;
use std::collections::BTreeMap;

/// What came of the worlds of a kind.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) worlds: usize,
    untrue: usize,
    counts: [usize; 3],
    /// Worlds with something wrong, by what it is.
    wrong: BTreeMap<&'static str, usize>,
    pub(super) tenths: Tenths,
    pub(super) voters: Voters,
}

impl Tally {
    pub(super) fn add(&mut self, watched: &Watched) {
        self.worlds += 1;
        self.untrue += usize::from(watched.untrue.is_some());
        for (own, other) in self.counts.iter_mut().zip(watched.counts) {
            *own += other;
        }
        let mut names: Vec<&'static str> = watched.findings.iter().map(|it| it.wrong.name()).collect();
        names.sort_unstable();
        names.dedup();
        for name in names {
            *self.wrong.entry(name).or_default() += 1;
        }
    }

    pub(super) fn join(&mut self, other: Tally) {
        self.worlds += other.worlds;
        self.untrue += other.untrue;
        for (own, other) in self.counts.iter_mut().zip(other.counts) {
            *own += other;
        }
        for (name, count) in other.wrong {
            *self.wrong.entry(name).or_default() += count;
        }
        for (own, other) in self.tenths.iter_mut().zip(other.tenths) {
            *own = (own.0 + other.0, own.1 + other.1, own.2 + other.2);
        }
        self.voters.join(&other.voters);
    }

    pub(super) fn is_right(&self) -> bool {
        self.untrue == 0 && self.wrong.is_empty() && self.voters.is_right()
    }

    /// One line about a kind.
    pub(super) fn line(&self, name: &str, as_json: bool) -> String {
        let [published, told, named] = self.counts;
        if as_json {
            return json!({
                "kind": name, "worlds": self.worlds, "untrue": self.untrue, "published": published,
                "to_be_told": told, "to_be_named": named, "wrong": self.wrong,
            })
            .to_string();
        }
        let wrong: Vec<String> = self.wrong.iter().map(|(name, count)| format!("{name} {count}")).collect();
        let untrue = if self.untrue > 0 { format!(", {} untrue", self.untrue) } else { String::new() };
        let due = if told > 0 { format!(", {told} to be told, {named} to be named") } else { String::new() };
        format!(
            "{name:<14} {:>5} worlds{untrue}, {published:>8} values{due}: {}",
            self.worlds,
            wrong.join(", ")
        )
    }

    /// How often signals were faulty that were printed with a probability of each tenth.
    pub(super) fn odds(&self, as_json: bool) -> String {
        let rows = self.tenths.iter().filter(|it| it.0 > 0).map(|(count, sum, right)| {
            let (mean, share) = (sum / *count as f64, *right as f64 / *count as f64);
            if as_json {
                json!({ "printed": mean, "right": share, "count": count }).to_string()
            } else {
                format!("printed {mean:.3}, right {share:.3}, of {count}")
            }
        });
        rows.collect::<Vec<_>>().join("\n")
    }
}

/// What is wrong with a world, each thing once.
pub(super) fn lines(watched: &Watched) -> Vec<String> {
    let untrue = watched.untrue.iter().map(|it| format!("untrue: {it}"));
    let mut seen = Vec::new();
    let first = watched.findings.iter().filter(|it| {
        let key = (it.wrong, it.signal);
        let is_new = !seen.contains(&key);
        seen.push(key);
        is_new
    });
    let found = first.map(|it| format!("{} at {:.3} s: {}", it.wrong.name(), it.time_s, it.text));
    let mut lines: Vec<String> = untrue.chain(found).collect();
    if !lines.is_empty() {
        lines.extend(watched.faults.iter().map(|it| format!("    fault: {it}")));
    }
    lines
}
