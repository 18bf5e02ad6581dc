//! A campaign in Markdown: figures by kind of fault, and what is missed, each miss with the fault that shows it.

use super::Arguments;
use super::grid::{Cell, Detectable, Kind, Trial};
use super::smallest::Smallest;
use super::tally::Campaign;
use super::text::rounded;
use super::trial::Measured;
use shsa_core::analysis::{Analysis, Options, analyze};
use shsa_core::computation::Computation;
use shsa_core::knowledge::{Id, KnowledgeBase, Signal, SignalId};
use shsa_core::time::Span;
use std::collections::BTreeMap;
use std::fmt::Write;

/// What is said about runs of one kind that are not as wished; the order is that of the report.
const REASONS: [&str; 5] = [
    "another signal called failed or silent",
    "a relation, or what signals share, called failed",
    "not detected, although a comparison of the model shows it",
    "not detected, and no comparison of the model shows it",
    "detected but not isolated, although analyze says that it is isolable",
];

/// A run that had an effect.
type Run<'a> = (&'a Trial, &'a Cell, &'a Measured);

struct Section<'a> {
    campaign: &'a Campaign<'a>,
    analysis: Analysis,
    /// For each signal the period of the slowest witness that it is compared with.
    periods: Vec<Span>,
}

/// The section of one model and its recordings.
pub(super) fn section(
    campaign: &Campaign<'_>,
    arguments: &Arguments,
    detectable: Option<&Detectable>,
) -> String {
    let analysis = analyze(campaign.knowledge(), Options { addition_steps: 0, ..Options::default() });
    let periods = periods(campaign, &analysis);
    let section = Section { campaign, analysis, periods };
    let title = arguments.model.file_stem().unwrap_or_default().to_string_lossy();
    let ground = campaign.ground;
    let mut text = format!(
        "## {title}\n\n    {}\n\nFaults of {:.1} s, beginning at {} s of {:.1} s. Without a fault: {} alarms in all.\n\n",
        command(arguments),
        campaign.grid.duration.seconds(),
        campaign.grid.onsets.iter().map(|at| format!("{:.1}", at.seconds())).collect::<Vec<_>>().join(", "),
        campaign.length().seconds(),
        ground.alarms.len(),
    );
    if let Some(detectable) = detectable {
        let late = ground.alarms.iter().filter(|(time, ..)| *time >= ground.first + detectable.from).count();
        let _ = write!(
            text,
            "The model is the calibrated one. Of those alarms {late} are in the half that it has not seen.\n\n{}",
            section.amounts(&detectable.smallest)
        );
    }
    text.push_str(&section.table());
    for reason in &campaign.grid.left_out {
        let _ = writeln!(text, "* left out: {reason}");
    }
    text.push_str(&section.missed());
    text
}

fn command(arguments: &Arguments) -> String {
    let mut text = format!("shsa campaign {}", arguments.model.display());
    for recording in &arguments.recordings {
        let _ = write!(text, " {}", recording.display());
    }
    match arguments.detectable {
        Some(by) => text += &format!(" --detectable={by}"),
        None => {
            let amounts: Vec<String> = arguments.amounts.iter().map(f64::to_string).collect();
            text += &format!(" --amounts={}", amounts.join(","));
        }
    }
    if !arguments.kinds.is_empty() {
        let kinds: Vec<&str> = arguments.kinds.iter().map(|kind| kind.name()).collect();
        text += &format!(" --kinds {}", kinds.join(","));
    }
    if !arguments.signals.is_empty() {
        text += &format!(" --signals {}", arguments.signals.join(","));
    }
    if let Some(duration) = arguments.duration {
        text += &format!(" --duration {}s", duration.seconds());
    }
    text + &format!(" --onsets {} --seeds {} --markdown FILE", arguments.onsets, arguments.seeds)
}

/// By signal, the period of the slowest witness in its comparisons: the mean time between values of the slowest signal, or the
/// window over which a rate is taken, as such a comparison knows something new once a window.
fn periods(campaign: &Campaign<'_>, analysis: &Analysis) -> Vec<Span> {
    let count = campaign.knowledge().signals().len();
    let mut seen = vec![0_i64; count];
    for sample in campaign.ground.samples {
        seen.get_mut(sample.wanted).into_iter().for_each(|seen| *seen += 1);
    }
    let length = campaign.length().0;
    let own = |signal: SignalId| match seen.get(signal.index()) {
        Some(&seen) if seen > 1 => Span(length / (seen - 1)),
        _ => Span::ZERO,
    };
    let mut periods: Vec<Span> = (0..count).map(|index| own(SignalId::from_index(index))).collect();
    for &pair in analysis.comparisons.pairs() {
        let together = analysis.comparisons.signals(pair);
        let windows =
            [pair.one, pair.other].into_iter().map(|way| window(campaign.knowledge(), analysis, way));
        let slowest = together.iter().map(own).chain(windows).max().unwrap_or(Span::ZERO);
        for signal in together.iter() {
            periods.get_mut(signal.index()).into_iter().for_each(|it| *it = slowest.max(*it));
        }
    }
    periods
}

/// The longest window of a way that is compared.
fn window(knowledge: &KnowledgeBase, analysis: &Analysis, way: usize) -> Span {
    let way = analysis.comparisons.ways().get(way).cloned();
    let computation = way.and_then(|way| Computation::new(knowledge, way, Computation::slowest_input));
    computation.map_or(Span::ZERO, |computation| computation.timing().window)
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

    /// What is seen of each signal, beside what its model tolerates.
    fn amounts(&self, smallest: &Smallest) -> String {
        let kinds = smallest.kinds();
        let onsets: Vec<String> = smallest.onsets.iter().map(|at| format!("{:.1}", at.seconds())).collect();
        let mut text = format!(
            "Smallest faults seen in the half that it was fitted to, beginning at {} s:\n\n| signal | tolerated |",
            onsets.join(", ")
        );
        kinds.iter().for_each(|kind| text += &format!(" {} |", kind.name()));
        text += &format!("\n|---|---|{}\n", "---|".repeat(kinds.len()));
        for &id in &self.campaign.grid.signals {
            let signal = &self.campaign.knowledge().signals()[id];
            let _ = write!(text, "| `{}` | {} |", signal.name, tolerated(signal));
            kinds.iter().for_each(|&kind| text += &format!(" {} |", smallest.told(signal, id, kind)));
            text.push('\n');
        }
        text + "\n"
    }

    fn table(&self) -> String {
        let mut text = "| fault | runs | too small | accused before | detected | isolated, of the isolable | wrong blame | shared blame | latency, median | worst | early alarms |\n\
                        |---|---|---|---|---|---|---|---|---|---|---|\n"
            .to_owned();
        let all = |_: &Cell| true;
        for what in &self.campaign.grid.whats {
            self.row(&mut text, &what.label(), |cell| cell.what == *what);
        }
        self.row(&mut text, "all", all);
        text + "\nA latency is in periods of the slowest witness: of the slowest signal that the faulty one is compared with, or windows of the rate that it is compared by where these are longer.\n\n"
    }

    fn row(&self, text: &mut String, label: &str, is_wanted: impl Fn(&Cell) -> bool) {
        let (below, runs): (Vec<Run<'_>>, Vec<Run<'_>>) =
            self.runs().filter(|(_, cell, _)| is_wanted(cell)).partition(is_passed_over);
        let too_small = below.iter().filter(|(trial, ..)| trial.is_below).count();
        let count = |is_it: &dyn Fn(&Run<'_>) -> bool| runs.iter().filter(|run| is_it(run)).count();
        let isolable = count(&|run| self.is_isolable(run.1.signal));
        let mut latencies: Vec<f64> = runs.iter().filter_map(|run| self.latency(run)).collect();
        latencies.sort_unstable_by(f64::total_cmp);
        let told = |latency: Option<&f64>| latency.map_or("-".to_owned(), |it| format!("{it:.1}"));
        let median = latencies.len().checked_sub(1).and_then(|last| latencies.get(last / 2));
        let _ = writeln!(
            text,
            "| {label} | {} | {} | {} | {} | {} of {isolable} | {} | {} | {} | {} | {} |",
            runs.len(),
            too_small,
            below.len() - too_small,
            count(&|run| run.2.latency.is_some()),
            count(&|run| self.is_isolable(run.1.signal) && run.2.is_isolated()),
            count(&|run| run.2.blamed_other) + below.iter().filter(|run| run.2.blamed_other).count(),
            count(&|run| run.2.blamed_shared) + below.iter().filter(|run| run.2.blamed_shared).count(),
            told(median),
            told(latencies.last()),
            runs.iter().map(|run| run.2.early).sum::<usize>(),
        );
    }

    fn latency(&self, (_, cell, measured): &Run<'_>) -> Option<f64> {
        let period = self.periods.get(cell.signal.index()).filter(|period| **period > Span::ZERO)?;
        Some(measured.latency?.seconds() / period.seconds())
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

    /// Runs that are not as wished, by reason and kind, each with its first fault as `--inject` takes it.
    fn missed(&self) -> String {
        let mut groups: BTreeMap<(usize, Kind), Vec<Run<'_>>> = BTreeMap::new();
        for run in self.runs() {
            for reason in self.reasons(&run) {
                groups.entry((reason, run.1.what.kind)).or_default().push(run);
            }
        }
        let mut text = String::new();
        let mut told = None;
        for ((reason, kind), runs) in &groups {
            if told.replace(*reason) != Some(*reason) {
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

/// Whether nothing is expected of a run: the fault is smaller than what is seen, or its signal stood accused before.
fn is_passed_over((trial, _, measured): &Run<'_>) -> bool {
    trial.is_below || (trial.is_measured && measured.accused)
}

/// The errors of value and time that a model grants a signal, and how late it may be.
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

/// The fault of a run as `shsa replay --inject` takes it.
fn inject((trial, cell, _): &Run<'_>) -> String {
    let fault = &trial.fault;
    let unit = if cell.what.kind == Kind::Delay { "s" } else { "" };
    let amount = cell.size.map_or(String::new(), |size| format!("={size}{unit}"));
    let to = fault.to.map_or(String::new(), |to| format!("{}s", to.seconds()));
    format!("{}{amount}:{}@{}s..{to}", cell.what.kind.name(), fault.signal, fault.from.seconds())
}
