//! Recognises, by content, our publications that a broker of version 3.1.1 sends back.
//!
//! A message of another publisher with the same topic and content within that time is taken for the echo once; the next one is
//! not.

use crate::clock::Uptime;
use std::collections::{BTreeMap, VecDeque};
use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

/// The number of publications remembered for each topic.
const COUNT_MAX: usize = 256;
/// How long a publication is remembered: an echo arrives at once, or after the next connection.
const AGE_MAX: Duration = Duration::from_secs(60);

#[derive(Debug, Default)]
pub(super) struct Echo {
    hasher: RandomState,
    sent: BTreeMap<String, VecDeque<Sent>>,
}

#[derive(Debug)]
struct Sent {
    content: u64,
    at: Uptime,
    /// Whether its echo has arrived; it may arrive again, marked as a duplicate.
    seen: bool,
}

impl Echo {
    /// Remembers a publication to a subscribed topic.
    pub(super) fn sent(&mut self, topic: &str, payload: &[u8], now: Uptime) {
        let sent = Sent { content: self.hasher.hash_one(payload), at: now, seen: false };
        let entry = self.sent.entry(topic.to_owned()).or_default();
        if entry.len() == COUNT_MAX {
            entry.pop_front();
        }
        entry.push_back(sent);
    }

    /// Whether a received message is our own.
    pub(super) fn is_own(&mut self, topic: &str, payload: &[u8], duplicate: bool, now: Uptime) -> bool {
        let Some(entry) = self.sent.get_mut(topic) else { return false };
        while entry.front().is_some_and(|sent| now.saturating_duration_since(sent.at) > AGE_MAX) {
            entry.pop_front();
        }
        let content = self.hasher.hash_one(payload);
        let found = entry.iter_mut().find(|sent| sent.content == content && (duplicate || !sent.seen));
        let is_own = found.is_some();
        found.into_iter().for_each(|sent| sent.seen = true);
        is_own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_publication_comes_back_once() {
        let (mut echo, now) = (Echo::default(), Uptime::now());
        echo.sent("a", b"1", now);
        echo.sent("a", b"1", now);
        let own: Vec<_> =
            [b"1", b"2", b"1", b"1"].map(|payload| echo.is_own("a", payload, false, now)).into();
        assert_eq!(own, [true, false, true, false]);
        assert!(echo.is_own("a", b"1", true, now), "a duplicate of an echo is one");
        assert!(!echo.is_own("b", b"1", false, now));
    }

    #[test]
    fn what_is_long_ago_is_forgotten() {
        let (mut echo, now) = (Echo::default(), Uptime::now());
        echo.sent("a", b"1", now);
        assert!(!echo.is_own("a", b"1", false, now + AGE_MAX + Duration::from_secs(1)));
        for _ in 0..=COUNT_MAX {
            echo.sent("a", b"2", now);
        }
        echo.sent("a", b"3", now);
        assert_eq!(echo.sent["a"].len(), COUNT_MAX);
    }
}
