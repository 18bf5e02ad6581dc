//! How many signals may lie together before a need's value can be wrong and nobody can tell.
//!
//! Signals that lie together can say what all of them would say in another state of the system. Where their lie changes a variable, they and
//! the honest ones that contradict them meet every way to know it. So of a variable whose ways the loss of `d` signals takes away, and of no
//! fewer, any `s` liars with `2 s < d` face more honest signals than they are; half of a smallest such set and more face as many or fewer,
//! and the explanation with the fewest faults blames the others. For linear systems this is 2s-sparse observability (Y. Shoukry and
//! P. Tabuada 2016, doi:10.1109/TAC.2015.2492159), of the ways that this crate can compute: equations that must be solved together are none.

use super::Options;
use super::basis::Basis;
use super::budget::Budget;
use super::losses::{Losses, Target, Tolerance};
use crate::knowledge::{CauseId, Id, IdVec, KnowledgeBase, NeedId, RelationId, SignalId};
use crate::plan::Graph;
use alloc::vec::Vec;

/// Who lies: a signal, or all signals of a common cause (a device, a bus, a supplier).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Liar {
    /// A signal.
    Signal(SignalId),
    /// All signals that share a common cause.
    Cause(CauseId),
}

/// The lies that a need withstands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Withstands {
    /// Any this many liars leave the honest ones in the majority; `None` where the need rests on no signal, and 0 where nothing serves it.
    pub liars: Option<usize>,
    /// Whether one more liar is too many; otherwise a limit was reached, and it may withstand more.
    pub exact: bool,
    /// As few liars as were found that the honest ones do not outnumber; empty where none were.
    pub coalition: Vec<Liar>,
    /// Whether as many honest ones contradict that coalition: then it is unknown who lies, else the honest ones are blamed.
    pub is_tie: bool,
    /// How many independent signals more raise the number by one.
    pub missing: usize,
}

/// The lies that each need withstands where each signal may lie, or with `by_cause` each common cause and each signal without one.
///
/// Complexity: a few dozen searches for each need, at most [`Options::steps`] for all.
#[must_use]
pub fn liars(knowledge: &KnowledgeBase, by_cause: bool, options: Options) -> IdVec<NeedId, Withstands> {
    let graph = Graph::new(knowledge);
    let basis = Basis::new(knowledge, options, RelationId::from_index(knowledge.relations().len()));
    let mut losses = match by_cause {
        true => Losses::of_causes(knowledge, &graph, &basis),
        false => Losses::new(knowledge, &graph, &basis),
    };
    let mut budget = Budget::new(options.steps);
    IdVec::filled(knowledge.needs().len(), |need| {
        let tolerance = losses.tolerance(&Target::of_need(knowledge, need), &mut budget);
        withstands(knowledge, &tolerance)
    })
}

fn withstands(knowledge: &KnowledgeBase, tolerance: &Tolerance) -> Withstands {
    let Some(survived) = tolerance.survives else {
        return Withstands { liars: None, exact: true, coalition: Vec::new(), is_tie: false, missing: 0 };
    };
    let taken = if tolerance.known { survived + 1 } else { 0 };
    let liars = taken.saturating_sub(1) / 2;
    let coalition = tolerance.cut.iter().take(tolerance.cut.len().div_ceil(2));
    Withstands {
        liars: Some(liars),
        exact: tolerance.exact,
        coalition: coalition.map(|number| liar(knowledge, number)).collect(),
        is_tie: tolerance.cut.len().is_multiple_of(2),
        missing: 2 * liars + 3 - taken,
    }
}

fn liar(knowledge: &KnowledgeBase, number: SignalId) -> Liar {
    match number.index().checked_sub(knowledge.signals().len()) {
        None => Liar::Signal(number),
        Some(cause) => Liar::Cause(CauseId::from_index(cause)),
    }
}
