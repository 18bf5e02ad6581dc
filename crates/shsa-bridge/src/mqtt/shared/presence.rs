//! Tells other clients that this one is connected, and its claims; retained for later clients.

use super::{Publication, Shared, State};
use crate::clock::Uptime;
use crate::mqtt::claims::EXPIRES;
use bytes::Bytes;

impl Shared {
    /// Subscribes to the claims of all clients.
    pub(in crate::mqtt) fn watch_claims(&self) {
        let mut state = self.lock();
        if state.sender.is_some() && !state.wants_everything {
            state.requests.extend(self.claims.topics().map(|topic| (topic, true)));
            // The own claims come back after the claims of others.
            self.publish_claims(&mut state);
            state.pump();
        }
    }

    /// Publishes the own claims again.
    pub(in crate::mqtt) fn renew_claims(&self) {
        self.claims.renew();
        self.claim();
    }

    /// Publishes the own claims.
    pub(in crate::mqtt) fn claim(&self) {
        let mut state = self.lock();
        self.publish_claims(&mut state);
        state.pump();
    }

    /// Publishes that this client is connected, and its claims.
    pub(super) fn publish_here(&self, state: &mut State) {
        if let Some(presence) = &self.presence {
            self.send_kept(state, &presence.topic, presence.here.clone(), None);
        }
        self.publish_claims(state);
    }

    /// Publishes that this client leaves, and ends its claims.
    pub(super) fn publish_gone(&self, state: &mut State) {
        if let Some(presence) = &self.presence {
            self.send_kept(state, &presence.topic, presence.gone.clone(), None);
        }
        if let Some((topic, _)) = self.claims.own_message() {
            self.send_kept(state, &topic, Bytes::new(), None);
        }
    }

    fn publish_claims(&self, state: &mut State) {
        let Some((topic, words)) = self.claims.own_message() else { return };
        let until = (!words.is_empty()).then(|| Uptime::now() + EXPIRES);
        self.send_kept(state, &topic, words.into(), until);
    }

    fn send_kept(&self, state: &mut State, topic: &str, words: Bytes, until: Option<Uptime>) {
        let publication = Publication::new(topic.into(), words, self.inbox.clock().now());
        // With a depth of 1, an earlier text that may not have arrived is replaced.
        let _older = state.outbox.keep(Publication { retain: true, until, ..publication }, 1);
    }
}
