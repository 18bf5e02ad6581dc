//! Conditions over time: whether one has held throughout a span, and whether each trigger was answered within a span.
//!
//! Metric temporal logic (R. Koymans, 1990, doi:10.1007/BF01995674) of the past, over samples, with three verdicts as in A. Bauer,
//! M. Leucker, C. Schallhart, "Runtime verification for LTL and TLTL", 2011, doi:10.1145/2000799.2000800: an observation that
//! leaves a condition open leaves the verdict open, and so does a gap without samples. Each sample takes constant time and
//! memory, whatever the span.

use alloc::vec;

use super::formula::Formula;
use super::number::Number;
use super::operation::{Comparison, Constant, Operation};
use crate::interval::{Interval, Truth};
use crate::time::{Span, Time, Validity};

/// The argument of `Answered`: the response holds, neither holds, the trigger holds without the response.
const RESPONSE: f64 = 0.0;
const NEITHER: f64 = 1.0;
const TRIGGER: f64 = 2.0;

/// Whether a condition has held throughout the last span.
pub(crate) fn always(condition: Formula, span: Span) -> Formula {
    over(Operation::Held(span), truth_as_number(condition))
}

/// Whether a condition has held at a time within the last span.
pub(crate) fn once(condition: Formula, span: Span) -> Formula {
    negated(always(negated(condition), span))
}

/// Whether a response has followed each trigger that is older than the span, at most the span later.
pub(crate) fn answered(trigger: Formula, response: Formula, span: Span) -> Formula {
    let waiting = choice(trigger, TRIGGER, Formula::number(NEITHER));
    over(Operation::Answered(span), choice(response, RESPONSE, waiting))
}

/// Whether a condition holds where another one does.
pub(crate) fn implied(condition: Formula, by: Formula) -> Formula {
    Formula::node(Operation::Or, vec![negated(by), condition])
}

/// 1 where a condition holds, 0 where it does not; both where it is not known.
pub(crate) fn truth_as_number(condition: Formula) -> Formula {
    choice(condition, 1.0, Formula::number(0.0))
}

/// A condition over time, as the language writes it.
pub(super) struct Written<'f> {
    pub(super) name: &'static str,
    /// The condition, or the trigger and the response.
    pub(super) of: (&'f Formula, Option<&'f Formula>),
    pub(super) span: Span,
}

impl<'f> Written<'f> {
    /// The function that a comparison was made of; `None` where it is a usual one.
    pub(super) fn of(comparison: &'f Formula) -> Option<Written<'f>> {
        let [_, number] = comparison.arguments() else { return None };
        let [choice] = number.arguments() else { return None };
        let [condition, _, other] = choice.arguments() else { return None };
        match (number.operation(), other.arguments()) {
            (Operation::Held(span), _) => Some(Written { name: "always", of: (condition, None), span }),
            (Operation::Answered(span), [trigger, ..]) => {
                Some(Written { name: "answered", of: (trigger, Some(condition)), span })
            }
            _ => None,
        }
    }
}

/// A condition over time as a condition: the operations on time take and give numbers.
fn over(operation: Operation, of: Formula) -> Formula {
    let number = Formula::node(operation, vec![of]);
    Formula::node(Operation::Compare(Comparison::Less), vec![Formula::number(0.5), number])
}

fn negated(condition: Formula) -> Formula {
    Formula::node(Operation::Not, vec![condition])
}

/// A number where a condition holds, else another one.
fn choice(condition: Formula, number: f64, other: Formula) -> Formula {
    Formula::node(Operation::Select, vec![condition, Formula::number(number), other])
}

/// What is known of the past.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Memory {
    /// Since when the condition has certainly held; the latest time at which the first unanswered trigger can have been.
    certain: Option<Time>,
    /// The earliest time of a trigger that may be unanswered.
    possible: Option<Time>,
    /// When the condition certainly did not hold for the last time.
    denied: Option<Time>,
}

/// A sample of the condition.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// All that the argument may be; empty where it has no value.
    pub(super) value: Interval,
    pub(super) at: Validity,
    /// The time of the sample before, where too much time has passed since.
    pub(super) unseen_since: Option<Time>,
}

impl Memory {
    /// The memory after a sample, and the verdict at its time.
    pub(super) fn after(self, operation: Operation, sample: Sample) -> (Memory, Truth) {
        match operation {
            Operation::Answered(span) => self.answered(sample, span),
            Operation::Held(span) => self.held(sample, span),
            _ => (self, Truth::Unknown),
        }
    }

    /// Whether the condition, 1 where it holds and 0 where it does not, has held throughout the span.
    fn held(self, sample: Sample, span: Span) -> (Memory, Truth) {
        let Sample { value, at, unseen_since } = sample;
        let kept = self.certain.filter(|_| unseen_since.is_none());
        let holds = !value.is_empty() && value.lo() >= 1.0;
        let fails = !value.is_empty() && value.hi() <= 0.0;
        let certain = holds.then(|| kept.unwrap_or(at.to));
        let denied = if fails { Some(at.from) } else { self.denied };
        let verdict = match (denied, certain) {
            (Some(denied), _) if at.to - denied <= span => Truth::False,
            (_, Some(since)) if at.from - since >= span => Truth::True,
            _ => Truth::Unknown,
        };
        (Memory { certain, denied, possible: None }, verdict)
    }

    /// Whether no trigger is older than the span without a response since. The trigger that a response comes with is answered.
    fn answered(self, sample: Sample, span: Span) -> (Memory, Truth) {
        let Sample { value, at, unseen_since } = sample;
        // In a gap there may have been a response, and another trigger after it.
        let certain = self.certain.filter(|_| unseen_since.is_none());
        let possible = self.possible.or(unseen_since);
        let (may_be_answered, is_answered, is_triggered, may_be_triggered) = match value.is_empty() {
            true => (true, false, false, true),
            false => {
                (value.lo() <= RESPONSE, value.hi() <= RESPONSE, value.lo() >= TRIGGER, value.hi() >= TRIGGER)
            }
        };
        let certain = certain.filter(|_| !may_be_answered).or(is_triggered.then_some(at.to));
        let possible = possible.filter(|_| !is_answered).or(may_be_triggered.then_some(at.from));
        let verdict = match (certain, possible) {
            (Some(since), _) if at.from - since >= span => Truth::False,
            (_, Some(since)) if at.to - since >= span => Truth::Unknown,
            _ => Truth::True,
        };
        (Memory { certain, possible, denied: None }, verdict)
    }
}

/// 1 for true, 0 for false, both for unknown: no plain number.
pub(super) fn as_number<N: Number>(truth: Truth) -> N {
    let number = |value| N::constant(Constant::exact(value));
    match truth {
        Truth::True => number(1.0),
        Truth::False => number(0.0),
        Truth::Unknown => number(1.0).hull(number(0.0)),
    }
}
