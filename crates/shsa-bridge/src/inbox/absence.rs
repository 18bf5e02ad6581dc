//! Detects whether the reader was away: messages that waited meanwhile may be outdated.
//!
//! A suspended process, a stopped machine and a client whose messages a broker kept have one thing in common: the next messages
//! may be as old as the absence was long, but are received as if they were new. A pulse that should beat all the time tells the
//! absence.

use super::Inbox;
use shsa_core::time::{Span, Time};
use std::sync::{Arc, PoisonError};

/// How often the pulse beats.
const PULSE: std::time::Duration = std::time::Duration::from_millis(100);
/// After a pause of this length, the process was away: a busy machine delays a thread for less.
const AWAY: Span = Span::from_millis(1_000);
/// Messages within this time after an absence, plus a share of its length, may have waited.
const DRAIN: Span = Span::from_millis(250);
const DRAIN_SHARE: i64 = 20;
const DRAIN_MAX: Span = Span::from_millis(5_000);

/// A past absence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Absence {
    /// Its length.
    pub away: Span,
    /// The number of messages that may have waited meanwhile.
    pub waited: u64,
}

/// Detects absences.
#[derive(Debug, Default)]
pub(super) struct Attendance {
    /// The time of the last beat; `None`: absences are not detected.
    seen: Option<Time>,
    /// The end of the last absence, until [`Attendance::has_come_back`] takes it.
    back: Option<Time>,
    /// The present absence, and the time until which its messages may arrive.
    present: Option<(Absence, Time)>,
    /// A past absence that was not reported yet.
    over: Option<Absence>,
}

impl Attendance {
    /// The process is active.
    pub(super) fn beat(&mut self, now: Time) {
        let away = self.seen.map_or(Span::ZERO, |seen| now - seen);
        if away >= AWAY {
            self.back = Some(now);
            self.was_away(away, now);
        }
        // A message may be passed on after its reception.
        self.seen = self.seen.max(Some(now));
        if let Some((absence, until)) = self.present
            && now > until
        {
            self.present = None;
            self.over = Some(absence);
        }
    }

    /// There was an absence of this length, until now.
    pub(super) fn was_away(&mut self, away: Span, now: Time) {
        let drain = Span((DRAIN + Span(away.0 / DRAIN_SHARE)).0.min(DRAIN_MAX.0));
        let before = self.present.map(|(absence, _)| absence);
        let waited = before.map_or(0, |absence| absence.waited);
        let away = before.map_or(away, |absence| Span(absence.away.0.max(away.0)));
        self.present = Some((Absence { away, waited }, now + drain));
    }

    /// Whether a message received now may have waited.
    pub(super) fn has_waited(&mut self, now: Time) -> bool {
        if self.seen.is_some() {
            self.beat(now);
        }
        let Some((absence, until)) = &mut self.present else { return false };
        let has_waited = now <= *until;
        absence.waited += u64::from(has_waited);
        has_waited
    }

    /// Whether the process was away until a moment ago; true once for each absence. Absences reported by a broker do not count.
    pub(super) fn has_come_back(&mut self, now: Time) -> bool {
        if self.seen.is_some() {
            self.beat(now);
        }
        self.back.take().is_some_and(|back| now - back < AWAY)
    }

    /// A past absence; reported once.
    pub(super) fn take_over(&mut self) -> Option<Absence> {
        self.over.take()
    }
}

impl Inbox {
    /// Detects from now on when the process was suspended or the machine stood still: messages that arrive then may have waited,
    /// and are marked as [`crate::Message::retained`]. While the inbox exists, a thread that otherwise sleeps beats ten times a
    /// second. With a manual clock there are no absences.
    ///
    /// # Errors
    /// When no thread can be started.
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

    /// The next messages may have waited for this long: a broker has kept them while there was no connection.
    #[cfg_attr(not(feature = "mqtt"), allow(dead_code, reason = "only brokers of MQTT keep messages"))]
    pub(crate) fn was_away(&self, away: Span) {
        let now = self.clock.now();
        self.lock().attendance.was_away(away, now);
    }

    /// Whether the process was away until a moment ago; true once for each absence.
    #[cfg_attr(
        not(feature = "mqtt"),
        allow(dead_code, reason = "only MQTT hands on what it cannot take back")
    )]
    pub(crate) fn has_come_back(&self) -> bool {
        let now = self.clock.now();
        self.lock().attendance.has_come_back(now)
    }

    /// A past absence whose messages have all arrived; reported once.
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
    fn an_absence_is_noticed_once_and_soon() {
        let at = |seconds: f64| Time(0) + Span::from_seconds(seconds);
        let mut attendance = Attendance::default();
        attendance.beat(at(0.0));
        assert!(!attendance.has_come_back(at(0.1)));
        assert!(attendance.has_come_back(at(5.0)) && !attendance.has_come_back(at(5.1)));
        // Only the connection to the broker was away, not this process.
        attendance.was_away(Span::from_seconds(3.0), at(5.2));
        assert!(!attendance.has_come_back(at(5.3)));
        attendance.beat(at(9.0));
        attendance.beat(at(9.9));
        attendance.beat(at(10.8));
        assert!(!attendance.has_come_back(at(10.9)), "too long ago");
    }
}
