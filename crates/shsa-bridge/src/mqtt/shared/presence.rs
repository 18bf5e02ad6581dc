//! What others are told of this client: whether it is there, and what it claims. Those of later are told, too.

use super::{Publication, Shared, State};
use crate::clock::Uptime;
use crate::mqtt::claims::EXPIRES;
use bytes::Bytes;

impl Shared {
    /// Who claims what is heard from now on.
    pub(in crate::mqtt) fn watch_claims(&self) {
        let mut state = self.lock();
        if state.sender.is_some() && !state.wants_everything {
            state.requests.extend(self.claims.topics().map(|topic| (topic, true)));
            // It comes back after what others claim.
            self.say_claims(&mut state);
            state.pump();
        }
    }

    /// Says again what this client claims.
    pub(in crate::mqtt) fn renew_claims(&self) {
        self.claims.renew();
        self.claim();
    }

    /// Says what this client claims.
    pub(in crate::mqtt) fn claim(&self) {
        let mut state = self.lock();
        self.say_claims(&mut state);
        state.pump();
    }

    /// Says that this client is there, and what it claims.
    pub(super) fn say_here(&self, state: &mut State) {
        if let Some(presence) = &self.presence {
            self.say(state, &presence.topic, presence.here.clone(), None);
        }
        self.say_claims(state);
    }

    /// Says that this client leaves, and takes back what it claims.
    pub(super) fn say_gone(&self, state: &mut State) {
        if let Some(presence) = &self.presence {
            self.say(state, &presence.topic, presence.gone.clone(), None);
        }
        if let Some((topic, _)) = self.claims.said() {
            self.say(state, &topic, Bytes::new(), None);
        }
    }

    fn say_claims(&self, state: &mut State) {
        let Some((topic, words)) = self.claims.said() else { return };
        let until = (!words.is_empty()).then(|| Uptime::now() + EXPIRES);
        self.say(state, &topic, words.into(), until);
    }

    fn say(&self, state: &mut State, topic: &str, words: Bytes, until: Option<Uptime>) {
        let said = Publication::new(topic.into(), words, self.inbox.clock().now());
        // Alone: what was said before and may not have arrived is out of date.
        let _older = state.outbox.keep(Publication { retain: true, until, ..said }, 1);
    }
}
