//! Reads a plan's field from a message: a value, a stamp, or the element that conditions select.

use super::definition::{Count, Primitive};
use super::layout::Body;
use super::plan::{Place, Plan, Target};
use crate::path::is_text;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};

impl Plan {
    /// The value of the field, or of one element of its list; times in seconds. `None` when the message is too short, or the
    /// field is no number and no list of numbers, or has no such element.
    #[must_use]
    pub fn value(&self, body: Body<'_>, element: Option<usize>) -> Option<RawValue> {
        if let Some(places) = self.places(body) {
            let numbers: Option<Vec<f64>> = places.into_iter().map(|at| self.number(body, at)).collect();
            return Some(match element {
                Some(element) => RawValue::Number(*numbers?.get(element)?),
                None => RawValue::Vector(numbers?),
            });
        }
        let place = self.locate(body)?;
        match (self.target, element) {
            (Target::Time, None) => body.time(place.at).map(|time| RawValue::Number(time.seconds())),
            (Target::Primitive(primitive), None) if self.count != Count::One => {
                let at = |index| place.at + index * primitive.size();
                let numbers = (0..place.count).map(|index| body.number(primitive, at(index)));
                numbers.collect::<Option<_>>().map(RawValue::Vector)
            }
            (Target::Primitive(primitive), _) => {
                let at = self.element(primitive, place, element)?;
                self.number(body, at).map(RawValue::Number)
            }
            _ => None,
        }
    }

    /// The number at a place.
    fn number(&self, body: Body<'_>, at: usize) -> Option<f64> {
        match self.target {
            Target::Primitive(primitive) => body.number(primitive, at),
            Target::Time => body.time(at).map(Time::seconds),
            Target::Text | Target::Message => None,
        }
    }

    fn element(&self, primitive: Primitive, list: Place, element: Option<usize>) -> Option<usize> {
        let Some(index) = element else { return Some(list.at) };
        (index < list.count && self.count != Count::One).then(|| list.at + index * primitive.size())
    }

    /// The field as a stamp: a point in time, or a number of steps. `None` as in [`Plan::value`], and for zero, which means an
    /// unstamped message.
    #[must_use]
    pub fn stamp(&self, body: Body<'_>, step: Span) -> Option<Time> {
        let place = self.locate(body)?;
        let stamp = match self.target {
            Target::Time => body.time(place.at)?,
            Target::Primitive(primitive) => {
                Time::from_seconds(body.number(primitive, place.at)? * step.seconds())
            }
            Target::Text | Target::Message => return None,
        };
        (stamp.0 != 0).then_some(stamp)
    }

    /// The field as text; `None` when the message is too short, or the field is no text.
    #[must_use]
    pub fn text(&self, body: Body<'_>) -> Option<String> {
        let mut at = self.locate(body)?.at;
        (self.target == Target::Text && self.count == Count::One).then(|| self.entry(body, &mut at)).flatten()
    }

    /// Whether the field has the wanted text: `Some(None)` for a single value, the first matching element of a list. Times and
    /// messages never match.
    #[must_use]
    pub fn find(&self, body: Body<'_>, asked: &str) -> Option<Option<usize>> {
        let place = self.locate(body)?;
        let mut entries = (0..place.count).scan(place.at, |at, _| self.entry(body, at));
        let index = entries.position(|entry| is_text(&entry, asked))?;
        Some((self.count != Count::One).then_some(index))
    }

    /// The element of a list at a position, as text; moves the position behind it.
    fn entry(&self, body: Body<'_>, at: &mut usize) -> Option<String> {
        match self.target {
            Target::Text => {
                let (found, end) = body.text(*at)?;
                *at = end;
                Some(String::from_utf8_lossy(found).into_owned())
            }
            Target::Primitive(primitive) => {
                let number = body.number(primitive, *at)?;
                *at += primitive.size();
                Some(number.to_string())
            }
            Target::Time | Target::Message => None,
        }
    }
}

/// The list element that conditions (a field, and its wanted text) select, if any. `None`: a condition is not met.
#[must_use]
pub fn chosen(conditions: &[(Plan, String)], body: Body<'_>) -> Option<Option<usize>> {
    let mut chosen = None;
    for (plan, asked) in conditions {
        chosen = plan.find(body, asked)?.or(chosen);
    }
    Some(chosen)
}
