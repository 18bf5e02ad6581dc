//! The arguments of reasons: names, numbers with their unit, times, and small structures of these.

use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, VariableId};
use crate::order::{Order, Subject};
use crate::time::Span;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// A Rust type that an argument can have.
pub(super) trait Value: Sized {
    const KIND: Kind;

    fn argument(&self) -> Argument;

    fn read(argument: Argument) -> Option<Self>;
}

/// Kinds of arguments, each for one Rust type.
macro_rules! arguments {
    ($($(#[doc = $doc:literal])+ $name:ident($type:ty) $word:literal;)+) => {
        /// The kind of an argument.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Kind {
            $($(#[doc = $doc])+ $name,)+
        }

        impl Kind {
            /// Every kind.
            pub const ALL: &'static [Kind] = &[$(Kind::$name),+];

            /// The kind's name in the reference.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Kind::$name => $word,)+
                }
            }
        }

        /// An argument of any kind.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Argument {
            $($(#[doc = $doc])+ $name($type),)+
        }

        $(impl Value for $type {
            const KIND: Kind = Kind::$name;

            fn argument(&self) -> Argument {
                Argument::$name(self.clone())
            }

            fn read(argument: Argument) -> Option<Self> {
                match argument {
                    Argument::$name(value) => Some(value),
                    _ => None,
                }
            }
        })+
    };
}

arguments! {
    /// The name of a signal, relation, common cause, variable or need, or of a way of knowing as
    /// [`Way::describe`](crate::substitution::Way::describe) gives it.
    Name(String) "name";
    /// Several names.
    Names(Vec<String>) "names";
    /// A length of time.
    Span(Span) "span";
    /// A number of things.
    Count(u64) "count";
    /// A number in SI, or in the unit that ends the argument's name.
    Number(f64) "number";
    /// A probability.
    Probability(Probability) "probability";
    /// A range of values.
    Range(Range) "range";
    /// A width, or a difference of values.
    Amount(Amount) "amount";
    /// A signal, a relation or a common cause.
    Subject(Subject) "subject";
    /// Several subjects.
    Subjects(Vec<Subject>) "subjects";
    /// An operator's order.
    Order(Order) "order";
    /// Several orders.
    Orders(Vec<Order>) "orders";
    /// The source of a need, or its uncertain service.
    ServedBy(ServedBy) "served by";
    /// A source that may serve a need.
    Candidate(Candidate) "candidate";
    /// Several candidates, the best first.
    Candidates(Vec<Candidate>) "candidates";
}

/// A probability from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probability(pub f64);

/// A range of values, in the unit of its variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    /// The lower bound.
    pub lo: f64,
    /// The upper bound.
    pub hi: f64,
    /// The unit; `None` where the variable has none.
    pub unit: Option<String>,
}

impl Range {
    /// The range of an interval in SI; wrapping values are brought into one turn.
    #[must_use]
    pub fn of(knowledge: &KnowledgeBase, variable: VariableId, value: Interval) -> Range {
        let variable = &knowledge.variables()[variable];
        let value = variable.brought_back(value);
        let shown = |number: f64| variable.unit.as_ref().map_or(number, |unit| unit.from_si(number));
        let unit = variable.unit.as_ref().map(ToString::to_string);
        Range { lo: shown(value.lo()), hi: shown(value.hi()), unit }
    }
}

/// A width or a difference, in the unit of its variable; for temperatures in kelvin.
#[derive(Clone, Debug, PartialEq)]
pub struct Amount {
    /// The amount.
    pub value: f64,
    /// The unit; `None` where the variable has none.
    pub unit: Option<String>,
}

impl Amount {
    /// The amount of a difference in SI.
    #[must_use]
    pub fn of(knowledge: &KnowledgeBase, variable: VariableId, difference: f64) -> Amount {
        match &knowledge.variables()[variable].unit {
            Some(unit) if unit.offset != 0.0 => Amount { value: difference, unit: Some("K".to_string()) },
            Some(unit) => Amount { value: difference / unit.scale, unit: Some(unit.to_string()) },
            None => Amount { value: difference, unit: None },
        }
    }
}

/// The source of a need, or its uncertain service; ways by their names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ServedBy {
    /// A trusted way of knowing the need's variable.
    Way(String),
    /// Without a trusted source: the hull of two ways that may be right.
    Hull(Vec<String>),
    /// Without a trusted source: the values that enough of several ways hold possible.
    Agreeing {
        /// The number of ways that is enough.
        count: u64,
        /// The ways.
        ways: Vec<String>,
    },
    /// Without a trusted source: the last trusted value.
    LastTrusted,
}

impl ServedBy {
    /// The way, if the need is served by a trusted way.
    #[must_use]
    pub fn way(&self) -> Option<&str> {
        match self {
            ServedBy::Way(name) => Some(name),
            ServedBy::Hull(_) | ServedBy::Agreeing { .. } | ServedBy::LastTrusted => None,
        }
    }
}

/// A source that may serve a need.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The way of knowing the need's variable.
    pub source: String,
    /// Its utility.
    pub utility: f64,
    /// The record of the source, where it has decided.
    pub proof: Option<Proof>,
}

/// The record of a source.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Proof {
    /// The share of comparisons in which the source agreed with others.
    pub agreement: Option<f64>,
    /// The mean distance of the source from the others.
    pub error: Option<Amount>,
    /// The share of the time in which the source was present.
    pub availability: Option<f64>,
}
