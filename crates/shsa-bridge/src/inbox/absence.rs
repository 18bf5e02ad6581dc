//! Whether whoever reads was there all the time: what has waited meanwhile says nothing about now.
//!
//! A process that was suspended, a machine that stood still and a client whose messages a broker kept have one thing in common: what
//! arrives next may be as old as the absence was long, and is received as if it were of now. A pulse tells: it should beat all the time.

use super::Inbox;
use shsa_core::time::{Span, Time};
use std::sync::{Arc, PoisonError};

/// How often the pulse beats.
const PULSE: std::time::Duration = std::time::Duration::from_millis(100);
/// Who has not been seen for so long was away: a machine that is merely busy keeps a thread waiting for less.
const AWAY: Span = Span::from_millis(1_000);
/// What arrives within this time after an absence, and within a share of its length more, may have waited.
const DRAIN: Span = Span::from_millis(250);
const DRAIN_SHARE: i64 = 20;
const DRAIN_MAX: Span = Span::from_millis(5_000);

/// An absence that is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Absence {
    /// How long nobody was there.
    pub away: Span,
    /// Messages that may have waited meanwhile.
    pub waited: u64,
}

/// Notices absences.
#[derive(Debug, Default)]
pub(super) struct Attendance {
    /// When somebody was seen last; `None`: nobody looks.
    seen: Option<Time>,
    /// When whoever was away came back, until somebody asks.
    back: Option<Time>,
    /// The present absence, whose messages may still come, and until when.
    present: Option<(Absence, Time)>,
    /// One that is over and was not told yet.
    over: Option<Absence>,
}

impl Attendance {
    /// Somebody is there.
    pub(super) fn beat(&mut self, now: Time) {
        let away = self.seen.map_or(Span::ZERO, |seen| now - seen);
        if away >= AWAY {
            self.back = Some(now);
            self.was_away(away, now);
        }
        // A message may be handed on later than it was received.
        self.seen = self.seen.max(Some(now));
        if let Some((absence, until)) = self.present
            && now > until
        {
            self.present = None;
            self.over = Some(absence);
        }
    }

    /// Nobody was there for so long, up to now.
    pub(super) fn was_away(&mut self, away: Span, now: Time) {
        let drain = Span((DRAIN + Span(away.0 / DRAIN_SHARE)).0.min(DRAIN_MAX.0));
        let before = self.present.map(|(absence, _)| absence);
        let waited = before.map_or(0, |absence| absence.waited);
        let away = before.map_or(away, |absence| Span(absence.away.0.max(away.0)));
        self.present = Some((Absence { away, waited }, now + drain));
    }

    /// Whether a message that is received now may have waited.
    pub(super) fn has_waited(&mut self, now: Time) -> bool {
        if self.seen.is_some() {
            self.beat(now);
        }
        let Some((absence, until)) = &mut self.present else { return false };
        let has_waited = now <= *until;
        absence.waited += u64::from(has_waited);
        has_waited
    }

    /// Whether nobody was here until a moment ago; said once of an absence. What a broker has kept is none of ours.
    pub(super) fn has_come_back(&mut self, now: Time) -> bool {
        if self.seen.is_some() {
            self.beat(now);
        }
        self.back.take().is_some_and(|back| now - back < AWAY)
    }

    /// An absence that is over, told once.
    pub(super) fn take_over(&mut self) -> Option<Absence> {
        self.over.take()
    }
}

impl Inbox {
    /// Notices from now on when the process was suspended, or the machine stood still: what arrives then may have waited, and is
    /// marked as [`crate::Message::retained`]. A thread that does little else than sleep looks ten times a second, as long as the inbox is
    /// there. By a clock that somebody sets nobody is ever absent.
    ///
    /// # Errors
    /// When there can be no thread.
    pub fn attend(&self) -> std::io::Result<()> {
        if !self.clock.is_running() {
            return Ok(());
        }
        let (shared, clock) = (Arc::downgrade(&self.shared), self.clock.clone());
        self.lock().attendance.beat(clock.now());
        std::thread::Builder::new().name("pulse".into()).spawn(move || {
            while let Some(shared) = shared.upgrade() {
                shared.queues.lock().unwrap_or_else(PoisonError::into_inner).attendance.beat(clock.now());
                drop(shared);
                std::thread::sleep(PULSE);
            }
        })?;
        Ok(())
    }

    /// The messages that arrive next may have waited for so long: a broker has kept them while the connection was gone.
    #[cfg_attr(not(feature = "mqtt"), allow(dead_code, reason = "only brokers of MQTT keep messages"))]
    pub(crate) fn was_away(&self, away: Span) {
        let now = self.clock.now();
        self.lock().attendance.was_away(away, now);
    }

    /// Whether nobody was here until a moment ago; said once of an absence.
    #[cfg_attr(
        not(feature = "mqtt"),
        allow(dead_code, reason = "only MQTT hands on what it cannot take back")
    )]
    pub(crate) fn has_come_back(&self) -> bool {
        let now = self.clock.now();
        self.lock().attendance.has_come_back(now)
    }

    /// An absence whose messages have all come, told once.
    #[must_use]
    pub fn absence(&self) -> Option<Absence> {
        self.lock().attendance.take_over()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Time {
        Time(milliseconds * 1_000_000)
    }

    #[test]
    fn what_waited_while_nobody_was_there_is_known() {
        let mut attendance = Attendance::default();
        assert!(!attendance.has_waited(at(0)), "nobody looks");
        attendance.beat(at(0));
        attendance.beat(at(600));
        assert!(!attendance.has_waited(at(900)), "it was busy");
        assert!(attendance.has_waited(at(12_900)), "the message comes before the pulse");
        attendance.beat(at(12_910));
        assert!(attendance.has_waited(at(13_700)));
        assert_eq!(attendance.take_over(), None, "it is not over");
        assert!(!attendance.has_waited(at(13_800)));
        let over = attendance.take_over().unwrap();
        assert_eq!((over.away, over.waited), (Span::from_millis(12_000), 2));
        assert_eq!(attendance.take_over(), None, "told once");
    }

    #[test]
    fn a_message_that_is_handed_on_late_makes_nobody_absent() {
        let mut attendance = Attendance::default();
        attendance.beat(at(5_000));
        assert!(!attendance.has_waited(at(1_000)));
        attendance.beat(at(5_100));
        assert!(!attendance.has_waited(at(5_110)));
    }

    #[test]
    fn an_absence_of_the_connection_alone_counts_too() {
        let mut attendance = Attendance::default();
        attendance.was_away(Span::from_millis(1_000), at(0));
        assert!(attendance.has_waited(at(300)));
        assert!(!attendance.has_waited(at(301)));
    }

    #[test]
    fn who_comes_back_is_told_so_once_and_soon() {
        let at = |seconds: f64| Time(0) + Span::from_seconds(seconds);
        let mut attendance = Attendance::default();
        attendance.beat(at(0.0));
        assert!(!attendance.has_come_back(at(0.1)));
        assert!(attendance.has_come_back(at(5.0)) && !attendance.has_come_back(at(5.1)));
        // The broker was away, and not we.
        attendance.was_away(Span::from_seconds(3.0), at(5.2));
        assert!(!attendance.has_come_back(at(5.3)));
        attendance.beat(at(9.0));
        attendance.beat(at(9.9));
        attendance.beat(at(10.8));
        assert!(!attendance.has_come_back(at(10.9)), "too long ago");
    }
}
