//! The clocks that stamp the signals: finds time stamps that cannot be the times of measurement.
//!
//! The time from the stamp to the reception is the sum of a clock difference and a transmission delay. The usual amount of each
//! signal is learnt from its first readings. Stamps are wrong when
//!
//! * the amount differs from the usual one by more than any transmission delay, and stays so: the clock was set;
//! * stamps that were not in the future are, and stay so, while those of most signals are not: the clock was set
//!   forward. Nothing is received before it is sent, so a second is enough;
//! * the usual amount differs from that of the other signals: the clock was wrong from the start. Where all clocks are equally
//!   behind (a recording of another host), nothing is wrong; no clock can be ahead;
//! * values change, and their stamp does not: the clock stands still.
//!
//! Readings that were held up and come at once are late, and no clock is wrong: the amount shrinks with each value.

use crate::knowledge::{IdVec, KnowledgeBase, Lineage, Signal, SignalId};
use crate::numbers::{BRIEF, CLOCKS_APART, IN_A_ROW, LASTING, MANY};
use crate::observation::{Observation, RawValue};
use crate::time::{Span, Time};
use alloc::vec::Vec;

/// The error of a time stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Misdated {
    /// The clock is this much behind the time of reception, beyond the usual amount; ahead of it where negative.
    Off(Span),
    /// The stamp has been the same for this long, while values have changed.
    Stopped(Span),
    /// The stamp is this far in the future, and those before were not: no value of then, whatever the reason. It is no symptom yet.
    Ahead(Span),
}

/// The clock of one signal.
#[derive(Clone, Copy, Debug)]
struct Clock {
    /// The largest deviation from the usual amount that is no error.
    margin: Span,
    /// How long after its stamp a value may have been measured, to the end of what it is a mean of: it comes after that.
    ahead: Span,
    /// Below this amount a stamp is in the future: negative.
    future: Span,
    /// Whether the clock was found to be set forward, since its amounts are unusual.
    is_set_forward: bool,
    /// The usual time from the stamp to the reception; `None` while unknown.
    usual: Option<Span>,
    /// An amount that may become the usual one or deviates from it; since when and in how many readings.
    other: Span,
    since: Time,
    readings: u32,
    /// The newest stamp, since when it is the same, and the value that came with it first.
    stamp: Option<Time>,
    stamped: Time,
    value: Option<f64>,
}

/// The clocks of all signals. O(1) an observation; nothing is allocated.
#[derive(Clone, Debug)]
pub struct Clocks {
    list: IdVec<SignalId, Clock>,
    /// The usual amounts of signals, as they were learnt, ascending.
    learnt: Vec<Span>,
    /// The usual amount of all signals together: the median; of two middle ones, the smaller in magnitude.
    reference: Option<Span>,
}

impl Clocks {
    /// The clocks of the signals of a knowledge base.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase) -> Clocks {
        let count = knowledge.signals().len();
        let clock = |signal| Clock::new(&knowledge.signals()[signal]);
        Clocks { list: IdVec::filled(count, clock), learnt: Vec::with_capacity(count), reference: None }
    }

    /// Takes over the clocks before a change of the model, for the signals whose readings mean the same.
    pub fn inherit(&mut self, old: &Clocks, lineage: &Lineage) {
        for (id, before) in old.list.enumerate() {
            let Some(clock) = lineage.signal(id).map(|signal| &mut self.list[signal]) else { continue };
            *clock = Clock { margin: clock.margin, ahead: clock.ahead, ..*before };
            if let Some(usual) = clock.usual {
                self.learnt.push(clock.unexplained(usual));
            }
        }
        self.learnt.sort_unstable();
        self.reference = reference(&self.learnt);
    }

    /// Takes in a stamp; returns its error.
    #[inline]
    pub fn observe(&mut self, observation: &Observation, now: Time) -> Option<Misdated> {
        let clock = &mut self.list[observation.signal];
        let amount = now - observation.stamp;
        // The most frequent case.
        if let Some(usual) = &mut clock.usual
            && clock.stamp != Some(observation.stamp)
            && is_between(amount - *usual, clock.future, clock.margin)
        {
            (clock.stamp, clock.stamped, clock.value, clock.readings) =
                (Some(observation.stamp), now, None, 0);
            usual.0 += (amount - *usual).0 / i64::from(MANY);
            return apart(*usual, self.reference, clock.margin);
        }
        self.look_closer(observation, amount, now)
    }

    #[inline(never)]
    fn look_closer(&mut self, observation: &Observation, amount: Span, now: Time) -> Option<Misdated> {
        let reference = self.reference;
        let clock = &mut self.list[observation.signal];
        if let Some(stood) = clock.stood(observation, now) {
            return (stood > LASTING.max(clock.margin - CLOCKS_APART)).then_some(Misdated::Stopped(stood));
        }
        let margin = clock.margin;
        let earliest = reference.unwrap_or(Span::ZERO).min(Span::ZERO) + clock.future;
        let is_new_in_future = |usual: Span| amount < earliest && earliest <= usual;
        if let Some(usual) =
            clock.usual.filter(|usual| is_near(amount, *usual, margin) && !is_new_in_future(*usual))
        {
            // A queue that has drained.
            let shorter = if amount - usual < clock.future { amount - usual } else { Span::ZERO };
            let usual = usual + Span(shorter.0 / i64::from(MANY));
            (clock.usual, clock.readings) = (Some(usual), 0);
            return apart(usual, reference, margin);
        }
        clock.is_set_forward &= clock.readings > 0;
        let lasted = clock.lasted(amount, now);
        let is_usual = |amount: Span| is_near(amount, reference.unwrap_or(Span::ZERO), margin);
        match clock.usual {
            Some(usual) if !lasted && is_new_in_future(usual) => Some(Misdated::Ahead(Span::ZERO - amount)),
            Some(usual) if lasted && is_near(amount, usual, margin) => {
                self.was_set_forward(observation.signal, amount).then_some(Misdated::Off(amount - usual))
            }
            // The clock has been corrected.
            Some(usual) if lasted && is_usual(amount) && !is_usual(usual) => {
                self.forget(observation.signal, usual);
                self.learn(observation.signal, amount);
                None
            }
            Some(usual) => lasted.then_some(Misdated::Off(amount - usual)),
            None if lasted => {
                self.learn(observation.signal, amount);
                apart(amount, self.reference, margin)
            }
            None => None,
        }
    }

    /// Whether the clock of a signal whose stamps are in the future was set forward. Where most signals show that, the clock of
    /// the receiver was set back: the amount is learnt anew. O(signals) once for each clock that is set.
    fn was_set_forward(&mut self, signal: SignalId, amount: Span) -> bool {
        if self.list[signal].is_set_forward {
            return true;
        }
        let since = self.list[signal].since;
        let heard = self.list.iter().filter(|it| it.usual.is_some() && it.stamped >= since);
        let (mut all, mut ahead) = (0, 0);
        for clock in heard {
            all += 1;
            ahead += usize::from(clock.leads());
        }
        let is_alone = 2 * ahead <= all;
        self.list[signal].is_set_forward = is_alone;
        if let Some(usual) = self.list[signal].usual.filter(|_| !is_alone) {
            self.forget(signal, usual);
            self.learn(signal, amount);
        }
        is_alone
    }

    fn learn(&mut self, signal: SignalId, usual: Span) {
        let clock = &mut self.list[signal];
        clock.usual = Some(usual);
        let usual = clock.unexplained(usual);
        // Inserted after its equals, so that equal amounts move nothing.
        let place = self.learnt.partition_point(|other| *other <= usual);
        self.learnt.insert(place, usual);
        self.reference = reference(&self.learnt);
    }

    /// Removes the amount of a signal that is learnt anew: the nearest one, as the usual amount has moved a little since.
    fn forget(&mut self, signal: SignalId, usual: Span) {
        let usual = self.list[signal].unexplained(usual);
        let distance = |other: &Span| (*other - usual).0.saturating_abs();
        let nearest = self.learnt.iter().enumerate().min_by_key(|(_, other)| distance(other));
        if let Some(place) = nearest.map(|(place, _)| place) {
            self.learnt.remove(place);
            self.reference = reference(&self.learnt);
        }
    }
}

/// The error of a signal whose usual amount differs from that of the others, or whose stamps are in the future.
#[inline]
fn apart(usual: Span, reference: Option<Span>, margin: Span) -> Option<Misdated> {
    if usual < Span::ZERO - margin {
        return Some(Misdated::Off(usual));
    }
    let off = usual - reference?;
    (!is_near(off, Span::ZERO, margin)).then_some(Misdated::Off(off))
}

/// The usual amount of all signals, from ascending amounts.
fn reference(learnt: &[Span]) -> Option<Span> {
    let count = learnt.len();
    let (one, other) = (learnt.get(count.checked_sub(1)? / 2)?, learnt.get(count / 2)?);
    Some(if one.0.saturating_abs() <= other.0.saturating_abs() { *one } else { *other })
}

/// Whether two amounts are no further apart than a margin.
#[inline]
fn is_near(one: Span, other: Span, margin: Span) -> bool {
    is_between(one - other, Span::ZERO - margin, margin)
}

#[inline]
fn is_between(span: Span, least: Span, most: Span) -> bool {
    span <= most && least <= span
}

impl Clock {
    fn new(signal: &Signal) -> Clock {
        let (early, late) = signal.time_error;
        let longest = signal.limits.max_delay.unwrap_or(Span::ZERO);
        // Errors of its own stamps may be all to one side, beside a clock without any.
        let errors = (late - early).max(late).max(Span::ZERO - early);
        let ahead = (Span(signal.mean_over.0 / 2) - signal.delay + late).max(Span::ZERO);
        Clock {
            margin: CLOCKS_APART.max(longest) + ahead + errors,
            ahead,
            future: Span::ZERO - BRIEF - (late - early),
            is_set_forward: false,
            usual: None,
            other: Span::ZERO,
            since: Time::MIN,
            readings: 0,
            stamp: None,
            stamped: Time::MIN,
            value: None,
        }
    }

    /// The part of an amount that the time from the stamp to the end of a measurement does not explain.
    fn unexplained(&self, amount: Span) -> Span {
        amount - amount.min(self.ahead).max(Span::ZERO)
    }

    /// Whether its stamps are further in the future than usual now.
    fn leads(&self) -> bool {
        self.readings > 0 && self.usual.is_some_and(|usual| self.other - usual < self.future)
    }

    /// How long the stamp has been the same while the value has changed; remembers a new stamp.
    fn stood(&mut self, observation: &Observation, now: Time) -> Option<Span> {
        let value = match &observation.value {
            RawValue::Number(number) => Some(*number),
            RawValue::Interval { lo, .. } => Some(*lo),
            RawValue::Vector(elements) => elements.first().copied(),
        };
        if self.stamp != Some(observation.stamp) {
            (self.stamp, self.stamped, self.value) = (Some(observation.stamp), now, value);
            return None;
        }
        let first = *self.value.get_or_insert(value?);
        (value != Some(first)).then(|| now - self.stamped)
    }

    /// Whether an unusual amount has lasted, without a change that shows a passing delay.
    fn lasted(&mut self, amount: Span, now: Time) -> bool {
        let since = now - self.since;
        let is_same = Span((amount - self.other).0.saturating_abs()) <= Span(since.0 / 2).max(BRIEF);
        if self.readings == 0 || !is_same {
            (self.other, self.since, self.readings) = (amount, now, 1);
            return false;
        }
        self.readings = self.readings.saturating_add(1);
        self.readings >= IN_A_ROW && since >= BRIEF
    }
}
