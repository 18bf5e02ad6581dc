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
struct Liveness {
    timeout: Option<Span>,
    /// The declared period, where the timeout is the usual one of the rate.
    period: Option<Span>,
    /// What has come since the end of a silence, while it may be one batch.
    batch: Option<Batch>,
    /// The silence before the last complete batch.
    pause: Span,
    arrived: Option<Time>,
    valid: Option<Time>,
    /// The problem of all messages after the last possible value.
    wrong: Option<Absence>,
    absence: Option<Absence>,
    /// Whether the signal was absent before the start and has given no value since.
    was_absent: bool,
    /// When the observation of the signal began, where that was after the start.
    since: Option<Time>,
}

/// The values that come at the end of a silence.
#[derive(Clone, Copy, Debug)]
struct Batch {
    began: Time,
    /// How long no value had come.
    silence: Span,
    values: i64,
}

/// A change between a signal's absence and presence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The signal.
    pub signal: SignalId,
    /// Why the signal gives no usable value now; `None` when it is back.
    pub absence: Option<Absence>,
    /// How long a silence may last.
    pub allowed: Span,
    /// When the signal last gave a possible value; `None` when it never did.
    pub last_valid: Option<Time>,
    /// Whether this is the signal's first possible value: then it returns from no absence.
    pub is_first: bool,
}

/// The timeouts of all signals.
#[derive(Clone, Debug)]
pub struct Timeouts {
    states: IdVec<SignalId, Liveness>,
    start: Option<Time>,
    /// A lower bound of the next timeout, so that not every observation checks every signal.
    quiet_until: Time,
}

impl Timeouts {
    /// Timeouts for the signals of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Timeouts {
        let liveness = |signal| Liveness {
            timeout: knowledge.signals()[signal].timeout,
            period: knowledge.signals()[signal].paced_by(),
            batch: None,
            pause: Span::ZERO,
            arrived: None,
            valid: None,
            wrong: None,
            absence: None,
            was_absent: false,
            since: None,
        };
        Timeouts {
            states: IdVec::filled(knowledge.signals().len(), liveness),
            start: None,
            quiet_until: Time::MIN,
        }
    }

    /// Takes over from before a change of the knowledge base: signals with the same source keep their last values, and the
    /// observation of the others begins now.
    pub fn inherit(&mut self, old: &Timeouts, lineage: &Lineage, now: Time) {
        self.start = old.start;
        self.states.iter_mut().for_each(|liveness| liveness.since = Some(now));
        for (id, before) in old.states.enumerate() {
            let Some(id) = lineage.source(id) else { continue };
            let Liveness { timeout, period, .. } = self.states[id];
            let absence = before.absence.filter(|_| timeout.is_some());
            let timeout = if period.is_some() && period == before.period { before.timeout } else { timeout };
            self.states[id] = Liveness { timeout, period, absence, ..*before };
        }
        let Some(start) = self.start else { return };
        let present = self.states.iter().filter(|liveness| liveness.absence.is_none());
        self.quiet_until =
            present.map(|liveness| liveness.deadline(liveness.last(start))).min().unwrap_or(Time::MAX);
    }

    /// Marks a signal as absent before the start; it stays absent until it gives a value.
    pub(super) fn expect_absent(&mut self, signal: SignalId, absence: Absence) {
        self.states[signal].absence = Some(absence);
        self.states[signal].was_absent = true;
    }

    /// Whether a signal has ever given a possible value.
    #[must_use]
    pub fn has_given_value(&self, signal: SignalId) -> bool {
        self.states[signal].valid.is_some()
    }

    /// Notes a message of a signal, with its problem when it has no possible value. Returns the change when the signal was absent
    /// until now.
    // Called for every observation from two places: `inline` alone would not inline it.
    #[inline(always)]
    pub fn observe_message(&mut self, signal: SignalId, wrong: Option<Absence>, now: Time) -> Option<Change> {
        if self.start.is_none() {
            self.start = Some(now);
            self.quiet_until =
                self.states.iter().map(|liveness| liveness.deadline(now)).min().unwrap_or(Time::MAX);
        }
        let liveness = &mut self.states[signal];
        liveness.arrived = Some(now);
        if let Some(wrong) = wrong {
            if liveness.valid == Some(now) {
                return None;
            }
            let is_all = liveness.wrong.is_none_or(|before| before == wrong);
            liveness.wrong = Some(if is_all { wrong } else { Absence::Invalid });
            return None;
        }
        liveness.wrong = None;
        let last_valid = liveness.valid.replace(now);
        if liveness.batch.is_some() {
            liveness.note_in_batch(now);
        }
        liveness.absence.take()?;
        let paced = last_valid.filter(|_| liveness.period.is_some());
        liveness.batch = paced.map(|last| Batch { began: now, silence: now - last, values: 1 });
        let is_first = last_valid.is_none() && !core::mem::take(&mut liveness.was_absent);
        // The signal may fall silent again before the bound that was computed without it.
        self.quiet_until = self.quiet_until.min(liveness.deadline(now));
        Some(Change { signal, absence: None, allowed: Span::ZERO, last_valid, is_first })
    }

    /// Why a signal gives no usable value now; `None` when it gives one.
    #[must_use]
    pub fn absence(&self, signal: SignalId) -> Option<Absence> {
        self.states[signal].absence
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
        for signal in self.states.ids() {
            let liveness = &mut self.states[signal];
            if liveness.absence.is_some() {
                continue;
            }
            let last = liveness.last(start);
            let deadline = liveness.deadline(last);
            if now < deadline || deadline == Time::MAX {
                next = next.min(deadline);
                continue;
            }
            let wrong = liveness.wrong.unwrap_or(Absence::Invalid);
            let absence = if liveness.has_arrived_since(last) { wrong } else { Absence::Silent };
            liveness.absence = Some(absence);
            let (allowed, last_valid) = (liveness.timeout.unwrap_or(Span::ZERO), liveness.valid);
            report(Change { signal, absence: Some(absence), allowed, last_valid, is_first: false });
        }
        self.quiet_until = next;
    }
}

impl Liveness {
    /// When the signal last gave a possible value, or when its observation began.
    fn last(&self, start: Time) -> Time {
        self.valid.or(self.since).unwrap_or(start)
    }

    /// The first moment at which the signal is silent for too long since `last`; `Time::MAX` when it never is.
    fn deadline(&self, last: Time) -> Time {
        self.timeout.map_or(Time::MAX, |timeout| last + timeout + Span(1))
    }

    /// Counts a value after a silence. Where all values of the silence have come within a period, it was the pause before a batch; of
    /// two like pauses on end, the timeout lasts until the next batch is late: three quarters of a pause more.
    #[cold]
    fn note_in_batch(&mut self, now: Time) {
        let (Some(batch), Some(period)) = (&mut self.batch, self.period) else { return };
        batch.values += 1;
        let Batch { began, silence, values } = *batch;
        if now - began >= period {
            self.batch = None;
        } else if period.times(values + 1) > silence {
            let longest = silence.max(self.pause);
            if longest <= silence.min(self.pause).times(2) {
                self.timeout = self.timeout.map(|timeout| timeout.max(Span(longest.0 / 4 * 7)));
            }
            (self.batch, self.pause) = (None, silence);
        }
    }

    fn has_arrived_since(&self, moment: Time) -> bool {
        self.arrived.is_some_and(|arrived| arrived > moment && self.valid != Some(arrived))
    }
}
