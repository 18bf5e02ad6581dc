//! Claims of clients on a broker: names that a client holds while it is connected, as tokens of Zenoh are held.
//!
//! `shsa/CLIENT/claims` lists them, one a line, retained. It is published again after each change, after each connection, and
//! every two seconds; with MQTT 5 it expires on the broker after eight. A client clears it at its end. If the connection of a
//! client breaks, its last will says so on `shsa/CLIENT/status`; else its claims end when they were not renewed for eight
//! seconds.

use crate::clock::Uptime;
use crate::{Attendance, BridgeError, Inbox, Presence};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::Notify;

/// The topics of clients' claims and of their presence.
const CLAIMS: &str = "shsa/+/claims";
const STATUS: &str = "shsa/+/status";
/// The status of a client that is not connected.
const OFFLINE: &[u8] = b"offline";
/// A claim ends when it was not renewed for this long.
pub(super) const EXPIRES: Duration = Duration::from_secs(8);
/// How often claims are renewed.
pub(super) const RENEWED: Duration = Duration::from_secs(2);
/// A client that has not checked for this long may have missed renewals.
const ABSENT: Duration = Duration::from_secs(3);
/// The largest number of clients whose claims are followed.
const CLIENTS_MAX: usize = 256;
/// The number of own texts that may come back.
const ON_THE_WAY: usize = 16;
/// The longest list of one client's claims, bytes.
const LONGEST: usize = 256 * 1024;

/// The claims of this client, and of other ones.
pub(super) struct Claims {
    /// The name of this client; `None`: it claims nothing.
    client: Option<String>,
    state: Mutex<State>,
    /// Notified when the own claims have changed.
    due: Notify,
    inbox: Inbox,
}

struct State {
    own: BTreeSet<Arc<str>>,
    /// By the client's name.
    others: BTreeMap<String, Other>,
    /// Clients whose status is offline: their retained claims are out of date.
    gone: BTreeSet<String>,
    watches: Vec<Watch>,
    /// Whether the claims of others are known: retained claims arrive before the echo of the own ones.
    is_informed: bool,
    /// The latest texts of the own claims; empty before the first publication.
    published: VecDeque<String>,
    /// Whether one of them has come back.
    is_echoed: bool,
    /// When expired claims were last looked for.
    looked: Uptime,
}

struct Other {
    claims: BTreeSet<Arc<str>>,
    last_seen: Uptime,
}

/// A subscription to the names that match a pattern.
struct Watch {
    pattern: String,
    changes: Sender<Presence>,
}

/// A held name; dropping it ends the claim.
struct Held {
    claims: Arc<Claims>,
    name: Arc<str>,
}

impl Claims {
    pub(super) fn new(client: Option<String>, inbox: Inbox) -> Arc<Claims> {
        let state = State {
            own: BTreeSet::new(),
            others: BTreeMap::new(),
            gone: BTreeSet::new(),
            watches: Vec::new(),
            is_informed: false,
            published: VecDeque::new(),
            is_echoed: false,
            looked: Uptime::now(),
        };
        Arc::new(Claims { client, state: Mutex::new(state), due: Notify::new(), inbox })
    }

    /// A thread that panicked with the lock has left whole entries behind.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Claims a name until the returned value is dropped. `None`: this client claims nothing.
    pub(super) fn attend(self: &Arc<Claims>, name: &str) -> Result<Option<Box<dyn Send>>, BridgeError> {
        if name.contains('\n') {
            return Err(BridgeError::Refused(format!(
                "`{name}` cannot be claimed: it has more than one line"
            )));
        }
        if self.client.is_none() {
            return Ok(None);
        }
        let name: Arc<str> = name.into();
        self.change(|state| {
            state.own.insert(name.clone());
            if state.is_informed {
                state.notify(&Presence::Alive(name.clone()));
            }
        });
        Ok(Some(Box::new(Held { claims: self.clone(), name })))
    }

    /// The changes of all names that match a pattern; own names are included as soon as the claims of others are known. `None`:
    /// this client claims nothing.
    pub(super) fn attendance(self: &Arc<Claims>, pattern: &str) -> Option<Attendance> {
        self.client.as_ref()?;
        let (changes, waiting) = channel();
        let mut state = self.lock();
        let watch = Watch { pattern: pattern.to_owned(), changes };
        let others = state.others.values().flat_map(|other| &other.claims);
        let own = state.own.iter().filter(|_| state.is_informed);
        others.chain(own).for_each(|name| watch.notify(&Presence::Alive(name.clone())));
        state.watches.push(watch);
        drop(state);
        let claims = Arc::downgrade(self);
        Some(Box::new(move || {
            waiting.try_recv().ok().or_else(|| {
                claims.upgrade()?.lock().look(Uptime::now());
                waiting.try_recv().ok()
            })
        }))
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.due.notify_one();
        self.inbox.wake();
    }

    /// The topics of others' claims; none if nobody watches.
    pub(super) fn topics(&self) -> impl Iterator<Item = String> + use<> {
        let is_wanted = !self.lock().watches.is_empty();
        [CLAIMS, STATUS].into_iter().filter(move |_| is_wanted).map(str::to_owned)
    }

    /// Waits until the own claims have changed.
    pub(super) async fn changed(&self) {
        self.due.notified().await;
    }

    /// Called before the own claims are published again. If the last publication has not come back, the broker does not let
    /// this client receive claims: as far as this client knows, no other client exists.
    pub(super) fn renew(&self) {
        let mut state = self.lock();
        if !state.published.is_empty() {
            state.inform();
        }
        drop(state);
        self.inbox.wake();
    }

    /// The topic and text of the own claims; the text is empty if there are none. `None`: there is no receiver.
    pub(super) fn own_message(&self) -> Option<(String, String)> {
        let mut state = self.lock();
        if state.own.is_empty() && state.watches.is_empty() {
            return None;
        }
        let own: Vec<&str> = state.own.iter().map(|name| &**name).collect();
        let text = own.join("\n");
        if state.published.back() != Some(&text) {
            state.published.push_back(text.clone());
        }
        while state.published.len() > ON_THE_WAY {
            state.published.pop_front();
        }
        Some((format!("shsa/{}/claims", self.client.as_ref()?), text))
    }

    /// Whether somebody else has published claims of this client: the text is none of the latest own ones, of which one has come back
    /// before. What the broker has kept comes earlier.
    pub(super) fn is_forged(&self, topic: &str, words: &[u8]) -> bool {
        let client = topic.strip_prefix("shsa/").and_then(|topic| topic.strip_suffix("/claims"));
        if client.is_none() || client != self.client.as_deref() {
            return false;
        }
        let mut state = self.lock();
        let is_own = state.published.iter().any(|text| text.as_bytes() == words);
        state.is_echoed |= is_own;
        state.is_echoed && !is_own
    }

    /// Takes in a message. Returns whether it is about claims, so that it needs no other reader.
    pub(super) fn receive(&self, topic: &str, words: &[u8], retained: bool) -> bool {
        let about = topic.strip_prefix("shsa/").and_then(|topic| topic.split_once('/'));
        let Some((client, kind @ ("claims" | "status"))) = about else { return false };
        let mut state = self.lock();
        if state.watches.is_empty() {
            return false;
        }
        match kind {
            "claims" if self.client.as_deref() == Some(client) => state.inform(),
            _ if self.client.as_deref() == Some(client) => {}
            "claims" => state.receive(client, words, retained),
            _ => state.meet(client, words == OFFLINE),
        }
        drop(state);
        self.inbox.wake();
        true
    }
}

impl State {
    fn notify(&mut self, presence: &Presence) {
        self.watches.iter().for_each(|watch| watch.notify(presence));
    }

    /// The claims of others are known now.
    fn inform(&mut self) {
        if !std::mem::replace(&mut self.is_informed, true) {
            let own = self.own.clone();
            own.into_iter().for_each(|name| self.notify(&Presence::Alive(name)));
        }
    }

    fn receive(&mut self, client: &str, words: &[u8], retained: bool) {
        // The retained message is older than the client's last will.
        let is_over = retained && self.gone.contains(client);
        let text = std::str::from_utf8(words).ok().filter(|text| text.len() <= LONGEST && !is_over);
        let claims: BTreeSet<Arc<str>> =
            text.into_iter().flat_map(str::lines).filter(|line| !line.is_empty()).map(Arc::from).collect();
        let is_room = self.others.len() < CLIENTS_MAX || self.others.contains_key(client);
        if !is_room {
            return;
        }
        let other = Other { claims: claims.clone(), last_seen: Uptime::now() };
        let before = match claims.is_empty() {
            true => self.others.remove(client),
            false => self.others.insert(client.to_owned(), other),
        };
        let before = before.map(|other| other.claims).unwrap_or_default();
        before.difference(&claims).for_each(|name| self.notify(&Presence::Gone(name.clone())));
        claims.difference(&before).for_each(|name| self.notify(&Presence::Alive(name.clone())));
    }

    /// Takes in whether a client is gone.
    fn meet(&mut self, client: &str, is_gone: bool) {
        if !is_gone {
            self.gone.remove(client);
        } else if self.gone.len() < CLIENTS_MAX {
            self.gone.insert(client.to_owned());
        }
        if is_gone {
            self.forget(client);
        }
    }

    fn forget(&mut self, client: &str) {
        let claims = self.others.remove(client).map(|other| other.claims).unwrap_or_default();
        claims.into_iter().for_each(|name| self.notify(&Presence::Gone(name)));
    }

    /// Ends the claims that have expired.
    fn look(&mut self, now: Uptime) {
        if now.saturating_duration_since(std::mem::replace(&mut self.looked, now)) > ABSENT {
            // Renewals during the absence may still wait.
            self.others.values_mut().for_each(|other| other.last_seen = now);
        }
        let is_over = |(client, other): (&String, &Other)| {
            (now.saturating_duration_since(other.last_seen) > EXPIRES).then(|| client.clone())
        };
        let over: Vec<String> = self.others.iter().filter_map(is_over).collect();
        over.iter().for_each(|client| self.forget(client));
    }
}

impl Watch {
    fn notify(&self, presence: &Presence) {
        let (Presence::Alive(name) | Presence::Gone(name)) = presence;
        if matches(&self.pattern, name) {
            // The receiver may be gone.
            let _ = self.changes.send(presence.clone());
        }
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        let name = self.name.clone();
        self.claims.change(|state| {
            state.own.remove(&name);
            if state.is_informed {
                state.notify(&Presence::Gone(name));
            }
        });
    }
}

/// Whether a name matches a pattern: `*` is one level, `**` at the end any number.
fn matches(pattern: &str, name: &str) -> bool {
    let (mut wanted, mut levels) = (pattern.split('/'), name.split('/'));
    loop {
        match (wanted.next(), levels.next()) {
            (Some("**"), _) | (None, None) => return true,
            (Some("*"), Some(_)) => {}
            (Some(wanted), Some(level)) if wanted == level => {}
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests;
