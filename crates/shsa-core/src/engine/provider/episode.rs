//! Reports when another way has stood in for the source for a while, and when the source gives values again.
//!
//! A source that jitters misses one moment and delivers at the next; no event reports that. An episode begins with the first
//! value of a stand-in and ends when the source has given all values for a while. An event reports an episode that has lasted
//! longer than a value may be old: without the stand-in, the need would not have been served.

use super::settings::Settings;
use crate::monitor::{Inheritance, WayIndex};
use crate::reason::Reason;
use crate::time::{Span, Time};
use alloc::string::String;

/// Another way gives values in the place of the source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Episode {
    way: WayIndex,
    since: Time,
    /// Since when the source gives all values again.
    own_since: Option<Time>,
    /// The stand-in that an event has reported.
    reported: Option<WayIndex>,
}

impl Episode {
    /// An episode that begins now.
    pub(super) fn new(way: WayIndex, now: Time) -> Episode {
        Episode { way, since: now, own_since: None, reported: None }
    }

    /// The episode after a change of the model; `None` where the stand-in is gone.
    pub(super) fn inherit(self, inheritance: &Inheritance) -> Option<Episode> {
        let way = inheritance.way(self.way)?;
        Some(Episode { way, reported: self.reported.and_then(|way| inheritance.way(way)), ..self })
    }

    /// Notes a value of a stand-in; returns how long it has stood in where an event is due.
    pub(super) fn note_stand_in(&mut self, way: WayIndex, max_age: Span, now: Time) -> Option<Span> {
        self.own_since = None;
        if self.way != way {
            (self.way, self.since) = (way, now);
        }
        if self.reported == Some(way) || now - self.since <= max_age {
            return None;
        }
        self.reported = Some(way);
        Some(now - self.since)
    }

    /// Notes a value of the source itself; returns whether the episode is over.
    pub(super) fn note_own(&mut self, settings: &Settings, now: Time) -> bool {
        let own_since = *self.own_since.get_or_insert(now);
        let calm = match self.reported {
            Some(_) => settings.switching.hold.max(settings.max_age),
            None => settings.half_age(),
        };
        now - own_since >= calm
    }

    /// The stand-in that an event has reported.
    pub(super) fn reported(&self) -> Option<WayIndex> {
        self.reported
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
    /// The fault as a reason about a source.
    pub(super) fn reason(self, source: String) -> Reason {
        match self {
            Fault::Late => Reason::NotInTime { source },
            Fault::Contradicted => Reason::Outvoted { source },
            Fault::Unfit => Reason::Unfit { source },
        }
    }
}
