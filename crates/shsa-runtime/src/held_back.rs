//! What has waited with its sender, or on its way, while a signal was silent: it comes faster than the signal's rate, and without a
//! stamp of its own nobody knows how old it is.

use shsa_core::knowledge::Signal;
use shsa_core::time::{Span, Time};

/// After so many pauses in a row of half a period at least there is a rhythm: a burst may be held up once.
const PAUSES: u32 = 2;
/// Of slow signals one pause is enough: no burst is held up for so long.
const SLOW: Span = Span::from_millis(1_000);
/// After a silence the rate is looked at for as long as the silence was, within these bounds.
const LEAST: Span = Span::from_millis(250);
const MOST: Span = Span::from_millis(5_000);

/// A silence that is over, and what has come at once after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HeldBack {
    /// How long the signal was silent.
    pub(super) silence: Span,
    /// How many messages were left aside.
    pub(super) count: u64,
}

/// The rhythm of one signal's messages without stamps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rhythm {
    /// `None`: nobody knows its rate, or when it is silent.
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

/// A signal that was silent speaks again.
#[derive(Clone, Copy, Debug)]
struct Return {
    until: Time,
    /// Pauses in a row, up to now.
    pauses: u32,
    backlog: HeldBack,
}

impl Rhythm {
    pub(super) fn new(signal: &Signal) -> Rhythm {
        let period = signal.rate_hz.map(|rate| Span::from_seconds(1.0 / rate)).filter(|it| *it > Span::ZERO);
        let expected = period.zip(signal.timeout).map(|(period, timeout)| Expected { period, timeout });
        Rhythm { expected, ..Rhythm::default() }
    }

    /// Whether a message that is received now may have waited since before; where that is known already, it is not counted here.
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

    /// A backlog that is over, told once. The first messages after a silence are none.
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

    /// Which of the messages at these moments, milliseconds, are left aside.
    fn aside(rhythm: &mut Rhythm, moments: impl IntoIterator<Item = i64>) -> Vec<i64> {
        moments.into_iter().filter(|at| rhythm.has_waited(Time(at * 1_000_000), false)).collect()
    }

    #[test]
    fn a_burst_after_a_silence_has_waited() {
        let mut rhythm = rhythm(RATE);
        assert_eq!(aside(&mut rhythm, (0..200).map(|at| at * 20)), [0; 0]);
        // It was silent from 3980 to 9000; what it had kept comes in 25 ms, with a pause.
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
