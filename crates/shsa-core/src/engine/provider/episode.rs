//! Tells when another way has stood in for the source for a while, and when the source gives values again.
//!
//! A source that jitters is stood in for at one moment and speaks at the next: that is told to nobody. An episode begins with the
//! first value of a stand-in and ends when the source has given all values for a while; it is told when it has lasted
//! longer than a value may be old, as without the stand-in the need would not have been served.

use super::super::message::{Event, EventKind};
use super::super::reason;
use super::Provider;
use crate::knowledge::KnowledgeBase;
use crate::monitor::{Inheritance, Monitor, WayIndex};
use crate::service::Service;
use crate::time::{Span, Time};
use alloc::format;
use alloc::string::String;

/// Another way gives values in the place of the source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Episode {
    way: WayIndex,
    since: Time,
    /// Since when the source gives all values again.
    own_since: Option<Time>,
    /// Which way was told.
    told: Option<WayIndex>,
}

impl Episode {
    /// The same after a change of the model; `None` where the way is gone.
    pub(super) fn inherit(self, inheritance: &Inheritance) -> Option<Episode> {
        let way = inheritance.way(self.way)?;
        Some(Episode { way, told: self.told.and_then(|way| inheritance.way(way)), ..self })
    }
}

/// Why the source does not give the value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    Late,
    Contradicted,
    Unfit,
}

impl Fault {
    fn words(self) -> &'static str {
        match self {
            Fault::Late => "gives no value in time",
            Fault::Contradicted => "is contradicted by more ways than support it",
            Fault::Unfit => "gives values that are too wide or too old",
        }
    }
}

impl Provider {
    /// A way has stood in at this moment.
    pub(super) fn note_stand_in(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        way: WayIndex,
        fault: Fault,
        now: Time,
    ) -> Option<Event> {
        let new = Episode { way, since: now, own_since: None, told: None };
        let episode = self.episode.get_or_insert(new);
        episode.own_since = None;
        if episode.way != way {
            (episode.way, episode.since) = (way, now);
        }
        if episode.told == Some(way) || now - episode.since <= self.max_age {
            return None;
        }
        let lasted = now - episode.since;
        episode.told = Some(way);
        let source = self.active.as_ref().map(|service| service.way().describe(knowledge))?;
        let stands_in = monitor.way(way)?.computation.way().describe(knowledge);
        let because = format!(
            "{source} {}; {stands_in} has stood in for it for {}",
            fault.words(),
            reason::span(lasted)
        );
        let event = self.event(knowledge, EventKind::Substituted, because, now);
        Some(Event { substitution: Some(stands_in), ..event })
    }

    /// The source has given the value of this moment itself.
    pub(super) fn note_own(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        now: Time,
    ) -> Option<Event> {
        let episode = self.episode.as_mut()?;
        let own_since = *episode.own_since.get_or_insert(now);
        let calm = match episode.told {
            Some(_) => self.switching.hold.max(self.max_age),
            None => Span(self.max_age.0 / 2),
        };
        if now - own_since < calm {
            return None;
        }
        let told = episode.told;
        self.episode = None;
        let before = monitor.way(told?).map(|way| way.computation.way().describe(knowledge));
        let because = format!("its source gives values again; before: {}", before.unwrap_or_default());
        Some(self.event(knowledge, EventKind::Restored, because, now))
    }

    /// The source in use.
    pub(super) fn active_words(&self, knowledge: &KnowledgeBase) -> Option<String> {
        self.active.as_ref().map(Service::way).map(|way| way.describe(knowledge))
    }
}
