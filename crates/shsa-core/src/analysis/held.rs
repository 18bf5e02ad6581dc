//! Inputs of substitutes that stand between their values without a bound on their change.

use crate::knowledge::{KnowledgeBase, SignalId, VariableId};
use crate::substitution::Way;
use crate::time::Span;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// The inputs that substitutes of a needed variable take at the slower rate, and whose variables have no `max_rate`.
///
/// Between two values of such an input, the bounds of the substitute may miss the truth by what the change of the input's variable
/// makes in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Held {
    /// The variable of a need.
    pub variable: VariableId,
    /// The signals that its substitutes hold, in file order.
    pub signals: Vec<SignalId>,
}

/// The variables in file order. Complexity: O(inputs of all ways).
pub(super) fn held(knowledge: &KnowledgeBase, ways: &[Way]) -> Vec<Held> {
    let needed = |variable: VariableId| knowledge.needs().iter().any(|need| need.variable == variable);
    let mut all: BTreeMap<VariableId, Vec<SignalId>> = BTreeMap::new();
    for way in ways.iter().filter(|way| needed(way.substitution.sink)) {
        all.entry(way.substitution.sink).or_default().extend(held_in(knowledge, way));
    }
    let named = |(variable, mut signals): (VariableId, Vec<SignalId>)| {
        signals.sort_unstable();
        signals.dedup();
        Held { variable, signals }
    };
    all.into_iter().map(named).filter(|held| !held.signals.is_empty()).collect()
}

/// The inputs of a way that are slower than another one, and stand unbounded meanwhile. A signal with `hold` stands by declaration.
fn held_in<'a>(knowledge: &'a KnowledgeBase, way: &'a Way) -> impl Iterator<Item = SignalId> + 'a {
    let period = |input: SignalId| knowledge.signals()[input].period();
    let fastest: Option<Span> = way.inputs().filter_map(period).min();
    way.inputs().filter(move |&input| {
        let signal = &knowledge.signals()[input];
        let is_unbounded = knowledge.variables()[signal.variable].max_rate.is_none() && !signal.holds;
        is_unbounded && period(input).is_some_and(|own| fastest.is_some_and(|fastest| own > fastest))
    })
}
