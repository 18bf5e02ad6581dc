//! Detects messages held back by their sender or by the transport while a signal was silent. They come faster than the signal's
//! rate, and without a stamp their age is unknown.

use shsa_core::knowledge::Signal;
use shsa_core::time::{Span, Time};

/// This many pauses in a row of at least half a period show that the signal has its rate again: a burst may be interrupted once.
const PAUSES: u32 = 2;
/// For periods from this one on, one pause is enough: no burst is interrupted for so long.
const SLOW: Span = Span::from_millis(1_000);
/// After a silence the rate is checked for as long as the silence lasted, within these bounds.
const LEAST: Span = Span::from_millis(250);
const MOST: Span = Span::from_millis(5_000);

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
    /// `None`: the signal's rate or timeout is unknown.
    expected: Option<Expected>,
    last: Option<Time>,
    present: Option<Return>,
    over: Option<HeldBack>,
}

#[derive(Clone, Copy, Debug)]
struct Expected {
    period: Span,
    timeout: Span,
}

/// The time after a silence in which the rate is checked.
#[derive(Clone, Copy, Debug)]
struct Return {
    until: Time,
    /// Pauses in a row so far.
    pauses: u32,
    backlog: HeldBack,
}

impl Rhythm {
    pub(super) fn new(signal: &Signal) -> Rhythm {
        let period = signal.rate_hz.map(|rate| Span::from_seconds(1.0 / rate)).filter(|it| *it > Span::ZERO);
        let expected = period.zip(signal.timeout).map(|(period, timeout)| Expected { period, timeout });
        Rhythm { expected, ..Rhythm::default() }
    }

    /// Whether a message received now may have been held back. If this is known already (`is_known`), the message is not counted.
    pub(super) fn has_waited(&mut self, now: Time, is_known: bool) -> bool {
        let Some(Expected { period, timeout }) = self.expected else { return false };
        let silence = self.last.map_or(Span::ZERO, |last| now - last);
        self.last = self.last.max(Some(now));
        if silence > timeout {
            let until = now + silence.clamp(LEAST, MOST);
            self.end();
            let backlog = HeldBack { silence, count: 0 };
            self.present = Some(Return { until, pauses: 0, backlog });
        }
        let Some(back) = self.present.as_mut().filter(|back| now <= back.until) else {
            self.end();
            return false;
        };
        let is_first = silence > timeout;
        let is_pause = !is_first && silence.0 >= period.0 / 2;
        back.pauses = if is_pause { back.pauses + 1 } else { 0 };
        let has_waited = back.pauses < if period < SLOW { PAUSES } else { 1 };
        back.backlog.count += u64::from(has_waited && !is_known);
        has_waited
    }

    /// The messages held back in a past silence; reported once. The first messages after a silence do not count.
    pub(super) fn take_over(&mut self, now: Time) -> Option<HeldBack> {
        if self.present.is_some_and(|back| now > back.until) {
            self.end();
        }
        self.over.take().filter(|backlog| backlog.count > u64::from(PAUSES))
    }

    fn end(&mut self) {
        self.over = self.present.take().map(|back| back.backlog).or(self.over);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: &str =
        "{shsa: 1, variables: {v: {}}, signals: {s: {variable: v, rate: 50 Hz, timeout: 500 ms}}}";

    fn rhythm(model: &str) -> Rhythm {
        let knowledge = shsa_format::model::load(model, "test.yaml").knowledge;
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
        assert!(after.iter().all(|at| *at < 9_040 + 2 * 20), "{after:?}");
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

    #[test]
    fn where_no_rate_is_known_nothing_has_waited() {
        let mut rhythm =
            rhythm("{shsa: 1, variables: {v: {}}, signals: {s: {variable: v, timeout: 500 ms}}}");
        assert_eq!(aside(&mut rhythm, [0, 20, 9_000, 9_000, 9_000]), [0; 0]);
    }
}
