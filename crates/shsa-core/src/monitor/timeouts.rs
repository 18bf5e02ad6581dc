//! Observes each signal for silence and for impossible values.
//!
//! A signal whose value stands may say nothing for any time. Where it has no timeout of its own, it is silent once all that share a
//! device with it are: their messages are its signs of life.

use crate::knowledge::{IdVec, KnowledgeBase, Lineage, SignalId};
use crate::time::{Span, Time};
use alloc::vec::Vec;

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

/// The signals with a timeout that share a common cause with one whose value stands, and the longest of their timeouts.
#[derive(Clone, Debug)]
struct Device {
    others: Vec<SignalId>,
    timeout: Span,
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
    /// The devices of the signals without a timeout whose values stand.
    devices: Vec<(SignalId, Vec<Device>)>,
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
            devices: devices(knowledge),
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
            let is_watched = timeout.is_some() || self.devices.iter().any(|(signal, _)| *signal == id);
            let absence = before.absence.filter(|_| is_watched);
            let timeout = if period.is_some() && period == before.period { before.timeout } else { timeout };
            self.states[id] = Liveness { timeout, period, absence, ..*before };
        }
        let Some(start) = self.start else { return };
        let present = self.states.iter().filter(|liveness| liveness.absence.is_none());
        self.quiet_until =
            present.map(|liveness| liveness.deadline(liveness.last(start))).min().unwrap_or(Time::MAX);
        let standing =
            self.devices.iter().filter_map(|(id, devices)| self.device_deadline(*id, devices, start));
        self.quiet_until =
            standing.map(|(deadline, _)| deadline).fold(self.quiet_until, Time::min).max(now + Span(1));
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
        let device = self.devices.iter().flat_map(|(_, devices)| devices).map(|device| device.timeout).min();
        let with_device = device.map_or(Time::MAX, |timeout| now + timeout + Span(1));
        self.quiet_until = self.quiet_until.min(liveness.deadline(now)).min(with_device);
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
        let mut next = self.pass_devices(start, now, &mut report);
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

    /// The same for the signals that are silent with their devices; returns when one of these may be next.
    fn pass_devices(&mut self, start: Time, now: Time, mut report: impl FnMut(Change)) -> Time {
        let mut next = Time::MAX;
        for at in 0..self.devices.len() {
            let found = self.devices.get(at);
            let found =
                found.and_then(|(id, devices)| Some((*id, self.device_deadline(*id, devices, start)?)));
            let Some((signal, (deadline, allowed))) = found else { continue };
            if now < deadline {
                next = next.min(deadline);
                continue;
            }
            let absence = Some(Absence::Silent);
            self.states[signal].absence = absence;
            let last_valid = self.states[signal].valid;
            report(Change { signal, absence, allowed, last_valid, is_first: false });
        }
        next
    }

    /// When a signal is silent with one of its devices, and the timeout there; `None` while it is absent.
    fn device_deadline(&self, signal: SignalId, devices: &[Device], start: Time) -> Option<(Time, Span)> {
        let own = &self.states[signal];
        let heard = |other: &SignalId| self.states[*other].arrived.unwrap_or(start);
        let last = |device: &Device| device.others.iter().map(heard).fold(own.last(start), Time::max);
        let deadline = |device: &Device| (last(device) + device.timeout + Span(1), device.timeout);
        devices.iter().map(deadline).min().filter(|_| own.absence.is_none())
    }
}

/// The devices of each signal that has no timeout of its own, and whose value stands. O(signals times causes).
fn devices(knowledge: &KnowledgeBase) -> Vec<(SignalId, Vec<Device>)> {
    let signals = knowledge.signals();
    let device = |signal: SignalId, shared: &[SignalId]| {
        let speaks = |other: &SignalId| {
            signals[*other].timeout.is_some()
                && !knowledge.is_fused(*other)
                && !signals[*other].derived_from.contains(&signal)
        };
        let others: Vec<SignalId> = shared.iter().copied().filter(speaks).collect();
        let timeout = others.iter().filter_map(|other| signals[*other].timeout).max()?;
        Some(Device { others, timeout })
    };
    let of = |signal: SignalId| {
        let causes = knowledge.causes().iter().filter(|cause| cause.signals.contains(&signal));
        causes.filter_map(|cause| device(signal, &cause.signals)).collect::<Vec<Device>>()
    };
    let standing = signals.enumerate().filter(|(_, signal)| signal.holds && signal.timeout.is_none());
    standing.map(|(signal, _)| (signal, of(signal))).filter(|(_, devices)| !devices.is_empty()).collect()
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
