//! Detects messages held back by their sender or by the transport while a signal was silent. They come faster than the signal's
//! rate, all at once or evenly, and without a stamp their age is unknown.
//!
//! After a silence of `S`, the message number `n` of a queue that is drained was sent `n` periods after the silence began: it is as old
//! as the silence and the time since have been longer than that. What is sent now comes in its period; a queue gives a surplus.

use shsa_core::knowledge::Signal;
use shsa_core::time::{Span, Time};

/// This many pauses in a row show that the signal has its rate again: a burst may be interrupted once.
const PAUSES: u32 = 2;
/// For periods from this one on, one pause is enough: no burst is interrupted for so long.
const SLOW: Span = Span::from_millis(1_000);
/// After a silence the rate is checked for as long as the silence lasted, within these bounds, and while there is a surplus.
const LEAST: Span = Span::from_millis(250);
const MOST: Span = Span::from_millis(5_000);
/// So many gaps must have been seen for a period that is not declared.
const KNOWN: u32 = 10;

/// A past silence, and the messages that came at once after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HeldBack {
    /// The length of the silence.
    pub(super) silence: Span,
    /// The number of discarded messages.
    pub(super) count: u64,
}

/// The timing of one signal's messages without stamps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rhythm {
    /// The declared period.
    period: Option<Span>,
    /// `None`: the signal may be silent for any time.
    timeout: Option<Span>,
    /// The mean time between two messages, and how many gaps it is of, up to [`KNOWN`].
    usual: Span,
    gaps: u32,
    last: Option<Time>,
    present: Option<Return>,
    over: Option<HeldBack>,
}

/// The time after a silence in which the rate is checked.
#[derive(Clone, Copy, Debug)]
struct Return {
    since: Time,
    /// The messages after the first one.
    given: i64,
    /// Pauses in a row so far, and the mean time between the latest messages.
    pauses: u32,
    mean: Span,
    backlog: HeldBack,
}

impl Rhythm {
    pub(super) fn new(signal: &Signal) -> Rhythm {
        let period = signal.rate_hz.map(|rate| Span::from_seconds(1.0 / rate)).filter(|it| *it > Span::ZERO);
        Rhythm { period, timeout: signal.timeout, ..Rhythm::default() }
    }

    /// Whether a message received now may have been held back. If this is known already (`is_known`), the message is not counted.
    pub(super) fn has_waited(&mut self, now: Time, is_known: bool) -> bool {
        let Some(timeout) = self.timeout else { return false };
        let gap = self.last.map_or(Span::ZERO, |last| now - last);
        self.last = self.last.max(Some(now));
        let Some(period) = self.period() else {
            self.learn(gap, timeout);
            return false;
        };
        if gap > timeout {
            self.end();
            let backlog = HeldBack { silence: gap, count: 0 };
            self.present = Some(Return { since: now, given: 0, pauses: 0, mean: Span::ZERO, backlog });
        } else if let Some(back) = &mut self.present {
            back.step(gap, period);
        }
        let Some(back) = self.present.as_mut().filter(|back| !back.is_over(now, period)) else {
            self.end();
            self.learn(gap, timeout);
            return false;
        };
        let has_waited = !back.is_present(now, period);
        back.backlog.count += u64::from(has_waited && !is_known);
        has_waited
    }

    /// The declared period, or the usual one.
    fn period(&self) -> Option<Span> {
        self.period.or_else(|| (self.gaps >= KNOWN && self.usual > Span::ZERO).then_some(self.usual))
    }

    /// Learns the period from a time between two messages, where it is not declared.
    fn learn(&mut self, gap: Span, timeout: Span) {
        if self.period.is_none() && gap > Span::ZERO && gap <= timeout {
            self.gaps = (self.gaps + 1).min(KNOWN);
            self.usual.0 += (gap.0 - self.usual.0) / i64::from(self.gaps);
        }
    }

    /// The messages held back in a past silence; reported once. The first messages after a silence do not count.
    pub(super) fn take_over(&mut self, now: Time) -> Option<HeldBack> {
        if let Some((back, period)) = self.present.zip(self.period())
            && back.is_over(now, period)
        {
            self.end();
        }
        self.over.take().filter(|backlog| backlog.count > u64::from(PAUSES))
    }

    fn end(&mut self) {
        self.over = self.present.take().map(|back| back.backlog).or(self.over);
    }
}

impl Return {
    /// Takes in a message, so long after the one before.
    fn step(&mut self, gap: Span, period: Span) {
        self.given += 1;
        let is_pause = gap.0 >= period.0 / 4 * 3;
        self.pauses = if is_pause { self.pauses + 1 } else { 0 };
        // After a burst, what comes in its period shows at once.
        let is_after_burst = is_pause && self.mean.0 < period.0 / 4;
        self.mean.0 += if is_after_burst { gap.0 - self.mean.0 } else { (gap.0 - self.mean.0) / 4 };
    }

    /// How many periods more have been given than have passed, as a time.
    fn surplus(&self, now: Time, period: Span) -> Span {
        period.times(self.given) - (now - self.since)
    }

    /// Whether the messages come in their period.
    fn is_present(&self, now: Time, period: Span) -> bool {
        let has_surplus = self.surplus(now, period).0 > period.0 / 2 * 3;
        let is_in_step = !has_surplus || self.mean.0 >= period.0 / 10 * 9;
        is_in_step && self.pauses >= if period < SLOW { PAUSES } else { 1 }
    }

    /// Whether all that can have been held back has come, or the time of the check is over and there is no surplus.
    fn is_over(&self, now: Time, period: Span) -> bool {
        let surplus = self.surplus(now, period);
        let is_checked = now - self.since > self.backlog.silence.clamp(LEAST, MOST);
        surplus >= self.backlog.silence || is_checked && (surplus <= period || self.is_present(now, period))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: &str =
        "{shsa: 1, variables: {v: {}}, signals: {s: {variable: v, rate: 50 Hz, timeout: 500 ms}}}";

    fn rhythm(model: &str) -> Rhythm {
        let knowledge = shsa_model::load(model, "test.yaml").knowledge;
        Rhythm::new(knowledge.signals().iter().next().unwrap())
    }

    /// The messages, by their times in milliseconds, that are discarded.
    fn aside(rhythm: &mut Rhythm, moments: impl IntoIterator<Item = i64>) -> Vec<i64> {
        moments.into_iter().filter(|at| rhythm.has_waited(Time(at * 1_000_000), false)).collect()
    }

    #[test]
    fn a_burst_after_a_silence_has_waited() {
        let mut rhythm = rhythm(RATE);
        assert_eq!(aside(&mut rhythm, (0..200).map(|at| at * 20)), [0; 0]);
        // The signal was silent from 3980 to 9000; the messages held back arrive within 25 ms, with a pause.
        let burst: Vec<i64> = (0..100).map(|at| 9_000 + at / 10 + if at > 50 { 15 } else { 0 }).collect();
        let kept = aside(&mut rhythm, burst.iter().copied());
        assert_eq!(kept, burst);
        let after = aside(&mut rhythm, (0..400).map(|at| 9_040 + at * 20));
        assert!(after.iter().all(|at| *at < 9_040 + 4 * 20), "{after:?}");
        assert_eq!(rhythm.take_over(Time(20_000_000_000)).unwrap().silence, Span::from_millis(5_020));
        assert_eq!(rhythm.take_over(Time(20_000_000_000)), None, "told once");
    }

    #[test]
    fn who_comes_back_in_its_rhythm_loses_two_messages() {
        let mut rhythm = rhythm(RATE);
        let moments = (0..10).chain(100..200).map(|at| at * 20 + at % 3);
        assert_eq!(aside(&mut rhythm, moments), [2_001, 2_022]);
        assert_eq!(rhythm.take_over(Time(20_000_000_000)), None, "so few messages are no backlog");
    }

    const NO_RATE: &str = "{shsa: 1, variables: {v: {}}, signals: {s: {variable: v, timeout: 500 ms}}}";

    #[test]
    fn where_no_rate_is_known_nothing_has_waited() {
        assert_eq!(aside(&mut rhythm(NO_RATE), [0, 20, 9_000, 9_000, 9_000]), [0; 0]);
    }

    #[test]
    fn a_period_that_is_not_declared_is_learned() {
        let mut rhythm = rhythm(NO_RATE);
        assert_eq!(aside(&mut rhythm, (0..200).map(|at| at * 20)), [0; 0]);
        let burst: Vec<i64> = (0..100).map(|at| 9_000 + at / 10).collect();
        assert_eq!(aside(&mut rhythm, burst.iter().copied()), burst);
    }

    /// A queue that is drained evenly, at any speed, is old until it is empty; then the messages count again.
    #[test]
    fn a_queue_that_is_drained_is_old_until_it_is_empty() {
        for (speed, silence_ms, unseen) in
            [(1.3, 3_000, 8), (1.8, 10_000, 0), (1.8, 1_000, 0), (3.0, 10_000, 0), (20.0, 60_000, 0)]
        {
            let mut rhythm = rhythm(RATE);
            assert_eq!(aside(&mut rhythm, (0..200).map(|at| at * 20)), [0; 0]);
            // Message n was made n periods after the last one before the silence.
            let (begin, back) = (3_980, 3_980 + silence_ms);
            let arrival = |n: i64| {
                let drained = back as f64 + (n - 1) as f64 * 20.0 / speed;
                (drained.round() as i64).max(begin + n * 20)
            };
            let taken = |n: &i64| !rhythm.has_waited(Time(arrival(*n) * 1_000_000), false);
            let taken: Vec<i64> = (1..8_000).filter(taken).collect();
            let age = |n: &&i64| arrival(**n) - (begin + **n * 20);
            let old = taken.iter().filter(|n| age(n) > 40).count();
            assert!(old <= unseen, "{speed} {silence_ms}: {old} old ones count");
            let first = taken.iter().find(|n| age(n) <= 40).unwrap();
            let empty = (1..8_000).find(|n| arrival(*n) == begin + n * 20).unwrap();
            assert!(arrival(*first) - arrival(empty) <= 200, "{speed} {silence_ms}: {first} after {empty}");
        }
    }

    /// Who was silent and sends nothing that waited counts again after two pauses, with jitter, too.
    #[test]
    fn jitter_is_no_queue() {
        let mut rhythm = rhythm(RATE);
        let jitter = |at: i64| at * 20 + (at * 7_919) % 5 - 2;
        let all: Vec<i64> = (0..200).chain(500..4_000).map(jitter).collect();
        let aside = aside(&mut rhythm, all.iter().copied());
        assert!(aside.len() <= 4 && aside.iter().all(|at| *at < 10_100), "{aside:?}");
    }
}
