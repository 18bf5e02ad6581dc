//! The stamps of one source by our clock, when our wall clock is stepped: those of the same machine step as well, those of other
//! machines do not.

use super::{Clock, ON_ITS_WAY, Steps};
use shsa_core::time::{Span, Time};

/// The weight of a message in the mean age is one in so many.
const SHARE: i64 = 16;

/// Converts the wall-clock stamps of one source. After a step of our own wall clock, its stamps show whether its clock was stepped,
/// too: of both conversions, the one is right by which messages are as old as they were before.
#[derive(Clone, Copy, Debug, Default)]
pub struct SourceClock {
    /// The lead of the source's clock over ours; `None` before the first stamp.
    lead: Option<i64>,
    /// The number of our wall clock's steps that the lead has taken in.
    steps: u64,
    /// The mean age of its messages at their reception, not negative.
    usual: Span,
}

/// A conversion of a stamp.
#[derive(Clone, Copy)]
struct Reading {
    lead: i64,
    time: Time,
    age: Span,
}

impl SourceClock {
    /// A message's wall-clock stamp as a time of `clock`.
    pub fn steady(&mut self, clock: &Clock, stamp: Time, received: Time) -> Time {
        match clock.steps() {
            Some(steps) => self.steady_by(steps, stamp, received),
            None => stamp,
        }
    }

    fn steady_by(&mut self, steps: Steps, stamp: Time, received: Time) -> Time {
        let read = |lead: i64| {
            let time = Time(stamp.0.saturating_sub(lead));
            Reading { lead, time, age: received - time }
        };
        let (new, old) = (read(steps.ahead), read(self.lead.unwrap_or(steps.was_ahead)));
        let is_decided = new.lead == old.lead || (received - steps.last).0 > ON_ITS_WAY;
        let chosen = if self.steps == steps.number { self.later(old, new) } else { self.nearer(old, new) };
        if is_decided {
            (self.lead, self.steps) = (Some(chosen.lead), steps.number);
        }
        self.usual = Span((self.usual.0 + (chosen.age.0 - self.usual.0) / SHARE).max(0));
        chosen.time
    }

    /// The conversion by which the message is as old as usual.
    fn nearer(&self, old: Reading, new: Reading) -> Reading {
        if self.surprise(new) < self.surprise(old) { new } else { old }
    }

    /// The conversion as before; but no message comes from the future, so the clock of the source was stepped after ours.
    fn later(&self, old: Reading, new: Reading) -> Reading {
        let is_future = old.age.0 < -(new.lead - old.lead).abs() / 2;
        if is_future { self.nearer(old, new) } else { old }
    }

    fn surprise(&self, reading: Reading) -> u64 {
        reading.age.0.abs_diff(self.usual.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// A source with messages every 100 ms that are so old at their reception; our clock is stepped at 10 s, its clock at another
    /// time, if it is. Returns the greatest error of a time after `settled` in milliseconds, and the greatest one at all.
    fn errors(step_ms: i64, age_ms: i64, period_ms: i64, other: Option<i64>) -> (i64, i64) {
        let mut source = SourceClock::default();
        let (mut after, mut all) = (0, 0);
        for at in (0..40_000).step_by(period_ms as usize) {
            let is_stepped = at >= 10_000;
            let steps = Steps {
                number: u64::from(is_stepped),
                ahead: if is_stepped { step_ms * MS } else { 0 },
                was_ahead: 0,
                last: if is_stepped { Time(10_000 * MS) } else { Time::MIN },
            };
            let stamped = at - age_ms;
            let lead = if other.is_some_and(|other| stamped >= other) { step_ms } else { 0 };
            let stamp = Time((stamped + lead) * MS);
            let time = source.steady_by(steps, stamp, Time(at * MS));
            let error = (time.0 / MS - stamped).abs();
            all = all.max(error);
            if at >= other.unwrap_or(10_000) + 3_000 {
                after = after.max(error);
            }
        }
        (after, all)
    }

    #[test]
    fn a_step_of_ours_moves_no_stamp_of_another_machine() {
        for step in [3_000_i64, -3_000, 100, 3_600_000, -3_600_000] {
            for (age, period) in [(5, 100), (40, 20), (300, 5_000)] {
                if step.abs() > 2 * age {
                    assert_eq!(errors(step, age, period, None), (0, 0), "{step} {age}");
                }
            }
        }
    }

    #[test]
    fn what_steps_with_us_is_followed_also_what_was_on_its_way() {
        for step in [3_000, -3_000, 3_600_000] {
            assert_eq!(errors(step, 30, 20, Some(10_000)), (0, 0), "{step}");
        }
    }

    #[test]
    fn a_source_whose_messages_are_old_keeps_their_age() {
        for step in [3_000, -3_000] {
            assert_eq!(errors(step, 2_000, 100, None).0, 0, "{step}");
        }
    }

    #[test]
    fn a_source_that_is_set_ahead_later_is_followed_then() {
        assert_eq!(errors(3_000, 30, 20, Some(20_000)), (0, 0));
    }
}
