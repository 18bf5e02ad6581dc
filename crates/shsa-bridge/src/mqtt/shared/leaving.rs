//! Publications in the library's queue, which cannot be taken back one by one.

use super::{Publication, Sender, Shared, State};
use crate::clock::Uptime;
use std::collections::VecDeque;
use std::sync::Arc;

/// The topics of publications that were passed to the library, in order, with their expiry.
#[derive(Debug, Default)]
pub(super) struct Leaving(VecDeque<(Arc<str>, Option<Uptime>)>);

impl Leaving {
    pub(super) fn push(&mut self, publication: &Publication) {
        self.0.push_back((publication.topic.clone(), publication.until));
    }

    /// The next publication was written; returns its topic.
    pub(super) fn pop(&mut self) -> Option<Arc<str>> {
        self.0.pop_front().map(|(topic, _)| topic)
    }

    /// Forgets all: a new connection has an empty queue.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Whether any publication has expired.
    fn are_over(&self, now: Uptime) -> bool {
        self.0.iter().any(|(_, until)| until.is_some_and(|until| until <= now))
    }
}

impl Shared {
    /// Whether expired publications are queued after an absence: they would be sent as if they were new. Only the end of the
    /// connection takes them back. A slow broker alone is no reason for that.
    pub(in crate::mqtt) fn is_overtaken(&self) -> bool {
        let are_over = self.lock().leaving.are_over(Uptime::now());
        are_over && self.inbox.has_come_back()
    }
}

impl State {
    /// Takes in that a publication was passed to the library, and expects its echo.
    pub(super) fn handed_over(&mut self, publication: &Publication) {
        self.leaving.push(publication);
        let is_subscribed = self.wants_everything || self.wanted.contains(&publication.topic);
        if is_subscribed && !self.sender.as_ref().is_some_and(Sender::has_no_echo) {
            self.echo.sent(&publication.topic, &publication.payload, Uptime::now());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytes::Bytes;
    use shsa_core::time::Time;
    use std::time::Duration;

    #[test]
    fn what_is_of_use_for_ever_is_never_over_and_what_was_written_is_forgotten() {
        let now = Uptime::now();
        let publication =
            |until| Publication { until, ..Publication::new("a".into(), Bytes::new(), Time(0)) };
        let mut leaving = Leaving::default();
        leaving.push(&publication(None));
        assert!(!leaving.are_over(now + Duration::from_secs(60)));
        leaving.push(&publication(Some(now + Duration::from_secs(1))));
        assert!(!leaving.are_over(now));
        assert!(leaving.are_over(now + Duration::from_secs(1)));
        assert_eq!((leaving.pop().as_deref(), leaving.pop().as_deref()), (Some("a"), Some("a")));
        assert!(!leaving.are_over(now + Duration::from_secs(60)) && leaving.pop().is_none());
    }
}
