//! Tells other clients that this one is connected, and its claims, retained for later clients; and passes
//! messages to the profile of the connection.

use super::{Arrived, Publication, Shared, State};
use crate::BridgeError;
use crate::clock::Uptime;
use crate::mqtt::claims::{EXPIRES, RENEWED};
use crate::mqtt::options::Presence;
use crate::mqtt::profile::Will;
use bytes::Bytes;

/// So many bytes of a forged text are shown.
const SHOWN: usize = 40;

/// What is done against forged words about this client.
#[derive(Debug, Default)]
pub(super) struct Corrections {
    /// Whether the status that this client is here has come back from the broker since it is connected.
    pub(super) is_known_here: bool,
    /// When something forged was corrected, and whether another correction is due.
    last: Option<Uptime>,
    is_due: bool,
    /// The report of a status that may be the own last will.
    doubt: Option<BridgeError>,
}

impl Corrections {
    /// A new connection: what was heard at the end of the one before was the own last will.
    pub(super) fn connected(&mut self) {
        (self.is_known_here, self.doubt) = (false, None);
    }
}

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
        let mut state = self.lock();
        if let Some(forged) = state.corrections.doubt.take() {
            state.trouble(forged);
        }
        if std::mem::take(&mut state.corrections.is_due) {
            self.publish_here(&mut state);
        }
        drop(state);
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

    /// Takes in a message; returns whether it is about the claims or the presence of a client.
    pub(super) fn hear_of_clients(&self, topic: &str, words: &[u8], retained: bool) -> bool {
        let is_claim = self.claims.receive(topic, words, retained);
        if is_claim {
            self.hear_of_itself(topic, words);
        }
        is_claim
    }

    /// Takes in a message about this client: its status or its claims. While it is connected, only a stranger publishes others than its
    /// own; the will of an earlier connection comes before the first word of this one. They are corrected at once, and then not more
    /// often than they are renewed, as two clients may have the same name. A broker that stops publishes the will of every client
    /// before it closes the connections: words like the will are reported when the connection has outlasted them until the claims
    /// are renewed.
    fn hear_of_itself(&self, topic: &str, words: &[u8]) {
        let presence = self.presence.as_ref().filter(|presence| presence.topic == topic);
        let is_here = presence.is_some_and(|presence| *words == *presence.here);
        let is_forged = self.claims.is_forged(topic, words);
        if presence.is_none() && !is_forged {
            return;
        }
        let mut state = self.lock();
        state.corrections.is_known_here |= is_here;
        let is_denied = presence.is_some() && !is_here && state.corrections.is_known_here;
        if !(is_forged || is_denied) || state.sender.is_none() || state.stopping {
            return;
        }
        let shown = String::from_utf8_lossy(&words[..words.len().min(SHOWN)]).into_owned();
        let forged = BridgeError::Refused(format!(
            "somebody else has published {shown:?} on `{topic}`, which is for this client alone; it is corrected"
        ));
        if presence.is_some_and(|presence| *words == *presence.gone) {
            state.corrections.doubt = Some(forged);
        } else {
            state.trouble(forged);
        }
        let now = Uptime::now();
        if state.corrections.last.is_some_and(|at| now.saturating_duration_since(at) < RENEWED) {
            state.corrections.is_due = true;
            return;
        }
        state.corrections.last = Some(now);
        self.publish_here(&mut state);
        state.pump(self.profile.as_deref());
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
