//! The rating of substitutions by a model: the key `utility`.
//!
//! A formula rates each relation (and each signal) from its properties, and an aggregate combines the ratings of a substitution.
//! No aggregate gets better by more relations, provided that every rating lies in the aggregate's range, which [`Utility::check`]
//! proves with intervals. The searches are right only then.

mod check;

pub(super) use check::out_of_range;
pub use check::{Element, UtilityProblem};
use check::{SLACK, described};

use super::ids::SignalId;
use super::{ACCURACY, COST, KnowledgeBase, Properties, Signal};
use crate::expression::{Number, Program, Value};
use crate::interval::Interval;
use crate::time::{Time, Validity};
use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

/// How substitutions are rated; higher is better.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Utility {
    /// `(0.3/n + 0.5/cost + 0.1/(u+1) + 0.5*A) / 1.4` for each relation, multiplied: few inputs, low cost, few inputs
    /// that must be substituted themselves, exact inputs (Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien
    /// 2019, chapter 6).
    #[default]
    Norm,
    /// The model's own formulas.
    Own(Box<OwnUtility>),
}

/// Formulas of a model that rate relations and signals.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnUtility {
    /// How the ratings of a substitution are combined.
    pub aggregate: Aggregate,
    /// Rates a relation that is used for an output; without it, every relation has the best rating.
    pub relation: Option<Rating>,
    /// Rates a signal that a substitution starts from; without it, every signal has the best rating.
    pub signal: Option<Rating>,
    /// Rates a way of knowing from its record; without it, every way has the best rating. Searches do not use it: it orders their
    /// results when a source is chosen.
    pub way: Option<Rating>,
}

impl Aggregate {
    /// The utility with one more rating; a rating without a value counts as the worst, one out of range as its bound.
    #[must_use]
    pub fn with(self, utility: f64, rating: f64) -> f64 {
        let range = self.range();
        let worst = if self == Aggregate::Sum { range.hi() } else { range.lo() };
        let rating = if rating.is_nan() { worst } else { rating.clamp(range.lo(), range.hi()) };
        match self {
            Aggregate::Product => utility * rating,
            Aggregate::Sum => utility - rating,
            Aggregate::Minimum => utility.min(rating),
        }
    }
}

/// How the ratings of a substitution's relations and signals are combined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Aggregate {
    /// The product of ratings in [0, 1].
    #[default]
    Product,
    /// Minus the sum of ratings, which are costs from 0 to 1e9, counted to 1e-9.
    Sum,
    /// The least of ratings in [0, 1].
    Minimum,
}

impl Aggregate {
    /// All aggregates, with their names in models.
    pub const NAMES: [(&'static str, Aggregate); 3] =
        [("product", Aggregate::Product), ("sum", Aggregate::Sum), ("minimum", Aggregate::Minimum)];

    /// The best rating.
    #[must_use]
    pub fn best(self) -> f64 {
        match self {
            Aggregate::Product | Aggregate::Minimum => 1.0,
            Aggregate::Sum => 0.0,
        }
    }

    /// The range of ratings.
    #[must_use]
    pub fn range(self) -> Interval {
        match self {
            Aggregate::Product | Aggregate::Minimum => Interval::new(0.0, 1.0),
            Aggregate::Sum => Interval::new(0.0, 1e9),
        }
    }
}

/// A formula over facts of a relation or signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Rating {
    /// As written in the model.
    pub text: String,
    /// The compiled formula over [`Rating::facts`].
    pub(super) program: Program,
    /// The inputs of the program, in its order.
    pub(super) facts: Vec<Fact>,
}

/// A fact that a formula of a utility may read.
#[derive(Clone, Debug, PartialEq)]
pub enum Fact {
    /// The number of variables that a relation needs.
    Inputs,
    /// The number of these variables that are not provided.
    Unprovided,
    /// The product of the accuracies of those inputs that have an accuracy.
    InputAccuracy,
    /// Observations a second of a signal.
    Rate,
    /// How old a signal's content is at its time stamp, in seconds.
    Delay,
    /// A property of a relation or signal; where that has none, of the output of the relation or the variable of the signal; else the
    /// default.
    Property(String, Option<f64>),
    /// A figure of a way's record, and its default without evidence.
    Figure(Figure, Option<f64>),
}

/// A figure of the record of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// The share of comparisons in which the way agreed with independent ways.
    Agreement,
    /// The mean distance from independent ways, SI.
    Error,
    /// The mean width of the values, SI.
    Width,
    /// The share of time with a value.
    Availability,
}

impl Figure {
    /// All figures, with their names in formulas.
    pub const NAMES: [(&'static str, Figure); 4] = [
        ("agreement", Figure::Agreement),
        ("error", Figure::Error),
        ("width", Figure::Width),
        ("availability", Figure::Availability),
    ];

    /// The range of the figure.
    #[must_use]
    pub fn range(self) -> Interval {
        match self {
            Figure::Agreement | Figure::Availability => Interval::new(0.0, 1.0),
            Figure::Error | Figure::Width => Interval::new(0.0, f64::INFINITY),
        }
    }

    /// The default of a figure without evidence: for a share 0.5, better than proven more often wrong than right, and worse than
    /// the contrary. A distance has no such default.
    #[must_use]
    pub fn unknown(self) -> Option<f64> {
        match self {
            Figure::Agreement | Figure::Availability => Some(0.5),
            Figure::Error | Figure::Width => None,
        }
    }
}

impl Fact {
    /// Facts of relations by their names in formulas.
    pub const OF_RELATIONS: [(&'static str, Fact); 3] =
        [("inputs", Fact::Inputs), ("unprovided", Fact::Unprovided), ("input_accuracy", Fact::InputAccuracy)];
    /// Facts of signals by their names in formulas.
    pub const OF_SIGNALS: [(&'static str, Fact); 2] = [("rate", Fact::Rate), ("delay", Fact::Delay)];
}

/// The facts about a relation that is used for one output, beside its properties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs<N = f64> {
    /// The number of variables that it needs.
    pub count: N,
    /// The number of these variables that are not provided.
    pub unprovided: N,
    /// The product of the accuracies of those variables that have an accuracy.
    pub accuracy: N,
}

impl Rating {
    /// Missing where a fact is missing, or the formula has no value.
    fn value<N: Number>(&self, fact: impl FnMut(&Fact) -> N) -> N {
        let facts: Vec<Value<N>> = self.facts.iter().map(fact).map(Value::Scalar).collect();
        let now = Validity { from: Time::default(), to: Time::default() };
        self.program.evaluate(&mut self.program.new_state(0, 0.0), &facts, now, None).value.scalar()
    }

    fn properties(&self) -> impl Iterator<Item = (&str, Option<f64>)> {
        self.facts.iter().filter_map(|fact| match fact {
            Fact::Property(name, otherwise) => Some((name.as_str(), *otherwise)),
            _ => None,
        })
    }

    fn of_relation<N: Number>(
        &self,
        numbers: Numbers<'_>,
        inputs: &Inputs<N>,
        number: impl Fn(f64) -> N,
    ) -> N {
        let mut at = 0;
        self.value(|fact| match fact {
            Fact::Inputs => inputs.count,
            Fact::Unprovided => inputs.unprovided,
            Fact::InputAccuracy => inputs.accuracy,
            Fact::Property(_, otherwise) => {
                let given = numbers.get(at);
                at += 1;
                given.or(*otherwise).map_or(N::MISSING, &number)
            }
            _ => N::MISSING,
        })
    }

    fn of_signal(&self, signal: &Signal, variable: &Properties) -> f64 {
        self.value(|fact| match fact {
            Fact::Rate => signal.rate_hz.unwrap_or(f64::NAN),
            Fact::Delay => signal.delay.seconds(),
            Fact::Property(name, otherwise) => {
                let given = signal.properties.get(name).or_else(|| variable.get(name));
                given.copied().or(*otherwise).unwrap_or(f64::NAN)
            }
            _ => f64::NAN,
        })
    }
}

impl Rating {
    fn of_way<N: Number>(&self, figure: impl Fn(Figure, Option<f64>) -> N) -> N {
        self.value(|fact| match fact {
            Fact::Figure(known, unknown) => figure(*known, *unknown),
            _ => N::MISSING,
        })
    }

    /// The range of a way's rating, if that exceeds the allowed one for some record.
    pub(super) fn outside_for_ways(&self, aggregate: Aggregate) -> Option<String> {
        let range = aggregate.range();
        let value = self.of_way(|figure, _| figure.range());
        let is_right =
            !value.is_empty() && value.lo() >= range.lo() - SLACK && value.hi() <= range.hi() + SLACK;
        (!is_right).then(|| described(value))
    }
}

/// The numbers that the rating of a relation reads from properties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers<'a> {
    /// Those of the relation, by [`Utility::numbers_of`].
    pub relation: &'a [f64],
    /// Those of its output, by [`Utility::numbers_of_output`].
    pub output: &'a [f64],
}

impl Numbers<'_> {
    fn get(&self, at: usize) -> Option<f64> {
        known(self.relation, at).or_else(|| known(self.output, at))
    }
}

fn known(numbers: &[f64], at: usize) -> Option<f64> {
    numbers.get(at).copied().filter(|number| !number.is_nan())
}

impl Utility {
    /// How the ratings of a substitution are combined.
    #[must_use]
    pub fn aggregate(&self) -> Aggregate {
        match self {
            Utility::Norm => Aggregate::Product,
            Utility::Own(own) => own.aggregate,
        }
    }

    /// Whether signals are rated.
    #[must_use]
    pub fn rates_signals(&self) -> bool {
        matches!(self, Utility::Own(own) if own.signal.is_some())
    }

    /// The numbers that the rating of a relation reads from its properties: [`f64::NAN`] for a missing one.
    #[must_use]
    pub fn numbers_of(&self, properties: &Properties) -> Vec<f64> {
        let number = |name: &str| properties.get(name).copied().unwrap_or(f64::NAN);
        match self {
            Utility::Norm => Vec::from([number(COST)]),
            Utility::Own(own) => {
                own.relation.iter().flat_map(Rating::properties).map(|(name, _)| number(name)).collect()
            }
        }
    }

    /// The numbers that the rating of a relation reads from the properties of its output, which count where the relation has none. The
    /// norm reads none.
    #[must_use]
    pub fn numbers_of_output(&self, properties: &Properties) -> Vec<f64> {
        match self {
            Utility::Norm => Vec::new(),
            Utility::Own(_) => self.numbers_of(properties),
        }
    }

    /// Rates a relation for an output; [`f64::NAN`] where a formula has no value.
    #[must_use]
    pub fn of_relation(&self, numbers: Numbers<'_>, inputs: &Inputs) -> f64 {
        match self {
            Utility::Norm => norm(known(numbers.relation, 0).unwrap_or(1.0), inputs),
            Utility::Own(own) => match &own.relation {
                Some(rating) => rating.of_relation(numbers, inputs, |value| value),
                None => own.aggregate.best(),
            },
        }
    }

    /// Sorts signals by their ratings, the best first; equals by their accuracy, without an accuracy last; then in their order.
    pub(crate) fn sort_signals(&self, knowledge: &KnowledgeBase, signals: &mut [SignalId]) {
        let accuracy = |signal: &SignalId| {
            let properties = &knowledge.signals()[*signal].properties;
            properties.get(ACCURACY).copied().unwrap_or(f64::NEG_INFINITY)
        };
        signals.sort_by(|a, b| accuracy(b).total_cmp(&accuracy(a)));
        if !self.rates_signals() {
            return;
        }
        let rating = |signal: &SignalId| self.of_signal(knowledge, *signal);
        match self.aggregate() {
            Aggregate::Sum => signals.sort_by(|a, b| rating(a).total_cmp(&rating(b))),
            Aggregate::Product | Aggregate::Minimum => {
                signals.sort_by(|a, b| rating(b).total_cmp(&rating(a)));
            }
        }
    }

    /// Whether ways are rated by their records.
    #[must_use]
    pub fn rates_ways(&self) -> bool {
        matches!(self, Utility::Own(own) if own.way.is_some())
    }

    /// Rates a way by its record; `figure` gives the known figures.
    #[must_use]
    pub fn of_way(&self, figure: impl Fn(Figure) -> Option<f64>) -> f64 {
        match self {
            Utility::Norm => Aggregate::Product.best(),
            Utility::Own(own) => own.way.as_ref().map_or(own.aggregate.best(), |rating| {
                rating.of_way(|known, unknown| figure(known).or(unknown).unwrap_or(f64::NAN))
            }),
        }
    }

    /// Rates a signal that a substitution starts from.
    #[must_use]
    pub fn of_signal(&self, knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
        match self {
            Utility::Norm => Aggregate::Product.best(),
            Utility::Own(own) => {
                let signal = &knowledge.signals()[signal];
                let variable = &knowledge.variables()[signal.variable].properties;
                own.signal.as_ref().map_or(own.aggregate.best(), |rating| rating.of_signal(signal, variable))
            }
        }
    }
}

fn norm(cost: f64, inputs: &Inputs) -> f64 {
    let few_inputs = 0.3 / inputs.count.max(1.0);
    let few_unprovided = 0.1 / (inputs.unprovided + 1.0);
    (few_inputs + 0.5 / cost + few_unprovided + 0.5 * inputs.accuracy) / 1.4
}

#[cfg(test)]
mod tests;
