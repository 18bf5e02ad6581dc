//! The inputs and outputs of the engine.

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
use alloc::sync::Arc;
use alloc::vec::Vec;

/// An input of the engine.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// A bridge or a recording delivers a value.
    Observation(Observation),
    /// Time has passed: a silence is noticed at a tick.
    Tick(Time),
    /// An operator orders something.
    Order {
        /// When the order comes in.
        time: Time,
        /// The order.
        order: Order,
    },
    /// A run goes on from the state before a restart.
    Restore {
        /// When the run goes on.
        time: Time,
        /// The state before the restart.
        snapshot: Box<Snapshot>,
    },
    /// A report of the process that computes the source of a need for the engine.
    Report {
        /// When the report comes in.
        time: Time,
        /// The need.
        need: NeedId,
        /// The report.
        report: Report,
    },
}

/// A report of a process that computes the source of a need for the engine.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// The process computes the present source from now on. Tasks come by [`Output::Task`].
    Ready {
        /// The number of the source, as [`Engine::delegation`](super::Engine::delegation) gives it.
        era: u64,
    },
    /// The result of a task. Late results are ignored.
    Answer {
        /// The number of the task.
        number: u64,
        /// The result; `None` when there is no value. The engine judges the result like a value of its own.
        result: Option<(PublishedValue, Validity)>,
    },
    /// The process has ended: from now on the engine computes the source itself, beginning with the newest open task.
    Gone,
}

impl Input {
    /// When the input comes in: of an observation, the time of its reception.
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

/// An output of the engine.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
    /// A decision, with its reason.
    Event(Event),
    /// A value of a need, to be published under the need's name.
    Publication(Publication),
    /// A task for the process that computes the source of a need; its results come as [reports](Input::Report).
    Task {
        /// The need.
        need: NeedId,
        /// Ascending for each need.
        number: u64,
        /// The task.
        task: Task,
    },
    /// A new knowledge base has taken over at this moment: ids in what comes after this are its ids.
    Reloaded(Time),
}

/// The kinds of decisions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EventKind {
    /// A signal may be faulty; others may be to blame instead.
    Suspected,
    /// A signal is faulty, and no other explains the evidence as well.
    Failed,
    /// A signal gives no usable value any more.
    Silent,
    /// A need is served from another source than before, because the source was lost.
    Substituted,
    /// A signal is trusted again, or a need has gone back to its source.
    Restored,
    /// A learned variable drifts towards an end of its range.
    Ageing,
    /// No trusted source can serve a need.
    Unhealable,
    /// A refusal: the demands of a need, or a contract, forbid a source that would serve it; an order cannot be obeyed, or not
    /// any more; remembered state is about an element that the model does not have; or an operator has overridden a contract for
    /// a time, or that time is over.
    Refused,
    /// A single reading of a signal is wrong; the signal is trusted as before.
    Outlier,
    /// A counter has begun anew; it is trusted as before.
    Restarted,
}

/// How serious a decision is for whoever watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// All is well again, or was all the time.
    Info,
    /// Something may be lost, or the system gets by without it.
    Warning,
    /// Something is lost.
    Error,
}

impl EventKind {
    /// How serious the kind is: what every screen, log and report goes by.
    #[must_use]
    pub fn severity(self) -> Severity {
        match self {
            EventKind::Restored | EventKind::Outlier | EventKind::Restarted => Severity::Info,
            EventKind::Suspected | EventKind::Substituted | EventKind::Refused | EventKind::Ageing => {
                Severity::Warning
            }
            EventKind::Failed | EventKind::Silent | EventKind::Unhealable => Severity::Error,
        }
    }

    /// Whether a signal is not trusted from now on.
    #[must_use]
    pub fn accuses(self) -> bool {
        matches!(self, EventKind::Suspected | EventKind::Failed | EventKind::Silent)
    }

    /// Whether trust, a source or the state of a need changes.
    #[must_use]
    pub fn is_decision(self) -> bool {
        !matches!(self, EventKind::Outlier | EventKind::Restarted)
    }

    /// The kind of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<EventKind> {
        EventKind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Every kind.
    pub const ALL: [EventKind; 10] = [
        EventKind::Suspected,
        EventKind::Failed,
        EventKind::Silent,
        EventKind::Substituted,
        EventKind::Restored,
        EventKind::Unhealable,
        EventKind::Refused,
        EventKind::Ageing,
        EventKind::Outlier,
        EventKind::Restarted,
    ];

    /// The kind's name in files and on screens.
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
            EventKind::Ageing => "ageing",
            EventKind::Outlier => "outlier",
            EventKind::Restarted => "restarted",
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
    /// The signal that the event is about.
    pub signal: Option<SignalId>,
    /// The variable, or the need's variable, that the event is about.
    pub variable: Option<VariableId>,
    /// The need that the event is about: a variable may have several.
    pub need: Option<NeedId>,
    /// How the signal misbehaves, where the event accuses one.
    pub symptom: Option<Symptom>,
    /// The relation that the event accuses (it no longer holds) or clears (it holds again).
    pub relation: Option<RelationId>,
    /// The common cause that the event blames.
    pub cause: Option<CauseId>,
    /// How probable the fault of the accused component is, where that could be computed.
    pub probability: Option<f64>,
    /// The evidence: values that disagreed, alternatives, limits that were reached.
    pub because: Reasons,
    /// What serves the need now.
    pub substitution: Option<ServedBy>,
}

impl Event {
    /// An event about a variable; the other fields are empty.
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
    /// From no trusted source: the value is what enough of the candidates hold possible, or the last trusted value. Its bounds
    /// hold the truth; its middle means nothing.
    Uncertain,
}

impl Quality {
    /// Every quality, the best first.
    pub const ALL: [Quality; 3] = [Quality::Good, Quality::Substitute, Quality::Uncertain];

    /// The quality's name in files.
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
    /// What has given the value. The values of one source share it.
    pub source: Arc<ServedBy>,
    /// The ground of the admission by contracts, and the level.
    pub admitted: Admitted,
    /// Whether another process has computed the value.
    pub delegated: bool,
}

/// The shape of a published value.
#[derive(Clone, Debug, PartialEq)]
pub enum PublishedValue {
    /// One number within an interval.
    Scalar(Interval),
    /// One interval for each element.
    Vector(Vec<Interval>),
}
