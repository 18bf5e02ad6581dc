//! How a need is served: by a source, by candidates, or not at all. Each state carries its own data.

use super::episode::Episode;
use super::pace::Pace;
use super::reported::Reported;
use super::settings::Settings;
use super::turn::period_of;
use super::unsure::Unsure;
use super::{Better, earlier};
use crate::knowledge::{KnowledgeBase, SignalId, SignalSet};
use crate::monitor::rests_on;
use crate::observation::Observation;
use crate::reason::Reasons;
use crate::service::Service;
use crate::substitution::Way;
use crate::time::{Span, Time};

/// How the need is served.
#[derive(Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "one for each need, and its source is read with every observation"
)]
pub(super) enum State {
    /// Nothing serves the need.
    Unserved,
    /// A source serves the need.
    Serving(Serving),
    /// Nothing trusted can serve the need: values of the candidates go out as uncertain, where they are fit.
    Unsure(Unsure),
}

/// What confirms a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Backing {
    /// A comparison has agreed with each of its signals, or none can.
    Known,
    /// None has yet, and others may.
    Beside,
    /// None has, and nothing else is left, or has spoken since the start.
    Alone,
}

/// A source that serves the need.
#[derive(Debug)]
pub(super) struct Serving {
    pub(super) service: Service,
    pub(super) rests_on: SignalSet,
    /// Whether a value of it stands until the next one.
    stands: bool,
    /// How regularly it gives values.
    pub(super) pace: Pace,
    /// Since when the source has given only values that are too old or too wide.
    pub(super) unfit_since: Option<Time>,
    /// Whether another way has agreed with a value of the source.
    pub(super) is_confirmed: bool,
    /// What confirms the source.
    pub(super) backing: Backing,
    /// Why a better source exists, when one does.
    pub(super) better_by: Better,
    /// The stand-in for the source, while there is one.
    pub(super) episode: Option<Episode>,
    /// The candidates that serve while the source is contradicted without a stand-in and without a suspect.
    pub(super) doubt: Option<Unsure>,
    /// Why the source serves, to be reported with its first value.
    pub(super) unreported: Option<Reasons>,
}

impl Serving {
    fn new(knowledge: &KnowledgeBase, service: Service) -> Serving {
        Serving {
            rests_on: rests_on(knowledge, service.way()),
            stands: service.stands(knowledge),
            pace: Pace::of(period_of(knowledge, service.computation())),
            service,
            unfit_since: None,
            is_confirmed: false,
            backing: Backing::Beside,
            better_by: Better::Trusted,
            episode: None,
            doubt: None,
            unreported: None,
        }
    }
}

impl State {
    /// The source.
    pub(super) fn serving(&self) -> Option<&Serving> {
        match self {
            State::Serving(serving) => Some(serving),
            State::Unserved | State::Unsure(_) => None,
        }
    }

    pub(super) fn serving_mut(&mut self) -> Option<&mut Serving> {
        match self {
            State::Serving(serving) => Some(serving),
            State::Unserved | State::Unsure(_) => None,
        }
    }

    /// Whether the source has given a value that stands until the next one: nothing is late or too old then.
    pub(super) fn stands(&self) -> bool {
        self.serving().is_some_and(|serving| serving.stands && serving.pace.has_begun())
    }

    /// The way by which the source knows the variable.
    pub(super) fn way(&self) -> Option<&Way> {
        self.serving().map(|serving| serving.service.way())
    }

    /// The candidates; beside a source, where that is contradicted.
    pub(super) fn unsure(&self) -> Option<&Unsure> {
        match self {
            State::Unserved => None,
            State::Serving(serving) => serving.doubt.as_ref(),
            State::Unsure(unsure) => Some(unsure),
        }
    }

    pub(super) fn unsure_mut(&mut self) -> Option<&mut Unsure> {
        match self {
            State::Unserved => None,
            State::Serving(serving) => serving.doubt.as_mut(),
            State::Unsure(unsure) => Some(unsure),
        }
    }

    /// A source takes over, or the source is lost; then the candidates beside it go on.
    pub(super) fn take_over(&mut self, knowledge: &KnowledgeBase, service: Option<Service>) {
        *self = match service {
            Some(service) => State::Serving(Serving::new(knowledge, service)),
            None => self.take_unsure().map_or(State::Unserved, State::Unsure),
        };
    }

    /// Leaves the source, if there is one, and takes out the candidates: nothing serves the need afterwards.
    pub(super) fn take_unsure(&mut self) -> Option<Unsure> {
        match core::mem::replace(self, State::Unserved) {
            State::Unserved => None,
            State::Serving(serving) => serving.doubt,
            State::Unsure(unsure) => Some(unsure),
        }
    }

    /// Drops the candidates, as a trusted value goes out.
    #[inline]
    pub(super) fn end_unsure(&mut self) {
        match self {
            State::Unserved => {}
            State::Serving(serving) => {
                if serving.doubt.is_some() {
                    serving.doubt = None;
                }
            }
            State::Unsure(_) => *self = State::Unserved,
        }
    }

    /// Drops the candidates beside a source where one of them can no longer be right.
    pub(super) fn end_doubt_unless(&mut self, may_be_right: impl Fn(&Way) -> bool) {
        if let State::Serving(serving) = self {
            serving.doubt.take_if(|doubt| !doubt.ways().all(&may_be_right));
        }
    }

    /// The candidates serve from now on: beside the source while there is one.
    pub(super) fn go_on_unsure(&mut self, unsure: Unsure) {
        match self {
            State::Serving(serving) => serving.doubt = Some(unsure),
            State::Unserved | State::Unsure(_) => *self = State::Unsure(unsure),
        }
    }

    pub(super) fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation) {
        if let State::Serving(serving) = self {
            serving.service.observe(knowledge, observation);
        }
        if let Some(unsure) = self.unsure_mut() {
            unsure.observe(knowledge, observation);
        }
    }

    pub(super) fn begin_anew(&mut self, signal: SignalId) {
        if let State::Serving(serving) = self {
            serving.service.begin_anew(signal);
        }
        if let Some(unsure) = self.unsure_mut() {
            unsure.begin_anew(signal);
        }
    }

    /// From when on a stand-in shall serve, where the last value went out at `served`.
    pub(super) fn late_after(&self, served: Time, settings: &Settings) -> Time {
        match self {
            State::Serving(serving) => serving.pace.late_after(served, settings.max_age),
            State::Unserved | State::Unsure(_) => Pace::default().late_after(served, settings.max_age),
        }
    }

    /// When something is due without an input: the source is late, a better source is no longer held back (`held`), or the last
    /// trusted value is too old.
    pub(super) fn deadline(
        &self,
        settings: &Settings,
        reported: &Reported,
        served: Option<Time>,
        held: impl FnOnce() -> Option<Time>,
        now: Time,
    ) -> Option<Time> {
        let late =
            served.map(|served| self.late_after(served, settings) + Span(1)).filter(|late| *late > now);
        let own = match self {
            State::Serving(_) => held(),
            State::Unsure(unsure) if !reported.is_unserved() => {
                unsure.ends(settings.max_age).map(|ends| ends + Span(1))
            }
            State::Unserved | State::Unsure(_) => None,
        };
        earlier(late, own.filter(|due| *due > now))
    }
}
