//! A campaign in Markdown: figures by kind of fault, and the misses, each with a fault that shows it.

use super::text::{NOT_COUNTED, headline, not_counted_rows, onsets};
use shsa_core::analysis::{Analysis, Comparison, Options, analyze};
use shsa_core::computation::Computation;
use shsa_core::knowledge::{Id, KnowledgeBase, Signal, SignalId};
use shsa_core::time::Span;
use shsa_lab::campaign::{Baseline, Campaign, Cell, Detectable, Kind, Measured, Smallest, Trial, rounded};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The texts about runs with a bad result, in the order of the report.
const REASONS: [&str; 5] = [
    "another signal called failed or silent",
    "a relation, or what signals share, called failed",
    "not detected, although a comparison of the model shows the fault",
    "not detected, and no comparison of the model shows the fault",
    "detected but not isolated, although the analysis says that it is isolable",
];

/// A run whose fault had an effect.
type Run<'a> = (&'a Trial, &'a Cell, &'a Measured);

struct Section<'a> {
    campaign: &'a Campaign<'a>,
    analysis: Analysis,
    /// For each signal, the period of its slowest witness.
    periods: Vec<Span>,
}

/// The section about one model and its recordings. `title` is its heading; `command` is what repeats the campaign; `detectable` are
/// the smallest detected faults, where amounts are multiples of these.
#[must_use]
pub fn markdown(
    campaign: &Campaign<'_>,
    title: &str,
    command: &str,
    detectable: Option<&Detectable>,
) -> String {
    let analysis = analyze(campaign.knowledge(), Options { addition_steps: 0, ..Options::default() });
    let periods = periods(campaign, &analysis);
    let section = Section { campaign, analysis, periods };
    let mut text = format!(
        "## {title}\n\n    {}\n\nFaults of {:.1} s, beginning at {} of {:.1} s. Without a fault: {} alarms in all.\n\n{}.\n\n",
        command,
        campaign.grid.duration.seconds(),
        onsets(campaign),
        campaign.length().seconds(),
        campaign.clean_alarms(),
        headline(campaign),
    );
    if let Some(detectable) = detectable {
        let late = late_alarms(campaign, &detectable.from);
        let _ = write!(
            text,
            "The model is the calibrated one. Of these alarms {late} are in the halves that it was not fitted to.\n\n{}",
            section.amounts(&detectable.smallest)
        );
    }
    text.push_str(&not_counted(campaign));
    text.push_str(&section.table());
    for reason in &campaign.grid.left_out {
        let _ = writeln!(text, "* left out: {reason}");
    }
    text.push_str(&section.missed());
    text
}

/// The number of alarms without a fault, from a moment of each session on.
fn late_alarms(campaign: &Campaign<'_>, from: &[Span]) -> usize {
    let late = |(baseline, from): (&Baseline<'_>, &Span)| {
        let begin = baseline.first + *from;
        baseline.alarms.iter().filter(|alarm| alarm.time >= begin).count()
    };
    campaign.baselines.iter().zip(from).map(late).sum()
}

/// The runs that no share counts, by signal.
fn not_counted(campaign: &Campaign<'_>) -> String {
    let rows = not_counted_rows(campaign);
    if rows.is_empty() {
        return String::new();
    }
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(&NOT_COUNTED.map(str::to_owned)) + "|---|---|---|---|---|---|---|\n";
    for mut row in rows {
        row[0] = format!("`{}`", row[0]);
        text += &line(&row);
    }
    text + "\n"
}

/// For each signal, the period of the slowest witness that is compared with it, or with one of its witnesses, which may be the
/// faulty one. The period is the longest of three: the mean time between values, the uncertainty of their time, and the time over
/// which a formula looks back, because the formula's result is completely new only after that time.
fn periods(campaign: &Campaign<'_>, analysis: &Analysis) -> Vec<Span> {
    let signals = campaign.knowledge().signals();
    let mut seen = vec![0_i64; signals.len()];
    for sample in campaign.baselines.iter().flat_map(|baseline| baseline.samples) {
        seen.get_mut(sample.wanted).into_iter().for_each(|seen| *seen += 1);
    }
    let length = campaign.length().0;
    let between = |seen: i64| if seen > 1 { Span(length / (seen - 1)) } else { Span::ZERO };
    let in_time = signals.iter().map(|signal| signal.time_error.1 - signal.time_error.0);
    let own: Vec<Span> =
        seen.into_iter().zip(in_time).map(|(seen, error)| between(seen).max(error)).collect();
    let back = |way| looks_back(campaign.knowledge(), analysis, way);
    let compared = |pair: &Comparison| {
        let signals = analysis.comparisons.signals(*pair).iter().map(Id::index).collect();
        (signals, back(pair.one).max(back(pair.other)))
    };
    let compared: Vec<(Vec<usize>, Span)> = analysis.comparisons.pairs().iter().map(compared).collect();
    with_those_beside(&with_those_beside(&own, &compared), &compared)
}

/// For each signal, the longest of its own period, those of the signals compared with it, and those of the comparisons.
fn with_those_beside(own: &[Span], compared: &[(Vec<usize>, Span)]) -> Vec<Span> {
    let mut longest = own.to_vec();
    for (signals, comparison) in compared {
        let slowest = signals.iter().filter_map(|&signal| own.get(signal)).max().max(Some(comparison));
        for &signal in signals {
            longest.get_mut(signal).into_iter().for_each(|it| *it = slowest.copied().unwrap_or(*it).max(*it));
        }
    }
    longest
}

/// How far back the formulas of a way look.
fn looks_back(knowledge: &KnowledgeBase, analysis: &Analysis, way: usize) -> Span {
    let way = analysis.comparisons.ways().get(way).cloned();
    let computation = way.and_then(|way| Computation::new(knowledge, way, Computation::slowest_input));
    computation.map_or(Span::ZERO, |computation| computation.looks_back())
}

impl Section<'_> {
    fn runs(&self) -> impl Iterator<Item = Run<'_>> {
        let trials = self.campaign.grid.trials.iter().zip(&self.campaign.results);
        trials.filter_map(|(trial, result)| {
            Some((trial, self.campaign.grid.cells.get(trial.cell)?, result.as_ref()?))
        })
    }

    fn is_isolable(&self, signal: SignalId) -> bool {
        self.analysis.faults.is_detectable(signal) && self.analysis.faults.suspects(signal).len() == 1
    }

    /// The smallest detected faults of each signal, and the errors that its model tolerates.
    fn amounts(&self, smallest: &Smallest) -> String {
        let kinds = smallest.kinds();
        let onsets: Vec<String> = smallest.onsets.iter().map(|at| format!("{:.1}", at.seconds())).collect();
        let mut text = format!(
            "Smallest detected faults in the half that it was fitted to, with onsets at {} s:\n\n| signal | tolerated | slowest witness |",
            onsets.join(", ")
        );
        kinds.iter().for_each(|kind| text += &format!(" {} |", kind.name()));
        text += &format!("\n|---|---|---|{}\n", "---|".repeat(kinds.len()));
        for &id in &self.campaign.grid.signals {
            let signal = &self.campaign.knowledge().signals()[id];
            let period = self.period(id).map_or("-".to_owned(), |it| format!("{} s", rounded(it.seconds())));
            let _ = write!(text, "| `{}` | {} | {period} |", signal.name, tolerated(signal));
            kinds.iter().for_each(|&kind| text += &format!(" {} |", smallest.described(signal, id, kind)));
            text.push('\n');
        }
        text + "\n"
    }

    fn table(&self) -> String {
        let mut text = "| fault | runs | too small | accused before | detected | isolated, of the isolable | wrong blame | shared blame | latency, median | worst | worst, s | early alarms |\n\
                        |---|---|---|---|---|---|---|---|---|---|---|---|\n"
            .to_owned();
        let all = |_: &Cell| true;
        for what in &self.campaign.grid.whats {
            self.row(&mut text, &what.label(), |cell| cell.what == *what);
        }
        self.row(&mut text, "all", all);
        text + "\nA latency is in periods of the slowest witness: a signal that is compared with the faulty one, or with a witness of it. Its period is the longest of three times: between its values, of the uncertainty of their stamps, and over which its formula looks back.\n\n"
    }

    fn row(&self, text: &mut String, label: &str, is_wanted: impl Fn(&Cell) -> bool) {
        let (below, runs): (Vec<Run<'_>>, Vec<Run<'_>>) =
            self.runs().filter(|(_, cell, _)| is_wanted(cell)).partition(is_passed_over);
        let count = |is_it: &dyn Fn(&Run<'_>) -> bool| runs.iter().filter(|run| is_it(run)).count();
        let isolable = count(&|run| self.is_isolable(run.1.signal));
        let mut latencies: Vec<f64> = runs.iter().filter_map(|run| self.latency(run)).collect();
        latencies.sort_unstable_by(f64::total_cmp);
        let digits = |it: f64| if it < 10.0 { 2 } else { 1 };
        let description =
            |latency: Option<&f64>| latency.map_or("-".to_owned(), |it| format!("{it:.*}", digits(*it)));
        let median = latencies.len().checked_sub(1).and_then(|last| latencies.get(last / 2));
        let _ = writeln!(
            text,
            "| {label} | {} | {} | {} | {} | {} of {isolable} | {} | {} | {} | {} | {} | {} |",
            runs.len(),
            below.len(),
            count(&|run| run.2.accused),
            count(&|run| run.2.latency.is_some()),
            count(&|run| self.is_isolable(run.1.signal) && run.2.is_isolated()),
            count(&|run| run.2.blamed_other) + below.iter().filter(|run| run.2.blamed_other).count(),
            count(&|run| run.2.blamed_shared) + below.iter().filter(|run| run.2.blamed_shared).count(),
            description(median),
            description(latencies.last()),
            description(runs.iter().filter_map(|run| run.2.latency).max().map(Span::seconds).as_ref()),
            runs.iter().map(|run| run.2.early).sum::<usize>(),
        );
    }

    fn latency(&self, (_, cell, measured): &Run<'_>) -> Option<f64> {
        Some(measured.latency?.seconds() / self.period(cell.signal)?.seconds())
    }

    /// The period of the slowest witness.
    fn period(&self, signal: SignalId) -> Option<Span> {
        self.periods.get(signal.index()).copied().filter(|period| *period > Span::ZERO)
    }

    fn reasons(&self, run: &Run<'_>) -> Vec<usize> {
        let (_, cell, measured) = run;
        let is_missed = measured.latency.is_none() && !is_passed_over(run);
        let shows = self.analysis.faults.is_detectable(cell.signal);
        let is_unnamed = measured.latency.is_some()
            && !is_passed_over(run)
            && self.is_isolable(cell.signal)
            && !measured.is_isolated();
        let plain = is_unnamed && !measured.blamed_other && !measured.blamed_shared;
        let holds =
            [measured.blamed_other, measured.blamed_shared, is_missed && shows, is_missed && !shows, plain];
        (0..REASONS.len()).filter(|&at| holds.get(at) == Some(&true)).collect()
    }

    /// Runs with a bad result, by reason and kind, each with its first fault in the notation of `--inject`.
    fn missed(&self) -> String {
        let mut groups: BTreeMap<(usize, Kind), Vec<Run<'_>>> = BTreeMap::new();
        for run in self.runs() {
            for reason in self.reasons(&run) {
                groups.entry((reason, run.1.what.kind)).or_default().push(run);
            }
        }
        let mut text = String::new();
        let mut description = None;
        for ((reason, kind), runs) in &groups {
            if description.replace(*reason) != Some(*reason) {
                let _ = writeln!(text, "\n**{}**\n", REASONS.get(*reason).unwrap_or(&""));
            }
            let mut by_signal: BTreeMap<SignalId, usize> = BTreeMap::new();
            runs.iter().for_each(|run| *by_signal.entry(run.1.signal).or_default() += 1);
            let names = by_signal.iter().map(|(&signal, count)| {
                format!("`{}` {count}", self.campaign.knowledge().signals()[signal].name)
            });
            let first = runs.first().map_or(String::new(), inject);
            let names = names.collect::<Vec<_>>().join(", ");
            let _ = writeln!(text, "* {} {}: {names}; first: `--inject {first}`", kind.name(), runs.len());
        }
        text + "\n"
    }
}

/// Whether no detection is expected: the fault is smaller than the smallest detectable one.
fn is_passed_over((trial, ..): &Run<'_>) -> bool {
    trial.is_below
}

/// The errors of value and time, and the delay, that a model grants a signal.
fn tolerated(signal: &Signal) -> String {
    let error = signal.value_error;
    let scale = signal.unit.as_ref().map_or(1.0, |unit| unit.scale);
    let unit = signal.unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
    let mut parts = Vec::new();
    if error.hi > error.lo {
        parts.push(format!("{} to {}{unit}", rounded(error.lo / scale), rounded(error.hi / scale)));
    }
    if error.relative > 0.0 {
        parts.push(format!("{} %", rounded(100.0 * error.relative)));
    }
    let late = signal.limits.max_delay.or(signal.timeout);
    parts.extend(late.map(|late| format!("{} s late", rounded(late.seconds()))));
    parts.join(", ")
}

/// The fault of a run in the notation of `shsa replay --inject`.
fn inject((trial, cell, _): &Run<'_>) -> String {
    let fault = &trial.fault;
    let unit = if cell.what.kind == Kind::Delay { "s" } else { "" };
    let amount = cell.size.map_or(String::new(), |size| format!("={size}{unit}"));
    let to = fault.to.map_or(String::new(), |to| format!("{}s", to.seconds()));
    format!("{}{amount}:{}@{}s..{to}", cell.what.kind.name(), fault.signal, fault.from.seconds())
}
