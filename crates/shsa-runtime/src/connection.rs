//! The connection of a run to its bus, and its outages.

use serde_json::{Value, json};
use shsa_bridge::{Clock, Link, Outage};
use shsa_core::time::{Span, Time};

/// The kind and the text of a note.
type Note = (&'static str, String);

/// The last known state of the connection.
#[derive(Debug, Default)]
pub(super) struct Connection {
    /// The number of outages.
    losses: u64,
    /// The total time of all outages before the present one.
    away: Span,
    /// The last outage.
    last: Option<Outage>,
    /// The number of the last outage of the bridge that was taken in.
    looked_at: u64,
}

impl Connection {
    /// Takes in the present link, and the last outage of a bridge that counts its own; returns notes to report.
    pub(super) fn follow(&mut self, link: Link, outage: Option<Outage>, now: Time) -> Vec<Note> {
        let mut notes = Vec::new();
        if let Some(outage) = outage {
            let unseen = outage.number - self.looked_at;
            if unseen > 0 {
                // The connection was lost twice: the end of the first outage was not seen.
                notes.extend(self.find(outage.lost));
                self.looked_at = outage.number;
                self.losses += unseen - 1;
                let times = if unseen > 1 { format!(", {unseen} times") } else { String::new() };
                notes.extend(self.lose(outage.lost, &outage.because, &times));
            }
            notes.extend(outage.found.and_then(|found| self.find(found)));
        } else {
            notes.extend(match link {
                Link::Up => self.find(now),
                Link::Down(why) => self.lose(now, &why, ""),
            });
        }
        notes
    }

    fn is_away(&self) -> bool {
        self.last.as_ref().is_some_and(|last| last.found.is_none())
    }

    fn lose(&mut self, lost: Time, because: &str, times: &str) -> Option<Note> {
        if self.is_away() {
            return None;
        }
        self.losses += 1;
        let because = because.to_owned();
        let described = format!("the bus is gone{times}: {because}; trying again");
        self.last = Some(Outage { number: self.losses, lost, found: None, because });
        Some(("disconnected", described))
    }

    fn find(&mut self, found: Time) -> Option<Note> {
        let last = self.last.as_mut().filter(|last| last.found.is_none())?;
        last.found = Some(found);
        let away = found - last.lost;
        self.away = self.away + away;
        Some(("connected", format!("the bus is there again after {:.3} s", away.seconds())))
    }

    /// The number of outages and their total time.
    pub(super) fn figures(&self, now: Time) -> (u64, Span) {
        let present = self.last.as_ref().filter(|last| last.found.is_none());
        (self.losses, self.away + present.map_or(Span::ZERO, |last| now - last.lost))
    }

    /// The last outage as in status and state; `null` if there was none.
    pub(super) fn json(&self, clock: &Clock) -> Value {
        self.last.as_ref().map_or(Value::Null, |last| {
            json!({
                "number": last.number,
                "lost_ns": clock.by_wall(last.lost).0,
                "for_s": last.found.map(|found| (found - last.lost).seconds()),
                "because": last.because,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(seconds: f64) -> Time {
        Time::from_seconds(seconds)
    }

    fn outage(number: u64, lost: f64, found: Option<f64>) -> Option<Outage> {
        let because = "cut".to_owned();
        Some(Outage { number, lost: seconds(lost), found: found.map(seconds), because })
    }

    #[track_caller]
    fn check(connection: &mut Connection, link: Link, outage: Option<Outage>, now: f64, expected: &[&str]) {
        let described: Vec<String> = connection
            .follow(link, outage, seconds(now))
            .into_iter()
            .map(|(kind, why)| format!("{kind}: {why}"))
            .collect();
        assert_eq!(described, expected);
    }

    #[test]
    fn what_is_looked_at_tells_when_it_is_lost_and_found() {
        let mut connection = Connection::default();
        let down = || Link::Down("nobody".to_owned());
        check(&mut connection, Link::Up, None, 1.0, &[]);
        check(&mut connection, down(), None, 2.0, &["disconnected: the bus is gone: nobody; trying again"]);
        check(&mut connection, down(), None, 3.0, &[]);
        assert_eq!(connection.figures(seconds(4.0)), (1, Span::from_seconds(2.0)));
        check(&mut connection, Link::Up, None, 5.0, &["connected: the bus is there again after 3.000 s"]);
        assert_eq!(connection.figures(seconds(9.0)), (1, Span::from_seconds(3.0)));
    }

    #[test]
    fn what_was_over_before_anybody_looked_is_reported_as_well() {
        let mut connection = Connection::default();
        let described = [
            "disconnected: the bus is gone: cut; trying again",
            "connected: the bus is there again after 0.250 s",
        ];
        check(&mut connection, Link::Up, outage(1, 2.0, Some(2.25)), 3.0, &described);
        check(&mut connection, Link::Up, outage(1, 2.0, Some(2.25)), 4.0, &[]);
        let again = "disconnected: the bus is gone, 3 times: cut; trying again";
        check(&mut connection, Link::Down("cut".to_owned()), outage(4, 5.5, None), 6.0, &[again]);
        assert_eq!(connection.figures(seconds(6.5)), (4, Span::from_seconds(1.25)));
        let found = "connected: the bus is there again after 2.500 s";
        check(&mut connection, Link::Up, outage(4, 5.5, Some(8.0)), 8.5, &[found]);
    }

    #[test]
    fn who_was_never_connected_is_when_it_is() {
        let mut connection = Connection::default();
        let never = "disconnected: the bus is gone: not yet; trying again";
        check(&mut connection, Link::Down("not yet".to_owned()), None, 1.0, &[never]);
        let described = [
            "connected: the bus is there again after 1.000 s",
            "disconnected: the bus is gone: cut; trying again",
        ];
        check(&mut connection, Link::Down("cut".to_owned()), outage(1, 2.0, None), 2.5, &described);
    }
}
