//! Messages that the bus has not taken: counted by name and cause, and reported when the first is lost and when the count has
//! grown tenfold. Lost values are sent again while they are fresh.

use serde_json::{Value, json};
use shsa_bridge::BridgeError;
use shsa_core::engine::Publication;
use shsa_core::time::{Span, Time};
use std::collections::BTreeMap;

/// After a pause of this length, the next loss is reported like the first.
const QUIET: Span = Span::from_millis(60_000);
/// The first pause before a value is sent again; it doubles.
const PAUSE: Span = Span::from_millis(50);
/// The longest pause.
const PAUSE_MAX: Span = Span::from_millis(2_000);

/// A count that reports its first increase, and each increase to a further power of ten: an event that occurs a thousand times a
/// second is reported a few times.
#[derive(Clone, Debug, Default)]
pub(super) struct Swell {
    count: u64,
    last: Option<Time>,
}

impl Swell {
    /// Adds to the count; returns the new count if it is to be reported.
    pub(super) fn rise(&mut self, more: u64, now: Time) -> Option<u64> {
        if more == 0 {
            return None;
        }
        if self.last.is_some_and(|last| now - last > QUIET) {
            self.count = 0;
        }
        self.last = Some(now);
        let before = self.count;
        self.count = before.saturating_add(more);
        let is_larger = before == 0 || self.count.ilog10() > before.ilog10();
        is_larger.then_some(self.count)
    }
}

/// Counts of messages that were not sent, by name and cause.
#[derive(Debug, Default)]
pub(super) struct Undelivered {
    causes: BTreeMap<(String, &'static str), Cause>,
}

#[derive(Debug, Default)]
struct Cause {
    count: u64,
    swell: Swell,
    because: String,
}

impl Undelivered {
    /// Counts a message; returns a note if it is to be reported.
    pub(super) fn count(&mut self, name: &str, error: &BridgeError, now: Time) -> Option<String> {
        let key = (name.to_owned(), kind(error));
        let cause = self.causes.entry(key).or_default();
        cause.count += 1;
        cause.because = error.to_string();
        let described = match cause.swell.rise(1, now)? {
            1 => format!("a message on {name} was not sent: {error}"),
            count => format!("{count} messages on {name} were not sent: {error}"),
        };
        Some(described)
    }

    /// Name, kind of the cause, and number of messages since the beginning.
    pub(super) fn counts(&self) -> impl Iterator<Item = (&str, &'static str, u64)> {
        self.causes.iter().map(|((name, kind), cause)| (name.as_str(), *kind, cause.count))
    }

    /// The counts for the state: by name and kind of cause, with the last reason.
    pub(super) fn json(&self) -> Value {
        let mut names = serde_json::Map::new();
        for ((name, kind), cause) in &self.causes {
            let of_name = names.entry(name.as_str()).or_insert_with(|| json!({}));
            of_name[kind] = json!({ "count": cause.count, "because": cause.because });
        }
        names.into()
    }
}

fn kind(error: &BridgeError) -> &'static str {
    match error {
        BridgeError::Configuration(_) => "configuration",
        BridgeError::Refused(_) => "refused",
        BridgeError::Lost(_) => "lost",
    }
}

/// For so long after a refusal an instance claims no need that another one may be allowed to serve.
const BARRED: Span = Span::from_millis(60_000);

/// Whether the other side refuses what is sent under a name, as a broker does by its access list: nobody receives it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Refusal {
    last: Option<Time>,
}

impl Refusal {
    pub(super) fn note(&mut self, now: Time) {
        self.last = Some(now);
    }

    /// Whether a value was refused within the age that readers allow.
    pub(super) fn is_fresh(self, max_age: Span, now: Time) -> bool {
        self.last.is_some_and(|last| now - last <= max_age)
    }

    /// Whether another instance shall serve.
    pub(super) fn bars(self, now: Time) -> bool {
        self.last.is_some_and(|last| now - last < BARRED)
    }

    /// When the next of these answers changes by itself.
    pub(super) fn lasts_until(self, max_age: Span, now: Time) -> Time {
        let ends = self.last.into_iter().flat_map(|last| [last + max_age + Span(1), last + BARRED]);
        ends.filter(|end| *end > now).fold(Time::MAX, Time::min)
    }
}

/// The newest lost value of each name. It is sent again unless a newer value has gone out.
#[derive(Debug, Default)]
pub(super) struct Backlog {
    waiting: BTreeMap<String, Waiting>,
}

#[derive(Debug)]
struct Waiting {
    publication: Publication,
    again: Time,
    pause: Span,
}

impl Backlog {
    /// Takes in whether a value was sent under a name. A refused value would be refused again, so only a lost value is kept.
    pub(super) fn follow(
        &mut self,
        name: &str,
        publication: &Publication,
        sent: Result<(), &BridgeError>,
        now: Time,
    ) {
        if let Err(BridgeError::Lost(_)) = sent {
            let before = self.waiting.get(name).map(|waiting| waiting.pause);
            let pause = before.map_or(PAUSE, |pause| Span((pause.0 * 2).min(PAUSE_MAX.0)));
            let waiting = Waiting { publication: publication.clone(), again: now + pause, pause };
            self.waiting.insert(name.to_owned(), waiting);
        } else {
            self.waiting.remove(name);
        }
    }

    /// When the next value is to be sent again.
    pub(super) fn due(&self) -> Option<Time> {
        self.waiting.values().map(|waiting| waiting.again).min()
    }

    /// The next value to be sent again now. If it fails again, the next attempt is due after a pause.
    pub(super) fn next(&mut self, now: Time) -> Option<(String, Publication)> {
        let (name, waiting) = self.waiting.iter_mut().find(|(_, waiting)| waiting.again <= now)?;
        waiting.again = now + waiting.pause;
        Some((name.clone(), waiting.publication.clone()))
    }

    /// Drops the value of a name, which is too old or of another owner.
    pub(super) fn forget(&mut self, name: &str) {
        self.waiting.remove(name);
    }

    /// Drops all values: the needs have changed.
    pub(super) fn clear(&mut self) {
        self.waiting.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_reported_when_it_begins_and_when_it_has_grown_tenfold() {
        let mut swell = Swell::default();
        let described: Vec<u64> = (0..2_000).filter_map(|at| swell.rise(1, Time(at))).collect();
        assert_eq!(described, [1, 10, 100, 1_000]);
        assert_eq!(swell.rise(0, Time(0)), None);
        assert_eq!(swell.rise(30_000, Time(0)), Some(32_000));
        // After a quiet time, the count begins anew.
        let later = Time(0) + Span::from_millis(100_000);
        assert_eq!((swell.rise(1, later), swell.rise(1, later)), (Some(1), None));
    }

    #[test]
    fn causes_are_told_apart_and_counted() {
        let mut undelivered = Undelivered::default();
        let mut count = |error: BridgeError| undelivered.count("a", &error, Time(0));
        let refused = || BridgeError::Refused("17 bytes".into());
        assert_eq!(count(refused()).unwrap(), "a message on a was not sent: refused: 17 bytes");
        assert_eq!(count(refused()), None);
        assert!(count(BridgeError::Lost("gone".into())).unwrap().contains("connection lost: gone"));
        assert_eq!(undelivered.counts().collect::<Vec<_>>(), [("a", "lost", 1), ("a", "refused", 2)]);
        assert_eq!(undelivered.json()["a"]["refused"]["because"], "refused: 17 bytes");
    }
}
