//! Who claims what on a broker: names that a client holds while it is there, as tokens of Zenoh are held.
//!
//! `shsa/CLIENT/claims` holds them, one a line, retained. It is published again whenever they change, after each connection, and
//! every two seconds; with MQTT 5 the broker forgets it after eight. A client takes it back at its end. Of one that is gone
//! without a word the last will says so on `shsa/CLIENT/status`; else its claims are over when nobody has heard of them for
//! eight seconds.

use crate::clock::Uptime;
use crate::{Attendance, BridgeError, Inbox, Presence};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::Notify;

/// Where clients say what they claim, and whether they are there.
const CLAIMS: &str = "shsa/+/claims";
const STATUS: &str = "shsa/+/status";
/// What is said there of a client that is not there.
const OFFLINE: &[u8] = b"offline";
/// A claim that was not heard of for so long is over.
pub(super) const EXPIRES: Duration = Duration::from_secs(8);
/// How often claims are said again.
pub(super) const RENEWED: Duration = Duration::from_secs(2);
/// Who has not looked for so long cannot know that nobody has renewed a claim meanwhile.
const ABSENT: Duration = Duration::from_secs(3);
/// The most clients whose claims are heard.
const CLIENTS_MAX: usize = 256;
/// The longest claims of one client, bytes.
const LONGEST: usize = 256 * 1024;

/// What this client claims, and what others do.
pub(super) struct Claims {
    /// What this client is called; `None`: it claims nothing.
    client: Option<String>,
    state: Mutex<State>,
    /// There is something to say.
    due: Notify,
    inbox: Inbox,
}

struct State {
    own: BTreeSet<Arc<str>>,
    /// By the client's name.
    others: BTreeMap<String, Other>,
    /// Those of which it was said that they are not there: what they have claimed before is out of date.
    gone: BTreeSet<String>,
    watches: Vec<Watch>,
    /// Whether it is known what others claim: what was kept for this client comes before the echo of what it says itself.
    is_informed: bool,
    /// Whether it was said what this client claims.
    is_said: bool,
    /// When somebody looked whether claims are over.
    looked: Uptime,
}

struct Other {
    claims: BTreeSet<Arc<str>>,
    heard: Uptime,
}

/// Who wants to know of the names that a pattern matches.
struct Watch {
    pattern: String,
    changes: Sender<Presence>,
}

/// A name that is held; dropping it takes the claim back.
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
            is_said: false,
            looked: Uptime::now(),
        };
        Arc::new(Claims { client, state: Mutex::new(state), due: Notify::new(), inbox })
    }

    /// Whoever panicked while holding the lock has left whole entries behind.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Claims a name until what is returned is dropped. `None`: this client claims nothing.
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
                state.tell(&Presence::Alive(name.clone()));
            }
        });
        Ok(Some(Box::new(Held { claims: self.clone(), name })))
    }

    /// Tells of all names that a pattern matches, our own among them as soon as it is known what others claim. `None`: this
    /// client claims nothing.
    pub(super) fn attendance(self: &Arc<Claims>, pattern: &str) -> Option<Attendance> {
        self.client.as_ref()?;
        let (changes, waiting) = channel();
        let mut state = self.lock();
        let watch = Watch { pattern: pattern.to_owned(), changes };
        let others = state.others.values().flat_map(|other| &other.claims);
        let own = state.own.iter().filter(|_| state.is_informed);
        others.chain(own).for_each(|name| watch.tell(&Presence::Alive(name.clone())));
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

    /// The topics by which others are heard; none where nobody wants to know.
    pub(super) fn topics(&self) -> impl Iterator<Item = String> + use<> {
        let is_wanted = !self.lock().watches.is_empty();
        [CLAIMS, STATUS].into_iter().filter(move |_| is_wanted).map(str::to_owned)
    }

    /// Waits until what this client claims has changed.
    pub(super) async fn changed(&self) {
        self.due.notified().await;
    }

    /// What this client claims is about to be said again. Where what was said before has not come back, the broker lets this client
    /// not hear of claims: then it is alone as far as it can know.
    pub(super) fn renew(&self) {
        let mut state = self.lock();
        if state.is_said {
            state.inform();
        }
        drop(state);
        self.inbox.wake();
    }

    /// Where to say what is claimed, and in which words: none where nothing is. `None`: nobody has to be told.
    pub(super) fn said(&self) -> Option<(String, String)> {
        let mut state = self.lock();
        if state.own.is_empty() && state.watches.is_empty() {
            return None;
        }
        state.is_said = true;
        let own: Vec<&str> = state.own.iter().map(|name| &**name).collect();
        Some((format!("shsa/{}/claims", self.client.as_ref()?), own.join("\n")))
    }

    /// Hears what was said under a topic. Whether that was about claims, and nobody has to look at it who did not ask for it.
    pub(super) fn hear(&self, topic: &str, words: &[u8], retained: bool) -> bool {
        let about = topic.strip_prefix("shsa/").and_then(|topic| topic.split_once('/'));
        let Some((client, kind @ ("claims" | "status"))) = about else { return false };
        let mut state = self.lock();
        if state.watches.is_empty() {
            return false;
        }
        match kind {
            "claims" if self.client.as_deref() == Some(client) => state.inform(),
            _ if self.client.as_deref() == Some(client) => {}
            "claims" => state.hear(client, words, retained),
            _ => state.meet(client, words == OFFLINE),
        }
        drop(state);
        self.inbox.wake();
        true
    }
}

impl State {
    fn tell(&mut self, presence: &Presence) {
        self.watches.iter().for_each(|watch| watch.tell(presence));
    }

    /// It is known what others claim.
    fn inform(&mut self) {
        if !std::mem::replace(&mut self.is_informed, true) {
            let own = self.own.clone();
            own.into_iter().for_each(|name| self.tell(&Presence::Alive(name)));
        }
    }

    fn hear(&mut self, client: &str, words: &[u8], retained: bool) {
        // What was kept is older than its last will.
        let is_over = retained && self.gone.contains(client);
        let text = std::str::from_utf8(words).ok().filter(|text| text.len() <= LONGEST && !is_over);
        let claims: BTreeSet<Arc<str>> =
            text.into_iter().flat_map(str::lines).filter(|line| !line.is_empty()).map(Arc::from).collect();
        let is_room = self.others.len() < CLIENTS_MAX || self.others.contains_key(client);
        if !is_room {
            return;
        }
        let other = Other { claims: claims.clone(), heard: Uptime::now() };
        let before = match claims.is_empty() {
            true => self.others.remove(client),
            false => self.others.insert(client.to_owned(), other),
        };
        let before = before.map(|other| other.claims).unwrap_or_default();
        before.difference(&claims).for_each(|name| self.tell(&Presence::Gone(name.clone())));
        claims.difference(&before).for_each(|name| self.tell(&Presence::Alive(name.clone())));
    }

    /// Whether a client is there.
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
        claims.into_iter().for_each(|name| self.tell(&Presence::Gone(name)));
    }

    /// Looks whose claims are over.
    fn look(&mut self, now: Uptime) {
        if now.saturating_duration_since(std::mem::replace(&mut self.looked, now)) > ABSENT {
            // What was said meanwhile may still wait.
            self.others.values_mut().for_each(|other| other.heard = now);
        }
        let is_over = |(client, other): (&String, &Other)| {
            (now.saturating_duration_since(other.heard) > EXPIRES).then(|| client.clone())
        };
        let over: Vec<String> = self.others.iter().filter_map(is_over).collect();
        over.iter().for_each(|client| self.forget(client));
    }
}

impl Watch {
    fn tell(&self, presence: &Presence) {
        let (Presence::Alive(name) | Presence::Gone(name)) = presence;
        if matches(&self.pattern, name) {
            // Nobody looks any more.
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
                state.tell(&Presence::Gone(name));
            }
        });
    }
}

/// Whether a name is one of a pattern's: `*` is one level, `**` any number at the end.
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
mod tests {
    use super::*;
    use crate::Clock;

    fn claims() -> Arc<Claims> {
        Claims::new(Some("me".to_owned()), Inbox::new(4, Clock::running()))
    }

    fn told(attendance: &mut Attendance) -> String {
        let told = std::iter::from_fn(attendance).map(|presence| match presence {
            Presence::Alive(name) => format!("+{name}"),
            Presence::Gone(name) => format!("-{name}"),
        });
        told.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn own_names_are_told_when_the_others_are_known_and_said_until_they_are_dropped() {
        for is_echoed in [true, false] {
            let claims = claims();
            let mut attendance = claims.attendance("a/**").unwrap();
            let _held = claims.attend("a/one").unwrap();
            assert_eq!(told(&mut attendance), "");
            claims.said();
            claims.said();
            assert_eq!(told(&mut attendance), "");
            match is_echoed {
                true => assert!(claims.hear("shsa/me/claims", b"", false)),
                false => claims.renew(),
            }
            assert_eq!(told(&mut attendance), "+a/one");
        }
        let claims = claims();
        assert_eq!(claims.said(), None);
        let mut attendance = claims.attendance("a/**").unwrap();
        claims.hear("shsa/me/claims", b"", false);
        let held = (claims.attend("a/one").unwrap(), claims.attend("b/two").unwrap());
        assert_eq!(told(&mut attendance), "+a/one");
        assert_eq!(claims.said(), Some(("shsa/me/claims".to_owned(), "a/one\nb/two".to_owned())));
        drop(held);
        assert_eq!(told(&mut attendance), "-a/one");
        assert_eq!(claims.said(), Some(("shsa/me/claims".to_owned(), String::new())));
        assert!(claims.attend("a\nb").is_err());
    }

    #[test]
    fn others_are_there_while_they_say_so() {
        let claims = claims();
        assert!(!claims.hear("shsa/one/claims", b"a/x", false), "nobody wants to know");
        let mut attendance = claims.attendance("a/**").unwrap();
        assert!(!claims.hear("shsa/one/need/x", b"a/x", false));
        assert!(claims.hear("shsa/me/claims", b"a/echo", false));
        for (topic, words, is_retained, expected) in [
            ("shsa/one/claims", "a/x\nb/y\na/z", false, "+a/x +a/z"),
            ("shsa/one/claims", "a/x\nb/y\na/z", false, ""),
            ("shsa/one/claims", "a/z", false, "-a/x"),
            ("shsa/one/status", "offline", false, "-a/z"),
            ("shsa/one/claims", "a/z", true, ""),
            ("shsa/one/claims", "a/z", false, "+a/z"),
            ("shsa/one/status", "online", false, ""),
            ("shsa/one/claims", "", false, "-a/z"),
        ] {
            assert!(claims.hear(topic, words.as_bytes(), is_retained));
            assert_eq!(told(&mut attendance), expected, "{topic} {words}");
        }
    }

    #[test]
    fn claims_that_nobody_renews_are_over_unless_nobody_has_looked() {
        let claims = claims();
        let mut attendance = claims.attendance("a/*").unwrap();
        claims.hear("shsa/one/claims", b"a/x", false);
        assert_eq!(told(&mut attendance), "+a/x");
        let began = Uptime::now();
        // A stall: who was not there does not know.
        let mut at = began + 3 * EXPIRES;
        claims.lock().look(at);
        for _ in 0..4 {
            assert_eq!(claims.lock().others.len(), 1);
            at = at + RENEWED;
            claims.lock().look(at);
        }
        claims.lock().look(at + RENEWED);
        assert_eq!(told(&mut attendance), "-a/x");
    }

    #[test]
    fn patterns_have_levels() {
        for (pattern, name, is) in
            [("a/**", "a/b/c", true), ("a/*", "a/b/c", false), ("a/*/c", "a/b/c", true), ("a", "b", false)]
        {
            assert_eq!(matches(pattern, name), is, "{pattern} {name}");
        }
    }
}
