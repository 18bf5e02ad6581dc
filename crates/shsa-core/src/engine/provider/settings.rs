//! The fixed settings of a need: what it demands of values, and how it changes its source.

use super::super::message::PublishedValue;
use crate::alignment::Sample;
use crate::computation::Timing;
use crate::interval::Interval;
use crate::knowledge::{KnowledgeBase, NeedId, Shape, Signal, Switching, Variable, VariableId, WhenUnsure};
use crate::time::{Span, Time, Validity};

/// How wide values may be where a need says nothing: less wide than those of a carrier that says no more than that the value is beyond
/// what it can show, as long as there is another one.
fn usable_width(knowledge: &KnowledgeBase, variable: VariableId) -> f64 {
    let carriers = || knowledge.carriers(variable).iter().map(|signal| &knowledge.signals()[*signal]);
    let width = |it: &Signal| it.value_error.hi - it.value_error.lo;
    let others = carriers().filter(|it| it.limits.saturation.is_none()).map(width);
    let narrowest = others.fold(f64::INFINITY, f64::min);
    let least = carriers().filter_map(|it| Some(it.limits.saturation?.least_width().max(width(it))));
    least.filter(|least| narrowest < *least).fold(f64::INFINITY, f64::min)
}

/// A value of a source, with the time in which it was true.
pub(super) type Given = (PublishedValue, Validity);

/// The model's settings of a need.
#[derive(Debug)]
pub(super) struct Settings {
    pub(super) need: NeedId,
    pub(super) variable: VariableId,
    quantity: Variable,
    pub(super) is_vector: bool,
    /// See [`Variable::wraps`](crate::knowledge::Variable::wraps).
    pub(super) wraps: Option<f64>,
    pub(super) switching: Switching,
    pub(super) max_age: Span,
    pub(super) max_width: f64,
    /// Whether a wider value serves where there is no narrower one.
    pub(super) is_any_width_usable: bool,
    pub(super) when_unsure: WhenUnsure,
}

impl Settings {
    pub(super) fn new(knowledge: &KnowledgeBase, id: NeedId) -> Settings {
        let need = &knowledge.needs()[id];
        let variable = &knowledge.variables()[need.variable];
        Settings {
            need: id,
            variable: need.variable,
            quantity: variable.clone(),
            is_vector: variable.shape == Shape::Vector,
            wraps: variable.wraps,
            switching: need.switching,
            max_age: need.max_age,
            max_width: need.max_width.unwrap_or_else(|| usable_width(knowledge, need.variable)),
            is_any_width_usable: need.max_width.is_none(),
            when_unsure: need.when_unsure,
        }
    }

    /// Whether the value of a moment that is not known exactly bounds the variable at another one, too.
    pub(super) fn is_bounded_at(&self, own: Validity, other: Validity, timing: Timing) -> bool {
        other == own || self.quantity.max_rate.is_some() || timing.mean_over > Span::ZERO
    }

    /// What the value of a source says of the middle of its validity, for which it is published; see
    /// [`stated_for`](Settings::stated_for).
    pub(super) fn stated(&self, sample: Sample, timing: Timing) -> Sample {
        self.stated_for(sample, timing, sample.validity)
    }

    /// What the value of a source says of the middle of another time: the value grows by as much as the variable may change in the
    /// time for which the value may be off, and ends at the variable's range. Empty where none of it is possible.
    #[inline]
    pub(super) fn stated_for(&self, sample: Sample, timing: Timing, validity: Validity) -> Sample {
        let moved = validity.centre() - sample.validity.centre();
        let off = timing.off(sample.validity.length()) + Span(moved.0.saturating_abs());
        let value = match self.quantity.max_rate {
            Some(max_rate) if off > Span::ZERO => sample.value.widened(off.seconds() * max_rate),
            _ => sample.value,
        };
        Sample { value: self.possible(value), validity }
    }

    /// The part of a value that the range of the variable leaves.
    #[inline]
    pub(super) fn possible(&self, value: Interval) -> Interval {
        self.quantity.possible(value)
    }

    /// A value as it goes out: within one turn where the variable wraps; the elements of a vector within its range. An element without a
    /// possible value, such as one of a beam without an echo, stays as it is.
    pub(super) fn shown(&self, value: PublishedValue) -> PublishedValue {
        match value {
            PublishedValue::Scalar(value) => PublishedValue::Scalar(self.quantity.brought_back(value)),
            PublishedValue::Vector(mut elements) => {
                let possible = |it: Interval| Some(self.possible(it)).filter(|it| !it.is_empty());
                elements.iter_mut().for_each(|it| *it = possible(*it).unwrap_or(*it));
                PublishedValue::Vector(elements)
            }
        }
    }

    /// Whether a [stated](Settings::stated) value is possible, and as new and as narrow as the need demands.
    pub(super) fn is_fit(&self, stated: &Sample, now: Time) -> bool {
        let is_narrow = !stated.value.is_empty() && stated.value.width() <= self.max_width;
        is_narrow && now - stated.validity.to <= self.max_age
    }

    /// Whether a value of any shape is possible, and as new and as narrow as the need demands.
    #[inline]
    pub(super) fn is_met_by(&self, given: &Given, timing: Timing, now: Time) -> bool {
        let is_any = self.max_width == f64::INFINITY && self.quantity.range.is_none();
        let is_narrow = is_any || self.width(given, timing).is_some_and(|width| width <= self.max_width);
        is_narrow && now - given.1.to <= self.max_age
    }

    /// The width of a value as it is stated; for a vector, of its widest element. `None` for what is not possible.
    pub(super) fn width(&self, (value, validity): &Given, timing: Timing) -> Option<f64> {
        match value {
            &PublishedValue::Scalar(value) => {
                let stated = self.stated(Sample { value, validity: *validity }, timing).value;
                (!stated.is_empty()).then(|| stated.width())
            }
            PublishedValue::Vector(elements) => {
                Some(elements.iter().map(|it| it.width()).fold(0.0, f64::max))
            }
        }
    }

    /// Half of the time that a value may be old: after that, the need is about to be overdue.
    pub(super) fn half_age(&self) -> Span {
        Span(self.max_age.0 / 2)
    }
}
