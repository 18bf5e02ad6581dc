//! The standing of one component: sound, or accused, with the data of that state.

use super::{ConflictPair, Trust, Verdict};
use crate::interval::Interval;
use crate::knowledge::CauseId;
use crate::monitor::Symptom;
use crate::reason::Reasons;
use crate::time::Time;
use alloc::boxed::Box;
use alloc::collections::BTreeSet;
use alloc::string::String;

/// How many comparisons that accuse one component are stored at most.
pub const MOST_CONFLICTS: usize = 64;

/// How far one component is relied on, and why.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Standing {
    pub(super) state: State,
    /// Whether an operator has forbidden the component: nothing may rest on it.
    pub(super) is_forbidden: bool,
    /// Since when the signal gives values again after a silence, until the end of its probation.
    pub(super) returning: Option<Return>,
    /// How often in a row the component was accused again soon after it was trusted again; each time doubles its probation.
    pub(super) relapses: u32,
    /// When the component was last trusted again.
    pub(super) cleared: Option<Time>,
}

/// What the evidence says of a component.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum State {
    /// No evidence stands against the component.
    Sound {
        /// Since when the component, once accused, is sound again.
        since: Option<Time>,
        /// Whether the operator vouches for the component.
        is_vouched_for: bool,
    },
    Accused(Box<Accused>),
}

impl Default for State {
    fn default() -> State {
        State::Sound { since: None, is_vouched_for: false }
    }
}

/// A signal that gives values again after a silence. A signal that was silent before its first value needs no probation, as it has
/// never failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Return {
    pub(super) since: Time,
    pub(super) is_first: bool,
}

/// A component that is suspect or failed.
#[derive(Clone, Debug, PartialEq)]
pub struct Accused {
    /// Suspect or failed.
    pub verdict: Verdict,
    /// What has accused the component.
    pub by: By,
    /// Whether the component was the only one accused: then it explains disagreements as a failed component does.
    pub is_alone: bool,
    /// When the component was accused; `None` after a restart.
    pub since: Option<Time>,
    /// Where it may be that the sensor only has nothing to show, since when at the earliest.
    pub absent_since: Option<Time>,
    /// The common cause that is blamed.
    pub cause: Option<CauseId>,
    /// What the evidence has said since.
    pub support: Support,
    /// The value with which the signal was accused, SI. While the signal repeats it, an agreement means that the plant has come
    /// back to the value, and the signal is not cleared.
    pub latest_value: Option<Interval>,
    /// The comparisons that have disagreed with the component, by their two ways: their agreement clears it.
    pub conflicts: BTreeSet<ConflictPair>,
    /// The accusation as an event has reported it.
    pub reported: Option<Accusation>,
    /// Whether the signal was accused before a restart and has given no value since: its first one is news to the judge.
    pub awaits_value: bool,
    /// Whether comparisons with it are evidence about others again, while it is not trusted yet: it agrees again with one that has
    /// accused it, and contradicts none that is trusted.
    pub bears_witness: bool,
}

/// What has accused a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// Comparisons with others.
    Comparisons,
    /// The readings of the signal itself: no comparison is needed to accuse it.
    Readings {
        /// Whether comparisons have contradicted the signal, too, while its readings were plausible: only they can clear it.
        contradicted: bool,
    },
}

/// What the evidence has said of an accused component since it was accused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// Evidence accuses the component.
    Against,
    /// No evidence has accused or supported the component since this time.
    Silent(Time),
    /// All evidence has supported the component since the first time, none has accused it since the second.
    Supported(Time, Time),
    /// For its probation no evidence has accused the component: it may serve, as uncertain, where nothing else is left. Since the
    /// given time, if any, all evidence supports it.
    Unproven(Option<Time>),
}

/// An accusation that stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Accusation {
    /// When the accusation was reported.
    pub since: Time,
    /// How the signal misbehaves, as far as that is known.
    pub symptom: Option<Symptom>,
    /// The common cause that is blamed, by name.
    pub cause: Option<String>,
    /// How probable the accusation is, where that could be computed.
    pub probability: Option<f64>,
    /// The evidence.
    pub because: Reasons,
}

/// The stored standing of a signal or relation, with what the evidence alone would not give again after a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// Suspect or failed; `None` for a component that is trusted again and kept for its relapses.
    pub verdict: Option<Verdict>,
    /// Whether the component was the only one accused: then it explains disagreements as a failed component does.
    pub alone: bool,
    /// Whether the readings of the signal itself have shown the fault: no comparison is needed to accuse it.
    pub failed_by_detector: bool,
    /// Whether only comparisons can clear the signal: they have contradicted it while its readings were plausible.
    pub contradicted: bool,
    /// Whether the component may serve, uncertain, where nothing else is left: for its probation no evidence has accused or
    /// supported it.
    pub unproven: bool,
    /// When the component was last trusted again.
    pub cleared: Option<Time>,
    /// How often in a row the component was accused again soon after it was trusted again; each time doubles its probation.
    pub relapses: u32,
    /// The value with which the signal was accused, SI. While the signal repeats it, an agreement means that the plant has come
    /// back to the value, and the signal is not cleared.
    pub latest_value: Option<Interval>,
}

impl Support {
    /// Since when all evidence has supported the component.
    #[must_use]
    pub fn clean_since(self) -> Option<Time> {
        match self {
            Support::Supported(since, _) => Some(since),
            Support::Unproven(since) => since,
            Support::Against | Support::Silent(_) => None,
        }
    }

    pub(super) fn is_unproven(self) -> bool {
        matches!(self, Support::Unproven(_))
    }
}

impl Accused {
    /// An accusation by comparisons, or by readings, with nothing else known of it.
    #[must_use]
    pub fn new(verdict: Verdict, by: By) -> Accused {
        Accused {
            verdict,
            by,
            is_alone: false,
            since: None,
            absent_since: None,
            cause: None,
            support: Support::Against,
            latest_value: None,
            conflicts: BTreeSet::new(),
            reported: None,
            awaits_value: false,
            bears_witness: false,
        }
    }

    /// Whether the readings of the signal itself have shown the fault.
    #[must_use]
    pub fn is_by_readings(&self) -> bool {
        self.by != By::Comparisons
    }

    /// Whether it explains that another component was accused: that a sensor has had nothing to show only since then does not.
    #[must_use]
    pub fn explains(&self, other: &Accused) -> bool {
        self.absent_since.zip(other.since).is_none_or(|(absent, accused)| absent <= accused)
    }

    /// Whether only comparisons can clear a signal whose readings have shown a fault.
    #[must_use]
    pub fn is_contradicted(&self) -> bool {
        self.by == By::Readings { contradicted: true }
    }
}

impl Standing {
    /// The accusation; `None` for a component that is not accused.
    #[must_use]
    pub fn accused(&self) -> Option<&Accused> {
        match &self.state {
            State::Accused(accused) => Some(accused),
            State::Sound { .. } => None,
        }
    }

    pub(super) fn accused_mut(&mut self) -> Option<&mut Accused> {
        match &mut self.state {
            State::Accused(accused) => Some(accused),
            State::Sound { .. } => None,
        }
    }

    /// How far the component may be relied on.
    #[must_use]
    pub fn trust(&self) -> Trust {
        match self.accused() {
            _ if self.is_forbidden => Trust::Excluded,
            Some(accused) if accused.support.is_unproven() => Trust::Unproven,
            Some(accused) if accused.verdict == Verdict::Failed => Trust::Excluded,
            Some(_) => Trust::Suspect,
            None if self.returning.is_some_and(|it| !it.is_first) => Trust::Returning,
            None => Trust::Trusted,
        }
    }

    /// Whether comparisons with the component are no evidence about others: it has failed, or is forbidden.
    pub(super) fn is_discounted(&self) -> bool {
        self.is_forbidden
            || self.accused().is_some_and(|it| it.verdict == Verdict::Failed && !it.bears_witness)
    }

    /// What outlasts a restart.
    #[must_use]
    pub fn record(&self) -> Record {
        let &Standing { relapses, cleared, .. } = self;
        let Some(accused) = self.accused() else { return Record { relapses, cleared, ..Record::default() } };
        Record {
            verdict: Some(accused.verdict),
            alone: accused.is_alone,
            failed_by_detector: accused.is_by_readings(),
            contradicted: accused.is_contradicted(),
            unproven: accused.support.is_unproven(),
            cleared,
            relapses,
            latest_value: accused.latest_value,
        }
    }
}

impl From<Record> for Standing {
    fn from(record: Record) -> Standing {
        let accused = record.verdict.map(|verdict| Accused {
            is_alone: record.alone,
            support: if record.unproven { Support::Unproven(None) } else { Support::Against },
            latest_value: record.latest_value,
            ..Accused::new(
                verdict,
                match record.failed_by_detector {
                    true => By::Readings { contradicted: record.contradicted },
                    false => By::Comparisons,
                },
            )
        });
        let state = accused.map_or_else(State::default, |accused| State::Accused(Box::new(accused)));
        Standing { state, relapses: record.relapses, cleared: record.cleared, ..Standing::default() }
    }
}
