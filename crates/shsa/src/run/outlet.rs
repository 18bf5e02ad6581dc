//! How a need goes out: its value under its name, and beside it where the value comes from.

use serde_json::{Value, json};
use shsa_bridge::payload::{self, SIZE_LIMIT, Writer};
use shsa_bridge::{Bridge, Clock, Outgoing, Payload, Provenance, Quality};
use shsa_core::engine::{EventKind, Publication, PublishedValue};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, NeedId};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_core::unit::Unit;

/// In which shape values go out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Form {
    /// The number alone, of an interval its middle; a list in JSON.
    Plain,
    /// One JSON object: value, lo, hi, stamp_ns, quality, status, source.
    Json,
}

/// One need on the bus.
#[derive(Clone, Debug)]
pub(super) struct Outlet {
    topic: String,
    variable: String,
    unit: Option<Unit>,
    max_age: Span,
    provenance: Provenance,
    /// What the provenance says at its end about where the value was computed.
    place: &'static str,
    /// `None`: the middleware writes the value itself.
    writer: Option<Writer>,
    /// Whether somebody serves it.
    served: bool,
    /// When the last value went out.
    last: Option<Time>,
}

impl Outlet {
    pub(super) fn new(knowledge: &KnowledgeBase, need: NeedId, form: Form) -> anyhow::Result<Outlet> {
        let writer = match form {
            Form::Plain => None,
            Form::Json => Some(Writer::new(payload::Form::Json, SIZE_LIMIT)?),
        };
        let need = &knowledge.needs()[need];
        let variable = &knowledge.variables()[need.variable];
        Ok(Outlet {
            topic: need.signal.clone(),
            variable: variable.name.clone(),
            unit: variable.unit.clone(),
            max_age: need.max_age,
            provenance: Provenance { quality: Quality::Bad, source: String::new() },
            place: "",
            writer,
            served: true,
            last: None,
        })
    }

    /// Goes on where another one of the same name was.
    pub(super) fn succeeding(&self, before: &Outlet) -> Outlet {
        Outlet {
            provenance: before.provenance.clone(),
            place: before.place,
            served: before.served,
            last: before.last,
            ..self.clone()
        }
    }

    /// The name under which it is published.
    pub(super) fn topic(&self) -> &str {
        &self.topic
    }

    /// The variable that is needed.
    pub(super) fn variable(&self) -> &str {
        &self.variable
    }

    /// Whether it is known what it is served from.
    pub(super) fn has_source(&self) -> bool {
        !self.provenance.source.is_empty()
    }

    /// Something was decided about the need, and this serves it now.
    pub(super) fn follow(&mut self, kind: EventKind, source: Option<String>) {
        self.served = kind != EventKind::Unhealable;
        self.provenance.source = source.unwrap_or_default();
        self.place = "";
    }

    /// The next value was computed there; said at the end of its source.
    pub(super) fn place(&mut self, place: &'static str) {
        if self.place != place {
            let source = &mut self.provenance.source;
            source.truncate(source.len().saturating_sub(self.place.len()));
            source.push_str(place);
            self.place = place;
        }
    }

    /// There is a value, whoever sends it. Whether the need is served better or worse by it than before.
    pub(super) fn note(&mut self, publication: &Publication, quality: Quality) -> bool {
        let before = self.quality(publication.time);
        self.provenance.quality = quality;
        self.last = Some(publication.time);
        self.quality(publication.time) != before
    }

    /// Until when its quality stays as it is if nothing comes and nothing is decided.
    pub(super) fn lasts_until(&self, now: Time) -> Time {
        let fresh = self.last.filter(|last| now - *last <= self.max_age);
        fresh.map_or(Time::MAX, |last| last + self.max_age)
    }

    /// Sends a value.
    ///
    /// # Errors
    /// Those of the bus.
    pub(super) fn send(
        &mut self,
        publication: &Publication,
        clock: &Clock,
        bridge: &mut dyn Bridge,
    ) -> anyhow::Result<()> {
        let stamp = clock.by_wall(Time(publication.validity.from.0.midpoint(publication.validity.to.0)));
        let value = self.raw(&publication.value);
        let payload = match &mut self.writer {
            None => Payload::Value(value),
            Some(writer) => match writer.write(Some(&value), stamp, &self.provenance)? {
                Some(bytes) => Payload::Bytes(bytes),
                None => return Ok(()),
            },
        };
        let message =
            Outgoing { provenance: Some(&self.provenance), ..Outgoing::new(&self.topic, stamp, payload) };
        Ok(bridge.publish(message)?)
    }

    /// A value in the unit of the variable.
    fn raw(&self, value: &PublishedValue) -> RawValue {
        let shown = |value: f64| self.unit.as_ref().map_or(value, |unit| unit.from_si(value));
        match value {
            PublishedValue::Scalar(value) => {
                RawValue::Interval { lo: shown(value.lo()), hi: shown(value.hi()) }
            }
            PublishedValue::Vector(elements) => RawValue::Vector(
                elements.iter().map(|element: &Interval| shown(element.midpoint())).collect(),
            ),
        }
    }

    /// How far what was published last can be trusted now.
    pub(super) fn quality(&self, now: Time) -> Quality {
        match self.last {
            Some(last) if now - last <= self.max_age && self.served => self.provenance.quality,
            Some(last) if now - last <= self.max_age => Quality::LastUsable,
            _ => Quality::Bad,
        }
    }

    /// The words of the status topic.
    pub(super) fn status(&self, now: Time, clock: &Clock) -> Value {
        let quality = self.quality(now);
        json!({
            "variable": self.variable,
            "signal": self.topic,
            "quality": quality.name(),
            "status": quality.code(),
            "source": (quality != Quality::Bad).then_some(&self.provenance.source),
            "last_ns": self.last.map(|last| clock.by_wall(last).0),
        })
    }
}
