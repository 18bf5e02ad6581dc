//! Watches each signal alone for silence and for values that are impossible.

use crate::knowledge::{IdVec, KnowledgeBase, Lineage, SignalId};
use crate::time::{Span, Time};

/// Why a signal gives no usable value now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Absence {
    /// Nothing has come for longer than its timeout.
    Silent,
    /// Something comes, but for longer than its timeout nothing of it was a value.
    Invalid,
    /// Values come, but for longer than its timeout none of them was possible.
    OutOfRange,
}

/// When a signal last said something.
#[derive(Clone, Copy, Debug)]
struct Voice {
    timeout: Option<Span>,
    heard: Option<Time>,
    valid: Option<Time>,
    /// What was wrong with all that came after that.
    wrong: Option<Absence>,
    absence: Option<Absence>,
    /// It was absent before the start and has not spoken since.
    was_absent: bool,
    /// When it came under watch, where that was after the start.
    since: Option<Time>,
}

/// A change in what a signal says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The signal.
    pub signal: SignalId,
    /// Why it gives nothing now; `None` when it is back.
    pub absence: Option<Absence>,
    /// When it last gave a possible value; `None` when it never did.
    pub last_valid: Option<Time>,
    /// Whether it gives its first possible value: it does not come back from anything.
    pub is_first: bool,
}

/// Watches every signal for silence.
#[derive(Clone, Debug)]
pub struct Timeouts {
    voices: IdVec<SignalId, Voice>,
    start: Option<Time>,
    /// No timeout runs out before this: a lower bound, so that not every observation looks at every signal.
    quiet_until: Time,
}

impl Timeouts {
    /// For the signals of a knowledge base.
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

    /// Goes on from the watch before a change: who has spoken from the same source is remembered, the others are under watch
    /// from now on.
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

    /// A signal was absent before the start; it counts as that until it speaks.
    pub(super) fn expect_absent(&mut self, signal: SignalId, absence: Absence) {
        self.voices[signal].absence = Some(absence);
        self.voices[signal].was_absent = true;
    }

    /// Whether a signal has ever given a possible value.
    #[must_use]
    pub fn has_spoken(&self, signal: SignalId) -> bool {
        self.voices[signal].valid.is_some()
    }

    /// A signal has delivered something, and what is wrong with it when it is not a possible value. Gives the change when the
    /// signal was absent until now.
    // Once for every observation or comparison, from two places: by a hint alone it would be called.
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
        // It may fall silent again before the bound that was computed without it.
        self.quiet_until = self.quiet_until.min(voice.deadline(now));
        Some(Change { signal, absence: None, last_valid, is_first })
    }

    /// Whether a signal says nothing usable now.
    #[must_use]
    pub fn absence(&self, signal: SignalId) -> Option<Absence> {
        self.voices[signal].absence
    }

    /// When a timeout may run out next; `None` before the first observation.
    #[must_use]
    pub fn next_deadline(&self) -> Option<Time> {
        self.start.map(|_| self.quiet_until).filter(|until| *until < Time::MAX)
    }

    /// Looks for timeouts that have run out. O(1) while none can have, else O(signals).
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
    /// When it last gave a possible value, or came under watch.
    fn last(&self, start: Time) -> Time {
        self.valid.or(self.since).unwrap_or(start)
    }

    /// The first moment at which it has been silent for too long since `last`; `Time::MAX` when it never is.
    fn deadline(&self, last: Time) -> Time {
        self.timeout.map_or(Time::MAX, |timeout| last + timeout + Span(1))
    }

    fn spoke_since(&self, moment: Time) -> bool {
        self.heard.is_some_and(|heard| heard > moment && self.valid != Some(heard))
    }
}
