//! Tells other clients that this one is connected, and its claims, retained for later clients; and passes
//! messages to the profile of the connection.

use super::{Arrived, Publication, Shared, State};
use crate::clock::Uptime;
use crate::mqtt::claims::EXPIRES;
use crate::mqtt::options::Presence;
use crate::mqtt::profile::Will;
use bytes::Bytes;

impl Shared {
    /// The will of the next connection.
    pub(in crate::mqtt) fn will(&self) -> Option<Will> {
        let of_presence = |presence: &Presence| Will {
            topic: presence.topic.clone(),
            payload: presence.gone.clone(),
            retain: true,
        };
        let of_profile = self.profile.as_ref().and_then(|profile| profile.will());
        of_profile.or_else(|| self.presence.as_ref().map(of_presence))
    }

    /// Subscribes to the claims of all clients.
    pub(in crate::mqtt) fn watch_claims(&self) {
        let mut state = self.lock();
        if state.sender.is_some() && !state.wants_everything {
            state.requests.extend(self.claims.topics().map(|topic| (topic, true)));
            // The own claims come back after the claims of others.
            self.publish_claims(&mut state);
            state.pump(self.profile.as_deref());
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
        state.pump(self.profile.as_deref());
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

    /// Requests the subscriptions of the profile, and queues its first messages.
    pub(super) fn begin_profile(&self, state: &mut State) {
        let Some(profile) = &self.profile else { return };
        let filters = profile.filters();
        state.followed = filters.iter().cloned().collect();
        state.requests.extend(filters.into_iter().map(|filter| (filter, true)));
        state.ahead.extend(profile.connected());
    }

    /// Takes in new subscriptions of the profile, and sends its messages.
    pub(in crate::mqtt) fn follow_profile(&self, publications: impl IntoIterator<Item = Publication>) {
        let Some(profile) = &self.profile else { return };
        let mut state = self.lock();
        if state.sender.is_none() {
            return;
        }
        for filter in profile.filters() {
            if state.followed.insert(filter.clone()) {
                state.requests.push_back((filter, true));
            }
        }
        state.ahead.extend(publications);
        state.pump(Some(profile.as_ref()));
    }

    /// Passes a message to the profile, whose answers follow; whether it is one of the profile.
    pub(super) fn pass_profile(&self, arrived: &Arrived) -> bool {
        let Some(answers) = self.profile.as_ref().and_then(|profile| profile.arrived(arrived)) else {
            return false;
        };
        if !answers.is_empty() {
            self.lock().ahead.extend(answers);
        }
        true
    }
}
