//! The steps of the published method: observations are buffered over a few periods and combined in every way.

use super::score::{ThesisMonitor, ThesisOptions, ThesisOutput, ThesisStep};
use crate::circle;
use crate::computation::{Computation, Item};
use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, SignalId};
use crate::observation::{Observation, RawValue};
use crate::substitution::Way;
use crate::time::{Time, Validity};
use alloc::vec::Vec;

/// The largest number of combinations of one substitution in a step; the step reports where there were more.
const MOST_COMBINATIONS: usize = 10_000;

/// An observation in the buffer.
#[derive(Clone, Debug)]
struct Buffered {
    step: usize,
    item: Item,
}

/// Runs the published monitor over ways of knowing one variable.
#[derive(Debug)]
pub struct ThesisRun {
    options: ThesisOptions,
    computations: Vec<Computation>,
    buffers: IdVec<SignalId, Vec<Buffered>>,
    /// The last value of each signal whose variable wraps: the next value is unwrapped from it.
    unwrapped: IdVec<SignalId, Option<Interval>>,
    monitor: ThesisMonitor,
    steps: usize,
}

impl ThesisRun {
    /// The monitor of these ways, numbered in their order; ways of structure only are left out.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, ways: Vec<Way>, options: ThesisOptions) -> ThesisRun {
        let computations: Vec<Computation> = ways
            .into_iter()
            .filter(|way| !way.substitution.continues_itself(knowledge))
            .filter_map(|way| Computation::new(knowledge, way, Computation::slowest_input))
            .collect();
        let variable = computations.first().map(|it| it.way().substitution.sink);
        let turn = variable.and_then(|variable| knowledge.variables()[variable].wraps);
        let monitor = ThesisMonitor::new(computations.len(), turn, options);
        let count = knowledge.signals().len();
        let (buffers, unwrapped) = (IdVec::filled(count, |_| Vec::new()), IdVec::filled(count, |_| None));
        ThesisRun { options, computations, buffers, unwrapped, monitor, steps: 0 }
    }

    /// The ways, in the order of their numbers.
    pub fn ways(&self) -> impl Iterator<Item = &Way> {
        self.computations.iter().map(Computation::way)
    }

    /// Buffers an observation; it is used for as many steps as the buffer holds.
    pub fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation) {
        let signal = &knowledge.signals()[observation.signal];
        let mut values: Vec<Interval> = match &observation.value {
            &RawValue::Number(number) => Vec::from([signal.enclose(number)]),
            &RawValue::Interval { lo, hi } => Vec::from([signal.enclose_bounds(lo, hi)]),
            RawValue::Vector(elements) => elements.iter().map(|&element| signal.enclose(element)).collect(),
        };
        if let (Some(turn), [value]) = (signal.limits.turn, values.as_mut_slice()) {
            let before = &mut self.unwrapped[observation.signal];
            *value = before.map_or(*value, |before| circle::nearest(*value, before, turn));
            *before = (!value.is_empty()).then_some(*value).or(*before);
        }
        let item = Item { validity: signal.validity(observation.stamp), values };
        self.buffers[observation.signal].push(Buffered { step: self.steps, item });
    }

    /// Evaluates a step at the end of a period. Complexity: O(c^2) for c combinations.
    pub fn step(&mut self, time: Time) -> ThesisStep {
        let (mut outputs, mut truncated) = (Vec::new(), false);
        for (substitution, computation) in self.computations.iter_mut().enumerate() {
            for (items, validity) in combinations(computation.way(), &self.buffers, &mut truncated) {
                let Some(value) = value_of(computation, &items, validity) else { continue };
                outputs.push(ThesisOutput { substitution, value, validity: Some(validity) });
            }
        }
        self.steps += 1;
        let oldest = (self.steps + 1).saturating_sub(self.options.buffer.max(1));
        self.buffers.iter_mut().for_each(|buffer| buffer.retain(|buffered| buffered.step >= oldest));
        ThesisStep { truncated, ..self.monitor.step(time, outputs) }
    }
}

/// The value for these inputs: empty when an input has no value, which is an error; `None` when the substitution gives no value,
/// as its constraint does not hold or an earlier value is missing.
fn value_of(computation: &mut Computation, items: &[Option<&Item>], validity: Validity) -> Option<Interval> {
    let lacks_value = |item: &&Item| item.values.iter().any(|value| value.is_empty());
    match items.iter().flatten().any(lacks_value) {
        true => Some(Interval::EMPTY),
        false => computation.evaluate_items(items, validity),
    }
}

/// Every choice of one buffered observation for each source whose times all overlap, with their common time; `truncated` becomes
/// true when there are too many.
fn combinations<'a>(
    way: &Way,
    buffers: &'a IdVec<SignalId, Vec<Buffered>>,
    truncated: &mut bool,
) -> Vec<(Vec<Option<&'a Item>>, Validity)> {
    let mut chosen = Vec::from([(Vec::new(), Validity::always())]);
    for signal in &way.signals {
        let Some(signal) = signal else {
            chosen.iter_mut().for_each(|(items, _)| items.push(None));
            continue;
        };
        let mut longer = Vec::new();
        for (items, validity) in &chosen {
            for buffered in &buffers[*signal] {
                let Some(shared) = validity.intersection(buffered.item.validity) else { continue };
                if longer.len() == MOST_COMBINATIONS {
                    *truncated = true;
                    break;
                }
                let mut items: Vec<Option<&Item>> = items.clone();
                items.push(Some(&buffered.item));
                longer.push((items, shared));
            }
        }
        chosen = longer;
    }
    chosen
}
