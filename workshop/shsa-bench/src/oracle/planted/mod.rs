//! Systems with planted relations: what `shsa_lab::learning` has to find in a recording, and what it must not.
//!
//! A relation that is proposed is true when it still holds on two other days of the same plant, on which what only went along
//! goes its own ways. One answer for each planted relation that can be learned, and one for each that is proposed and is not
//! true, or has signals that do not belong.

mod formula;
mod world;
mod record;

use super::Compared;
use serde::Deserialize;
use shsa_lab::learning::{Relation, Signal, formula, learn, share_elsewhere};
use std::collections::BTreeSet;
use world::Variable;

/// A relation is true when it leaves no more than this share of its target on the worse of two other days.
const TRUE: f64 = 0.2;

/// A file of `shsa-planted-1`.
#[derive(Deserialize)]
pub(super) struct Recorded {
    systems: Vec<System>,
}

#[derive(Deserialize)]
struct System {
    id: String,
    seed: u64,
    duration_s: f64,
    variables: Vec<Variable>,
    files: Vec<record::File>,
    signals: Vec<record::SignalRecord>,
    #[serde(default)]
    hidden: Vec<String>,
    relations: Vec<Planted>,
}

#[derive(Deserialize)]
struct Planted {
    id: String,
    kind: String,
    variables: BTreeSet<String>,
    formula: String,
}

impl System {
    /// The variables that a relation is about, and whether one of its signals is computed from another.
    fn variables_of(&self, signals: &[Signal], relation: &Relation) -> (BTreeSet<String>, bool) {
        let record_of = |signal: usize| self.signals.iter().find(|it| it.name == signals[signal].name);
        let records: Vec<&record::SignalRecord> =
            relation.signals().into_iter().filter_map(record_of).collect();
        (
            records.iter().map(|it| it.variable.clone()).collect(),
            records.iter().any(|it| it.copy_of.is_some()),
        )
    }

    fn can_be_learned(&self, planted: &Planted) -> bool {
        planted.variables.iter().all(|variable| !self.hidden.contains(variable))
    }
}

/// Learns from the first day of each system, and judges on two others.
///
/// # Errors
/// When a system uses what it does not have.
pub(super) fn compare(recorded: &Recorded, compared: &mut Compared) -> anyhow::Result<()> {
    for system in &recorded.systems {
        let signals = record::signals(system, 0)?;
        let days = [record::signals(system, 1)?, record::signals(system, 2)?];
        let mut found: Vec<BTreeSet<String>> = Vec::new();
        for relation in learn(&signals, &())?.relations {
            let text = formula(&signals, &relation, &|signal| signals[signal].name.clone());
            let left = days.iter().map(|day| share_elsewhere(day, &relation).unwrap_or(f64::INFINITY));
            let left = left.fold(0.0, f64::max);
            let (variables, uses_copy) = system.variables_of(&signals, &relation);
            let wrong = if left > TRUE {
                Some(format!("false, leaves {left:.2} on other days"))
            } else if uses_copy {
                Some("a copy is a witness".to_owned())
            } else {
                is_bloated(system, &variables).then(|| "bloated".to_owned())
            };
            match wrong {
                Some(wrong) => compared.answer(vec![format!("{}: {text}: {wrong}", system.id)]),
                None => found.push(variables),
            }
        }
        for planted in system.relations.iter().filter(|it| system.can_be_learned(it)) {
            let Planted { id, kind, formula, .. } = planted;
            let is_found = found.contains(&planted.variables);
            let missed = (!is_found).then(|| format!("{} {id}: {kind} not found: {formula}", system.id));
            compared.answer(missed.into_iter().collect());
        }
    }
    Ok(())
}

/// Whether a relation has all variables of a planted one, and more.
fn is_bloated(system: &System, variables: &BTreeSet<String>) -> bool {
    let is_within = |planted: &Planted| {
        planted.variables.len() > 1
            && planted.variables.len() < variables.len()
            && planted.variables.is_subset(variables)
    };
    system.relations.iter().any(is_within)
}
