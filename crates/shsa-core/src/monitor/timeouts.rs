//! Observes each signal for silence and for impossible values.

use crate::knowledge::{IdVec, KnowledgeBase, Lineage, SignalId};
use crate::time::{Span, Time};

/// Why a signal gives no usable value now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Absence {
    /// No message has come for longer than the timeout.
    Silent,
    /// Messages have come, but for longer than the timeout none had a value.
    Invalid,
    /// Values have come, but for longer than the timeout none was possible.
    OutOfRange,
}

/// When a signal last gave a value.
#[derive(Clone, Copy, Debug)]
struct Voice {
    timeout: Option<Span>,
    heard: Option<Time>,
    valid: Option<Time>,
    /// The problem of all messages after the last possible value.
    wrong: Option<Absence>,
    absence: Option<Absence>,
    /// Whether the signal was absent before the start and has given no value since.
    was_absent: bool,
    /// When the observation of the signal began, where that was after the start.
    since: Option<Time>,
}

/// A change between a signal's absence and presence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The signal.
    pub signal: SignalId,
    /// Why the signal gives no usable value now; `None` when it is back.
    pub absence: Option<Absence>,
    /// When the signal last gave a possible value; `None` when it never did.
    pub last_valid: Option<Time>,
    /// Whether this is the signal's first possible value: then it returns from no absence.
    pub is_first: bool,
}

/// The timeouts of all signals.
#[derive(Clone, Debug)]
pub struct Timeouts {
    voices: IdVec<SignalId, Voice>,
    start: Option<Time>,
    /// A lower bound of the next timeout, so that not every observation checks every signal.
    quiet_until: Time,
}

impl Timeouts {
    /// Timeouts for the signals of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Timeouts {
        let voice = |signal| Voice {
            timeout: knowledge.signals()[signal].timeout,
            heard: None,
            valid: None,
            wrong: None,
            absence: None,
            was_absent: false,
            since: None,
        };
        Timeouts {
            voices: IdVec::filled(knowledge.signals().len(), voice),
            start: None,
            quiet_until: Time::MIN,
        }
    }

    /// Takes over from before a change of the knowledge base: signals with the same source keep their last values, and the
    /// observation of the others begins now.
    pub fn inherit(&mut self, old: &Timeouts, lineage: &Lineage, now: Time) {
        self.start = old.start;
        self.voices.iter_mut().for_each(|voice| voice.since = Some(now));
        for (id, before) in old.voices.enumerate() {
            let Some(id) = lineage.source(id) else { continue };
            let timeout = self.voices[id].timeout;
            let absence = before.absence.filter(|_| timeout.is_some());
            self.voices[id] = Voice { timeout, absence, ..*before };
        }
        let Some(start) = self.start else { return };
        let present = self.voices.iter().filter(|voice| voice.absence.is_none());
        self.quiet_until = present.map(|voice| voice.deadline(voice.last(start))).min().unwrap_or(Time::MAX);
    }

    /// Marks a signal as absent before the start; it stays absent until it gives a value.
    pub(super) fn expect_absent(&mut self, signal: SignalId, absence: Absence) {
        self.voices[signal].absence = Some(absence);
        self.voices[signal].was_absent = true;
    }

    /// Whether a signal has ever given a possible value.
    #[must_use]
    pub fn has_given_value(&self, signal: SignalId) -> bool {
        self.voices[signal].valid.is_some()
    }

    /// Notes a message of a signal, with its problem when it has no possible value. Returns the change when the signal was absent
    /// until now.
    // Called for every observation from two places: `inline` alone would not inline it.
    #[inline(always)]
    pub fn hear(&mut self, signal: SignalId, wrong: Option<Absence>, now: Time) -> Option<Change> {
        if self.start.is_none() {
            self.start = Some(now);
            self.quiet_until = self.voices.iter().map(|voice| voice.deadline(now)).min().unwrap_or(Time::MAX);
        }
        let voice = &mut self.voices[signal];
        voice.heard = Some(now);
        if let Some(wrong) = wrong {
            if voice.valid == Some(now) {
                return None;
            }
            let is_all = voice.wrong.is_none_or(|before| before == wrong);
            voice.wrong = Some(if is_all { wrong } else { Absence::Invalid });
            return None;
        }
        voice.wrong = None;
        let last_valid = voice.valid.replace(now);
        voice.absence.take()?;
        let is_first = last_valid.is_none() && !core::mem::take(&mut voice.was_absent);
        // The signal may fall silent again before the bound that was computed without it.
        self.quiet_until = self.quiet_until.min(voice.deadline(now));
        Some(Change { signal, absence: None, last_valid, is_first })
    }

    /// Why a signal gives no usable value now; `None` when it gives one.
    #[must_use]
    pub fn absence(&self, signal: SignalId) -> Option<Absence> {
        self.voices[signal].absence
    }

    /// When a timeout may run out next; `None` before the first observation.
    #[must_use]
    pub fn next_deadline(&self) -> Option<Time> {
        self.start.map(|_| self.quiet_until).filter(|until| *until < Time::MAX)
    }

    /// Reports the timeouts that have expired. O(1) while none can have, else O(signals).
    pub fn pass(&mut self, now: Time, mut report: impl FnMut(Change)) {
        let start = *self.start.get_or_insert(now);
        if now < self.quiet_until {
            return;
        }
        let mut next = Time::MAX;
        for signal in self.voices.ids() {
            let voice = &mut self.voices[signal];
            if voice.absence.is_some() {
                continue;
            }
            let last = voice.last(start);
            let deadline = voice.deadline(last);
            if now < deadline || deadline == Time::MAX {
                next = next.min(deadline);
                continue;
            }
            let wrong = voice.wrong.unwrap_or(Absence::Invalid);
            let absence = if voice.spoke_since(last) { wrong } else { Absence::Silent };
            voice.absence = Some(absence);
            report(Change { signal, absence: Some(absence), last_valid: voice.valid, is_first: false });
        }
        self.quiet_until = next;
    }
}

impl Voice {
    /// When the signal last gave a possible value, or when its observation began.
    fn last(&self, start: Time) -> Time {
        self.valid.or(self.since).unwrap_or(start)
    }

    /// The first moment at which the signal is silent for too long since `last`; `Time::MAX` when it never is.
    fn deadline(&self, last: Time) -> Time {
        self.timeout.map_or(Time::MAX, |timeout| last + timeout + Span(1))
    }

    fn spoke_since(&self, moment: Time) -> bool {
        self.heard.is_some_and(|heard| heard > moment && self.valid != Some(heard))
    }
}
