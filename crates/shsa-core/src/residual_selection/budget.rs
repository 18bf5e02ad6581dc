//! Limits the watched ways, and selects those to give up where the limit is too small for all.

use super::candidates::MOST_SEARCHED;
use super::cost::{Cost, added_cost};
use super::fault_signature::FaultSignature;
use super::greedy::{Choice, chosen};
use super::witnesses::Witnesses;
use crate::knowledge::KnowledgeBase;
use crate::substitution::Way;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// The limits of the watched ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WatchBudget {
    /// Computed ways of each variable; its signals are always watched. A single way is compared with nothing.
    pub ways: usize,
    /// Operations a second of all variables together, by the declared rates: those of the formulas, and ten for each comparison.
    /// A signal without a rate counts as 100 Hz, a vector as 256 numbers.
    pub cost: u64,
}

impl Default for WatchBudget {
    /// 32 ways a variable; 10 million operations a second, about what one core does.
    fn default() -> WatchBudget {
        WatchBudget { ways: 32, cost: 10_000_000 }
    }
}

/// One or two ways that are kept or given up together.
struct Unit {
    variable: usize,
    places: Vec<usize>,
    /// The number of earlier units of the same variable.
    number: usize,
    gain: usize,
    round: usize,
    cost: f64,
}

/// Gives up ways until the rest costs at most `cost` operations a second.
///
/// Every variable first gets two ways, then one more in each turn, in the order in which they isolate most faults. In each turn
/// the best gain for its cost goes first, and a variable whose next way costs too much gets no more. Complexity: O(n log n) in
/// all ways; when they cost too much, also that of choosing among the ways of each variable.
pub fn afford<'w>(knowledge: &KnowledgeBase, all: impl Iterator<Item = &'w mut Witnesses>, cost: u64) {
    let mut all: Vec<&mut Witnesses> = all.filter(|witnesses| witnesses.ways.len() > 1).collect();
    let sum: f64 = all.iter().map(|witnesses| witnesses.cost(knowledge)).sum();
    if sum <= cost as f64 {
        return;
    }
    let units = all.iter().enumerate().flat_map(|(at, witnesses)| units(knowledge, at, &witnesses.ways));
    let mut units: Vec<Unit> = units.collect();
    let worth = |unit: &Unit| unit.gain as f64 / unit.cost.max(f64::MIN_POSITIVE);
    units.sort_by(|one, other| {
        let turn = |unit: &Unit| (unit.round, unit.number);
        turn(one).cmp(&turn(other)).then(worth(other).total_cmp(&worth(one)))
    });
    let mut kept: Vec<BTreeSet<usize>> = all.iter().map(|_| BTreeSet::new()).collect();
    let mut is_open: Vec<bool> = all.iter().map(|_| true).collect();
    let mut left = cost as f64;
    for unit in units {
        let (Some(kept), Some(is_open)) = (kept.get_mut(unit.variable), is_open.get_mut(unit.variable))
        else {
            continue;
        };
        *is_open &= unit.cost <= left;
        if *is_open {
            left -= unit.cost;
            kept.extend(unit.places);
        }
    }
    all.iter_mut().zip(&kept).for_each(|(witnesses, kept)| witnesses.keep(kept));
}

/// The ways of a variable in the order in which they isolate most faults; the first two together.
fn units(knowledge: &KnowledgeBase, variable: usize, ways: &[Way]) -> Vec<Unit> {
    let choices = match ways.len() <= MOST_SEARCHED {
        true => chosen(&FaultSignature::of_all(knowledge, ways), ways.len()),
        // Too many ways to compute their gains: they stay in their order.
        false => (0..ways.len()).map(|at| Choice { at, gain: 1, round: 0 }).collect(),
    };
    let costs: Vec<Cost> = ways.iter().map(|way| Cost::of(knowledge, way)).collect();
    let places: Vec<usize> = choices.iter().map(|choice| choice.at).collect();
    let mut units: Vec<Unit> = Vec::new();
    for (number, &Choice { at, gain, round }) in choices.iter().enumerate() {
        let cost = added_cost(&costs, places.iter().copied().take(number + 1));
        match units.last_mut() {
            Some(first) if number == 1 => {
                first.places.push(at);
                first.gain += gain;
                first.cost += cost;
            }
            _ => units.push(Unit { variable, places: Vec::from([at]), number, gain, round, cost }),
        }
    }
    units
}
