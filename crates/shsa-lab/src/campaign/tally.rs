//! Counts over the runs of a cell, of a row of cells, or of all.

use super::baseline::{Baseline, Measured};
use super::grid::{Cell, Grid, Reason, Trial};
use serde_json::{Map, Value, json};
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalId};
use shsa_core::time::Span;

/// The definitions of the figures.
pub const LEGEND: [(&str, &str); 14] = [
    (
        "amount",
        "2× is twice the error that the model declares for a value of median size of the signal; a drift reaches it \
         at the fault's end, a scale gives it to that value, a spoof sends the last value before the fault with it \
         on top; for a delay twice its error of time and the mean time between its values; of a signal that declares no \
         error, as its tolerance stands at a relation, it is the smallest bias that is seen in the recording; with \
         --detectable it is twice the smallest fault of that kind that is seen in the first half, and a drift reaches at least three \
         smallest biases",
    ),
    ("runs", "one for each onset, and for each seed where the fault is random; a run ends with its fault"),
    (
        "without effect",
        "runs that are left out of all shares, and told above them: faults that changed no value, such as stuck where the \
         value did not move; with --detectable also values that stick while they would have moved by less than what is \
         seen (too_small in the JSON); of these only wrong and shared blame count",
    ),
    (
        "accused before",
        "runs whose signal was already suspected, failed or silent when its fault began; they count like all others, so one \
         in which nothing further is told is not detected",
    ),
    (
        "not tried",
        "faults of which no amount is seen at each moment of the first half (with --detectable), or whose signal is silent \
         at that time; they are no runs, and told above the shares",
    ),
    (
        "detected",
        "an alarm was given during the fault, about whichever signal: suspected, failed or silent; an alarm that the \
         recording without a fault gives at the same moment does not count",
    ),
    ("isolated", "the faulty signal was named during the fault, failed or silent, and nothing else was"),
    ("wrong blame", "another signal was named"),
    ("shared blame", "a relation, or what signals share, was called failed; in the JSON and in Markdown"),
    ("not told", "runs that are not detected; a small fault may be within what the model tolerates"),
    (
        "false alarms",
        "alarms before the fault, in all runs together; the recording is the same, so each one counts in every run \
         that begins after it",
    ),
    ("latency", "from the fault's beginning to the first alarm of it, median and worst of the detected runs"),
    (
        "unmet",
        "runs in which a need got no value for longer than its max_age allows, and for longer than without the fault",
    ),
    (
        "error",
        "how far the interval published for a need was from the one that the recording without a fault gives at that \
         moment, at most; 0 when they overlap",
    ),
];

/// A finished campaign.
pub struct Campaign<'a> {
    /// The baselines by session; there is at least one.
    pub baselines: &'a [Baseline<'a>],
    /// The model.
    pub knowledge: &'a KnowledgeBase,
    /// The grid.
    pub grid: &'a Grid,
    /// The number of seeds for a random fault.
    pub seeds: u64,
    /// The results in the order of the grid's trials; `None` for a fault without effect.
    pub results: Vec<Option<Measured>>,
}

/// The settings that must be equal for a comparison.
pub fn settings(baselines: &[Baseline<'_>], grid: &Grid, seeds: u64) -> Value {
    let onsets: Vec<f64> = grid.onsets.iter().map(|onset| onset.at.seconds()).collect();
    let mut settings = json!({
        "recording_s": length(baselines).seconds(),
        "onsets_s": onsets,
        "fault_s": grid.duration.seconds(),
        "seeds": seeds,
    });
    if let (Some(settings), [_, _, ..]) = (settings.as_object_mut(), baselines) {
        let sessions: Vec<usize> = grid.onsets.iter().map(|onset| onset.session + 1).collect();
        settings.insert("onsets_session".to_owned(), json!(sessions));
    }
    settings
}

fn length(baselines: &[Baseline<'_>]) -> Span {
    Span(baselines.iter().map(|baseline| (baseline.last - baseline.first).0).sum())
}

/// Counts over runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Runs with a fault that should be detected.
    pub runs: usize,
    /// Runs whose fault changed no value, or is smaller than the smallest detectable one.
    pub without_effect: usize,
    /// Those of stuck values whose signal would have changed less than the smallest detectable fault.
    pub too_small: usize,
    /// Those among the latter that were detected nevertheless.
    pub too_small_detected: usize,
    /// Counted runs whose signal was accused before.
    pub accused: usize,
    /// Those among them that were detected.
    pub accused_detected: usize,
    /// Runs in which an alarm followed the fault.
    pub detected: usize,
    /// Runs in which the faulty signal was named, and nothing else.
    pub isolated: usize,
    /// Runs in which another signal was named.
    pub wrong_blame: usize,
    /// Runs in which a relation or a common cause failed.
    pub shared_blame: usize,
    /// Alarms before the faults.
    pub false_alarms: usize,
    /// Runs in which any need was unmet.
    pub unmet: usize,
    /// The latencies of detected runs, ascending.
    pub latencies: Vec<Span>,
    /// For each need, the number of runs in which it was unmet, and the largest error, SI.
    pub needs: Vec<(usize, f64)>,
}

impl Tally {
    fn of<'m>(results: impl Iterator<Item = (&'m Trial, &'m Option<Measured>)>, needs: usize) -> Tally {
        let mut tally = Tally { needs: vec![(0, 0.0); needs], ..Tally::default() };
        for (trial, result) in results {
            match result {
                None => tally.without_effect += 1,
                Some(measured) if trial.is_below => tally.pass_over(measured),
                Some(measured) => tally.add(measured),
            }
        }
        tally.latencies.sort_unstable();
        tally
    }

    /// Counts a fault below the smallest detectable one: it need not be detected, but nobody else may be blamed.
    fn pass_over(&mut self, measured: &Measured) {
        self.without_effect += 1;
        self.too_small += 1;
        self.too_small_detected += usize::from(measured.latency.is_some());
        self.wrong_blame += usize::from(measured.blamed_other);
        self.shared_blame += usize::from(measured.blamed_shared);
    }

    fn add(&mut self, measured: &Measured) {
        self.runs += 1;
        self.detected += usize::from(measured.latency.is_some());
        self.accused += usize::from(measured.accused);
        self.accused_detected += usize::from(measured.accused && measured.latency.is_some());
        self.isolated += usize::from(measured.is_isolated());
        self.wrong_blame += usize::from(measured.blamed_other);
        self.shared_blame += usize::from(measured.blamed_shared);
        self.false_alarms += measured.early;
        self.unmet += usize::from(measured.needs.iter().any(|served| served.unmet));
        self.latencies.extend(measured.latency);
        for ((unmet, error), served) in self.needs.iter_mut().zip(&measured.needs) {
            *unmet += usize::from(served.unmet);
            *error = error.max(served.error);
        }
    }

    /// A count as a share of the runs; `None` without runs.
    pub fn share(&self, count: usize) -> Option<f64> {
        (self.runs > 0).then(|| count as f64 / self.runs as f64)
    }

    /// The median latency; the lower one of the middle two.
    pub fn median(&self) -> Option<Span> {
        self.latencies.get(self.latencies.len().checked_sub(1)? / 2).copied()
    }

    /// The longest latency.
    pub fn worst(&self) -> Option<Span> {
        self.latencies.last().copied()
    }
}

impl Campaign<'_> {
    /// The model.
    pub fn knowledge(&self) -> &KnowledgeBase {
        self.knowledge
    }

    /// The number of recorded observations.
    pub fn observations(&self) -> usize {
        self.baselines.iter().map(|baseline| baseline.samples.len()).sum()
    }

    /// The number of alarms without a fault.
    pub fn clean_alarms(&self) -> usize {
        self.baselines.iter().map(|baseline| baseline.alarms.len()).sum()
    }

    /// The number of runs that were not tried for a reason, over the wanted signals.
    pub fn untried(&self, reason: Reason, is_wanted: impl Fn(SignalId) -> bool) -> usize {
        let of_reason = self.grid.untried.iter().filter(|it| it.reason == reason && is_wanted(it.signal));
        of_reason.map(|it| it.runs).sum()
    }

    /// The counts over all runs of the wanted cells.
    pub fn tally(&self, is_wanted: impl Fn(&Cell) -> bool) -> Tally {
        let trials = self.grid.trials.iter().zip(&self.results);
        let of_cells = trials.filter(|(trial, _)| self.grid.cells.get(trial.cell).is_some_and(&is_wanted));
        Tally::of(of_cells, self.knowledge().needs().len())
    }

    /// The counts of each cell, in the order of the cells.
    pub fn by_cell(&self) -> Vec<Tally> {
        let mut results = vec![Vec::new(); self.grid.cells.len()];
        for (trial, result) in self.grid.trials.iter().zip(&self.results) {
            let of_cell = results.get_mut(trial.cell).into_iter();
            of_cell.for_each(|of_cell: &mut Vec<_>| of_cell.push((trial, result)));
        }
        let needs = self.knowledge().needs().len();
        results.into_iter().map(|of_cell| Tally::of(of_cell.into_iter(), needs)).collect()
    }

    /// The length of the recording.
    pub fn length(&self) -> Span {
        length(self.baselines)
    }

    /// A need's error in the unit of its variable, and this unit.
    pub fn error(&self, need: NeedId, si: f64) -> (f64, String) {
        let knowledge = self.knowledge();
        let unit = &knowledge.variables()[knowledge.needs()[need].variable].unit;
        let (scale, name) =
            unit.as_ref().map_or((1.0, String::new()), |unit| (unit.scale, format!(" {unit}")));
        (si / scale, name)
    }

    /// The campaign as JSON, with the definitions of its figures.
    pub fn to_json(&self) -> Value {
        let cells: Vec<Value> = self
            .grid
            .cells
            .iter()
            .zip(self.by_cell())
            .map(|(cell, tally)| self.cell_json(cell, &tally))
            .collect();
        let legend: Map<String, Value> =
            LEGEND.iter().map(|(word, meaning)| ((*word).to_owned(), json!(meaning))).collect();
        json!({
            "settings": settings(self.baselines, self.grid, self.seeds),
            "observations": self.observations(),
            "clean_alarms": self.clean_alarms(),
            "left_out": self.grid.left_out,
            "not_counted": self.not_counted_json(),
            "all": self.tally_json(&self.tally(|_| true)),
            "cells": cells,
            "legend": legend,
        })
    }

    /// The runs that no share counts, and those whose signal was accused before, in total and by signal.
    fn not_counted_json(&self) -> Value {
        let figures = |tally: &Tally, is_wanted: &dyn Fn(SignalId) -> bool| {
            json!({
                "no_value_changed": tally.without_effect - tally.too_small,
                "too_small": tally.too_small,
                "too_small_detected": tally.too_small_detected,
                "no_amount_seen": self.untried(Reason::Unseen, is_wanted),
                "signal_silent": self.untried(Reason::Absent, is_wanted),
                "no_amount": self.untried(Reason::NoAmount, is_wanted),
                "accused_before": tally.accused,
                "accused_before_detected": tally.accused_detected,
            })
        };
        let of_signal = |&id: &SignalId| {
            let tally = self.tally(|cell| cell.signal == id);
            (self.knowledge.signals()[id].name.clone(), figures(&tally, &|it| it == id))
        };
        let signals: Map<String, Value> = self.grid.signals.iter().map(of_signal).collect();
        json!({ "all": figures(&self.tally(|_| true), &|_| true), "signals": signals })
    }

    fn cell_json(&self, cell: &Cell, tally: &Tally) -> Value {
        let mut object = json!({
            "kind": cell.what.kind.name(),
            "multiple": cell.what.multiple,
            "signal": self.knowledge().signals()[cell.signal].name,
            "amount": cell.size,
        });
        let figures = self.tally_json(tally);
        if let (Some(object), Value::Object(figures)) = (object.as_object_mut(), figures) {
            object.extend(figures);
        }
        object
    }

    fn tally_json(&self, tally: &Tally) -> Value {
        let needs = self.knowledge().needs().enumerate().zip(&tally.needs);
        let needs: Map<String, Value> = needs
            .map(|((id, need), (unmet, error))| {
                (need.signal.clone(), json!({ "unmet": unmet, "max_error": self.error(id, *error).0 }))
            })
            .collect();
        json!({
            "runs": tally.runs,
            "without_effect": tally.without_effect,
            "too_small": tally.too_small,
            "too_small_detected": tally.too_small_detected,
            "accused": tally.accused,
            "accused_detected": tally.accused_detected,
            "detected": tally.detected,
            "detection_rate": tally.share(tally.detected),
            "isolated": tally.isolated,
            "isolation_rate": tally.share(tally.isolated),
            "wrong_blame": tally.wrong_blame,
            "shared_blame": tally.shared_blame,
            "not_told": tally.runs - tally.detected,
            "false_alarms": tally.false_alarms,
            "latency_median_s": tally.median().map(Span::seconds),
            "latency_worst_s": tally.worst().map(Span::seconds),
            "unmet": tally.unmet,
            "needs": needs,
        })
    }
}
