//! The share of the time in which a way gave a value.

use super::fading::Fading;
use crate::numbers::HELD_PERIODS;
use crate::time::{Span, Time};

/// The times in which a way gave values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Presence {
    stretches: Fading,
    /// How long a value counts as present, where a rate is declared.
    held: Option<Span>,
    since: Option<Time>,
    last: Option<Time>,
    /// The time between the last two values.
    gap: Option<Span>,
    /// The weighted time with a value, and in all, until `counted`. From then until `last` there always was a value; that time is
    /// added when it ends.
    given: f64,
    all: f64,
    counted: Time,
}

impl Presence {
    /// The presence of a way that gives a value every `period`, if that is declared.
    pub(super) fn new(period: Option<Span>, memory: Span) -> Presence {
        Presence {
            stretches: Fading::new(memory),
            held: period.map(|period| period.times(HELD_PERIODS)),
            since: None,
            last: None,
            gap: None,
            given: 0.0,
            all: 0.0,
            counted: Time::MIN,
        }
    }

    /// Adopts the settings of another record.
    pub(super) fn adopt(&mut self, new: &Presence) {
        if self.stretches.memory_s != new.stretches.memory_s {
            self.count();
        }
        self.stretches = new.stretches;
        self.held = new.held;
    }

    /// Begins the record: from this moment on there could be values.
    pub(super) fn begin(&mut self, now: Time) {
        self.since.get_or_insert(now);
    }

    /// The share of the time with a value until a moment.
    pub(super) fn share(mut self, now: Time) -> Option<f64> {
        self.pass_until(now);
        (self.all > 0.0).then(|| (self.given / self.all).clamp(0.0, 1.0))
    }

    #[inline]
    pub(super) fn deliver(&mut self, now: Time) {
        match self.last {
            Some(last) if last <= now && now - last <= self.held() => self.gap = Some(now - last),
            _ => self.resume(now),
        }
        self.last = Some(now);
    }

    /// Notes the first value, or the first one after a pause.
    #[cold]
    fn resume(&mut self, now: Time) {
        self.since.get_or_insert(now);
        self.pass_until(now);
        self.counted = now;
        self.gap = self.last.map(|last| now - last).or(self.gap);
    }

    /// Adds the time until the last value.
    fn count(&mut self) {
        if let Some(last) = self.last {
            self.pass(last - self.counted, 1.0);
            self.counted = last;
        }
    }

    /// Adds the time until a moment.
    fn pass_until(&mut self, now: Time) {
        self.count();
        let Some(from) = self.last.or(self.since) else { return };
        let span = (now - from).max(Span::ZERO);
        let held = self.held();
        self.pass(span.min(held), 1.0);
        if span > held {
            self.pass(span - held, 0.0);
        }
    }

    /// How long a value counts as present: as declared, else twice the last gap. Without either, the time before the first value
    /// counts as absence and the time after it as presence.
    #[inline]
    fn held(&self) -> Span {
        let learnt = || self.gap.map(|gap| gap.times(HELD_PERIODS));
        let nothing_yet = if self.last.is_some() { Span::MAX } else { Span::ZERO };
        self.held.or_else(learnt).unwrap_or(nothing_yet)
    }

    fn pass(&mut self, span: Span, share: f64) {
        if span <= Span::ZERO {
            return;
        }
        let factor = self.stretches.over(span);
        self.given = self.given * factor + share * (1.0 - factor);
        self.all = self.all * factor + (1.0 - factor);
    }
}
