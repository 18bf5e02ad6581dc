//! The outlet of a need: publishes its values with their provenance.

mod past;
mod status;

use super::message_template::{MessageTemplate, raw};
use super::ownership::Ability;
use super::undelivered::Refusal;
use crate::error::RuntimeError;
use past::Past;
use shsa_bridge::payload::Writer;
use shsa_bridge::{Admission, Bridge, BridgeError, Clock, Outgoing, Payload, Provenance, Quality};
use shsa_core::assurance::{Admitted, Ground};
use shsa_core::engine::{self, EventKind, Publication, PublishedValue};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalId};
use shsa_core::reason::ServedBy;
use shsa_core::statement::Scales;
use shsa_core::time::{Span, Time};
use shsa_core::unit::Unit;
use shsa_format::wiring::Form;
use shsa_format::words;
use std::sync::Arc;

/// The form of the messages.
#[derive(Clone, Debug)]
enum Shape {
    /// The middleware encodes the value itself.
    Value,
    Envelope(Box<Writer>),
    Like(Box<MessageTemplate>),
}

/// The outlet of one need.
#[derive(Clone, Debug)]
pub(super) struct Outlet {
    topic: String,
    variable: String,
    /// The name of the need: its variable, or if the variable has several needs, the published name.
    key: String,
    unit: Option<Unit>,
    max_age: Span,
    /// The need is settled after sound values for this time without a break.
    probation: Span,
    provenance: Provenance,
    /// The admission of the provenance in words.
    admitted: Admitted,
    /// What has given the last value, and where it was computed: the source of the provenance in words.
    given_by: Option<Arc<ServedBy>>,
    place: &'static str,
    shape: Shape,
    /// Whether the need has a source.
    served: bool,
    /// The time of the last value, whether or not this instance sent it.
    known: Option<Time>,
    /// The beginning of the present stretch of sound values, and whether a stretch has ever lasted for the probation.
    sound_since: Option<Time>,
    is_settled: bool,
    /// The time of the last published value.
    last: Option<Time>,
    /// Why the last value could not be written or sent, or was refused.
    unwritten: Option<String>,
    refusal: Refusal,
    /// The latest value of a scalar, whoever has sent it, SI.
    value: Option<Interval>,
    /// The elements of the latest vector, whoever has sent it, SI.
    elements: Vec<Interval>,
    /// The last minutes of a scalar.
    past: Past,
}

impl Outlet {
    /// `own` is the signal that serves the need in the fault-free state.
    ///
    /// # Errors
    /// When the signal's messages cannot be copied.
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        need: NeedId,
        form: Form,
        own: Option<SignalId>,
    ) -> Result<Outlet, RuntimeError> {
        let key = knowledge.need_name(need).to_owned();
        let need = &knowledge.needs()[need];
        let variable = &knowledge.variables()[need.variable];
        let shape = match (form, own) {
            (Form::Plain, _) => Shape::Value,
            (Form::Json, _) => Shape::Envelope(Box::new(Writer::envelope())),
            (Form::Like, Some(own)) => Shape::Like(Box::new(MessageTemplate::new(knowledge, own)?)),
            (Form::Like, None) => {
                let name = &variable.name;
                let why = format!(
                    "the form `like` of {name}: no signal carries it, so there is nothing to be like"
                );
                return Err(RuntimeError::Unfit(why));
            }
        };
        Ok(Outlet {
            topic: need.signal.clone(),
            variable: variable.name.clone(),
            key,
            unit: variable.unit.clone(),
            max_age: need.max_age,
            probation: need.switching.probation,
            provenance: Provenance::new(Quality::Bad, ""),
            admitted: Admitted::default(),
            given_by: None,
            place: "",
            shape,
            served: true,
            known: None,
            sound_since: None,
            is_settled: false,
            last: None,
            unwritten: None,
            refusal: Refusal::default(),
            value: None,
            elements: Vec::new(),
            past: Past::default(),
        })
    }

    /// The outlet with the state of a previous outlet of the same name.
    pub(super) fn succeeding(&self, before: &Outlet) -> Outlet {
        Outlet {
            provenance: before.provenance.clone(),
            admitted: before.admitted,
            given_by: before.given_by.clone(),
            place: before.place,
            served: before.served,
            known: before.known,
            sound_since: before.sound_since,
            is_settled: before.is_settled,
            last: before.last,
            refusal: before.refusal,
            value: before.value,
            elements: before.elements.clone(),
            past: before.past.clone(),
            ..self.clone()
        }
    }

    pub(super) fn topic(&self) -> &str {
        &self.topic
    }

    /// The name of the need: its variable, or if the variable has several needs, the published name.
    pub(super) fn key(&self) -> &str {
        &self.key
    }

    /// Whether the source of the need is known.
    pub(super) fn has_source(&self) -> bool {
        !self.provenance.source.is_empty()
    }

    /// Takes in a decision about the need, and its present source.
    pub(super) fn follow(&mut self, kind: EventKind, source: Option<&ServedBy>) {
        self.served = kind != EventKind::Unhealable;
        self.provenance.source = source.map(words::served_by).unwrap_or_default();
        (self.given_by, self.place) = (None, "");
    }

    /// Sets what has given the next value, and where it was computed: the source's text ends with that.
    pub(super) fn credit(&mut self, given_by: &Arc<ServedBy>, place: &'static str) {
        let is_same = self.given_by.as_ref().is_some_and(|known| Arc::ptr_eq(known, given_by));
        if !is_same || self.place != place {
            self.served |= !self.has_source();
            self.provenance.source = words::served_by(given_by);
            self.provenance.source.push_str(place);
            (self.given_by, self.place) = (Some(given_by.clone()), place);
        }
    }

    /// Takes in a value of this quality, whether or not this instance sends it.
    pub(super) fn note(&mut self, publication: &Publication, quality: Quality) {
        let now = publication.time;
        let was_sound = self.is_sound() && self.is_able(now);
        if !was_sound {
            self.sound_since = None;
        }
        self.provenance.quality = quality;
        self.known = Some(now);
        self.value = match &publication.value {
            PublishedValue::Scalar(value) => {
                self.past.note(*value, &publication.source, self.max_age, now);
                Some(*value)
            }
            PublishedValue::Vector(_) => None,
        };
        if !self.is_settled && self.is_sound() && self.is_able(now) {
            let since = *self.sound_since.get_or_insert(now);
            self.is_settled = now - since >= self.probation;
        }
    }

    /// The value that goes out next is admitted by contracts on this ground.
    pub(super) fn certify(&mut self, admitted: Admitted, scales: &Scales) {
        if self.admitted != admitted {
            let admission = || Admission {
                ground: admitted.ground,
                level: admitted.level.map(|level| scales.written(level)),
                rank: admitted.level.map_or(0, |level| level.rank + 1),
            };
            self.provenance.admission = (admitted.ground != Ground::Undemanded).then(admission);
            self.admitted = admitted;
        }
    }

    /// How far the need can be served. After sound values for the probation it is known whether the sources agree. An instance
    /// that has just been started does not know this yet.
    pub(super) fn ability(&self, now: Time) -> Ability {
        match self.is_able(now) {
            true if self.is_settled && self.is_sound() => Ability::Settled,
            true => Ability::Able,
            false => Ability::Unable,
        }
    }

    /// The other side has refused a value that was sent: nobody has received it.
    pub(super) fn refuse(&mut self, error: &BridgeError, now: Time) {
        self.refusal.note(now);
        (self.last, self.unwritten) = (None, Some(error.to_string()));
    }

    /// Another instance, or the source itself, has published the last value.
    pub(super) fn leave(&mut self) {
        self.last = self.known;
    }

    /// A value of another instance has arrived under the name of the need.
    pub(super) fn hear(&mut self, now: Time) {
        self.last = Some(now);
    }

    /// This process was away: it must show again that its sources agree before it takes the need from another instance.
    pub(super) fn unsettle(&mut self) {
        (self.sound_since, self.is_settled) = (None, false);
    }

    /// Whether the last value is one that goes out: it is certain, and its form is known.
    pub(super) fn can_send(&self) -> bool {
        let is_written = !matches!(&self.shape, Shape::Like(template) if !template.is_known());
        self.is_sound() && is_written
    }

    /// Whether the present values are certain.
    fn is_sound(&self) -> bool {
        matches!(self.provenance.quality, Quality::Good | Quality::Substitute)
    }

    /// Whether there are fresh values to serve the need, sent or not.
    fn is_able(&self, now: Time) -> bool {
        self.served && !self.refusal.bars(now) && self.known.is_some_and(|known| self.is_fresh(known, now))
    }

    /// Until when quality and ability stay unchanged without a value or a decision.
    pub(super) fn lasts_until(&self, now: Time) -> Time {
        let fresh = |last: &Time| self.is_fresh(*last, now);
        let ends = self.last.into_iter().chain(self.known).filter(fresh).map(|last| last + self.max_age);
        ends.fold(self.refusal.lasts_until(self.max_age, now), Time::min)
    }

    /// The middle of a value's validity, by the wall clock.
    pub(super) fn stamp(publication: &Publication, clock: &Clock) -> Time {
        clock.by_wall(publication.validity.centre())
    }

    /// Sends a value. Sends nothing if the messages to copy are not known yet, or if the value cannot be written.
    ///
    /// # Errors
    /// Errors of the bus; the value is not published then.
    pub(super) fn send(
        &mut self,
        publication: &Publication,
        stamp: Time,
        bridge: &mut dyn Bridge,
    ) -> Result<(), BridgeError> {
        let payload = self.payload(publication, stamp, bridge);
        // The process may have been suspended since the value was computed, or may be while the value is sent.
        let is_fresh = self.is_fresh(publication.time, bridge.inbox().clock().now());
        let sent = match payload {
            Ok(Some(_)) if !is_fresh => return Ok(()),
            Ok(Some(payload)) => {
                let message = Outgoing::new(&self.topic, stamp, payload);
                let (provenance, expires) = (Some(&self.provenance), Some(publication.time + self.max_age));
                bridge.publish(Outgoing { provenance, expires, ..message })
            }
            Ok(None) => return Ok(()),
            Err(why) => {
                self.unwritten = Some(why);
                return Ok(());
            }
        };
        match &sent {
            Ok(()) => {
                self.last = Some(publication.time);
                self.unwritten.take_if(|_| !self.refusal.is_fresh(self.max_age, publication.time));
            }
            Err(error) => self.unwritten = Some(error.to_string()),
        }
        sent
    }

    fn payload(
        &mut self,
        publication: &Publication,
        stamp: Time,
        bridge: &mut dyn Bridge,
    ) -> Result<Option<Payload>, String> {
        let (topic, value, provenance) = (&self.topic, &publication.value, &self.provenance);
        let is_uncertain = publication.quality == engine::Quality::Uncertain;
        let has_bounds = matches!(value, PublishedValue::Scalar(_)) && bridge.carries_bounds();
        match &mut self.shape {
            Shape::Value if is_uncertain && has_bounds => {
                Ok(Some(Payload::Value(raw(value, self.unit.as_ref(), None))))
            }
            Shape::Value | Shape::Like(_) if is_uncertain => {
                Err("a value that is uncertain goes out only with its bounds, in the form `json`".to_owned())
            }
            Shape::Value => Ok(Some(Payload::Value(raw(value, self.unit.as_ref(), None)))),
            Shape::Envelope(writer) => {
                let written = writer.write(Some(&raw(value, self.unit.as_ref(), None)), stamp, provenance);
                Ok(written.map_err(|why| why.to_string())?.map(Payload::Bytes))
            }
            Shape::Like(template) if !template.is_known() => Ok(None),
            Shape::Like(template) => template.message(topic, value, stamp, provenance, bridge),
        }
    }

    /// The template of the messages, if the form is `like`.
    pub(super) fn template(&mut self) -> Option<&mut MessageTemplate> {
        match &mut self.shape {
            Shape::Like(template) => Some(template),
            Shape::Value | Shape::Envelope(_) => None,
        }
    }

    /// The source of the need and its quality.
    pub(super) fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Whether something other than this signal serves the need.
    pub(super) fn is_served_without(&self, signal: &str) -> bool {
        self.served && self.has_source() && self.provenance.source != signal
    }

    /// Whether a value of time `then` is not too old.
    pub(super) fn is_fresh(&self, then: Time, now: Time) -> bool {
        now - then <= self.max_age
    }

    /// The present quality of the last published value.
    pub(super) fn quality(&self, now: Time) -> Quality {
        match self.last.filter(|_| !self.refusal.is_fresh(self.max_age, now)) {
            Some(last) if self.is_fresh(last, now) && self.served => self.provenance.quality,
            Some(last) if self.is_fresh(last, now) => Quality::LastUsable,
            _ => Quality::Bad,
        }
    }

    /// On which ground contracts admit what serves it now; `None` while nothing does.
    pub(super) fn admitted(&self, now: Time) -> Option<Admitted> {
        let is_served = !matches!(self.quality(now), Quality::LastUsable | Quality::Bad);
        is_served.then_some(self.admitted)
    }

    /// The latest value of a scalar, SI.
    pub(super) fn value(&self) -> Option<Interval> {
        self.value
    }

    /// Keeps a vector that was served: it is moved here, not copied.
    pub(super) fn keep(&mut self, value: PublishedValue) {
        if let PublishedValue::Vector(elements) = value {
            self.elements = elements;
        }
    }

    /// The elements of the latest vector, SI; none for a scalar.
    pub(super) fn elements(&self) -> &[Interval] {
        &self.elements
    }

    /// When the latest value went out.
    pub(super) fn last(&self) -> Option<Time> {
        self.last
    }

    /// What it is a value of, and the unit.
    pub(super) fn variable(&self) -> (&str, Option<&Unit>) {
        (&self.variable, self.unit.as_ref())
    }

    /// How old a value may grow.
    pub(super) fn max_age(&self) -> Span {
        self.max_age
    }
}
