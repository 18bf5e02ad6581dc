//! What the structs of outputs look like, and how they are filled.

use crate::model::{NO_ID, index};
use crate::words::{address, c_text};
use shsa_core::engine;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, NeedId};
use shsa_core::unit::Unit;
use shsa_format::words;
use std::ffi::{CString, c_char};
use std::ptr;

/// The kinds of outputs.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputKind {
    /// A value of a need: see `publication`.
    Publication = 0,
    /// A decision: see `event`.
    Event = 1,
}

/// Where a published value comes from.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// From the need's preferred source.
    Good = 0,
    /// From a substitute.
    Substitute = 1,
    /// From no trusted source: the bounds hold the truth, their middle means nothing.
    Uncertain = 2,
}

/// The kinds of decisions.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// A signal may be faulty; others may be to blame instead.
    Suspected = 0,
    /// A signal is faulty, and no other explains the evidence as well.
    Failed = 1,
    /// A signal gives no usable value any more.
    Silent = 2,
    /// A need is served from another source than before, because the source was lost.
    Substituted = 3,
    /// A signal is trusted again, or a need has gone back to its source.
    Restored = 4,
    /// No trusted source can serve a need.
    Unhealable = 5,
    /// The demands of a need, or a contract, forbid a source that would serve it.
    Refused = 6,
    /// A learned variable drifts towards an end of its range.
    Ageing = 7,
    /// A single reading of a signal is wrong; the signal is trusted as before.
    Outlier = 8,
    /// A counter has begun anew; it is trusted as before.
    Restarted = 9,
}

/// The bounds between which a number lies.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The lower bound.
    pub lo: f64,
    /// The upper bound.
    pub hi: f64,
}

/// A value of a need.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Publication {
    /// The need.
    pub need: u32,
    /// Where the value comes from.
    pub quality: Quality,
    /// When the value was true, in ns: from this moment
    pub from_ns: i64,
    /// to this one.
    pub to_ns: i64,
    /// The value in the unit of the need's variable: one range for a number, one for each element of a vector. Belongs to the engine,
    /// and is valid until the next call with it.
    pub values: *const Range,
    /// The number of ranges.
    pub length: usize,
}

/// A decision. What does not apply is `SHSA_NO_ID`, null or not-a-number. The texts belong to the engine, and are valid until the next
/// call with it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Event {
    /// What was decided.
    pub kind: EventKind,
    /// The signal that the decision is about.
    pub signal: u32,
    /// The variable that the decision is about.
    pub variable: u32,
    /// The need that the decision is about.
    pub need: u32,
    /// The relation that is accused or cleared.
    pub relation: u32,
    /// How probable the accusation is, from 0 to 1.
    pub probability: f64,
    /// How the signal misbehaves: `bias`, `stuck`, ...
    pub symptom: *const c_char,
    /// The common cause that is blamed.
    pub cause: *const c_char,
    /// The evidence, as a sentence.
    pub because: *const c_char,
    /// What serves the need now.
    pub substitution: *const c_char,
}

/// An output of the engine.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// Which of the two parts is filled.
    pub kind: OutputKind,
    /// When it was decided or computed, in ns.
    pub time_ns: i64,
    /// The published value.
    pub publication: Publication,
    /// The decision.
    pub event: Event,
}

/// What the pointers of the last output point to. The room for values stays: publishing allocates nothing.
#[derive(Debug, Default)]
pub(crate) struct Room {
    values: Vec<Range>,
    symptom: Option<CString>,
    cause: Option<CString>,
    because: Option<CString>,
    substitution: Option<CString>,
}

impl Room {
    /// Takes in a published value.
    pub(crate) fn publication(&mut self, known: &KnowledgeBase, it: &engine::Publication) -> Output {
        let unit = unit(known, it.need);
        self.values.clear();
        match &it.value {
            engine::PublishedValue::Scalar(value) => self.values.push(range(unit, *value)),
            engine::PublishedValue::Vector(elements) => {
                self.values.extend(elements.iter().map(|value| range(unit, *value)));
            }
        }
        let publication = Publication {
            need: index(it.need),
            quality: quality(it.quality),
            from_ns: it.validity.from.0,
            to_ns: it.validity.to.0,
            values: self.values.as_ptr(),
            length: self.values.len(),
        };
        Output { kind: OutputKind::Publication, time_ns: it.time.0, publication, ..Output::default() }
    }

    /// Takes in a decision.
    pub(crate) fn event(&mut self, known: &KnowledgeBase, it: &engine::Event) -> Output {
        self.symptom = it.symptom.map(|symptom| c_text(symptom.name()));
        self.cause = it.cause.map(|cause| c_text(&known.causes()[cause].name));
        self.because = Some(c_text(&words::reasons(&it.because)));
        self.substitution = it.substitution.as_ref().map(|served_by| c_text(&words::served_by(served_by)));
        let event = Event {
            kind: kind(it.kind),
            signal: it.signal.map_or(NO_ID, index),
            variable: it.variable.map_or(NO_ID, index),
            need: it.need.map_or(NO_ID, index),
            relation: it.relation.map_or(NO_ID, index),
            probability: it.probability.unwrap_or(f64::NAN),
            symptom: address(self.symptom.as_ref()),
            cause: address(self.cause.as_ref()),
            because: address(self.because.as_ref()),
            substitution: address(self.substitution.as_ref()),
        };
        Output { kind: OutputKind::Event, time_ns: it.time.0, event, ..Output::default() }
    }
}

impl Default for Output {
    /// An output of which no part is filled.
    fn default() -> Output {
        let publication = Publication {
            need: NO_ID,
            quality: Quality::Uncertain,
            from_ns: 0,
            to_ns: 0,
            values: ptr::null(),
            length: 0,
        };
        let event = Event {
            kind: EventKind::Refused,
            signal: NO_ID,
            variable: NO_ID,
            need: NO_ID,
            relation: NO_ID,
            probability: f64::NAN,
            symptom: ptr::null(),
            cause: ptr::null(),
            because: ptr::null(),
            substitution: ptr::null(),
        };
        Output { kind: OutputKind::Event, time_ns: 0, publication, event }
    }
}

/// The unit in which a need is published; `None` for that of the SI.
fn unit(known: &KnowledgeBase, need: NeedId) -> Option<&Unit> {
    known.variables()[known.needs()[need].variable].unit.as_ref()
}

fn range(unit: Option<&Unit>, value: Interval) -> Range {
    let shown = |bound: f64| unit.map_or(bound, |unit| unit.from_si(bound));
    Range { lo: shown(value.lo()), hi: shown(value.hi()) }
}

fn quality(quality: engine::Quality) -> Quality {
    match quality {
        engine::Quality::Good => Quality::Good,
        engine::Quality::Substitute => Quality::Substitute,
        engine::Quality::Uncertain => Quality::Uncertain,
    }
}

fn kind(kind: engine::EventKind) -> EventKind {
    match kind {
        engine::EventKind::Suspected => EventKind::Suspected,
        engine::EventKind::Failed => EventKind::Failed,
        engine::EventKind::Silent => EventKind::Silent,
        engine::EventKind::Substituted => EventKind::Substituted,
        engine::EventKind::Restored => EventKind::Restored,
        engine::EventKind::Unhealable => EventKind::Unhealable,
        engine::EventKind::Refused => EventKind::Refused,
        engine::EventKind::Ageing => EventKind::Ageing,
        engine::EventKind::Outlier => EventKind::Outlier,
        engine::EventKind::Restarted => EventKind::Restarted,
    }
}
