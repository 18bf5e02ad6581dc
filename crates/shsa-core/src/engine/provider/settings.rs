//! The fixed settings of a need: what it demands of values, and how it changes its source.

use super::super::message::PublishedValue;
use crate::alignment::Sample;
use crate::knowledge::{KnowledgeBase, NeedId, Shape, Switching, VariableId, WhenUnsure};
use crate::time::{Span, Time, Validity};

/// A value of a source, with the time in which it was true.
pub(super) type Given = (PublishedValue, Validity);

/// The model's settings of a need.
#[derive(Debug)]
pub(super) struct Settings {
    pub(super) need: NeedId,
    pub(super) variable: VariableId,
    pub(super) is_vector: bool,
    /// See [`Variable::wraps`](crate::knowledge::Variable::wraps).
    pub(super) wraps: Option<f64>,
    pub(super) switching: Switching,
    pub(super) max_age: Span,
    pub(super) max_width: f64,
    pub(super) when_unsure: WhenUnsure,
}

impl Settings {
    pub(super) fn new(knowledge: &KnowledgeBase, id: NeedId) -> Settings {
        let need = &knowledge.needs()[id];
        let variable = &knowledge.variables()[need.variable];
        Settings {
            need: id,
            variable: need.variable,
            is_vector: variable.shape == Shape::Vector,
            wraps: variable.wraps,
            switching: need.switching,
            max_age: need.max_age,
            max_width: need.max_width.unwrap_or(f64::INFINITY),
            when_unsure: need.when_unsure,
        }
    }

    /// Whether a scalar value is as new and as narrow as the need demands.
    pub(super) fn is_fit(&self, sample: &Sample, now: Time) -> bool {
        now - sample.validity.to <= self.max_age && sample.value.width() <= self.max_width
    }

    /// Whether a value of any shape is as new and as narrow as the need demands.
    pub(super) fn is_met_by(&self, (value, validity): &Given, now: Time) -> bool {
        now - validity.to <= self.max_age && width(value) <= self.max_width
    }

    /// Half of the time that a value may be old: after that, the need is about to be overdue.
    pub(super) fn half_age(&self) -> Span {
        Span(self.max_age.0 / 2)
    }
}

/// The width of a value; for a vector, of its widest element.
pub(super) fn width(value: &PublishedValue) -> f64 {
    match value {
        PublishedValue::Scalar(value) => value.width(),
        PublishedValue::Vector(elements) => elements.iter().map(|it| it.width()).fold(0.0, f64::max),
    }
}
