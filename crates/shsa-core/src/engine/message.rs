//! What goes into the engine and what comes out of it.

use super::snapshot::Snapshot;
use crate::assurance::Admitted;
use crate::computation::Task;
use crate::interval::Interval;
use crate::knowledge::{CauseId, NeedId, RelationId, SignalId, VariableId};
use crate::monitor::Symptom;
use crate::observation::Observation;
use crate::order::Order;
use crate::reason::{Reasons, ServedBy};
use crate::time::{Time, Validity};
use alloc::boxed::Box;
use alloc::vec::Vec;

/// Everything that goes in.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// A bridge or a recording delivers a value.
    Observation(Observation),
    /// Time has passed: silence is noticed by this.
    Tick(Time),
    /// An operator orders something.
    Order {
        /// When.
        time: Time,
        /// What.
        order: Order,
    },
    /// A run goes on from what was known before a restart.
    Restore {
        /// When.
        time: Time,
        /// What was known.
        snapshot: Box<Snapshot>,
    },
    /// Who computes the source of a need for the engine says something.
    Report {
        /// When.
        time: Time,
        /// The need.
        need: NeedId,
        /// What.
        report: Report,
    },
}

/// What somebody says who computes the source of a need for the engine.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// It computes this source from now on, which is still the present one. Tasks come by [`Output::Task`].
    Ready {
        /// The number of the source, as [`Engine::delegation`](super::Engine::delegation) gives it.
        era: u64,
    },
    /// It has done a task. Late ones are left unread.
    Answer {
        /// The number of the task.
        number: u64,
        /// The result; `None` when there is no value. The engine judges it like a value that it has computed itself.
        result: Option<(PublishedValue, Validity)>,
    },
    /// The process has ended: from now on the engine computes the source itself, beginning with the newest open task.
    Gone,
}

impl Input {
    /// When it comes in: of an observation, its reception.
    #[must_use]
    pub fn time(&self) -> Time {
        match self {
            Input::Observation(observation) => observation.received,
            Input::Tick(time)
            | Input::Order { time, .. }
            | Input::Restore { time, .. }
            | Input::Report { time, .. } => *time,
        }
    }
}

/// Everything that comes out.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
    /// A decision, with its reason.
    Event(Event),
    /// A value of a need, to be published under the need's name.
    Publication(Publication),
    /// Something to compute for a need whose source somebody else computes, who [reports](Input::Report).
    Task {
        /// The need.
        need: NeedId,
        /// Ascending for each need.
        number: u64,
        /// What.
        task: Task,
    },
    /// A new knowledge base has taken over at this moment: ids in what comes after this are its ids.
    Reloaded(Time),
}

/// What has been decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EventKind {
    /// A signal may be faulty; others may be to blame instead.
    Suspected,
    /// A signal is faulty, and no other explains the evidence as well.
    Failed,
    /// A signal says nothing any more.
    Silent,
    /// A need is served from another source than before, because the source was lost.
    Substituted,
    /// A signal is trusted again, or a need has gone back to its source.
    Restored,
    /// No trusted source can serve a need.
    Unhealable,
    /// The demands of a need, or a contract, forbid a source that would serve it. An order cannot be obeyed, or not any more. What
    /// was known before a restart is about something that the model does not have. An operator has overridden a contract for a
    /// time, or that time is over.
    Refused,
}

impl EventKind {
    /// Every kind.
    pub const ALL: [EventKind; 7] = [
        EventKind::Suspected,
        EventKind::Failed,
        EventKind::Silent,
        EventKind::Substituted,
        EventKind::Restored,
        EventKind::Unhealable,
        EventKind::Refused,
    ];

    /// What it is called in files and on screens.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            EventKind::Suspected => "suspected",
            EventKind::Failed => "failed",
            EventKind::Silent => "silent",
            EventKind::Substituted => "substituted",
            EventKind::Restored => "restored",
            EventKind::Unhealable => "unhealable",
            EventKind::Refused => "refused",
        }
    }
}

/// A decision, with its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When it was decided.
    pub time: Time,
    /// What was decided.
    pub kind: EventKind,
    /// The signal that it is about.
    pub signal: Option<SignalId>,
    /// The variable, or the need's variable, that it is about.
    pub variable: Option<VariableId>,
    /// The need that it is about: a variable may have several.
    pub need: Option<NeedId>,
    /// How the signal misbehaves, where the event accuses one.
    pub symptom: Option<Symptom>,
    /// The relation that it is about, where it accuses or clears one: it no longer holds, or holds again.
    pub relation: Option<RelationId>,
    /// What the signal shares with others, where that is blamed.
    pub cause: Option<CauseId>,
    /// How probable it is that what the event accuses is faulty, where that could be computed.
    pub probability: Option<f64>,
    /// Which values disagreed, which alternatives there were, which limit was reached.
    pub because: Reasons,
    /// What serves the need now.
    pub substitution: Option<ServedBy>,
}

impl Event {
    /// About a variable; the rest is empty.
    #[must_use]
    pub fn new(time: Time, kind: EventKind, variable: Option<VariableId>, because: Reasons) -> Event {
        Event {
            time,
            kind,
            signal: None,
            variable,
            need: None,
            symptom: None,
            relation: None,
            cause: None,
            probability: None,
            because,
            substitution: None,
        }
    }
}

/// Where a published value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// From the need's preferred source.
    Good,
    /// From a substitute.
    Substitute,
    /// Nothing that serves the need is trusted: the value is what enough of the candidates hold possible, or the last that was
    /// trusted. Its bounds hold the truth; its middle means nothing.
    Uncertain,
}

impl Quality {
    /// Every quality, the best first.
    pub const ALL: [Quality; 3] = [Quality::Good, Quality::Substitute, Quality::Uncertain];

    /// What it is called in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Quality::Good => "good",
            Quality::Substitute => "substitute",
            Quality::Uncertain => "uncertain",
        }
    }
}

/// A value of a need.
#[derive(Clone, Debug, PartialEq)]
pub struct Publication {
    /// The need that it serves.
    pub need: NeedId,
    /// When it was computed.
    pub time: Time,
    /// When the value was true.
    pub validity: Validity,
    /// The value in SI; one interval for a scalar variable, one an element for a vector.
    pub value: PublishedValue,
    /// Where it comes from.
    pub quality: Quality,
    /// On which ground contracts let it go out, and at which level.
    pub admitted: Admitted,
    /// Whether somebody else than the engine has computed it.
    pub delegated: bool,
}

/// The shape of a published value.
#[derive(Clone, Debug, PartialEq)]
pub enum PublishedValue {
    /// One number within an interval.
    Scalar(Interval),
    /// A list of them.
    Vector(Vec<Interval>),
}
