//! Proves that a utility never rises with additional relations, whichever signals are available.

use super::{Aggregate, Fact, Inputs, Numbers, Rating, Utility};
use crate::interval::Interval;
use crate::knowledge::ids::{RelationId, SignalId, VariableId};
use crate::knowledge::{ACCURACY, COST, KnowledgeBase};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// By how much rounding may move a rating out of its range.
pub(super) const SLACK: f64 = 1e-9;

/// A rating that would let the utility rise with additional relations, or that has no value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UtilityProblem {
    /// The element with the rating.
    pub element: Element,
    /// The problem.
    pub message: String,
    /// The help.
    pub help: String,
}

/// An element of a knowledge base that has properties.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Element {
    /// A variable.
    Variable(VariableId),
    /// A relation.
    Relation(RelationId),
    /// A signal.
    Signal(SignalId),
}

impl Utility {
    /// Every problem because of which additional relations could raise the utility, whichever signals are available. Complexity:
    /// O(model).
    ///
    /// The searches refuse a knowledge base with such problems.
    #[must_use]
    pub fn check(&self, knowledge: &KnowledgeBase) -> Vec<UtilityProblem> {
        let variables = knowledge.variables().ids().map(Element::Variable);
        let carriers = knowledge.signals().ids().map(Element::Signal);
        let accuracies = variables.chain(carriers).filter_map(|element| inaccurate(knowledge, element));
        let relations = knowledge.relations().ids().filter_map(|id| self.check_relation(knowledge, id));
        let signals = knowledge.signals().ids().filter_map(|id| self.check_signal(knowledge, id));
        accuracies.chain(relations).chain(signals).collect()
    }

    /// The problem that [`Utility::check`] finds for one element.
    #[must_use]
    pub fn check_element(&self, knowledge: &KnowledgeBase, element: Element) -> Option<UtilityProblem> {
        match element {
            Element::Variable(_) => inaccurate(knowledge, element),
            Element::Relation(id) => self.check_relation(knowledge, id),
            Element::Signal(id) => {
                inaccurate(knowledge, element).or_else(|| self.check_signal(knowledge, id))
            }
        }
    }

    /// The first problem after a change of one element's property, where there was none before. Complexity: that of the element
    /// with the norm; else O(model), as formulas of relations may read the accuracy of their inputs.
    pub(in super::super) fn check_after(
        &self,
        knowledge: &KnowledgeBase,
        element: Element,
    ) -> Option<UtilityProblem> {
        match (self, element) {
            (Utility::Norm, _) | (_, Element::Relation(_)) => self.check_element(knowledge, element),
            (Utility::Own(_), _) => self.check(knowledge).into_iter().next(),
        }
    }

    fn check_relation(&self, knowledge: &KnowledgeBase, id: RelationId) -> Option<UtilityProblem> {
        let relation = &knowledge.relations()[id];
        let wrong = |message, help: &str| {
            Some(UtilityProblem { element: Element::Relation(id), message, help: help.into() })
        };
        let own = match self {
            Utility::Norm => {
                let cost = relation.properties.get(COST).copied().unwrap_or(1.0);
                let message = || format!("the cost {cost} of relation `{}` is below 1", relation.name);
                return if cost >= 1.0 { None } else { wrong(message(), "a cost is at least 1") };
            }
            Utility::Own(own) => own,
        };
        let rating = own.relation.as_ref()?;
        let has_all = |name: &str| {
            let has_one = |&output: &VariableId| knowledge.variables()[output].properties.contains_key(name);
            relation.properties.contains_key(name) || relation.outputs.iter().all(has_one)
        };
        let missing = |(name, otherwise): &(&str, Option<f64>)| otherwise.is_none() && !has_all(name);
        if let Some((name, _)) = rating.properties().find(missing) {
            let message = format!("relation `{}` has no `{name}`, which the utility reads", relation.name);
            return wrong(
                message,
                "give it or its outputs one, or name a value for all without it under `defaults`",
            );
        }
        let own_numbers = self.numbers_of(&relation.properties);
        let outputs = relation.outputs.iter();
        let outside = |&output: &VariableId| {
            let inputs: Vec<VariableId> = relation.needs(output).collect();
            let of_output = self.numbers_of_output(&knowledge.variables()[output].properties);
            let numbers = Numbers { relation: &own_numbers, output: &of_output };
            outside(own.aggregate, rating, numbers, &inputs, knowledge)
        };
        let value = outputs.filter_map(outside).next()?;
        let message = format!("the utility of relation `{}` may be {value}", relation.name);
        wrong(message, out_of_range(own.aggregate))
    }

    fn check_signal(&self, knowledge: &KnowledgeBase, id: SignalId) -> Option<UtilityProblem> {
        let aggregate = self.aggregate();
        let signal = &knowledge.signals()[id];
        let value = self.of_signal(knowledge, id);
        if aggregate.range().contains(value) {
            return None;
        }
        let message = match value.is_nan() {
            true => format!("the utility of signal `{}` has no value", signal.name),
            false => format!("the utility of signal `{}` is {value}", signal.name),
        };
        let help = match value.is_nan() {
            true => {
                "give it or its variable every property that the formula reads, or name values under `defaults`"
            }
            false => out_of_range(aggregate),
        };
        Some(UtilityProblem { element: Element::Signal(id), message, help: help.into() })
    }
}

pub(in super::super) fn out_of_range(aggregate: Aggregate) -> &'static str {
    match aggregate {
        Aggregate::Sum => "costs lie between 0 and 1e9, so that no relation makes a substitution better",
        _ => {
            "it must lie between 0 and 1 whichever inputs are provided, so that no relation makes a substitution better"
        }
    }
}

/// The range of a relation's rating, if that exceeds the allowed one for some number of provided inputs.
fn outside(
    aggregate: Aggregate,
    rating: &Rating,
    numbers: Numbers<'_>,
    inputs: &[VariableId],
    knowledge: &KnowledgeBase,
) -> Option<String> {
    let count = Interval::point(inputs.len() as f64);
    let accuracy = inputs.iter().fold(Interval::point(1.0), |all, &input| all * accuracies(knowledge, input));
    let range = aggregate.range();
    let rate = |unprovided, accuracy| {
        let value = rating.of_relation(numbers, &Inputs { count, unprovided, accuracy }, Interval::point);
        let is_right =
            !value.is_empty() && value.lo() >= range.lo() - SLACK && value.hi() <= range.hi() + SLACK;
        (!is_right).then_some(value)
    };
    // Interval bounds can miss points without a value, such as roots of negative numbers, so the end points are tested, too.
    let accuracies = [accuracy, Interval::point(accuracy.lo()), Interval::point(accuracy.hi())];
    let most = if rating.facts.contains(&Fact::Unprovided) { inputs.len() } else { 0 };
    let numbers = (0..=most).map(|unprovided| Interval::point(unprovided as f64));
    let mut cases = numbers.flat_map(|unprovided| accuracies.map(|accuracy| (unprovided, accuracy)));
    cases.find_map(|(unprovided, accuracy)| rate(unprovided, accuracy)).map(described)
}

pub(super) fn described(value: Interval) -> String {
    match value {
        _ if value.is_empty() => "without a value".into(),
        _ if value.hi() - value.lo() < SLACK => format!("{}", value.midpoint()),
        _ => format!("{} to {}", value.lo(), value.hi()),
    }
}

/// The range of an input's accuracy, whichever of its signals are available.
fn accuracies(knowledge: &KnowledgeBase, variable: VariableId) -> Interval {
    let of_signal = |&signal: &SignalId| knowledge.signals()[signal].properties.get(ACCURACY).copied();
    match knowledge.variables()[variable].properties.get(ACCURACY) {
        Some(&own) => Interval::point(own),
        None => {
            let signals = knowledge.carriers(variable).iter().filter_map(of_signal);
            signals.fold(Interval::point(1.0), |all, accuracy| all.hull(Interval::point(accuracy)))
        }
    }
}

/// The problem of an accuracy that is no share: a product of such could rise.
fn inaccurate(knowledge: &KnowledgeBase, element: Element) -> Option<UtilityProblem> {
    let (name, properties) = match element {
        Element::Variable(id) => (&knowledge.variables()[id].name, &knowledge.variables()[id].properties),
        Element::Signal(id) => (&knowledge.signals()[id].name, &knowledge.signals()[id].properties),
        Element::Relation(_) => return None,
    };
    let accuracy = properties.get(ACCURACY).copied()?;
    (!(0.0..=1.0).contains(&accuracy)).then(|| {
        let message = format!("the accuracy {accuracy} of `{name}` is outside 0 to 1");
        UtilityProblem { element, message, help: String::from("an accuracy is a share") }
    })
}
