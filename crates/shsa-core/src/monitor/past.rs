//! How much of the past the monitor keeps: the lengths of its histories.

use crate::alignment::{History, Port};
use crate::computation::Computation;
use crate::knowledge::{Access, IdVec, KnowledgeBase, SignalId};
use crate::time::Span;

/// Least and largest number of samples in a history.
const CAPACITY: (usize, usize) = (16, 4_096);

/// Samples in a history of a signal whose rate is not declared.
const CAPACITY_WITHOUT_RATE: usize = 256;

/// Three periods of the outputs of a computation: so much later than expected may an observation come.
fn patience(computation: &Computation) -> Span {
    computation.timing().period.unwrap_or(Span::ZERO).times(3)
}

/// The longest time between an event and the last observation of it: how far back histories reach at least.
pub(super) fn lookback(computations: &[Computation]) -> Span {
    let slowest = |it: &Computation| it.timing().complete_after() + patience(it);
    computations.iter().map(slowest).max().unwrap_or(Span::ZERO)
}

/// How far back the history of each signal reaches: as far as the time operators that take it, too. A service that starts fills
/// their windows from it, so that its first value comes at once.
pub(super) fn reach_of_inputs(
    knowledge: &KnowledgeBase,
    computations: &[Computation],
    lookback: Span,
) -> IdVec<SignalId, Span> {
    let mut reach = IdVec::filled(knowledge.signals().len(), |_| lookback);
    for computation in computations {
        let own = computation.looks_back() + computation.timing().lag + patience(computation);
        computation.way().inputs().for_each(|signal| reach[signal] = reach[signal].max(own));
    }
    reach
}

/// The port of a signal whose history reaches so far.
pub(super) fn port(knowledge: &KnowledgeBase, signal: SignalId, reach: Span) -> Port {
    let signal = &knowledge.signals()[signal];
    let variable = &knowledge.variables()[signal.variable];
    let estimated = if signal.access == Access::Port { 0 } else { History::AHEAD };
    Port::new(variable.shape, signal, capacity(signal.rate_hz, reach).max(estimated))
}

/// The number of samples in a history that reaches so far.
pub(super) fn capacity(rate_hz: Option<f64>, lookback: Span) -> usize {
    let (fewest, most) = CAPACITY;
    rate_hz.map_or(CAPACITY_WITHOUT_RATE, |rate| {
        (libm::ceil(rate * 1.5 * lookback.seconds()) as usize).clamp(fewest, most)
    })
}
