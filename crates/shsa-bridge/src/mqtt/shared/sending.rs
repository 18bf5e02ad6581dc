//! What goes out, in which order, and what becomes of it when the connection breaks.

use super::{Publication, Sender, State};
use crate::clock::Uptime;
use crate::mqtt::client::Purpose;
use crate::mqtt::profile::Profile;
use crate::{BridgeError, Inbox};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// The number of messages of one topic that may wait for the connection.
const WAITING_MAX: usize = 1024;
/// The number of troubles that are kept.
const TROUBLES_MAX: usize = 64;
/// A message that was unfinished at this many breaks in a row is not sent again.
const ATTEMPTS_MAX: u32 = 3;

/// How many connections in a row broke with unfinished messages of a topic.
#[derive(Debug, Default)]
pub(super) struct Attempts(BTreeMap<String, u32>);

impl Attempts {
    /// A connection broke with unfinished messages of these topics, any number of each; returns each topic, and whether its newest
    /// message is sent again.
    fn broke(&mut self, topics: Vec<String>) -> Vec<(String, bool)> {
        let attempt = |topic: String| {
            let attempts = self.0.entry(topic.clone()).or_default();
            *attempts += 1;
            let is_sent_again = *attempts <= ATTEMPTS_MAX;
            if !is_sent_again {
                self.0.remove(&topic);
            }
            (topic, is_sent_again)
        };
        BTreeSet::from_iter(topics).into_iter().map(attempt).collect()
    }
}

impl State {
    pub(super) fn publish(&mut self, publication: Publication) {
        if publication.is_over(Uptime::now()) {
            return;
        }
        let is_next = self.outbox.is_empty() && self.ahead.is_empty();
        let sends_at_once = |sender: &Sender| is_next && sender.publish(&publication);
        if self.sender.as_ref().is_some_and(sends_at_once) {
            self.handed_over(&publication);
            return self.outbox.remember(publication);
        }
        let is_connected = self.sender.is_some();
        let topic = publication.topic.clone();
        let Some(other) = self.outbox.keep(publication, if is_connected { WAITING_MAX } else { 1 }) else {
            return;
        };
        if other.topic != topic {
            self.trouble(BridgeError::Lost(format!("a message on `{}`: too many topics wait", other.topic)));
        } else if is_connected {
            self.trouble(BridgeError::Lost(format!(
                "messages on `{topic}`: they come faster than they can be sent"
            )));
        }
    }

    /// Passes an answer to the next asker that still waits; `false` if there is none.
    pub(super) fn answer(&mut self, topic: &str, payload: &Bytes) -> bool {
        let Some(asking) = self.asking.get_mut(topic) else { return false };
        std::iter::from_fn(|| asking.pop_front()).any(|asking| asking.send(payload.clone()).is_ok())
    }

    /// Sends what waits, as far as the connection accepts it: subscriptions, messages of the profile, others.
    pub(super) fn pump(&mut self, profile: Option<&dyn Profile>) {
        let Some(sender) = self.sender.clone() else { return };
        while let Some((topic, is_wanted)) = self.requests.front() {
            let is_taken = match is_wanted {
                true => sender.subscribe(topic, self.purpose(topic)),
                false => sender.unsubscribe(topic),
            };
            if !is_taken {
                return;
            }
            let request = self.requests.pop_front().filter(|(_, is_wanted)| *is_wanted);
            self.asked.extend(request.map(|(topic, _)| topic));
        }
        if !self.send_all(&sender, |state| &mut state.ahead) {
            return;
        }
        if let Some(profile) = profile {
            profile.pump(&mut |publication| self.send(&sender, publication));
        }
        while let Some(publication) = self.outbox.next(Uptime::now()) {
            if !sender.publish(publication) {
                return;
            }
            let publication = publication.clone();
            self.handed_over(&publication);
            self.outbox.take();
        }
        self.send_all(&sender, |state| &mut state.last);
    }

    /// Whether everything has been sent.
    pub(super) fn has_sent_all(&self) -> bool {
        self.outbox.is_empty() && self.ahead.is_empty() && self.last.is_empty()
    }

    /// What a subscription to a topic is for.
    fn purpose(&self, topic: &str) -> Purpose {
        match topic {
            _ if self.followed.contains(topic) => Purpose::Profile,
            _ if self.served.contains_key(topic) => Purpose::Questions,
            _ if topic.contains('+') => Purpose::Claims,
            _ => Purpose::Values,
        }
    }

    /// Whether a message of the profile was accepted.
    fn send(&mut self, sender: &Sender, publication: &Publication) -> bool {
        let is_taken = sender.publish(publication);
        if is_taken {
            self.handed_over(publication);
        }
        is_taken
    }

    /// Sends the messages of a queue, in order; whether all were accepted.
    fn send_all(
        &mut self,
        sender: &Sender,
        queue: impl Fn(&mut State) -> &mut VecDeque<Publication>,
    ) -> bool {
        while let Some(publication) = queue(self).pop_front() {
            if !self.send(sender, &publication) {
                queue(self).push_front(publication);
                return false;
            }
        }
        true
    }

    /// Delivers messages that arrived before their subscription.
    pub(super) fn deliver_unasked(&mut self, inbox: &Inbox) {
        let State { unasked, wanted, wants_everything, .. } = self;
        let waiting = unasked.take(|message| *wants_everything || wanted.contains(&message.topic));
        waiting.into_iter().for_each(|message| inbox.push(message));
    }

    /// Messages of these topics may not have arrived when the connection broke.
    pub(super) fn unfinished(&mut self, topics: Vec<String>) {
        for (topic, is_sent_again) in self.attempts.broke(topics) {
            if is_sent_again {
                self.outbox.again(&topic);
                continue;
            }
            self.outbox.forget(&topic);
            self.trouble(BridgeError::Lost(format!(
                "a message on `{topic}`: the connection broke with it again and again"
            )));
        }
    }

    /// Keeps that the broker has refused the message of this number.
    pub(super) fn refuse(&mut self, number: u16, reason: String) {
        if self.refused.len() == TROUBLES_MAX {
            self.refused.pop_front();
        }
        let topic = self.unacknowledged.remove(&number).unwrap_or_default();
        self.refused.push_back((topic, BridgeError::Refused(format!("the broker says {reason}"))));
    }

    /// Keeps a trouble; an equal one is kept once.
    pub(super) fn trouble(&mut self, trouble: BridgeError) {
        if self.troubles.contains(&trouble) {
            return;
        }
        if self.troubles.len() == TROUBLES_MAX {
            self.troubles.pop_front();
        }
        self.troubles.push_back(trouble);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A message is given up at the fourth break, whatever number of its topic was on its way at each.
    #[test]
    fn breaks_are_counted_and_not_messages() {
        for on_their_way in [1, 2, 3, 50] {
            let mut attempts = Attempts::default();
            let mut broke = |topic: &str| attempts.broke(vec![topic.to_owned(); on_their_way]);
            for is_sent_again in [true, true, true, false, true] {
                assert_eq!(broke("a"), [("a".to_owned(), is_sent_again)], "{on_their_way}");
            }
            assert_eq!(broke("b"), [("b".to_owned(), true)]);
        }
    }
}
