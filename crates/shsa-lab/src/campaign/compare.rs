//! Compares a campaign with an earlier one: which cells became better or worse.

use crate::LabError;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Figures that are better when they are higher.
const HIGHER: [&str; 2] = ["detected", "isolated"];
/// Counts that are better when they are lower.
const LOWER: [&str; 3] = ["wrong_blame", "false_alarms", "unmet"];
/// Measures that are better when they are lower; they are reported, but are never a regression.
const MEASURES: [&str; 2] = ["latency_median_s", "latency_worst_s"];

/// A figure of a cell that has changed.
pub struct Change {
    /// The kind of fault and its multiple.
    pub fault: String,
    /// The signal with the fault.
    pub signal: String,
    /// The name of the figure.
    pub figure: String,
    /// The earlier figure.
    pub before: String,
    /// The present figure.
    pub now: String,
    /// Whether the present one is better.
    pub is_better: bool,
    /// Whether it is a count of runs or alarms, not a measure.
    is_count: bool,
}

/// The changes; regressions come first.
pub struct Comparison {
    /// The number of cells with the same fault in both.
    same: usize,
    /// The number of cells that only one campaign has, or whose injected fault differs.
    others: usize,
    /// Each figure of each cell that has changed; regressions come first.
    pub changes: Vec<Change>,
}

impl Comparison {
    /// Compares two campaigns of the same settings, as JSON.
    ///
    /// # Errors
    /// When they have no fault in common.
    pub fn new(before: &Value, now: &Value) -> Result<Comparison, LabError> {
        let (old, new) = (by_fault(before), by_fault(now));
        let shared = || new.iter().filter_map(|(key, now)| Some((*old.get(key)?, *now)));
        let same = shared().count();
        if same == 0 {
            return Err(LabError::Unfit(
                "nothing to compare: no fault of the earlier campaign is in this one".to_string(),
            ));
        }
        let mut changes: Vec<Change> = shared().flat_map(|(before, now)| cell(before, now)).collect();
        changes.sort_by_key(|change| (change.is_better, !change.is_count));
        Ok(Comparison { same, others: old.len() + new.len() - 2 * same, changes })
    }

    /// Whether a count of any cell is worse.
    pub fn is_worse(&self) -> bool {
        self.changes.iter().any(|change| change.is_count && !change.is_better)
    }

    /// Describes the numbers of changes.
    pub fn summary(&self) -> String {
        let count = |is_better, is_count| {
            let of_kind = |change: &&Change| (change.is_better, change.is_count) == (is_better, is_count);
            self.changes.iter().filter(of_kind).count()
        };
        let others = match self.others {
            0 => String::new(),
            others => format!("; {others} cells are in only one of the two"),
        };
        format!(
            "Against the earlier campaign, {} cells{others}: counts better {}, worse {}; latencies and errors better {}, worse {}",
            self.same,
            count(true, true),
            count(false, true),
            count(true, false),
            count(false, false)
        )
    }

    /// The comparison as JSON.
    pub fn to_json(&self) -> Value {
        let change = |change: &Change| {
            json!({
                "fault": change.fault,
                "signal": change.signal,
                "figure": change.figure,
                "before": change.before,
                "now": change.now,
                "better": change.is_better,
            })
        };
        let changes: Vec<Value> = self.changes.iter().map(change).collect();
        json!({ "cells": self.same, "other_cells": self.others, "worse": self.is_worse(), "changes": changes })
    }
}

/// Compares the settings of a stored campaign with those of this one.
///
/// # Errors
/// When a setting differs, because then the figures are of other runs.
pub fn check_settings(before: &Value, settings: &Value) -> Result<(), LabError> {
    for (name, now) in settings.as_object().into_iter().flatten() {
        let before = &before["settings"][name];
        if before != now {
            return Err(LabError::Unfit(format!(
                "not comparable: {name} was {before} in the earlier campaign and is {now} in this one"
            )));
        }
    }
    Ok(())
}

/// Cells by the injected fault: kind, multiple, signal, and the amount, which depends on the model.
fn by_fault(campaign: &Value) -> BTreeMap<String, &Value> {
    let cells = campaign["cells"].as_array().map(Vec::as_slice).unwrap_or_default();
    let key = |cell: &Value| {
        // Numbers that were written and read again may differ in the last digit.
        let amount = cell["amount"].as_f64().map_or(String::new(), |amount| format!("{amount:.9e} "));
        amount + &["kind", "multiple", "signal", "runs"].map(|key| cell[key].to_string()).join(" ")
    };
    cells.iter().map(|cell| (key(cell), cell)).collect()
}

fn cell(before: &Value, now: &Value) -> Vec<Change> {
    let multiple = now["multiple"].as_f64().map_or(String::new(), |by| format!(" {by}×"));
    let fault = format!("{}{multiple}", now["kind"].as_str().unwrap_or_default());
    let signal = now["signal"].as_str().unwrap_or_default();
    let change = |figure: String, before: &Value, now: &Value, higher: bool, is_count: bool| {
        // A fault that was never detected has no latency; the figure `detected` shows this.
        let (old, new) = (before.as_f64()?, now.as_f64()?);
        ((old - new).abs() > 1e-9 * old.abs().max(new.abs())).then(|| Change {
            fault: fault.clone(),
            signal: signal.to_owned(),
            figure,
            before: before.to_string(),
            now: now.to_string(),
            is_better: (new > old) == higher,
            is_count,
        })
    };
    let plain = |names: &[&str], higher, is_count| -> Vec<Change> {
        let one = |name: &&str| change((*name).to_owned(), &before[*name], &now[*name], higher, is_count);
        names.iter().filter_map(one).collect()
    };
    let mut changes = plain(&HIGHER, true, true);
    changes.extend(plain(&LOWER, false, true));
    changes.extend(plain(&MEASURES, false, false));
    let nothing = Map::new();
    for (need, served) in now["needs"].as_object().unwrap_or(&nothing) {
        let figure = format!("max_error of {need}");
        changes.extend(change(
            figure,
            &before["needs"][need]["max_error"],
            &served["max_error"],
            false,
            false,
        ));
    }
    changes
}
